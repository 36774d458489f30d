"""Estimated cost of a reduction, reported before the work: interfaces with very many dofs, and geometric stiffness.

The geometric stiffness has a matrix over all modes for each unit load: 12 loads of the frame, 6 distributed over the
nodes, and 6 for each interface (for kind "nodes", of the mean motion of its nodes). Forty interfaces and two thousand
modes need 9 GB, which is too much for a default. It becomes small with fewer modes (interface reduction), or with the
loads of chosen interfaces only; loads at the other interfaces then do not stiffen the body.
"""

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cms.errors import BodyError
from fe_models.body.fe_body import FEBody

__all__ = [
    "UNASKED", "Asked", "ReductionCost", "chosen_words", "interface_reduction_size", "large_interfaces",
    "left_out_words", "reduction_cost", "require_room_for_stiffness", "stiffness_bytes", "stiffness_words",
]  # fmt: skip

MANY = 600  #: number of boundary dofs of one interface above which its cost is reported
PROPOSED = 20  #: number of interface modes that the report proposes
SQUARES = 26  #: number of matrices over the modes in a modal file: moments, invariants, M, K, D, columns
TALL = 3  #: number of arrays over all dofs and columns in memory together: columns, shapes, mesh displacement
TALL_PRODUCTS = 10.0  #: number of products of two such arrays: Gram matrices, shapes, moments
CUBES = 100.0  #: operations of eigenproblems and matrix products, divided by the cube of the number of columns
UNASKED = 2e9  #: largest size of a geometric stiffness that is computed by default [bytes]
HELD = 4.0  #: peak memory while the geometric stiffness is computed, divided by its size
SPARSE = 10.0  #: time of an operation in a sparse product divided by its time in a dense product
NAMED = 5  #: largest number of interfaces that a note lists

#: whether to compute the geometric stiffness, or the interfaces whose loads it includes
Asked = bool | Sequence[str] | None


@dataclass(frozen=True)
class ReductionCost:
    """Estimated cost of a reduction without its geometric stiffness."""

    n_columns: int
    memory: float  #: peak memory [bytes]
    file: float  #: size of the modal file [bytes]
    seconds: float  #: time on one processor, without factorisation and solves [s]

    @property
    def description(self) -> str:
        """Description of the cost in one line."""
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
        Whether the file contains the stress of the modes.
    n_constraint_modes
        Number of constraint modes that are combined to fewer columns. Two copies of them are in memory, and they have
        one Gram matrix.
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
        f"{len(np.asarray(interface.dofs))} boundary dofs, each with a static solution and a mode of the body. With "
        f"all of them: {whole}. Consider interface reduction: interface_modes = {PROPOSED} in [reduction] "
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


# geometric stiffness --------------------------------------------------------------------------------------------------


def n_loads(body: FEBody, asked: Asked = None) -> int:
    """Return the number of unit loads in the geometric stiffness."""
    return 18 + 6 * (len(body.interfaces) if asked is None or isinstance(asked, bool) else len(set(asked)))


def stiffness_bytes(body: FEBody, n_modes: int, asked: Asked = None) -> float:
    """Return the size of the geometric stiffness of a body with this number of modes [bytes]."""
    return 8.0 * n_loads(body, asked) * n_modes**2


def stiffness_seconds(body: FEBody, n_modes: int, asked: Asked = None) -> float:
    """Estimate the processor time of the geometric stiffness [s]: Phiᵀ (S Phi) with a sparse S for each load."""
    each = float(body.n_dof) * n_modes**2 + SPARSE * (2 * body.K.nnz / 9) * 3 * n_modes
    return n_loads(body, asked) * each / operations_per_second()


def left_out_words(body: FEBody, n_modes: int) -> str:
    """Return a note that the geometric stiffness was left out because it is large; "" if it is small."""
    size = stiffness_bytes(body, n_modes)
    if size <= UNASKED:
        return ""
    return (
        f"geometric stiffness left out: {n_loads(body)} unit loads over {n_modes} modes would be {size / 1e9:.2g} GB. "
        f"{remedies(body, n_modes)}; geometric_stiffness = true computes it anyway, false omits it "
        "without this note"
    )


def stiffness_words(body: FEBody, n_modes: int, asked: Asked) -> str:
    """Return a note about the cost of a requested geometric stiffness, before the work; "" if it is small."""
    size = stiffness_bytes(body, n_modes, asked)
    if size <= UNASKED:
        return ""
    time = duration(stiffness_seconds(body, n_modes, asked))
    return (
        f"geometric stiffness of {n_loads(body, asked)} unit loads over about {n_modes} modes: {size / 1e9:.2g} GB in "
        f"the file, {HELD * size / 1e9:.2g} GB while it is made, about {time} of processor time. "
        f"{remedies(body, n_modes)}"
    )


def chosen_words(body: FEBody, asked: Asked) -> str:
    """Return a note that names the interfaces whose loads do not stiffen the body; "" if all do."""
    if asked is None or isinstance(asked, bool):
        return ""
    others = [interface.name for interface in body.interfaces if interface.name not in asked]
    if not others:
        return ""
    more = f" and {len(others) - NAMED} more" if len(others) > NAMED else ""
    return (
        f"loads at interfaces {', '.join(others[:NAMED])}{more} do not stiffen the body: geometric_stiffness names "
        f"{', '.join(asked) if asked else 'none'}"
    )


def remedies(body: FEBody, n_modes: int) -> str:
    """Describe how to make the geometric stiffness small, with the lines to add to the job."""
    few = interface_reduction_size(body, PROPOSED) + max(0, n_modes - len(body.b))
    reduced = ""
    if few < n_modes:
        reduced = (
            f"interface_modes = {PROPOSED} in [reduction] leaves about {few} modes and "
            f"{stiffness_bytes(body, few) / 1e9:.2g} GB; "
        )
    first = body.interfaces[0].name if body.interfaces else ""
    return (
        f"{reduced}geometric_stiffness = [{first!r}] has only the loads of the frame and of the named interfaces, "
        f"{stiffness_bytes(body, n_modes, [first]) / 1e9:.2g} GB and about "
        f"{duration(stiffness_seconds(body, n_modes, [first]))} for one".replace("'", '"')
    )


def require_room_for_stiffness(body: FEBody, n_modes: int, asked: Asked = None) -> None:
    """Raise `BodyError` if the geometric stiffness with this number of modes does not fit into the machine's memory."""
    size, memory = stiffness_bytes(body, n_modes, asked), machine_memory()
    if HELD * size > memory:
        raise BodyError(
            f"body {body.name!r}: geometric stiffness of {n_loads(body, asked)} unit loads over about "
            f"{n_modes} modes: {size / 1e9:.3g} GB, and {HELD * size / 1e9:.3g} GB while it is made; this machine has "
            f"{memory / 1e9:.3g} GB. {remedies(body, n_modes)}; geometric_stiffness = false leaves it out"
        )


def machine_memory() -> float:
    """Return the memory of this machine [bytes]; infinite if the system does not report it."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * float(os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return float("inf")
