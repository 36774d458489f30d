"""A solver that keeps a reduction within a memory budget: factor in memory, factor on disk, or an early error.

The peak is the largest of three stages. Symbols: n dofs, c columns of the mode set, m vibration modes, b their block
size, k static columns, h memory of the process at the start of the stage.

(1) factorisation: h + permuted matrix + active and waiting fronts (`Blocks.n_working`) + factor, if in memory
(2) vibration and static modes: h + factor (or its largest part for each thread) + 8 n times the columns
    (4 m + 8 b + k) during the mode search; basis: 3 m + 6 b columns
    (k + c + m) while the set is assembled from the k = c - m static columns and the modes
(3) finishing, moments and stress, with the factor freed: memory of the coupled body + 6.2 arrays of (n, c)

If (3) does not fit, the columns are put on disk (`fe_models.foundation.tall`). Then k and c drop out of (2), and (3) is

(3') memory of the coupled body + 54 matrices (c, c) + 400 MB of products

The numbers 3 m + 6 b, 6.2, 54 and 400 MB are measured; all others follow from array shapes. docs/measured.md compares
forecasts with peaks.
"""

import logging
import tempfile
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from cms.errors import MemoryBudgetError
from cms.linear_algebra.memory.size import resident_bytes
from cms.linear_algebra.solvers.superlu import SuperLuFactor
from cms.linear_algebra.sparse_cholesky.analysis import Fronts, analyse
from cms.linear_algebra.sparse_cholesky.blocks import blocks_of
from cms.linear_algebra.sparse_cholesky.factor import CholeskyFactor
from fe_models.foundation.solver import Factor, Solver
from fe_models.foundation.threads import n_threads

__all__ = ["Peak", "ReductionShape", "columns_within", "peak_of", "solver_within"]

log = logging.getLogger(__name__)

PERMUTED = 12.0  #: bytes per entry of the reordered lower triangle
TALL = 6.2  #: number of arrays over all dofs and columns in memory in the third stage
SQUARES = 54.0  #: number of (c, c) matrices in memory if the columns are on disk: Gram matrices, moments, invariants
SLICES = 4e8  #: size of slices and products in memory if the columns are on disk [bytes]
ON_DISK = 6.0  #: largest number of arrays over all dofs and columns on disk


@dataclass(frozen=True)
class ReductionShape:
    """Data that determine the peak memory of a reduction, in addition to the matrix."""

    n_dof: int
    n_columns: int  #: number of columns of the mode set
    n_modes: int  #: number of vibration modes among the columns
    held: float  #: memory of the process that includes the coupled body [bytes]
    to_disk: bool = False  #: whether the columns are on disk


@dataclass(frozen=True)
class Peak:
    """Peak memory of each of the three stages [bytes]."""

    factorisation: float
    modes: float
    reduction: float

    @property
    def most(self) -> float:
        """Largest peak of the three stages [bytes]."""
        return max(self.factorisation, self.modes, self.reduction)


def peak_of(shape: ReductionShape, fronts: Fronts, n_entries: int, held: float, *, on_disk: bool) -> Peak:
    """Return the peak memory of a reduction.

    Parameters
    ----------
    shape
        Data of the reduction.
    fronts
        Fronts of the interior stiffness.
    n_entries
        Number of entries of its lower triangle.
    held
        Memory of the process before the factorisation [bytes].
    on_disk
        Whether the factor is on disk.
    """
    blocks, threads = blocks_of(fronts), n_threads()
    stored = np.diff(blocks.stored)
    factor = 0.0 if on_disk else 8.0 * fronts.n_stored
    at_hand = 8.0 * np.sort(stored)[-threads:].sum() if on_disk else factor
    block = 16 if shape.n_modes >= 32 else 8
    n_static = 0 if shape.to_disk else shape.n_columns - shape.n_modes
    columns = max(4 * shape.n_modes + 8 * block + n_static, 2 * (n_static + shape.n_modes))
    return Peak(
        held + PERMUTED * n_entries + 8.0 * blocks.n_working(threads, on_disk=on_disk) + factor,
        held + at_hand + 8.0 * shape.n_dof * columns,
        reduction_peak(shape),
    )


