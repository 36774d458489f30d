"""Craig-Bampton for large bodies and many modes: modes by automated multilevel substructuring (AMLS)."""

from contextlib import nullcontext
from multiprocessing import current_process

import numpy as np

from cms.errors import FactorizationError, ModeSetError
from cms.linear_algebra.solvers.eigen import EigenResult, no_modes
from cms.linear_algebra.solvers.factorization import Factorization
from cms.linear_algebra.solvers.mode_count import ModeCount, mode_count
from cms.linear_algebra.substructures.modes import Interior, MultilevelResult, multilevel_modes
from cms.modes.families.families import Families, families_of
from cms.modes.families.fixed_interface import FixedInterfaceBody
from cms.modes.mode_set import (
    ModeSet,
    checked_modes,
    constraint_block,
    mode_set,
    require_interfaces,
    rigid_block,
    vibration_block,
)
from fe_models.body.fe_body import MULTIPLIER, FEBody
from fe_models.foundation.sparse.submatrix import principal_block
from fe_models.foundation.tasks.workers import Workers, tasks_of

__all__ = ["multilevel"]


def multilevel(
    body: FEBody | Families,
    n_modes: int | ModeCount,
    *,
    inertia_relief: bool = False,
    tolerance: float = 1e-3,
    cutoff_factor: float | None = None,
    workers: Workers = None,
) -> ModeSet:
    """Craig-Bampton with fixed-interface modes from multilevel substructuring: [Psi_C, (Psi_H,) modes] [1]_.

    The constraint modes are exact. They use the same tree, which then serves as the factorisation of the body.
    Frequencies are never below the true ones. `data["frequency error"]` holds an error estimate for each mode, and NaN
    for static columns.

    Parameters
    ----------
    body
        A coupled body whose interfaces hold it, or its `Families`.
    n_modes
        Number of fixed-interface modes, or a `ModeCount` for all modes up to a cutoff, with or without proof.
    inertia_relief
        Whether to add the static responses to rigid-body accelerations after the constraint modes, as in
        `craig_bampton_ir`.
    tolerance
        Largest relative error of a frequency, 1e-10 to 0.1; a warning names the frequencies with a larger error.
    cutoff_factor
        Substructures keep their modes up to this factor times the cutoff, or times the highest wanted frequency; 1.2 or
        more. None: 4 for solids; for shells and beams 20, or 14 if `n_modes` is a number and at least 1/400 of the
        interior dofs (many modes: then fewer substructure modes are enough).
    workers
        Workers that eliminate subtrees: number of processes, dask, or dask://host:port; None: threads of this process.

    Raises
    ------
    ModeSetError
        If there are fewer interior dofs than modes, no mode lies below the cutoff, the interfaces do not hold the body,
        or tolerance or cutoff_factor is out of range.
    BodyError
        If the body is a mechanism with its interfaces held.
    EigenError
        If the substructures kept fewer modes than wanted, or the proof fails.

    References
    ----------
    .. [1] Bennighof & Lehoucq (2004), docs/bibliography.md; derived in docs/theory.md §2.
    """
    with families_of(body) as families:
        body, wanted = families.body, mode_count(n_modes)
        require_interfaces("multilevel", body)
        _require_range("tolerance", tolerance, 1e-10, 0.1)
        if cutoff_factor is not None:
            _require_range("cutoff_factor", cutoff_factor, 1.2, 100.0)
        if len(families.h) > len(body.b):
            raise ModeSetError(
                f"multilevel: the interfaces of body {body.name!r} leave a rigid-body motion free; expected interfaces "
                "that hold it; take craig-bampton"
            )
        results: list[MultilevelResult] = []

        def find(n_modes: ModeCount) -> EigenResult:
            if n_modes.n == 0 or not len(body.i):
                return no_modes(body.n_dof)
            results.append(_modes_of(families, n_modes, tolerance, cutoff_factor, workers))
            return results[-1].modes

        modes = checked_modes("multilevel", "fixed-interface", find, body, wanted)
        blocks = [constraint_block(families)]
        if inertia_relief:
            blocks.append(rigid_block(families, families.Psi_H, "inertia-relief"))
        n_static = sum(block.columns.shape[1] for block in blocks)
        errors = results[-1].errors if results else np.zeros(0)
        made = mode_set(
            "multilevel",
            families,
            [*blocks, vibration_block("fixed-interface", modes)],
            modes=modes,
            wanted=wanted,
            options=_provenance(results[-1], tolerance) if results else None,
            data={"frequency error": np.concatenate([np.full(n_static, np.nan), errors])} if results else None,
        )
        return made


def _modes_of(
    families: Families, wanted: ModeCount, tolerance: float, cutoff_factor: float | None, workers: Workers
) -> MultilevelResult:
    """Compute the modes over all dofs; families without a factorisation take that of the tree of substructures."""
    body = families.body
    i = body.i
    K, M = principal_block(body.K, i), principal_block(body.M, i)
    interior = Interior(K, M, body.dofs[i, 0], body.nodes, body.dofs[i, 1] == MULTIPLIER)
    if current_process().daemon:  # a task of a fleet or sweep cannot start processes
        workers = None
    with nullcontext() if workers is None else tasks_of(workers) as tasks:
        try:
            found = multilevel_modes(
                interior, wanted, tolerance=tolerance, cutoff_factor=cutoff_factor, tasks=tasks,
                rows=(body.n_dof, i), solver=families.solver,
            )  # fmt: skip
        except FactorizationError:
            families.fixed  # noqa: B018 - raises an error that names the mechanism
            raise
    families.adopt(FixedInterfaceBody(body, i, body.b, Factorization(found.tree, families.solver)))
    return found


def _provenance(result: MultilevelResult, tolerance: float) -> dict[str, str]:
    """Describe the method and the remaining error, for the provenance."""
    above = np.flatnonzero(result.errors > tolerance) + 1
    return {
        "cutoff factor": f"{result.cutoff_factor:g}",
        "substructures": result.tree.division,
        "tolerance": f"{tolerance:g}",
        "largest frequency error": f"{result.errors.max(initial=0.0):.1e} (estimate)",
        "above tolerance": ", ".join(map(str, above)) if len(above) else "none",
    }


def _require_range(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise ModeSetError(f"multilevel: {name} = {value:g}; expected {low:g} to {high:g}")
