"""Consistency of the geometric stiffness of a file with its moments, interfaces and quadratic modes.

A rotation theta of the whole body also rotates the stress of a load f, and the load that balances it. Between a
rotation and a mode, the geometric stiffness is therefore (theta × f)·phi_k, which follows from f alone (docs/theory.md
§7). The second-order displacement of a reference point is minus the geometric stiffness of a unit force there.
"""

from collections.abc import Iterator

import numpy as np

from cms.assessment.quality.of_body.identities import body_length, mode_size
from cms.assessment.quality.record import QualityRecord, information, judge
from cms.body.geometric_stiffness import UNIT_LOADS, GeometricStiffness
from cms.body.reduced_body import BodyFrame, ReducedBody
from cms.reduction.geometric_stiffness.unit_states import unit_mass_loads
from fe_models.foundation.arrays import Array
from fe_models.meshes.mesh import SOLID_TYPES

__all__ = ["check_second_order", "check_turned_loads", "turned_loads"]

#: relative rounding error of moments, to be multiplied by (distance / size of the body)²
ROUNDING = 100 * np.finfo(float).eps
NEGLIGIBLE = 1e-3  #: smallest scale of a difference, relative to the largest possible size of the field


def check_second_order(reduced: ReducedBody) -> QualityRecord:
    """Check that force matrices of interfaces are minus the quadratic modes of their nodes, at unit strain energy."""
    geometric = reduced.geometric
    if geometric is None or reduced.quadratic is None or not (np.diag(reduced.K) > 0).all():
        return information("second-order", "the file has no quadratic modes, or modes without stiffness")
    defects = dict(quadratic_defects(reduced, geometric))
    if not defects:
        return information("second-order", "no interface of the file is a kept node")
    worst = max(defects, key=lambda key: defects[key])
    reason = f"largest difference from the geometric stiffness is {defects[worst]:.1e}, of {worst}"
    return judge("second-order", defects[worst], reason, {"defects": defects})


def check_turned_loads(reduced: ReducedBody) -> QualityRecord:
    """Check that rotated loads follow from the moments: difference over their sum, for modes of unit strain energy.

    This is exact for solids. Beams and shells are not checked: their nodes also receive couples, a rotated couple
    counts only half, and rotated loads in bending are no larger than this effect.
    """
    geometric = reduced.geometric
    if geometric is None or geometric.turned is None or not reduced.n_q or not (np.diag(reduced.K) > 0).all():
        return information("turned-loads", "the file has no turned loads, or modes without stiffness")
    if not is_solid(reduced):
        return information("turned-loads", "the file does not say that all its cells are solid")
    defects = dict(turned_defects(reduced, geometric))
    if not defects:
        return information(
            "turned-loads", f"a {reduced.frame.kind} frame, or missing moments, leave nothing to compare"
        )
    worst = max(defects, key=lambda key: defects[key])
    reason = f"largest difference from loads that turn with the body is {defects[worst]:.1e}, of {worst}"
    return judge("turned-loads", defects[worst], reason, {"defects": defects})


