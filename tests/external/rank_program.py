"""Run by mpirun: every mode set with the factor on all ranks beside one process; prints the differences as JSON."""

import gc
import json
from contextlib import contextmanager
from dataclasses import fields

import numpy as np
import scipy.linalg as la

from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.modes.families.families import Families
from cms.modes.families.interface_loads import point_load
from cms.modes.mode_sets import MODE_SETS
from cms.reduction.basis.finishing import finish
from cms.reduction.basis.frames import TisserandFrame, frame_condition
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.foundation.ranks.mpi import all_ranks
from fe_models.foundation.ranks.row_layout import asked
from fe_models.foundation.ranks.spread_matrix import SpreadMatrix
from fe_models.foundation.tall.columns import in_memory
from tests.bodies import bar

# krylov by whole blocks: a number of modes cuts between directions that are as significant, where rounding chooses;
# h2-optimal by few iterations: for this symmetric bar later ones leave a saddle in a direction that rounding chooses
OPTIONS = {
    "benfield-hruda": {
        "n_modes": 6,
        "loads": [point_load("left", mass=1.0, inertia=0.01), point_load("right", stiffness=1e6)],
    },
    "guyan": {},
    "craig-bampton": {"n_modes": ModeCount(6, verify=True)},
    "rubin": {"n_modes": ModeCount(6, verify=True)},
    "krylov": {"n_blocks": 1, "shifts": (0.0, 1234.0)},
    "balanced-truncation": {"n_modes": 6},
    "h2-optimal": {"n_modes": 6, "max_iterations": 5},
    "assumed-modes": {"n_axial": 2, "n_bending": 3, "n_torsion": 1},
}


def reduced_by(solver, body, name):
    """Return the finished shapes, the reduced body and its interface response, by this solver."""
    options = OPTIONS.get(name, {"n_modes": 6})
    with Families(body, solver=solver) as families:
        if name == "user-basis":
            options = {"columns": in_memory(MODE_SETS["craig-bampton"](families, n_modes=6).columns)}
        modes = MODE_SETS[name](families, **options)
        reduced = reduce(families, modes)
    Phi = in_memory(finish(body, modes, frame_condition(body, TisserandFrame())).Phi)
    Psi = np.concatenate([interface.Psi for interface in reduced.interfaces])
    omega2 = (2 * np.pi * np.linspace(20.0, 3000.0, 7)) ** 2
    K = reduced.K * (1 + 0.02j)
    H = np.array([Psi @ la.solve(K - x * reduced.M, Psi.T) for x in omega2])
    return Phi, reduced, H


def relative(a, b):
    """Return the largest difference over the largest entry."""
    scale = np.abs(b).max() if np.size(b) else 0.0
    return float(np.abs(a - b).max() / scale) if scale else 0.0


def arrays(record):
    """Return the arrays of a record."""
    values = (getattr(record, field.name) for field in fields(record))
    return [each for each in values if isinstance(each, np.ndarray) and each.dtype.kind == "f"]


def compared(spread, body, name):
    """Return by how much frequencies, subspaces (sines of principal angles), invariants and responses differ."""
    with counted_collections() as collections:
        Phi, ours, H = reduced_by("petsc", spread, name)
    Phi_1, one, H_1 = reduced_by(None, body, name)
    rest = Phi - Phi_1 @ (Phi_1.T @ (body.M @ Phi))
    size = np.sqrt([one.moments.m, np.trace(one.moments.R)])  # of 1 and c; shapes are M-orthonormal
    scales = {"m": size[0] ** 2, "S": size[0] * size[1], "R": size[1] ** 2, "C1": size[0], "P": size[1], "S_kl": 1.0}
    invariants = [np.abs(getattr(ours.moments, k) - getattr(one.moments, k)).max() / scales[k] for k in scales]
    if one.geometric is not None:
        invariants += [relative(*pair) for pair in zip(arrays(ours.geometric), arrays(one.geometric), strict=True)]
    return {
        "frequencies": float(np.abs(ours.free_frequencies / one.free_frequencies - 1).max()),
        "angle": float(np.sqrt(max(la.eigvalsh(rest.T @ (body.M @ rest))[-1], 0.0))),
        "invariants": float(max(invariants)),
        "response": relative(H, H_1),
        "solver": ours.provenance.get("mode set solver", ""),
        "collected": len(collections),
    }


@contextmanager
def counted_collections():
    """Note whenever rank 0 collects a whole matrix."""
    collections, kept = [], SpreadMatrix.whole

    def whole(matrix):
        collections.append(matrix)
        return kept(matrix)

    SpreadMatrix.whole = whole
    yield collections
    SpreadMatrix.whole = kept


def n_kept(ranks):
    """Return how many things this rank still keeps for others."""
    return len(ranks.store)


def main():
    """Compare on rank 0, serve on the others."""
    ranks = all_ranks()
    if ranks.rank:
        ranks.serve()
        return
    try:
        body, spread = (couple(bar(nx=16, ny=2, nz=2, kind="hexahedron", ranks=who)) for who in (None, ranks))
        gc.collect()
        before = sum(asked(ranks, n_kept))  # K, M, M_s and the mesh
        found = {
            name: compared(spread, body, name) | {"kept": sum(asked(ranks, n_kept)) - before} for name in MODE_SETS
        }
        print("RESULT " + json.dumps(found), flush=True)
    finally:
        ranks.end()


if __name__ == "__main__":
    main()
