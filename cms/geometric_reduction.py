"""Geometric stiffness of a reduced body from its elements: a static solution and a matrix per unit load (THEORY §7).

(1) unit loads f_j, balanced by the support of the frame: P f_j (`cms.unit_loads`)
(2) static states u_j = G_R P f_j, by the factorisation that gave the modes; only their stress counts
(3) Phiᵀ K_geo(sigma_j) Phi of the elements
(4) rigid links: the forces on followers, internal less applied, on the second order of the rotation they follow
(5) interfaces that are a mean of their members: the applied loads on the second order of the mean
"""

import numpy as np
import scipy.linalg as la

from cms.arrays import Array, IntArray
from cms.errors import BodyError, ModeSetError
from cms.families import Families
from cms.fe_body import FEBody, Interface
from cms.frames import FrameCondition
from cms.geometric_stiffness import GeometricStiffness
from cms.link_work import followers, link_work
from cms.mass_loads import MassLoads
from cms.mean_work import mean_second_order
from cms.node_motion import is_mean, reference_motion, translation_rows
from cms.tall import combine
from cms.unit_loads import balanced, unit_loads

__all__ = ["has_geometric_stiffness", "reduced_geometric_stiffness"]

LOADS_AT_ONCE = 60  #: of many interfaces; their static states are as tall as the body


def has_geometric_stiffness(body: FEBody) -> bool:
    """Return whether the elements behind the body know their geometric stiffness."""
    return body.element_model is not None and body.element_model.has_geometric_stiffness


def reduced_geometric_stiffness(
    body: FEBody, Phi: Array, condition: FrameCondition, *, families: Families | None = None
) -> GeometricStiffness:
    """Return the geometric stiffness of shapes for all unit loads of a body frame.

    Parameters
    ----------
    body
        A coupled body with an element model.
    Phi
        Shapes over its dofs that satisfy the condition of the frame, (n_dof, n_q).
    condition
        The frame; it is the support of all loads.
    families
        The families of this body, whose factorisation is taken; made and freed here by default.

    Raises
    ------
    BodyError
        If the body has no element model that knows its geometric stiffness.
    ModeSetError
        If the families are those of another body.
    """
    require_geometric_stiffness(body)
    if families is None:
        with Families(body) as own:
            return reduced_geometric_stiffness(body, Phi, condition, families=own)
    if families.body is not body:
        raise ModeSetError(
            f"families: made for body {families.body.name!r}, but the geometric stiffness is asked of another one, "
            f"{body.name!r}; make Families of the very body"
        )
    loads = balanced(body, unit_loads(body, condition.frame), condition)  # (1)
    K = np.zeros((loads.mass.k, Phi.shape[1], Phi.shape[1]))
    for wanted in blocks(np.flatnonzero(~loads.is_zero)):
        u = static_states(families, loads.F[:, wanted])  # (2)
        mass = MassLoads(loads.mass.A[wanted], loads.mass.b[wanted])
        K[wanted] = elastic_part(body, u, mass, Phi)
    K -= mean_part(body, loads.on_dofs, Phi, condition.frame.axes)
    return GeometricStiffness(
        translation=K[:3],
        rotation=K[3:6],
        spin=K[6:12],
        interfaces=K[12:].reshape(len(body.interfaces), 6, *K.shape[1:]),
    )


def require_geometric_stiffness(body: FEBody) -> None:
    """Raise `BodyError` unless the elements know their geometric stiffness."""
    if not has_geometric_stiffness(body):
        raise BodyError(
            f"body {body.name!r}: geometric stiffness needs the elements, and it came without them (bare matrices); "
            "build it from its mesh (fe_models.solid_body, beam_body), or reduce it without (geometric=False, in a job "
            "geometric_stiffness = false)"
        )


