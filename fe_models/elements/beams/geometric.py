"""Geometric stiffness of straight Timoshenko beams, point masses and springs (docs/theory.md §7).

Sections rotate by rotation vectors, R = exp(theta~) = 1 + theta~ + ½ theta~² + …, and keep their shape. With r' = e +
u', the strains of a section are Gamma = Rᵀ r' - e, and kappa, the axial vector of Rᵀ R'. To second order

    Gamma = u' - theta × e  +  [-theta × u' + ½ theta × (theta × e)],   kappa = theta'  +  [-½ theta × theta'],

In addition, a twisted fibre at distance o from the axis becomes longer by ½ kappa_x² o². The section force n, the
moment m and the tension n·e of the fibres do work on these second-order terms. So do loads off the axis, on the
second-order term of the rotation of their section (`rigid_motion.rotation_work`); an example is the transverse stress
of a spinning shaft.

n(s) and m(s) are the section forces of the loaded element, in equilibrium with the loads along it: n' + q = 0, m' + e ×
n + mu = 0. The geometric stiffness therefore belongs to exact section forces, and its work in a rigid rotation is
exact to roundoff.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.body.rigid_motion import MassLoads, rotation_work
from fe_models.elements.beams.attachments import Spring, spring_matrix
from fe_models.elements.beams.slices import Slices
from fe_models.foundation.arrays import Array, axial, tilde

__all__ = [
    "BeamLines", "line_geometric_stiffness", "point_geometric_stiffness", "slice_forces", "spring_geometric_stiffness",
]  # fmt: skip


@dataclass(frozen=True, eq=False)
class BeamLines:
    """Line data for the geometric stiffness of a frame."""

    slices: Slices  #: slices at the Gauss points of each line
    xi: Array  #: Gauss points from 0 to 1, (p,)
    weights: Array  #: Gauss weights with sum 1, (p,)
    length: Array  #: lengths of the lines, (n,) [m]
    x: Array  #: unit vectors along the axes, (n, 3)
    levers: Array  #: vectors from the nodes to the ends of the axis, (n, 2, 3) [m]
    polar_radius2: Array  #: squared polar radius of gyration (Iy + Iz)/A, (n,) [m²]


def slice_couples(slices: Slices, loads: MassLoads) -> tuple[Array, Array]:
    """Return the force, (k, n, p, 3), and V = Σ f oᵀ, (k, n, p, 3, 3), about the centre of each slice.

    f = A (c + o) + b per unit mass. The first moment of o over a slice is zero, so that V = A E with E = ∫ o oᵀ dm.
    """
    force = np.einsum("np,npaj->jnpa", slices.mass, loads.at(slices.position))
    E = (slices.axes * slices.moments[..., None, :]) @ slices.axes.swapaxes(-1, -2)
    return force, np.tensordot(loads.A, E, axes=(2, 2)).transpose(0, 2, 3, 1, 4)


def slice_forces(slices: Slices, loads: MassLoads) -> Array:
    """Return the consistent forces on the element dofs, Σ motionᵀ (force, moment) over the slices, (n, d, k)."""
    force, V = slice_couples(slices, loads)
    wrench = np.concatenate([force, axial(V)], axis=-1)
    k, n, p, _ = wrench.shape
    motion = slices.motion.reshape(n, 6 * p, -1).transpose(0, 2, 1)
    return np.asarray(motion @ wrench.transpose(1, 2, 3, 0).reshape(n, 6 * p, k))


def line_geometric_stiffness(lines: BeamLines, end_forces: Array, loads: MassLoads) -> Array:
    """Return the geometric stiffness of each line over the dofs of its nodes, (n, 12, 12), for one load.

    Parameters
    ----------
    end_forces
        Forces and moments of the nodes on the element minus the consistent loads, mesh axes, (n, 2, 6) [N, N m].
    loads
        One load per unit mass, k = 1.
    """
    slices = lines.slices
    n_force, n_moment = section_forces(lines, end_forces, loads)
    x, length = lines.x, lines.length
    U, Theta = slices.motion[:, :, :3], slices.motion[:, :, 3:]
    D = differentiation(lines.xi)
    dU, dTheta = (np.einsum("pq,nqad->npad", D, field) / length[:, None, None, None] for field in (U, Theta))
    weight = lines.weights * length[:, None]
    n_tilde, m_tilde = tilde(n_force), tilde(n_moment)
    x_slices = np.broadcast_to(x[:, None], n_force.shape)
    _, V = slice_couples(slices, loads)
    # -n·(theta_k × u_l') = theta_kᵀ n~ u_l', and the same with k and l exchanged
    mixed = np.einsum("npad,npab,npbc,np->ndc", Theta, n_tilde, dU, weight, optimize=True)
    # -½ m·(theta_k × theta_l')
    mixed += np.einsum("npad,npab,npbc,np->ndc", Theta, m_tilde, dTheta, weight / 2, optimize=True)
    K = mixed + mixed.transpose(0, 2, 1)
    # ½ n·[theta_k × (theta_l × x) + …], and the loads of the slices, which act in the opposite direction
    turning = weight[..., None, None] * rotation_work(n_force[..., :, None] * x_slices[..., None, :])
    turning -= rotation_work(V[0])
    K += np.einsum("npad,npab,npbc->ndc", Theta, turning, Theta, optimize=True)
    tension = np.einsum("npa,na->np", n_force, x) * weight * lines.polar_radius2[:, None]
    twist = np.einsum("npad,na->npd", dTheta, x)
    K += np.einsum("npd,np,npc->ndc", twist, tension, twist, optimize=True)
    for end in range(2):  # the ends of the axis move with the nodes through the levers
        at = slice(6 * end + 3, 6 * end + 6)
        K[:, at, at] += rotation_work(end_forces[:, end, :3, None] * lines.levers[:, end, None, :])
    return np.asarray((K + K.transpose(0, 2, 1)) / 2)


def section_forces(lines: BeamLines, end_forces: Array, loads: MassLoads) -> tuple[Array, Array]:
    """Return n and m at the Gauss points, on faces with normal +x, mesh axes, (n, p, 3) each."""
    slices, x = lines.slices, lines.x
    s = lines.xi * lines.length[:, None]
    mass = slices.mass / (lines.weights * lines.length[:, None])  # mass per length
    start = slices.position[:, 0] - lines.xi[0] * lines.length[:, None] * x
    q_0 = mass[:, 0, None] * loads.at(start)[..., 0]
    q_1 = mass[:, 0, None] * np.einsum("ab,nb->na", loads.A[0], x)
    _, V = slice_couples(slices, loads)
    mu = axial(V[0])[:, 0] / (lines.weights[0] * lines.length)[:, None]
    force_0 = -end_forces[:, 0, :3]
    moment_0 = -(end_forces[:, 0, 3:] - np.cross(lines.levers[:, 0], end_forces[:, 0, :3]))
    s1, s2, s3 = s[..., None], s[..., None] ** 2 / 2, s[..., None] ** 3 / 6
    force = force_0[:, None] - q_0[:, None] * s1 - q_1[:, None] * s2
    integral = force_0[:, None] * s1 - q_0[:, None] * s2 - q_1[:, None] * s3
    return force, moment_0[:, None] - np.cross(x[:, None], integral) - mu[:, None] * s1


def point_geometric_stiffness(points: Slices, loads: MassLoads) -> Array:
    """Return the geometric stiffness of point masses over the dofs of their nodes, (n, 6, 6), for one load.

    A point mass has no strain. Its loads do work on the second-order term of the rotation of its offset and inertia.
    """
    force, V = slice_couples(points, loads)
    lever = -axial(points.motion[:, 0, :3, 3:]) / 2  # the block is -o~
    K = np.zeros((len(lever), 6, 6))
    K[:, 3:, 3:] = -rotation_work(V[0, :, 0] + force[0, :, 0, :, None] * lever[:, None])
    return K


def spring_geometric_stiffness(nodes: Array, spring: Spring, u: Array) -> Array:
    """Return the geometric stiffness of a spring, (12, 12), over the dofs of its nodes in the state u, (12,).

    Node i moves the point by d_i = u_i + (R_i - 1) l_i. The axes of the spring rotate with the mean rotation theta of
    both nodes. The second-order term of the extension Rᵀ (d_2 - d_1) is therefore -theta × d + ½ [theta_2 × (theta_2 ×
    l_2) - …]; the second-order term of the twist, the logarithm of R_1ᵀ R_2, is -½ theta_1 × theta_2.
    """
    first, second = (nodes[node] for node in spring.nodes)
    point = (first + second) / 2 if spring.point is None else np.asarray(spring.point)
    force = spring_matrix(nodes, spring, np.asarray(spring.stiffness))[0] @ u
    S = force[6:9]  # force on the second node; the force on the first node is opposite
    levers = point - first, point - second
    M = force[9:] - np.cross(levers[1], S)
    turns = np.eye(12)[3:6], np.eye(12)[9:]
    D = np.eye(12)[6:9] - tilde(levers[1]) @ turns[1] - np.eye(12)[:3] + tilde(levers[0]) @ turns[0]
    half = (turns[0] + turns[1]).T / 2 @ tilde(S) @ D + turns[0].T @ tilde(M) @ turns[1] / 2
    K = half + half.T
    for sign, at, lever in ((-1.0, 3, levers[0]), (1.0, 9, levers[1])):
        K[at : at + 3, at : at + 3] += sign * rotation_work(np.outer(S, lever))
    return np.asarray(K)


def differentiation(xi: Array) -> Array:
    """Return the matrix D of derivatives, (p, p): f'(xi_p) = Σ D_pq f(xi_q) for polynomials of degree < p."""
    powers = np.arange(len(xi))
    values = xi[:, None] ** powers
    slopes = powers * xi[:, None] ** np.maximum(powers - 1, 0)
    return np.asarray(np.linalg.solve(values.T, slopes.T).T)
