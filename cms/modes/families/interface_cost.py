"""Cost of interfaces with very many dofs, reported before the work: columns, memory, file size, processor time."""

import time
from dataclasses import dataclass

import numpy as np

from fe_models.body.fe_body import FEBody

__all__ = ["ReductionCost", "interface_reduction_size", "large_interfaces", "reduction_cost"]

MANY = 600  #: boundary dofs of one interface from which its cost is reported
PROPOSED = 20  #: number of interface modes that the report proposes
SQUARES = 26  #: number of matrices over the modes in a modal file: moments, invariants, M, K, D, columns
TALL = 3  #: number of arrays over all dofs and columns held at the same time: columns, shapes, mesh displacement
TALL_PRODUCTS = 10.0  #: number of products of two such arrays: Gram matrices, shapes, moments
CUBES = 100.0  #: operations of eigenproblems and matrix products, per cubed number of columns


@dataclass(frozen=True)
class ReductionCost:
    """Estimated cost, without the geometric stiffness."""

    n_columns: int
    memory: float  #: [bytes]
    file: float  #: [bytes]
    seconds: float  #: [s] of one processor, without factorisation and solves

    @property
    def description(self) -> str:
        """Description in one line."""
        return (
            f"{self.n_columns} columns, about {self.memory / 1e9:.2g} GB of memory, a file of {self.file / 1e9:.2g} GB "
            f"and {duration(self.seconds)} of processor time"
        )


def reduction_cost(body: FEBody, n_columns: int, *, stress: bool = True, n_constraint_modes: int = 0) -> ReductionCost:
    """Estimate the cost of a mode set with this number of columns, from the columns to the file.

    Parameters
    ----------
    body
        A coupled body.
    n_columns
        Number of columns of the mode set.
    stress
        Whether the file holds the stress of the modes.
    n_constraint_modes
        Number of constraint modes that are combined to fewer columns: they are held twice, and have one Gram matrix.
    """
    n, k = body.n_dof, n_columns
    n_kept = len(np.unique(np.concatenate([body.surface.ravel(), *(each.nodes for each in body.interfaces)])))
    moments = 2 * (3 * k + 4) ** 2
    operations = TALL_PRODUCTS * 2 * n * k**2 + CUBES * k**3 + 2 * n * n_constraint_modes**2
    file = 8.0 * (SQUARES * k**2 + (9 if stress else 3) * n_kept * k)
    memory = max(8.0 * (TALL * n * k + moments) + file, 8.0 * 2 * n * n_constraint_modes)
    return ReductionCost(k, memory, file, operations / operations_per_second())


def interface_reduction_size(body: FEBody, interface_modes: int) -> int:
    """Return the number of constraint modes that remain if interfaces of kind "nodes" keep this number of modes."""
    sizes = [(interface.kind, len(interface.dofs)) for interface in body.interfaces if interface.dofs is not None]
    return sum(min(n_b, 6 + interface_modes) if kind == "nodes" else n_b for kind, n_b in sizes)


def large_interfaces(body: FEBody) -> list[str]:
    """Describe the cost of interfaces with very many boundary dofs, and cheaper options, one text for each."""
    large = [each for each in body.interfaces if each.dofs is not None and len(each.dofs) >= MANY]
    if not large:
        return []
    whole = reduction_cost(body, len(body.b)).description
    fewer = reduction_cost(body, interface_reduction_size(body, PROPOSED), n_constraint_modes=len(body.b)).description
    return [
        f"body {body.name!r}: interface {interface.name!r} of {len(interface.nodes)} nodes has "
        f"{len(np.asarray(interface.dofs))} boundary dofs: as many static solves and modes of the body. With all of them: "
        f"{whole}. Consider interface reduction: interface_modes = {PROPOSED} in [reduction] "
        f"(with_characteristic_modes) keeps its rigid motions and its softest modes: {fewer}; kind rigid or "
        "distributing has 6"
        for interface in large
    ]


def operations_per_second() -> float:
    """Measure the floating-point operations per second of a dense product here; takes a few milliseconds."""
    A = np.ones((384, 384))
    fastest = np.inf
    for _ in range(3):
        start = time.process_time()
        A @ A
        fastest = min(fastest, max(time.process_time() - start, 1e-4))
    return 2.0 * len(A) ** 3 / fastest


def duration(seconds: float) -> str:
    """Return a duration as text."""
    if seconds < 90:
        return f"{seconds:.2g} s"
    return f"{seconds / 60:.2g} minutes" if seconds < 5400 else f"{seconds / 3600:.2g} hours"
