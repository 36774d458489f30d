"""Flexible multibody dynamics in floating frames of reference.

rod = cms.read("rod.h5")
system = System(
[FlexibleBody("rod", rod)],
[RevoluteJoint("pin", GROUND, Marker("rod", "big_end"), axis=(0, 1, 0))],
[Gravity((0, 0, -9810.0))],
units=rod.units,
)
trajectory = integrate(system, GeneralizedAlpha(rho_inf=0.8), t_end=1.0, h=1e-3)
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from floatframe.errors import ConvergenceError, FloatframeError, ModelError, ResultsError, SystemFileError
    from floatframe.flexible_body import FlexibleBody
    from floatframe.forces import Gravity, PointForce, SpringDamper
    from floatframe.ground import GROUND, Ground
    from floatframe.initial import ConsistentState, consistent_state
    from floatframe.integration import Progress, integrate
    from floatframe.integrators import GeneralizedAlpha
    from floatframe.joints import FixedJoint, RevoluteJoint, SphericalJoint
    from floatframe.markers import Marker
    from floatframe.rigid_body import RigidBody
    from floatframe.state import State
    from floatframe.system import System
    from floatframe.trajectory import Trajectory, read_results

__all__ = [
    "GROUND",
    "ConsistentState",
    "ConvergenceError",
    "FixedJoint",
    "FlexibleBody",
    "FloatframeError",
    "GeneralizedAlpha",
    "Gravity",
    "Ground",
    "Marker",
    "ModelError",
    "PointForce",
    "Progress",
    "ResultsError",
    "RevoluteJoint",
    "RigidBody",
    "SphericalJoint",
    "SpringDamper",
    "State",
    "System",
    "SystemFileError",
    "Trajectory",
    "consistent_state",
    "integrate",
    "read_results",
]

HOMES = {
    "ConsistentState": "floatframe.initial",
    "ConvergenceError": "floatframe.errors",
    "FixedJoint": "floatframe.joints",
    "FlexibleBody": "floatframe.flexible_body",
    "FloatframeError": "floatframe.errors",
    "GROUND": "floatframe.ground",
    "GeneralizedAlpha": "floatframe.integrators",
    "Gravity": "floatframe.forces",
    "Ground": "floatframe.ground",
    "Marker": "floatframe.markers",
    "ModelError": "floatframe.errors",
    "PointForce": "floatframe.forces",
    "Progress": "floatframe.integration",
    "ResultsError": "floatframe.errors",
    "RevoluteJoint": "floatframe.joints",
    "RigidBody": "floatframe.rigid_body",
    "SphericalJoint": "floatframe.joints",
    "SpringDamper": "floatframe.forces",
    "State": "floatframe.state",
    "System": "floatframe.system",
    "SystemFileError": "floatframe.errors",
    "Trajectory": "floatframe.trajectory",
    "consistent_state": "floatframe.initial",
    "integrate": "floatframe.integration",
    "read_results": "floatframe.trajectory",
}  #: where each public name lives; loaded when it is first asked for, so that the command line answers at once


def __getattr__(name: str) -> Any:
    """Load a public name."""
    if name not in HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names."""
    return sorted(__all__)
