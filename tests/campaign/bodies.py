"""Random finite element bodies against dense algebra: a reduced body that differs by more than 1e-5 is a fault.

(1) the body is coupled and reduced as drawn (`random_body`), written and read again, and put in other units
(2) K, M, D of the mesh, dense, give the span of its mode set by textbook formulas (`tests.references.dense_bodies`), or
    hold the columns of the set where it has none there
(3) the fields of the reduced modes over the mesh are the combinations of that span that move the kept nodes as Phi says
(4) everything the body holds is compared with what these fields say: M, K, D, frequencies, mass and first moments of
    inertia, frame, motion of interfaces, load cases

A sound body that is refused is a fault too.
"""

import logging
import warnings
from pathlib import Path

import numpy as np

import cms
from fe_models.foundation.errors import ReportedError
from tests.campaign.random_bodies import BodyCase, random_body
from tests.campaign.verdict import ACCEPTED, UNCLEAR, WRONG, Verdict
from tests.references.dense_bodies import DenseBody, angle, frequencies, rigid_fields

__all__ = ["body_case", "body_verdict", "defects"]

MOST = 1e-5  #: relative difference that is rounding, of dense algebra with bodies of many sizes
DEPENDENT = 1e-10  #: squared norm of a combination of columns of unit length below which they repeat each other
ROUNDING = 1e-7  #: part of a column that is left of a rigid motion when rigid motions are taken off
OTHER_MASS = ("macneal",)  #: sets that leave mass of their columns out


def body_case(seed: int, folder: Path) -> Verdict:
    """Return the verdict of the case of a seed."""
    return body_verdict(random_body(seed), folder)


def body_verdict(case: BodyCase, folder: Path) -> Verdict:
    """Return what became of a case."""
    logging.disable(logging.WARNING)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                reduced, coupled, columns = reduced_of(case)
            except ReportedError as error:
                return Verdict(WRONG, f"refused: {type(error).__name__}: {str(error)[:300]}; {case.words}")
            found = defects(case, coupled, columns, reduced) | file_defects(reduced, folder)
        worst = max(found, key=lambda name: np.inf if np.isnan(found[name]) else found[name])
        told = f"{worst} differs by {found[worst]:.2g} ({len(found)} compared); {case.words}"
        return Verdict(ACCEPTED if found[worst] <= MOST else WRONG, f"compared: {told}")
    except ReportedError as error:
        return Verdict(UNCLEAR, f"{type(error).__name__}: {str(error)[:300]}; {case.words}")
    finally:
        logging.disable(logging.NOTSET)


def reduced_of(case: BodyCase):
    """Return the reduced body of a case, the coupled body and the columns of its mode set."""
    coupled = cms.couple(case.body)
    make = cms.MODE_SETS[case.set_name]
    modes = make(coupled) if case.set_name == "guyan" else make(coupled, n_modes=case.n_modes)
    reduced = cms.reduce(coupled, modes, frame=case.frame, damping=case.damping, geometric=False, stress=False)
    return reduced, coupled, modes.columns


def relative(got, expected, scale=None) -> float:
    """Return the largest difference by the largest number expected, or another scale."""
    got, expected = np.asarray(got), np.asarray(expected)
    if got.shape != expected.shape:
        return np.inf
    size = np.abs(expected).max(initial=0.0) if scale is None else scale
    return float(np.abs(got - expected).max(initial=0.0) / size) if size else float(np.abs(got).max(initial=0.0))


