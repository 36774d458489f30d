"""The path of the reference body in a steady motion, and the bodies that spin."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted
from floatframe.analyses.steady.carrier import Carrier, Spin
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.errors import ModelError
from floatframe.model.checked_values import array_of_shape, unit_vector
from floatframe.model.rotations import rotation_matrix
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["Path", "path_of", "require_body", "spins_of"]

SPINS = 1e-9  #: smallest speed of a spin, relative to the speed of the system divided by its size


@dataclass(frozen=True, eq=False)
class Path:
    """The path of the reference body."""

    body: int
    name: str
    point: Array  #: point on the path, ground axes, (3,) [m]
    ahead: Array  #: direction of motion at the point, ground axes, (3,)
    axis: Array  #: axis of the circle, ground axes, (3,)
    speed: float
    placed_speed: float
    is_open: bool  #: whether the curvature is unknown

    @property
    def aside(self) -> Array:
        """Direction to the left of the motion, (3,)."""
        return np.cross(self.axis, self.ahead)


def require_body(system: System, name: str) -> None:
    """Raise `ModelError`, with the closest name, if a body does not exist."""
    names = [each.name for each in system.bodies]
    if name not in names:
        raise ModelError(f"steady_motion: no body {quoted(name)}{nearest(name, names)}")


def path_of(
    compiled: CompiledSystem,
    start: State,
    name: str,
    speed: float | None,
    curvature: float | None,
    center: Array | Sequence[float] | None,
    axis: Array,
) -> tuple[Carrier, Path]:
    """Return the initial carrier and the path of the reference body.

    Raises
    ------
    ModelError
        If the body has no velocity perpendicular to the axis, or center and curvature do not agree.
    """
    i = compiled.body_names.index(name)
    u0 = int(compiled.model.bodies.u0[i])
    v = start.u[u0 : u0 + 3]
    v = v - (v @ axis) * axis
    placed_speed, point = float(np.linalg.norm(v)), start.r[i].copy()
    speed = placed_speed if speed is None else float(speed)
    if not (np.isfinite(speed) and speed >= 0):
        raise ModelError(f"steady_motion: speed: expected a number of 0 or more, got {speed}")
    if speed > 0 and placed_speed == 0:
        raise ModelError(
            f"steady_motion: body {name!r} is placed without a velocity perpendicular to the axis {axis.tolist()}; "
            "give it its running velocity, which defines the direction"
        )
    ahead = v / (placed_speed or 1.0)
    path = Path(i, name, point, ahead, axis, speed, placed_speed, curvature is None)
    if center is not None:
        center = array_of_shape("steady_motion: center", center, (3,))
        if not curvature:
            raise ModelError("steady_motion: center: expected a curvature too, whose sign is the side of the centre")
        arm = point - center
        arm = arm - (arm @ axis) * axis
        distance = float(np.linalg.norm(arm))
        if distance == 0 or abs(distance * abs(curvature) - 1) > 0.1:
            raise ModelError(
                f"steady_motion: center: its distance from body {name!r} is {distance:g}, but the curvature is "
                f"{curvature:g}; expected the distance 1/curvature, within a tenth"
            )
        omega = np.sign(curvature) * speed / distance * axis
        return Carrier(center, np.zeros(3), omega), replace(path, ahead=np.cross(omega, arm) / speed)
    if speed == 0 and curvature != 0:
        raise ModelError("steady_motion: a system at rest has no curvature; give curvature = 0")
    if curvature is not None and not np.isfinite(curvature):
        raise ModelError(f"steady_motion: curvature: expected a number or None, got {curvature}")
    return Carrier(point, speed * ahead, speed * (curvature or 0.0) * axis), path


def spins_of(
    system: System,
    compiled: CompiledSystem,
    start: State,
    path: Path,
    more: Mapping[str, Sequence[float]],
) -> tuple[tuple[Spin, ...], Array]:
    """Return the bodies that spin, and their initial speeds.

    The speeds are those of the placed bodies, scaled by the ratio of the requested to the placed speed of the reference
    body.

    Raises
    ------
    ModelError
        If a named body does not exist, or a flexible body spins.
    """
    for name in more:
        require_body(system, name)
    u0 = [int(first) for first in compiled.model.bodies.u0[:-1]]
    i, axis, faster = path.body, path.axis, path.speed / path.placed_speed if path.speed else 1.0
    omega = (axis @ rotation_matrix(start.p[i]) @ start.u[u0[i] + 3 : u0[i] + 6]) * axis
    least = SPINS * float(np.abs(start.u[u0[i] : u0[i] + 3]).max()) / compiled.length
    spins: list[Spin] = []
    s: list[float] = []
    for k, name in enumerate(compiled.body_names):
        own = start.u[u0[k] + 3 : u0[k] + 6] - rotation_matrix(start.p[k]).T @ omega
        size = float(np.linalg.norm(own))
        if name in more:
            e = unit_vector(f"steady_motion: spinning: {name}", more[name])
            spins, s = [*spins, Spin(k, e)], [*s, faster * float(own @ e)]
        elif size > least:
            spins, s = [*spins, Spin(k, own / size)], [*s, faster * size]
    for spin in spins:
        if compiled.model.bodies.n_q[spin.body]:
            raise ModelError(
                f"steady_motion: body {compiled.body_names[spin.body]!r} is flexible and spins relative to body "
                f"{path.name!r}: its modes would rotate with it; make it rigid (is_rigid), or use steady_rotation"
            )
    return tuple(spins), np.array(s, dtype=float)
