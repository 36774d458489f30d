"""Springs and dampers between two markers, and forces along the coordinate of a joint.

Evaluated in `floatframe.engine.kernels.connections.spring_damper`,
`floatframe.engine.kernels.joints.coordinate_force`.
"""

from dataclasses import dataclass, field

from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.units import SPEED, Quantity
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import number
from floatframe.model.functions.time_functions import NOT_OF_TIME, TimeFunction, constant

__all__ = ["JointForce", "SpringDamper"]


# a spring and a damper in parallel along the line between two markers -------------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class SpringDamper:
    """Tension k (l - l_0) + c l_dot + preload + characteristic(l - l_0) along the line from marker A to marker B.

    l is the length of that line. A spring has no direction while its markers coincide. If that can happen, set
    free_length = 0 and no preload, or keep the markers apart.

    Parameters
    ----------
    name
        Name of the force, unique in the system.
    marker_a
        Marker A.
    marker_b
        Marker B.
    stiffness
        Stiffness k [N/m].
    damping
        Damping c [N s/m].
    free_length
        l_0 [m]; None: the assembled distance.
    preload
        Constant part of the tension [N].
    characteristic
        A function of l - l_0, such as a table [N].
    """

    name: str
    marker_a: Marker
    marker_b: Marker
    stiffness: float = 0.0
    damping: float = 0.0
    free_length: float | None = None
    preload: float = 0.0
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
                f"{where}: characteristic: expected a function of floatframe.functions, such as table(x, force), "
                f"got {self.characteristic!r}"
            )
        if self.stiffness == 0 and self.damping == 0 and self.preload == 0 and self.characteristic is None:
            raise ModelError(f"{where}: expected stiffness, damping or preload above zero, got none")


# forces along the coordinate of a joint: torsional springs, dampers, motors, friction ---------------------------------


FRICTION_SPEED = Quantity(1e-3, SPEED)


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class JointForce:
    """A force or torque that acts to increase a free coordinate x of a joint (a distance or an angle).

    Q = -k (x - x_0) - c x_dot + preload + motor(t) + characteristic(x - x_0) - (T + mu N) tanh(x_dot/v_0)

    N is the magnitude of the joint force normal to its axis. An angle is taken between -pi and pi from its free value.
    Regularised Coulomb friction creeps: it holds a load only while x_dot stays below v_0.

    Parameters
    ----------
    name
        Name of the force, unique in the system.
    joint
        Name of the joint.
    coordinate
        Name of the coordinate of the joint, such as "angle".
    stiffness
        Stiffness k [N/m, N m/rad].
    free
        Coordinate without force x_0 [m, rad].
    damping
        Damping c [N s/m, N m s/rad].
    preload
        Constant force or torque [N, N m].
    motor
        A number or a function of time [N, N m].
    characteristic
        A function of x - x_0, such as a table [N, N m].
    friction
        Coulomb friction T [N, N m].
    friction_coefficient
        Coefficient mu; for an angle, mu times the bearing radius [1, m].
    friction_speed
        v_0, the speed at which friction reaches tanh(1) of its value [m/s, rad/s].
    """

    name: str
    joint: str
    coordinate: str
    stiffness: float = 0.0
    free: float = 0.0
    damping: float = 0.0
    preload: float = 0.0
    motor: TimeFunction | float | None = None
    characteristic: TimeFunction | None = field(default=None, metadata=NOT_OF_TIME)
    friction: float = 0.0
    friction_coefficient: float = 0.0
    friction_speed: float = FRICTION_SPEED

    @property
    def is_angular(self) -> bool:
        """Whether the coordinate is an angle, according to the joint's name for it."""
        return self.coordinate.startswith("angle")

    def __post_init__(self) -> None:
        where = f"force {self.name!r}"
        for name in ("stiffness", "damping", "friction", "friction_coefficient"):
            object.__setattr__(self, name, number(f"{where}: {name}", getattr(self, name), at_least=0.0))
        for name in ("free", "preload"):
            object.__setattr__(self, name, number(f"{where}: {name}", getattr(self, name)))
        speed = number(f"{where}: friction_speed", self.friction_speed, above=0.0)
        object.__setattr__(self, "friction_speed", speed)
        if isinstance(self.motor, int | float):
            object.__setattr__(self, "motor", constant(number(f"{where}: motor", self.motor)))
        for name in ("motor", "characteristic"):
            if not isinstance(getattr(self, name), TimeFunction | None):
                raise ModelError(
                    f"{where}: {name}: expected a function of floatframe.functions, got {getattr(self, name)!r}"
                )
        numbers = self.stiffness, self.damping, self.preload, self.friction, self.friction_coefficient
        if not any(numbers) and self.motor is None and self.characteristic is None:
            raise ModelError(f"{where}: expected at least one part above zero, or a motor, got none")
