"""Canonical moments of a body given only by matrices, from acceleration fields (docs/theory.md §5).

A linear field u = E c has the nodal values (E c, rotation ½ curl). With nodal inertia, these rotations make the
products below exact if the inertia is isotropic. Otherwise the result is labelled approximate.

The rigid motion in a shape needs no approximation. It is separated first, so that the moments of one body in two frames
belong to the same deformations: reduction in a frame and conversion to this frame give the same moments.
"""

import numpy as np

from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.foundation.arrays import Array
from fe_models.foundation.tall.columns import in_memory

__all__ = ["gram_from_matrices"]

MASSLESS = 1e-12  #: inertia of a rigid motion relative to the largest, below which it is rounding (masses on a line)
ISOTROPIC = 1e-9  #: largest relative difference of rigid mass matrices from M and from m, S, J that counts as agreement


def gram_from_matrices(body: FEBody, Phi: Array, origin: Array | None = None) -> Array:
    """Return the Gram matrix ∫ a aᵀ dm of a = [1, c, phi_x, phi_y, phi_z] from M and the node positions.

    (0) phi = phi' + d + theta × c, where phi' has no momentum (`rigid_parts`); (2) to (4) use phi'
    (1) m, S, R from the rigid-body mass matrix: exact
    (2) 1C = Psi_tᵀ M Phi: exact
    (3) P_ab,k = (field c_a e_b)ᵀ M phi_k, whose antisymmetric part 2C is exact
    (4) S_ab,kl = phi_kᵀ M (e_a (e_b·phi_l))
    (5) L Gram' Lᵀ with a = L a': the rigid parts are linear in 1 and c

    Parameters
    ----------
    origin
        Reference point of c, (3,) [m]; default: the mesh origin, which costs digits if the body is far away.

    Returns
    -------
    Array
        Gram matrix in mesh axes, (4 + 3 n_q, 4 + 3 n_q).
    """
    at = np.zeros(3) if origin is None else origin
    C = rigid_parts(body, in_memory(Phi), at)  # step (0)
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs, at)
    Phi = in_memory(Phi) - Psi_R @ C
    n = Phi.shape[1]
    node, component = body.dofs.T
    gram = np.zeros((4 + 3 * n, 4 + 3 * n))
    rigid_mass = Psi_R.T @ (body.M @ Psi_R)
    J = rigid_mass[3:, 3:]
    gram[0, 0] = np.trace(rigid_mass[:3, :3]) / 3
    # (1) ∫ e_b · (e_a × c) = (e_b × e_a) · S
    S = (
        np.array(
            [
                rigid_mass[1, 5] - rigid_mass[2, 4],
                rigid_mass[2, 3] - rigid_mass[0, 5],
                rigid_mass[0, 4] - rigid_mass[1, 3],
            ]
        )
        / 2
    )
    gram[0, 1:4] = gram[1:4, 0] = S
    gram[1:4, 1:4] = np.trace(J) / 2 * np.eye(3) - J
    M_Phi = body.M @ Phi
    blocks = [slice(4 + a * n, 4 + (a + 1) * n) for a in range(3)]
    for b in range(3):  # (2)
        gram[0, blocks[b]] = Psi_R[:, b] @ M_Phi
        gram[blocks[b], 0] = gram[0, blocks[b]]
        for a in range(3):  # (3)
            field = np.where(component == b, body.nodes[node, a] - at[a], 0.0)
            half_curl = np.cross(np.eye(3)[a], np.eye(3)[b]) / 2
            is_rotation = component >= 3
            field[is_rotation] = half_curl[component[is_rotation] - 3]
            gram[1 + a, blocks[b]] = field @ M_Phi
            gram[blocks[b], 1 + a] = gram[1 + a, blocks[b]]
    u = _nodal(body, Phi)
    for a in range(3):  # (4)
        for b in range(3):
            field = np.zeros_like(u)
            field[:, a] = u[:, b]
            if a == b:
                field[:, 3:] += u[:, 3:] / 2
            field[:, 3 + b] -= u[:, 3 + a] / 2
            gram[blocks[a], blocks[b]] = M_Phi.T @ _columns(body, field)
    # ∫ phi_a,k phi_b,l is the transpose of ∫ phi_b,l phi_a,k; both routes differ if M is not M_s ⊗ 1
    gram = (gram + gram.T) / 2
    L = np.eye(len(gram))  # (5)
    L[4:, 0] = C[:3].reshape(-1)
    L[4:, 1:4] = np.cross(C[3:].T[:, None], np.eye(3)).transpose(2, 0, 1).reshape(3 * n, 3)  # (theta_k × e_c)_a
    return np.asarray(L @ gram @ L.T)


def rigid_parts(body: FEBody, Phi: Array, origin: Array) -> Array:
    """Return the rigid motions [d; theta] about a point with the same momenta as the shapes, (6, n_q).

    They are zero if the mass matrix does not describe rigid motion, as for a body with fixed dofs.
    """
    middle = body.nodes.mean(axis=0)  # with a point far away, the rotations would lose digits
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs, middle)
    M_R = Psi_R.T @ (body.M @ Psi_R)
    m = np.trace(M_R[:3, :3]) / 3
    scale = np.repeat([1.0, np.sqrt(np.trace(M_R[3:, 3:]) / m) or 1.0], 3)
    M_R = M_R / np.outer(scale, scale)
    moment = M_R[:3, 3:]
    of_masses = np.allclose(M_R[:3, :3], m * np.eye(3), rtol=0, atol=ISOTROPIC * m)
    if not (of_masses and np.allclose(moment, -moment.T, rtol=0, atol=ISOTROPIC * m)):
        return np.zeros((6, Phi.shape[1]))
    C = np.linalg.pinv(M_R, rcond=MASSLESS, hermitian=True) @ (Psi_R.T @ (body.M @ Phi) / scale[:, None])
    C = C / scale[:, None]
    C[:3] += np.cross(C[3:], origin - middle, axisa=0, axisc=0)
    return np.asarray(C)


def _nodal(body: FEBody, columns: Array) -> Array:
    """Return columns as a table (n_nodes, 6, k)."""
    table = np.zeros((len(body.nodes), 6, columns.shape[1]))
    node, component = body.dofs.T
    has_place = component >= 0
    table[node[has_place], component[has_place]] = columns[has_place]
    return table


def _columns(body: FEBody, table: Array) -> Array:
    """Return a table (n_nodes, 6, k) as columns over the dofs."""
    node, component = body.dofs.T
    columns = table[node, component]
    columns[component < 0] = 0.0
    return columns
