"""Derivatives of joint coordinate rates by body velocities, used to name free and prescribed coordinates."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.markers import MarkerData, joint_markers, marker_pose, n_q_of
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.kernels.model import marker_shapes
from floatframe.engine.kernels.work import Work
from floatframe.model.joints import SlidingJoint
from floatframe.model.joints.rows import RelativePlace
from floatframe.model.rotations import tilde
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.small_motions.marker_jacobian import marker_jacobian

__all__ = ["coordinate_rows", "driven_coordinates"]


def driven_coordinates(system: System) -> tuple[str, ...]:
    """Return the names "joint.coordinate" of joint coordinates whose motion is prescribed."""
    return tuple(f"{joint.name}.{name}" for joint in system.joints for name in getattr(joint, "motions", {}))


def coordinate_rows(system: System, compiled: CompiledSystem, work: Work, state: State) -> dict[str, Array]:
    """Return derivatives of all joint coordinate rates by body velocities (body axes), (n_u,), by "joint.coordinate".

    Parameters
    ----------
    work
        Working arrays, evaluated at the state.
    """
    model, placed, n_q = compiled.model, compiled.placed, n_q_of(system)
    rows: dict[str, Array] = {}
    n_lines = 0
    for joint in system.joints:
        ends = joint_markers(system, joint, placed)
        if isinstance(joint, SlidingJoint):
            rows[f"{joint.name}.distance"] = sliding_row(compiled, work, n_lines, ends[1])
            n_lines += 1
            continue
        (r_a, A_a), (r_b, A_b) = (marker_pose(end, placed, n_q) for end in ends)
        coordinates = [row.coordinate for row in joint.rows(A_a, A_b, r_b - r_a) if row.coordinate is not None]
        if not coordinates:
            continue
        (r_a, A_a), (r_b, A_b) = (marker_pose(end, state, n_q) for end in ends)
        place = RelativePlace(A_a, A_b, r_b - r_a)
        J = np.zeros((2, 6, int(model.bodies.u0[-1])))  # for A and B: translation and rotation in ground axes
        for k, end in enumerate(ends):
            if end.body >= 0:
                J[k][:, int(model.bodies.u0[end.body]) : int(model.bodies.u0[end.body + 1])] = marker_jacobian(
                    compiled, work, end
                )
        slip = J[1, :3] - J[0, :3] + tilde(place.d) @ J[0, 3:]  # v_B - v_A - omega_A × d
        turning = J[1, 3:] - J[0, 3:]
        for own in coordinates:
            rows[f"{joint.name}.{own.name}"] = np.asarray(own.direction(place) @ own.moves(slip, turning))
    return rows


def sliding_row(compiled: CompiledSystem, work: Work, k: int, marker_b: MarkerData) -> Array:
    """Return the row for the rate along deformed line k, n·(v_B - v_A)/|r'|, with A fixed in the line, (n_u,)."""
    model = compiled.model
    m = int(model.lines.marker[k])
    i = int(model.markers.body[m])
    n_0, slope = work.lines.n_0[k], work.lines.slope[k]
    row = np.zeros(int(model.bodies.u0[-1]))
    shapes = marker_shapes(model, work.markers.psi, m)
    of_a = work.state.R[i] @ np.hstack([np.eye(3), -tilde(work.markers.rho[m]), shapes[:3]])
    row[int(model.bodies.u0[i]) : int(model.bodies.u0[i + 1])] -= n_0 @ of_a / slope
    if marker_b.body >= 0:
        of_b = marker_jacobian(compiled, work, marker_b)[:3]
        row[int(model.bodies.u0[marker_b.body]) : int(model.bodies.u0[marker_b.body + 1])] += n_0 @ of_b / slope
    return row