def turned_defects(reduced: ReducedBody, geometric: GeometricStiffness) -> Iterator[tuple[str, float]]:
    """Yield the differences of the rotated loads, each kind divided by the sum of both terms."""
    turned = geometric.turned
    wanted = turned_loads(reduced, geometric)
    if turned is None or wanted is None:
        return
    n, by_energy = reduced.n_q, 1 / np.sqrt(np.diag(reduced.K))
    shape = float((mode_size(reduced) * by_energy).max())
    m, L = reduced.moments.m, reach(reduced)
    force = {"translation": m, "rotation": m * L, "spin": m * L, "interfaces": 1.0}
    far = float(np.linalg.norm(reduced.frame.origin)) / L  # moments about the mesh origin have lost these digits
    rounding = ROUNDING * (1 + far**2)
    parts = np.split(wanted, [3, 6, 12])
    for name, made in zip(UNIT_LOADS, parts, strict=True):
        own = np.asarray(getattr(turned, name)).reshape(-1, 3, n)
        if name == "interfaces":  # a mean motion of nodes has an additional second-order part
            is_point = [reduced.interfaces[k].kind != "nodes" for k in geometric.loaded]
            own, made = own[np.repeat(is_point, 6)], made[np.repeat(is_point, 6)]
        if not len(own):
            continue
        scale = np.ones(len(own)) if name != "interfaces" else np.tile(np.repeat([1.0, L], 3), len(own) // 6)
        a, b = (x * by_energy / scale[:, None, None] for x in (own, made))
        unit = shape * force[name]
        size = max(float(np.linalg.norm(a) + np.linalg.norm(b)), NEGLIGIBLE * unit)
        yield name, max(0.0, float(np.linalg.norm(a - b) - rounding * unit * np.sqrt(a.size)) / size)


def quadratic_defects(reduced: ReducedBody, geometric: GeometricStiffness) -> Iterator[tuple[str, float]]:
    """Yield the largest difference between the force matrix of each interface and minus its quadratic modes."""
    if reduced.quadratic is None:
        return
    by_energy = 1 / np.sqrt(np.diag(reduced.K))
    weights = np.outer(by_energy, by_energy)
    largest = float((np.abs(reduced.quadratic) * weights).max(initial=0.0))
    length = body_length(reduced)
    for k in geometric.loaded:
        interface = reduced.interfaces[k]
        distance = np.linalg.norm(reduced.nodes - interface.position, axis=1)
        if interface.kind == "nodes" or not len(distance) or distance.min() > 1e-9 * length:
            continue  # the file does not keep this node
        own = np.flatnonzero(distance <= 1e-9 * length)
        second = np.asarray(reduced.quadratic)[own] + geometric.of_interface(k)[:3]
        apart = (np.abs(second) * weights).max(axis=(1, 2, 3)).min()  # best match among several nodes at this position
        yield f"quadratic modes at {interface.name!r}", float(apart / (largest or 1.0))


def turned_loads(reduced: ReducedBody, geometric: GeometricStiffness) -> Array | None:
    """Return (e_x × f_j)·phi_k of all unit loads with their reactions, (12 + 6 n_loaded, 3, n_q); None if unknown.

    (1) loads A c + b per mass, forces and moments at interfaces
    (2) in a Tisserand frame the reaction is a rigid-body acceleration; in a nodal frame it acts on the interface that
        does not move, and does no work
    (3) the work of rotated forces per mass follows from P and 1C, at interfaces from Psi; a rotated moment counts half
    """
    moments, frame = reduced.moments, reduced.frame
    kinds = {each.name: each.kind for each in reduced.interfaces}
    is_carried = frame.kind == "nodal" and kinds.get(frame.at) == "rigid"
    if moments.missing or not (frame.kind == "tisserand" or is_carried):
        return None
    mass, n_loaded = unit_mass_loads(BodyFrame("", np.zeros(3))), len(geometric.loaded)
    A, b = np.zeros((12 + 6 * n_loaded, 3, 3)), np.zeros((12 + 6 * n_loaded, 3))  # (1)
    A[:12], b[:12] = mass.A, mass.b
    e, tilde = np.eye(3), np.cross(np.eye(3)[:, None], np.eye(3)[None]).transpose(0, 2, 1)  # tilde[x] v = e_x × v
    if frame.kind == "tisserand":  # (2)
        V = A @ moments.R + b[:, :, None] * moments.S  # ∫ f cᵀ
        wrench = np.zeros((len(A), 6))
        wrench[:, :3] = A @ moments.S + moments.m * b
        wrench[:, 3:] = np.stack([V[:, 2, 1] - V[:, 1, 2], V[:, 0, 2] - V[:, 2, 0], V[:, 1, 0] - V[:, 0, 1]], axis=1)
        for i, k in enumerate(geometric.loaded):
            own = slice(12 + 6 * i, 18 + 6 * i)
            wrench[own] += np.eye(6)
            wrench[own, 3:][:3] += np.cross(reduced.interfaces[k].position, e)
        try:
            reaction = -np.linalg.solve(moments.rigid_mass, wrench.T).T
        except np.linalg.LinAlgError:
            return None
        A = A + np.einsum("jx,xab->jab", reaction[:, 3:], tilde)
        b = b + reaction[:, :3]
    work = np.einsum("xab,jbc,cak->jxk", tilde, A, moments.P, optimize=True)  # (3)
    work += np.einsum("xab,jb,ak->jxk", tilde, b, moments.C1, optimize=True)
    for i, k in enumerate(geometric.loaded):
        Psi = reduced.interfaces[k].Psi
        work[12 + 6 * i : 15 + 6 * i] += np.einsum("xac,ak->cxk", tilde, Psi[:3])
        work[15 + 6 * i : 18 + 6 * i] += np.einsum("xac,ak->cxk", tilde, Psi[3:]) / 2
    return np.asarray(work)


def is_solid(reduced: ReducedBody) -> bool:
    """Return whether the provenance says that all cells are solid."""
    kinds = [key.split()[1] for key in reduced.provenance if key.startswith("cells ")]
    others = [key for key in reduced.provenance if key.startswith(("section", "shell", "line", "matrices"))]
    return bool(kinds) and all(kind in SOLID_TYPES for kind in kinds) and not others


def reach(reduced: ReducedBody) -> float:
    """Return the body size or the largest distance of a node from the origin of B, whichever is larger [m]."""
    return max(body_length(reduced), float(np.linalg.norm(reduced.nodes, axis=1).max(initial=0.0)))