def static_states(families: Families, F: Array) -> Array:
    """Return the response to balanced loads with R held, (n_dof, k); it needs no inertia, as P would.

    v = K_II⁻¹ f_I;  S_ee z_e = (f_h - K_hI v)_e with z = 0 at R;  u = v + Psi_C z.
    """
    body = families.body
    if not F.shape[1]:
        return np.zeros(F.shape)
    i, h = families.fixed.i, families.h
    v = families.fixed.factorization.solve(F[i])
    z = np.zeros((len(h), F.shape[1]))
    e = np.flatnonzero(~np.isin(h, families.r))
    if len(e):
        g = F[h] - (body.K[:, h].T @ embedded(v, i, body.n_dof))
        S_ee = families.S[np.ix_(e, e)]
        size = 1 / np.sqrt(np.where(np.diag(S_ee) > 0, np.diag(S_ee), 1.0))
        try:
            factor = la.cho_factor(S_ee * np.outer(size, size))
        except la.LinAlgError as error:
            raise BodyError(
                f"body {body.name!r}: motions besides the rigid ones cost no energy: a mechanism; join the parts or "
                "add what holds them"
            ) from error
        z[e] = size[:, None] * la.cho_solve(factor, size[:, None] * g[e])
    u = combine(families.Psi_C, z)
    u[i] += v
    return u


def embedded(v: Array, rows: IntArray, n: int) -> Array:
    """Return v in some rows of n, zero in the others."""
    whole = np.zeros((n, v.shape[1]))
    whole[rows] = v
    return whole


def blocks(loads: IntArray) -> list[IntArray]:
    """Return the loads in blocks, whose states are held at once."""
    return [loads[first : first + LOADS_AT_ONCE] for first in range(0, len(loads), LOADS_AT_ONCE)]


def elastic_part(body: FEBody, u: Array, mass: MassLoads, Phi: Array) -> Array:
    """Return steps (3) and (4) of static states u, (n_dof, k), under their loads per mass, (k, n, n)."""
    model = body.element_model
    assert model is not None
    u_mesh = body.mesh_displacement(u)
    K = model.geometric_stiffness(u_mesh, mass, body.mesh_displacement(Phi))
    if body.recovery is None:
        return K
    T, dofs = body.recovery.matrix, body.recovery.dofs
    nodes = followers(T, dofs, body.dofs)
    if not len(nodes):
        return K
    forces = model.internal_forces(u_mesh, nodes=nodes)
    on_followers = forces - model.mass_forces(mass)
    on_followers[~np.isin(dofs[:, 0], nodes)] = 0.0
    return K + link_work(T, dofs, body.dofs, on_followers, Phi)


def mean_part(body: FEBody, on_dofs: Array, Phi: Array, axes: Array) -> Array:
    """Return step (5): work of the loads on the second order of the interfaces' own motion, (k, n, n).

    A distributing interface hands what acts on its reference node to its members. The other ones that are no node of
    the body are read off several members, or by a lever: that counts for their own unit loads, 12 + 6 i + c.
    """
    work = distributing_part(body, on_dofs, Phi)
    turn = np.kron(np.eye(2), axes)
    for number, interface in enumerate(body.interfaces):
        own = slice(12 + 6 * number, 18 + 6 * number)
        motion, _, turns = reference_motion(body, interface)
        if interface.kind == "distributing":
            continue
        if is_mean(body, interface):
            gamma = members_second_order(body, interface, Phi, turns)
            work[own] += np.einsum("cj,ckl->jkl", turn, gamma, optimize=True)
        else:
            six = np.stack([np.zeros(6, np.int64), np.arange(6)], axis=1)
            work[own] += link_work(motion, six, body.dofs, np.asarray(turn, np.float64), Phi)
    return work


def distributing_part(body: FEBody, on_dofs: Array, Phi: Array) -> Array:
    """Return the work of loads on reference nodes that are the mean of their members, (k, n, n)."""
    n = Phi.shape[1]
    work = np.zeros((on_dofs.shape[1], n, n))
    for interface in body.interfaces:
        if interface.kind == "distributing":
            _, _, turns = reference_motion(body, interface)
            gamma = members_second_order(body, interface, Phi, turns)
            work += np.einsum("cj,ckl->jkl", on_dofs[np.asarray(interface.dofs)], gamma, optimize=True)
    return work


def members_second_order(body: FEBody, interface: Interface, Phi: Array, turns: bool) -> Array:
    """Return the second order of the mean motion of the members with the shapes, (6, n, n), mesh axes."""
    rows = translation_rows(body, interface.nodes)
    v = np.asarray(rows @ Phi).reshape(len(interface.nodes), 3, -1)
    weights = np.asarray(interface.weights)
    return mean_second_order(body.nodes[interface.nodes], weights, interface.reference, v, turns=turns)