def defects(case: BodyCase, coupled, columns, reduced) -> dict[str, float]:
    """Return by how much a reduced body differs from dense algebra, relative, by name."""
    body = case.body
    K, M = body.K.toarray(), body.M.toarray()
    dense = DenseBody(K, M, body.nodes, body.dofs, body.interfaces)
    at, extent = dense.center(), float(np.ptp(body.nodes, axis=0).max())
    mesh = fields_of(coupled, columns, body.dofs)
    own = dense.span(case.set_name, case.n_modes)
    R = rigid_fields(body.nodes, body.dofs, at, np.eye(3))
    R_scaled = R / np.r_[1, 1, 1, extent, extent, extent]
    shift = np.trace(K) / np.trace(M) * 1e-4
    norm = K + shift * M
    found = {}
    if own is not None:
        one, other = (elastic_basis(each, R, M, norm) for each in (own, mesh))
        found["span"] = max(angle(one, other, norm), angle(other, one, norm))
    E = elastic_basis(mesh if own is None else own, R, M, norm)
    W = np.hstack([R_scaled, E])

    frame, A = reduced.frame, reduced.frame.axes
    n_free = len(reduced.free_frequencies)
    if case.set_name not in OTHER_MASS:
        omega = frequencies(E.T @ K @ E, E.T @ M @ E)[0] / 2 / np.pi
        finite = omega[omega < 1e5 * omega[0]]
        found["frequencies"] = relative(
            np.sort(reduced.free_frequencies)[: len(finite)] / finite, np.ones(len(finite)), 1.0
        ) if n_free >= len(finite) else np.inf  # fmt: skip

    # (3): fields over the mesh, by all that is known of the kept nodes: translations alone tell bent beams apart badly
    kept = [(k, node) for k, node in enumerate(reduced.node_ids.tolist()) if node < len(body.nodes)]
    row_of = {(int(node), int(c)): row for row, (node, c) in enumerate(body.dofs)}
    kept = [(k, node) for k, node in kept if (node, 0) in row_of]
    rows = np.array([row_of[node, c] for _, node in kept for c in range(3)])
    places = reduced.nodes[[k for k, _ in kept]]
    found["places"] = relative(frame.origin + places @ A.T, body.nodes[[node for _, node in kept]], extent)
    shapes = np.einsum("ab,kbq->kaq", A, reduced.Phi[[k for k, _ in kept]]).reshape(-1, reduced.n_q)
    turning, turns = rotations_of(reduced, row_of, A)
    seen, shapes = np.vstack([W[rows], extent * W[turning]]), np.vstack([shapes, extent * turns])
    values = np.linalg.svd(seen, compute_uv=False)
    if len(values) < W.shape[1] or values[-1] < 1e-9 * values[0]:
        return found  # the kept nodes do not tell the fields apart
    a = np.linalg.lstsq(seen, shapes, rcond=None)[0]
    found["Phi"] = relative(seen @ a, shapes)
    U = W @ a

    # (4): what they say
    R_B = rigid_fields(body.nodes, body.dofs, frame.origin, A)
    lengths = np.r_[1, 1, 1, extent, extent, extent]
    K_q = U.T @ K @ U
    weights = 1 / np.sqrt(np.maximum(np.diag(K_q), np.diag(K_q).max() * 1e-30))
    by_mode = np.outer(weights, weights)
    found["K"] = relative(reduced.K * by_mode, K_q * by_mode, 1.0)
    moments = reduced.moments
    M_R = R_B.T @ M @ R_B
    found["mass"] = relative(moments.m, M_R[0, 0])
    if case.mass is not None:
        found["known mass"] = relative(moments.m, case.mass)
    distance = np.linalg.norm(at - frame.origin) + extent
    found["first moment"] = relative(np.cross(moments.S, np.eye(3)).T, M_R[3:, :3], moments.m * distance)
    found["inertia"] = relative(moments.J0, M_R[3:, 3:], moments.m * distance**2)
    if case.set_name not in OTHER_MASS:
        found["M"] = relative(reduced.M, U.T @ M @ U, 1.0)
        Y = R_B.T @ M @ U
        size = np.sqrt(M_R[0, 0])
        found["1C"] = relative(moments.C1, Y[:3], size)
        found["2C"] = relative(moments.C2, Y[3:], size * distance)
        D_q = damping_of(case, reduced, U)
        scale = np.sqrt(np.outer(np.diag(D_q), np.diag(D_q))).max() if D_q.any() else 0.0
        found["D"] = relative(reduced.D, D_q, scale or float(np.sqrt(np.diag(reduced.K).max())))
    found |= frame_defects(case, dense, U, M, R_B, lengths, reduced)
    is_rotation = body.dofs[:, 1] > 2
    sizes = np.where(is_rotation, np.abs(U[is_rotation]).max(initial=0.0), np.abs(U[~is_rotation]).max())
    for port in reduced.interfaces:
        if port.name in dense.mean:
            motion = np.kron(np.eye(2), A.T) @ dense.mean[port.name] @ U
            terms = np.abs(dense.mean[port.name]) @ sizes  # its rounding: large where members are nearly on a line
            found[f"Psi {port.name}"] = max(
                relative(port.Psi[rows], motion[rows], terms[rows].max())
                for rows in ([slice(3), slice(3, 6)] if port.has_rotation else [slice(3)])
            )
    for load, given in zip(reduced.load_cases, body.load_cases, strict=True):
        wrench = R_B.T @ given.f
        size = np.abs(given.f).sum()
        found["force"] = relative(load.force, wrench[:3], size)
        found["torque"] = relative(load.torque, wrench[3:], size * distance)
        found["h"] = relative(load.h, U.T @ given.f, size * np.abs(shapes).max())
    return found


