"""The ground: the inertial frame G, and a body at rest in it."""

from dataclasses import dataclass

from fe_models.foundation.records import checked_fields
from floatframe.errors import ModelError

__all__ = ["GROUND", "Ground"]


@dataclass(frozen=True)
@checked_fields(ModelError)
class Ground:
    """The inertial frame as a body; markers on it are at rest.

    Parameters
    ----------
    name
        Name of the ground.
    """

    name: str = "ground"


GROUND = Ground()  #: the only instance of the ground
