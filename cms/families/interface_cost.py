"""What interfaces with very many dofs cost, told before the work: columns, memory, file, processor time."""

import time
from dataclasses import dataclass

import numpy as np

from fe_models.body.fe_body import FEBody, Interface

__all__ = ["ReductionCost", "few_columns", "large_interfaces", "reduction_cost"]

MANY = 600  #: boundary dofs of one interface from which its cost is announced
PROPOSED = 20  #: modes of a large interface that the announcement proposes
SQUARES = 26  #: matrices over the modes in a modal file: moments, invariants, M, K, D, columns
TALL = 3  #: arrays over all dofs and all columns that are held at once: columns, shapes, displacement of the mesh
TALL_PRODUCTS = 10.0  #: of two such arrays: Gram matrices, shapes, moments
CUBES = 100.0  #: operations in eigenproblems and products of matrices over the columns, by the cube of their number


@dataclass(frozen=True)
class ReductionCost:
    """Estimates, without the geometric stiffness."""

    n_columns: int
    memory: float  #: [bytes]
    file: float  #: [bytes]
    seconds: float  #: of one processor, without factorisation and solves

    @property
    def words(self) -> str:
        """In one line."""
        return (
            f"{self.n_columns} columns, about {self.memory / 1e9:.2g} GB of memory, a file of {self.file / 1e9:.2g} GB "
            f"and {duration(self.seconds)} of processor time"
        )


def reduction_cost(body: FEBody, n_columns: int, *, stress: bool = True, n_constraint_modes: int = 0) -> ReductionCost:
    """Estimate what a mode set of so many columns costs from the columns to the file.

    Parameters
    ----------
    body
        A coupled body.
    n_columns
        Of the mode set.
    stress
        Whether the file holds the stress of the modes.
    n_constraint_modes
        From which a few columns are combined: they are held twice, and one Gram matrix of them is formed.
    """
    n, k = body.n_dof, n_columns
    n_kept = len(np.unique(np.concatenate([body.surface.ravel(), *(each.nodes for each in body.interfaces)])))
    moments = 2 * (3 * k + 4) ** 2
    operations = TALL_PRODUCTS * 2 * n * k**2 + CUBES * k**3 + 2 * n * n_constraint_modes**2
    file = 8.0 * (SQUARES * k**2 + (9 if stress else 3) * n_kept * k)
    memory = max(8.0 * (TALL * n * k + moments) + file, 8.0 * 2 * n * n_constraint_modes)
    return ReductionCost(k, memory, file, operations / operations_per_second())


def few_columns(body: FEBody, interface_modes: int) -> int:
    """Return the number of constraint modes left when interfaces of kind "nodes" keep so many modes each."""
    return sum(
        min(n_b, 6 + interface_modes) if interface.kind == "nodes" else n_b
        for interface in body.interfaces
        if (n_b := n_boundary(interface))
    )


def large_interfaces(body: FEBody) -> list[str]:
    """Say what interfaces with very many boundary dofs cost, and what is cheaper, one text for each."""
    large = [interface for interface in body.interfaces if n_boundary(interface) >= MANY]
    if not large:
        return []
    whole = reduction_cost(body, len(body.b)).words
    fewer = reduction_cost(body, few_columns(body, PROPOSED), n_constraint_modes=len(body.b)).words
    return [
        f"body {body.name!r}: interface {interface.name!r} of {len(interface.nodes)} nodes has "
        f"{n_boundary(interface)} boundary dofs: as many static solves and modes of the body. With all of them: "
        f"{whole}. Consider interface reduction: interface_modes = {PROPOSED} in [reduction] "
        f"(with_characteristic_modes) keeps its rigid motions and its softest modes: {fewer}; kind rigid or "
        "distributing has 6"
        for interface in large
    ]


def n_boundary(interface: Interface) -> int:
    """Return the number of boundary dofs of an interface."""
    return 0 if interface.dofs is None else len(interface.dofs)


def operations_per_second() -> float:
    """Return how many floating-point operations a second a dense product makes here; takes some milliseconds."""
    A = np.ones((384, 384))
    fastest = np.inf
    for _ in range(3):
        start = time.process_time()
        A @ A
        fastest = min(fastest, max(time.process_time() - start, 1e-4))
    return 2.0 * len(A) ** 3 / fastest


def duration(seconds: float) -> str:
    """Return a time in words."""
    if seconds < 90:
        return f"{seconds:.2g} s"
    return f"{seconds / 60:.2g} minutes" if seconds < 5400 else f"{seconds / 3600:.2g} hours"
