"""The sensor of a bushing: its six deformations and their rates, in the axes in which it acts.

The formulas are those of the force (`floatframe/engine/kernels/connections/bushing.py`). A, B are the axes of the
markers, d the vector between their points, theta the rotation vector of A^T B with full turns counted, t = |theta|, and
C the axes of A rotated by a share of theta:

    e = C^T d,  e' = C^T d' + e × gamma,  theta' = S u,   u = C^T (omega_B - omega_A)
    gamma = C^T ((1 - share) omega_A + share omega_B) - tau theta × u
    S = alpha 1 + beta theta theta^T + (share - 1/2) tilde(theta),   beta = (1 - alpha) / t²
    alpha = (t/2) cot(t/2), tau = 0;   half way: alpha = (t/2) / sin(t/2), tau = tan(t/4) / (2 t)
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.counted_angles import CountedAngle, rotation_of
from floatframe.engine.compiling.markers import MarkerData
from floatframe.engine.compiling.pair_forces import bushing_markers
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError
from floatframe.model.forces import Bushing
from floatframe.model.forces.bushing import AXES, DEFORMATIONS
from floatframe.model.rotations import continued_rotation, tilde
from floatframe.model.system import System
from floatframe.results.joint_coordinates import end_motion
from floatframe.results.sensors.linear_columns import scalar_columns
from floatframe.results.sensors.measurement import Measurement, unit_words
from floatframe.results.small_motions.rows import LinearColumns
from floatframe.results.small_motions.small_motions import SmallMotions
from floatframe.results.trajectory import Trajectory

__all__ = ["BushingSensor"]

SERIES_BELOW = 1e-2  #: t² below which alpha, beta, tau are evaluated by series
NAMES = (*DEFORMATIONS, *(f"{name} rate" for name in DEFORMATIONS))


@frozen_copies
@dataclass(frozen=True, eq=False)
class BushingSensor:
    """Deformations x, y, z, rx, ry, rz of a bushing and their rates, as used by its stiffness and damping."""

    name: str
    of: str  #: name of the bushing

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return deformations and rates over time."""
        # imported late, because motions are computed without scipy.spatial
        from scipy.spatial.transform import Rotation

        ends, share = self.ends(system), AXES[self.bushing(system).axes]
        a, b = (end_motion(system, trajectory, end) for end in ends)
        theta = Rotation.from_matrix(np.swapaxes(a.axes, -1, -2) @ b.axes).as_rotvec()
        if self.bushing(system).counts_turns:
            theta = counted(trajectory, rotation_of(*ends), theta)
        C = a.axes @ Rotation.from_rotvec(share * theta).as_matrix()
        e = np.einsum("tba,tb->ta", C, b.position - a.position)
        u = np.einsum("tba,tb->ta", C, b.omega - a.omega)
        mean = np.einsum("tba,tb->ta", C, (1 - share) * a.omega + share * b.omega)
        alpha, beta, tau = (x[:, None] for x in scalars(np.einsum("ta,ta->t", theta, theta), share))
        gamma = mean - tau * np.cross(theta, u)
        e_rate = np.einsum("tba,tb->ta", C, b.velocity - a.velocity) + np.cross(e, gamma)
        turning = alpha * u + beta * np.einsum("ta,ta->t", theta, u)[:, None] * theta
        turning = turning + (share - 0.5) * np.cross(theta, u)
        columns = np.hstack([e, theta, e_rate, turning]).T
        return Measurement(self.name, trajectory.t, dict(zip(NAMES, columns, strict=True)), self.units(system))

    def linear(self, small: SmallMotions) -> LinearColumns:
        """Return de = Cᵀ dd + e × dc and dtheta = S u; the rows of the rates are their derivatives."""
        # imported late, because motions are computed without scipy.spatial
        from scipy.spatial.transform import Rotation

        share = AXES[self.bushing(small.system).axes]
        a, b = (small.place(end, self.of) for end in self.ends(small.system))
        theta = Rotation.from_matrix(a.axes.T @ b.axes).as_rotvec()
        C = a.axes @ Rotation.from_rotvec(share * theta).as_matrix()
        e = C.T @ (b.position - a.position)
        alpha, beta, tau = (float(x[0]) for x in scalars(np.array([theta @ theta]), share))
        u = (b.turned - a.turned).turned(C.T)
        dc = a.turned.turned((1 - share) * C.T) + b.turned.turned(share * C.T) - u.turned(tau * tilde(theta))
        de = (b.moved - a.moved).turned(C.T) + dc.turned(tilde(e))
        turning = u.turned(alpha * np.eye(3) + beta * np.outer(theta, theta) + (share - 0.5) * tilde(theta))
        rows = [*(de[k] for k in range(3)), *(turning[k] for k in range(3))]
        rows += [row.rate for row in rows]
        return scalar_columns(dict(zip(NAMES, rows, strict=True)), self.units(small.system))

    def ends(self, system: System) -> tuple[MarkerData, MarkerData]:
        """Return both markers."""
        a, b = bushing_markers(system, self.bushing(system), compiled_system(system).placed)
        return a, b

    def bushing(self, system: System) -> Bushing:
        """Return the bushing; `ModelError` with the nearest name if there is none."""
        bushings = {force.name: force for force in system.forces if isinstance(force, Bushing)}
        if self.of not in bushings:
            raise ModelError(f"sensor {self.name!r}: no bushing {quoted(self.of)}{nearest(self.of, list(bushings))}")
        return bushings[self.of]

    def units(self, system: System) -> dict[str, str]:
        """Return the units of the columns."""
        kinds = ("length", "angle", "speed", "angular speed")
        return {name: unit_words(system.units, kinds[k // 3]) for k, name in enumerate(NAMES)}


def counted(trajectory: Trajectory, angles: list[CountedAngle], theta: Array) -> Array:
    """Return rotation vectors with the turns that the run has counted, (n_t, 3); unchanged if it has not."""
    known = list(trajectory.head.angles or ())
    first = next((k for k, each in enumerate(known) if each.is_same(angles[0])), None)
    if first is None:
        return theta
    return continued_rotation(theta, trajectory.source.read("angle")[:, first : first + 3])


def scalars(t2: Array, share: float) -> tuple[Array, Array, Array]:
    """Return alpha, beta, tau of t², (n,) each; for small t² from series up to t⁶."""
    near = t2 < SERIES_BELOW
    t = np.sqrt(np.where(near, 1.0, t2))
    if share != 0.5:
        alpha = (t / 2) / np.tan(t / 2)
        low = 1 / 12 + t2 * (1 / 720 + t2 * (1 / 30240 + t2 / 1209600))
        return np.where(near, 1 - t2 * low, alpha), np.where(near, low, (1 - alpha) / t**2), np.zeros_like(t2)
    alpha = (t / 2) / np.sin(t / 2)
    beta, tau = (1 - alpha) / t**2, np.tan(t / 4) / (2 * t)
    low = -(1 / 24 + t2 * (7 / 5760 + t2 * (31 / 967680 + t2 * 127 / 154828800)))
    y = t2 / 16
    low_tau = (1 + y * (1 / 3 + y * (2 / 15 + y * 17 / 315))) / 8
    return np.where(near, 1 - t2 * low, alpha), np.where(near, low, beta), np.where(near, low_tau, tau)
