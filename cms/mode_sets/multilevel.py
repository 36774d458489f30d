"""Craig-Bampton for large bodies and many modes: its modes by multilevel substructures (AMLS)."""

from contextlib import nullcontext
from multiprocessing import current_process

import numpy as np

from cms.errors import FactorizationError, ModeSetError
from cms.families.families import Families
from cms.families.fixed_interface import FixedInterfaceBody
from cms.families.sharing import families_of
from cms.families.vibration_modes import no_modes
from cms.mode_set import ModeSet
from cms.mode_sets.blocks import constraint_block, inertia_relief_block, mode_set, vibration_block
from cms.mode_sets.selection import checked_modes, require_interfaces
from cms.solvers.eigen import EigenResult
from cms.solvers.factorization import Factorization
from cms.solvers.mode_count import ModeCount, mode_count
from cms.substructures.modes import Interior, MultilevelResult, multilevel_modes
from fe_models.body.fe_body import MULTIPLIER, FEBody
from fe_models.body.submatrix import principal_block
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
    """Craig-Bampton whose fixed-interface modes come from multilevel substructures: [Psi_C, (Psi_H,) modes] [1]_.

    Constraint modes are exact, by the same tree, which stands for the factorisation of the body from then on.
    Frequencies are never below the true ones; an estimate of the error of each stands in `data["frequency error"]`, NaN
    for static columns.

    Parameters
    ----------
    body
        A coupled body whose interfaces hold it, or its `Families`.
    n_modes
        Number of fixed-interface modes, or a `ModeCount`: all up to a cutoff, proven or not.
    inertia_relief
        Whether the static responses to rigid-body accelerations stand after the constraint modes, as in
        `craig_bampton_ir`.
    tolerance
        Largest relative error of a frequency, 1e-10 to 0.1; a warning says what is above it.
    cutoff_factor
        Substructures keep their modes up to so many times the cutoff (of a number of modes: times its highest
        frequency), 1.2 or more; None: 20 for shells and beams, 14 where there are at
        most 400 interior dofs for each wanted mode, 4 for solids.
    workers
        Where subtrees are eliminated: a number of processes, dask, or dask://host:port; None: threads of this process.

    Raises
    ------
    ModeSetError
        If there are fewer interior dofs than modes, no mode lies below the cutoff, the interfaces do not hold the body,
        or tolerance or cutoff_factor are out of range.
    BodyError
        If the body is a mechanism when its interfaces are held.
    EigenError
        If the substructures kept fewer modes than are wanted, or the proof fails.

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
            blocks.append(inertia_relief_block(families))
        n_static = sum(block.columns.shape[1] for block in blocks)
        errors = results[-1].errors if results else np.zeros(0)
        made = mode_set(
            "multilevel",
            families,
            [*blocks, vibration_block("fixed-interface", modes)],
            modes=modes,
            wanted=wanted,
            options=_words(results[-1], tolerance) if results else None,
            data={"frequency error": np.concatenate([np.full(n_static, np.nan), errors])} if results else None,
        )
        return made


def _modes_of(
    families: Families, wanted: ModeCount, tolerance: float, cutoff_factor: float | None, workers: Workers
) -> MultilevelResult:
    """Find the modes over all dofs; the tree becomes the factorisation of the families, if they have none yet."""
    body = families.body
    i = body.i
    K, M = principal_block(body.K, i), principal_block(body.M, i)
    interior = Interior(K, M, body.dofs[i, 0], body.nodes, body.dofs[i, 1] == MULTIPLIER)
    if current_process().daemon:  # a task of a fleet or sweep: it may start no processes
        workers = None
    with nullcontext() if workers is None else tasks_of(workers) as tasks:
        try:
            found = multilevel_modes(
                interior, wanted, tolerance=tolerance, cutoff_factor=cutoff_factor, tasks=tasks,
                rows=(body.n_dof, i), solver=families.solver,
            )  # fmt: skip
        except FactorizationError:
            families.fixed  # noqa: B018 - says where the mechanism is
            raise
    families.adopt(FixedInterfaceBody(body, i, body.b, Factorization(found.tree, families.solver)))
    return found


def _words(result: MultilevelResult, tolerance: float) -> dict[str, str]:
    """Return what was done and what error is left, for the provenance."""
    above = np.flatnonzero(result.errors > tolerance) + 1
    return {
        "cutoff factor": f"{result.cutoff_factor:g}",
        "substructures": result.tree.words,
        "tolerance": f"{tolerance:g}",
        "largest frequency error": f"{result.errors.max(initial=0.0):.1e} (estimate)",
        "above tolerance": ", ".join(map(str, above)) if len(above) else "none",
    }


def _require_range(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise ModeSetError(f"multilevel: {name} = {value:g}; expected {low:g} to {high:g}")
