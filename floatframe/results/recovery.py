"""Positions of nodes and interfaces in ground axes, computed from a motion."""

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, IntArray
from floatframe.errors import ResultsError
from floatframe.model.bodies.marker_shape import interface_shape
from floatframe.model.rotations import rotated, rotation_matrix
from floatframe.results.trajectory import Trajectory

__all__ = [
    "elastic_displacements",
    "interface_positions",
    "nodal_displacements",
    "nodal_positions",
]


def require_same_modes(trajectory: Trajectory, body_name: str, reduced: ReducedBody) -> None:
    """Raise `ResultsError` unless the reduced body has as many modes as the body in the trajectory."""
    _, entry = trajectory.entry(body_name)
    if entry.n_q != reduced.n_q:
        raise ResultsError(
            f"body {body_name!r} has {entry.n_q} modes in the trajectory, but the reduced body {reduced.name!r} has "
            f"{reduced.n_q}; give the modal file of the run ({entry.source or 'made in memory'})"
        )


def nodal_positions(trajectory: Trajectory, body_name: str, reduced: ReducedBody, i_time: int) -> Array:
    """Return the positions of the kept nodes of a flexible body at an output time, in ground axes, (n_kept, 3) [m].

    The position is r + R (c + Phi q), with all modes of the body including static ones; for a stiffened body with
    quadratic modes the second-order part is added.

    Raises
    ------
    ResultsError
        If there is no such body, or `reduced` does not match it.
    """
    require_same_modes(trajectory, body_name, reduced)
    motion = trajectory.body(body_name)
    local = reduced.nodes + nodal_displacements(trajectory, body_name, reduced, i_time)
    return motion.r[i_time] + local @ rotation_matrix(motion.p[i_time]).T


def nodal_displacements(trajectory: Trajectory, body_name: str, reduced: ReducedBody, i_time: int | IntArray) -> Array:
    """Return the displacements of the kept nodes in the body frame at output times, (..., n_kept, 3) [m].

    The displacement is Phi q, plus ½ Σ q_k q_l g_kl for a stiffened body with quadratic modes.
    """
    require_same_modes(trajectory, body_name, reduced)
    _, entry = trajectory.entry(body_name)
    q = trajectory.body(body_name).q[i_time]
    displacement = np.einsum("nak,...k->...na", reduced.Phi, q, optimize=True)
    if reduced.quadratic is not None and entry.is_stiffened:
        displacement = displacement + 0.5 * np.einsum("nakl,...k,...l->...na", reduced.quadratic, q, q, optimize=True)
    return np.asarray(displacement)


def interface_positions(trajectory: Trajectory, body_name: str, reduced: ReducedBody, interface: str) -> Array:
    """Return positions of an interface's reference point over time, ground axes, (n_t, 3) [m]."""
    require_same_modes(trajectory, body_name, reduced)
    motion = trajectory.body(body_name)
    d = elastic_displacements(trajectory, body_name, reduced, interface)
    return motion.r + rotated(rotation_matrix(motion.p), reduced.interface(interface).position + d)


def elastic_displacements(trajectory: Trajectory, body_name: str, reduced: ReducedBody, interface: str) -> Array:
    """Return the displacement of an interface in the body frame over time, (n_t, 3) [m].

    The displacement is Psi q, plus the second-order part for a stiffened body, such as the shortening of a bent rod.
    """
    require_same_modes(trajectory, body_name, reduced)
    _, entry = trajectory.entry(body_name)
    q = trajectory.body(body_name).q
    return interface_shape(reduced, interface, is_stiffened=entry.is_stiffened).deformation(q)[:, :3]