def rotations_of(reduced, row_of, A):
    """Return the rows of rotations that the body keeps of dofs of the mesh, and these rotations in mesh axes."""
    kept = reduced.kept
    if kept is None:
        return np.zeros(0, dtype=int), np.zeros((0, reduced.n_q))
    nodes = reduced.node_ids[kept.nodes]
    known = [k for k, node in enumerate(nodes.tolist()) if kept.source[k] == "dofs" and (node, 3) in row_of]
    rows = [row_of[int(nodes[k]), 3 + c] for k in known for c in range(3)]
    return np.array(rows, dtype=int), np.einsum("ab,kbq->kaq", A, kept.rotation[known]).reshape(-1, reduced.n_q)


def elastic_basis(columns, R, M, norm):
    """Return a basis of columns without their rigid motion, orthonormal in a norm, (n_dof, n)."""
    before = np.sqrt(np.einsum("ik,ij,jk->k", columns, norm, columns))
    for _ in range(2):
        columns = columns - R @ np.linalg.solve(R.T @ M @ R, R.T @ M @ columns)
    size = np.sqrt(np.einsum("ik,ij,jk->k", columns, norm, columns))
    is_elastic = size > ROUNDING * before
    columns = columns[:, is_elastic] / size[is_elastic]
    values, vectors = np.linalg.eigh(columns.T @ norm @ columns)
    keep = values > DEPENDENT * values[-1]
    return columns @ (vectors[:, keep] / np.sqrt(values[keep]))


def damping_of(case: BodyCase, reduced, U):
    """Return the damping matrix: that of the body over the fields, and what was asked for."""
    K_q, M_q = np.diag(np.diag(reduced.K)), np.diag(np.diag(reduced.M))
    D = np.zeros_like(K_q) if case.body.D is None else U.T @ case.body.D.toarray() @ U
    if isinstance(case.damping, cms.reduction.RayleighDamping):
        D = D + case.damping.alpha * M_q + case.damping.beta * K_q
    elif isinstance(case.damping, cms.reduction.ModalDamping):
        D = D + 2 * case.damping.ratio * np.sqrt(K_q @ M_q)
    return D


def frame_defects(case: BodyCase, dense: DenseBody, U, M, R_B, lengths, reduced) -> dict[str, float]:
    """Return by how much the modes break the condition of their frame."""
    if isinstance(case.frame, cms.NodalFrame):
        moved = dense.mean[case.frame.at] @ U
        return {"frame": relative(moved * np.r_[1, 1, 1, lengths[3:]][:, None], 0 * moved, np.abs(reduced.Phi).max())}
    if isinstance(case.frame, cms.reduction.BuckensFrame):
        return {}
    if case.set_name in OTHER_MASS:
        return {}
    momentum = R_B.T @ M @ U / lengths[:, None]
    center = R_B[:, :3].T @ M @ R_B[:, 3:] / (R_B[:, 0] @ M @ R_B[:, 0])
    return {
        "frame": relative(momentum, 0 * momentum, np.sqrt(R_B[:, 0] @ M @ R_B[:, 0])),
        "center": relative(center, 0 * center, lengths[-1]),
    }


def fields_of(coupled, columns, dofs):
    """Return columns over the dofs of the mesh, (n_dof, n)."""
    moved = coupled.mesh_displacement(columns)
    where = coupled.dofs if coupled.recovery is None else coupled.recovery.dofs
    row_of = {(int(node), int(c)): row for row, (node, c) in enumerate(where)}
    return moved[[row_of[int(node), int(c)] for node, c in dofs]]


def file_defects(reduced, folder: Path) -> dict[str, float]:
    """Return what a file of the body, and the body in other units and back, say otherwise."""
    cms.write(reduced, folder / "body.h5")
    back = cms.read(folder / "body.h5")
    same = all(np.array_equal(getattr(back, name), getattr(reduced, name)) for name in ("M", "K", "D", "Phi", "nodes"))
    other = next(name for name in ("mm-t-s", "m-kg-s") if name != reduced.units.name)
    moved = cms.body.convert_units(reduced, other)
    time = moved.units.time / reduced.units.time
    mass = moved.units.mass / reduced.units.mass
    return {
        "file": 0.0 if same else np.inf,
        "frequencies in other units": relative(moved.free_frequencies / time, reduced.free_frequencies),
        "mass in other units": relative(moved.moments.m * mass, reduced.moments.m),
    }