def reduction_peak(shape: ReductionShape) -> float:
    """Return the peak of the third stage [bytes]."""
    if shape.to_disk:
        return shape.held + 8.0 * SQUARES * shape.n_columns**2 + SLICES
    return shape.held + 8.0 * TALL * shape.n_dof * shape.n_columns


def columns_within(budget: float, shape: ReductionShape) -> ReductionShape:
    """Return the shape, with columns on disk if they fit only there; the log mentions this."""
    stored = replace(shape, to_disk=True)
    if reduction_peak(shape) <= budget or reduction_peak(stored) >= reduction_peak(shape):
        return shape
    log.warning(
        "memory: %d columns of %d dofs need %s, more than %s; stored on disk they need %s, and up to %s on disk in "
        "%s. Fewer columns avoid this: interface_modes = 20 in [reduction] for interfaces of many nodes",
        shape.n_columns, shape.n_dof, gigabytes(reduction_peak(shape)), gigabytes(budget),
        gigabytes(reduction_peak(stored)), gigabytes(8.0 * ON_DISK * shape.n_dof * shape.n_columns),
        tempfile.gettempdir(),
    )  # fmt: skip
    return stored


def solver_within(budget: float, shape: ReductionShape) -> Solver:
    """Return the solver for a reduction within `budget` bytes, which include all memory of the process.

    Its `factor` raises `MemoryBudgetError` before any factorisation if the factor fits neither in memory nor on disk.
    """

    def factor(lower: sp.csc_array, *, definite: bool) -> Factor:
        if not definite:
            log.warning(
                "memory: the matrix is not positive definite (multipliers): SuperLU, whose memory is not bounded"
            )
            return SuperLuFactor(lower, definite=False)
        held = resident_bytes()
        fronts = analyse(lower)
        inside, outside = (peak_of(shape, fronts, lower.nnz, held, on_disk=on_disk) for on_disk in (False, True))
        if inside.most <= budget:
            log.info("memory: this needs %s of %s; in core", gigabytes(inside.most), gigabytes(budget))
            return CholeskyFactor(lower, fronts=fronts)
        if outside.most > budget:
            raise MemoryBudgetError(refusal(budget, inside, outside))
        log.warning(
            "memory: this needs %s, more than %s; it runs out of core: %s, and %s on disk in %s",
            gigabytes(inside.most), gigabytes(budget), gigabytes(outside.most), gigabytes(8.0 * fronts.n_stored),
            tempfile.gettempdir(),
        )  # fmt: skip
        return CholeskyFactor(lower, on_disk=True, fronts=fronts)

    return Solver("cholesky", factor)


def refusal(budget: float, inside: Peak, outside: Peak) -> str:
    """Return the message about missing memory or disk space, with possible remedies."""
    stages = {
        "the factorisation": (outside.factorisation, "fewer dofs (a coarser mesh), or cms split"),
        "the modes": (outside.modes, "fewer modes, or fewer columns (interface_modes for interfaces of many nodes)"),
        "the reduction": (outside.reduction, "fewer columns: fewer modes, interface_modes, rigid interfaces"),
    }
    name = max(stages, key=lambda each: stages[each][0])
    return (
        f"memory = {gigabytes(budget)}: this needs {gigabytes(inside.most)}, or {gigabytes(outside.most)} with its "
        f"factor on disk, most for {name}; allow that much, or take {stages[name][1]}"
    )


def gigabytes(size: float) -> str:
    """Return a size in gigabytes as text."""
    return f"{size / 1e9:.3g} GB" if size >= 1e9 else f"{np.ceil(size / 1e6):.0f} MB"
