"""A spring and a damper in parallel along the line between two markers."""

from dataclasses import dataclass, field

from fe_models.foundation.copies import frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import number
from floatframe.model.functions.time_functions import NOT_OF_TIME, TimeFunction

__all__ = ["SpringDamper"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class SpringDamper:
    """Tension k (l - l_0) + c l_dot + preload + characteristic(l - l_0) along the line from marker A to marker B.

    l is the length of that line. A spring has no direction where its markers coincide. If that can happen, set
    free_length = 0 and no preload, or keep the markers apart.
    """

    name: str
    marker_a: Marker
    marker_b: Marker
    stiffness: float = 0.0  #: k [N/m]
    damping: float = 0.0  #: c [N s/m]
    free_length: float | None = None  #: l_0 [m]; None: the assembled distance
    preload: float = 0.0  #: constant part of the tension [N]
    #: a function of l - l_0, such as a table [N]
    characteristic: TimeFunction | None = field(default=None, metadata=NOT_OF_TIME)

    def __post_init__(self) -> None:
        where = f"force {self.name!r}"
        for name in ("stiffness", "damping"):
            object.__setattr__(self, name, number(f"{where}: {name}", getattr(self, name), at_least=0.0))
        object.__setattr__(self, "preload", number(f"{where}: preload", self.preload))
        if self.free_length is not None:
            value = number(f"{where}: free_length", self.free_length, at_least=0.0)
            object.__setattr__(self, "free_length", value)
        if not isinstance(self.characteristic, TimeFunction | None):
            raise ModelError(
                f"{where}: characteristic: expected a function of functions.time_functions, such as table(x, force), "
                f"got {self.characteristic!r}"
            )
        if self.stiffness == 0 and self.damping == 0 and self.preload == 0 and self.characteristic is None:
            raise ModelError(f"{where}: expected stiffness, damping or preload above zero, got none")
