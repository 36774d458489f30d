"""The ground: the frame G in which everything moves, and a body that does not."""

from dataclasses import dataclass

__all__ = ["GROUND", "Ground"]


@dataclass(frozen=True)
class Ground:
    """The inertial frame as a body: markers on it stand still."""

    name: str = "ground"


GROUND = Ground()  #: the one ground there is
