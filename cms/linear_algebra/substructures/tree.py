"""Tree of eliminated substructures: solutions with the whole tree, and motions spanned by its modes."""

from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from cms.linear_algebra.substructures.by_columns import by_columns
from cms.linear_algebra.substructures.dissection import Dissection
from cms.linear_algebra.substructures.elimination import Part, Reduced, Remainder, Substructure, eliminate_part
from cms.linear_algebra.substructures.reduced_mass import ReducedMass
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.tasks.task_map import Progress, TaskMap
from fe_models.foundation.threads import bounded_threads, n_threads

__all__ = ["SubstructureTree", "substructure_tree"]

BLOCK = 256  #: number of columns that are brought into elimination order at a time
PARTS = 16  #: a task has at most 1 / (PARTS n_processors) of the body


class SubstructureTree:
    """A body as a tree of substructures, each with its factor, constraint modes and own modes.

    It is also a `Factor` of K: `solve` takes and returns rows in the order of the body.
    """

    def __init__(self, dissection: Dissection, substructures: list[Substructure], n_multipliers: int) -> None:
        self.dissection, self.substructures = dissection, substructures
        counts = [len(each.omega2) for each in substructures]
        #: start of the modes of each substructure, (n_substructures + 1,)
        self.mode_starts = np.concatenate([[0], np.cumsum(counts)])
        self.n = len(dissection.order)
        self.n_negative, self.n_perturbed, self.n_positive = n_multipliers, 0, self.n - n_multipliers
        self.n_factor_entries = sum(each.n_numbers for each in substructures)
        self.is_open = True
        self.description = f"tree of {len(substructures)} substructures (dense Cholesky; {n_threads()} threads)"

    @property
    def division(self) -> str:
        """Description of how the body is divided."""
        levels = np.zeros(self.dissection.n, dtype=int)
        for t in range(self.dissection.n - 2, -1, -1):
            levels[t] = levels[self.dissection.parents[t]] + 1
        sizes = np.diff(self.dissection.starts)
        return (
            f"{len(sizes)} in {levels.max(initial=0) + 1} levels, the largest of {sizes.max()} dofs, "
            f"{self.mode_starts[-1]} modes"
        )

    def close(self) -> None:
        """Free all substructures."""
        self.is_open = False
        self.substructures = []

    @property
    def omega2(self) -> Array:
        """omega² of the modes of all substructures in order, (n_modes,) [1/s²]: the diagonal reduced stiffness."""
        return np.concatenate([each.omega2 for each in self.substructures])

    def mass(self) -> ReducedMass:
        """Return the reduced mass."""
        firsts = self.mode_starts[self.dissection.first_of_subtrees()]
        return ReducedMass(self.mode_starts, firsts, [each.coupling for each in self.substructures])

    def expand(self, Z: Array) -> Array:
        """Return the motion of all dofs in elimination order, (n, k), for modal amplitudes, (n_modes, k).

        It is computed from the root down: u_s = Phi z_s + Psi u_b.
        """
        X = np.empty((self.n, Z.shape[1]))

        def part(columns: slice) -> None:
            u = X[:, columns]
            z = np.ascontiguousarray(Z[:, columns])
            for t in range(len(self.substructures) - 1, -1, -1):
                each = self.substructures[t]
                own = u[each.start : each.stop]
                own[:] = each.Phi @ z[self.mode_starts[t] : self.mode_starts[t + 1]]
                if len(each.boundary):
                    own += each.Psi @ u[each.boundary]

        by_columns(Z.shape[1], part)
        return X

    def solve(self, b: Array) -> Array:
        """Return K⁻¹ b, (n, k), rows in the order of the body."""
        x = np.empty(b.shape, order="F")
        for first in range(0, b.shape[1], BLOCK):
            columns = slice(first, first + BLOCK)
            u = np.ascontiguousarray(b[self.dissection.order, columns])
            self.solve_ordered(u)
            x[self.dissection.order, columns] = u
        return x

    def solve_ordered(self, b: Array) -> None:
        """Overwrite b, (n, k) in C order, rows in elimination order, with K⁻¹ b.

        (1) forward, from the leaves to the root: f_b <- f_b + Psiᵀ f_s;  u_s = K_ss⁻¹ f_s
        (2) back, from the root to the leaves: u_s <- u_s + Psi u_b
        """

        def part(columns: slice) -> None:
            u = np.ascontiguousarray(b[:, columns])
            left: dict[int, Array] = {}
            for t, each in enumerate(self.substructures):  # (1)
                own = u[each.start : each.stop]
                out = np.zeros((len(each.boundary), u.shape[1]))
                for child in each.children:
                    below = self.substructures[child].boundary
                    f = left.pop(child)
                    p = int(np.searchsorted(below, each.stop))
                    own[below[:p] - each.start] += f[:p]
                    out[np.searchsorted(each.boundary, below[p:])] += f[p:]
                if len(out):
                    out += each.Psi.T @ own
                left[t] = out
                each.solve_own(own)
            for each in reversed(self.substructures):  # (2)
                if len(each.boundary):
                    u[each.start : each.stop] += each.Psi @ u[each.boundary]
            if u is not b:
                b[:, columns] = u

        by_columns(b.shape[1], part)

    def spread_ordered(self, Xi: Array) -> None:
        """Overwrite Xi, (n, k) in C order, rows in elimination order, with W Xi, where W Wᵀ = K⁻¹.

        From the root down: u_s = L_s⁻ᵀ xi_s + Psi u_b. With multipliers, W Wᵀ f = K⁻¹ f holds for the motions, if f has
        no entries on multipliers.
        """

        def part(columns: slice) -> None:
            u = np.ascontiguousarray(Xi[:, columns])
            for each in reversed(self.substructures):
                own = u[each.start : each.stop]
                each.spread_own(own)
                if len(each.boundary):
                    own += each.Psi @ u[each.boundary]
            Xi[:, columns] = u

        by_columns(Xi.shape[1], part)


def substructure_tree(
    dissection: Dissection,
    K: sp.csc_array,
    M: sp.csc_array,
    omega2: float,
    *,
    multipliers: IntArray,
    tasks: TaskMap | None = None,
    progress: Progress | None = None,
) -> SubstructureTree:
    """Eliminate all substructures: subtrees as parallel tasks, and each separator above as soon as possible.

    Parameters
    ----------
    dissection
        Tree of the dofs.
    K, M
        Symmetric, in elimination order (`in_order`), (n, n).
    omega2
        Modes of substructures are kept up to this omega² [1/s²].
    multipliers
        Multipliers, as dofs in elimination order; the root owns them and the dofs that they tie.
    tasks
        Workers that eliminate subtrees; None: threads of this process.
    progress
        Callback that receives the number of finished tasks and of all tasks.

    Raises
    ------
    FactorizationError
        If K is not positive definite, apart from multipliers.
    """
    lower_K, lower_M = (sp.csc_array(sp.tril(A, format="csc")) for A in (K, M))
    body = _Body(dissection, lower_K, lower_M, omega2, multipliers)
    runs, is_top = body.runs()
    found: dict[int, Substructure] = {}
    left: dict[int, Remainder] = {}
    work: dict[Future[Reduced], range] = {}

    def keep(run: range, reduced: Reduced) -> None:
        for t, x in zip(run, reduced.substructures, strict=True):
            found[t] = replace(x, children=tuple(body.children[t]))
        left[run[-1]] = reduced.remainder

    def begin(t: int) -> None:
        if is_top[t] and all(c in left for c in body.children[t]):
            below = tuple(left.pop(c) for c in body.children[t])
            run = range(t, t + 1)
            work[pool.submit(eliminate_part, body.part(run, below))] = run

    if tasks is not None:
        parts = [body.part(run) for run in runs]
        for run, each in zip(runs, tasks.map(eliminate_part, parts, progress=progress), strict=True):
            keep(run, each)
        del parts
    # one BLAS thread per task: on fronts of this size, OpenBLAS threads would mostly wait for each other
    with bounded_threads(1), ThreadPoolExecutor(body.n_threads) as pool:
        if tasks is None:
            work.update({pool.submit(eliminate_part, body.part(run)): run for run in runs})
        for t in np.flatnonzero(is_top).tolist():
            begin(t)
        while work:
            done, _ = wait(work, return_when=FIRST_COMPLETED)
            for future in done:
                run = work.pop(future)
                try:
                    keep(run, future.result())
                except BaseException:
                    pool.shutdown(cancel_futures=True)
                    raise
                if run[-1] < dissection.n - 1:
                    begin(int(dissection.parents[run[-1]]))
    return SubstructureTree(dissection, [found[t] for t in range(dissection.n)], len(multipliers))


class _Body:
    """Matrices in elimination order, from which parts are cut."""

    def __init__(
        self, dissection: Dissection, K: sp.csc_array, M: sp.csc_array, omega2: float, multipliers: IntArray
    ) -> None:
        self.dissection, self.K, self.M, self.omega2, self.multipliers = dissection, K, M, omega2, multipliers
        self.children: list[list[int]] = [[] for _ in range(dissection.n)]
        for t, parent in enumerate(dissection.parents[:-1].tolist()):
            self.children[parent].append(t)
        self.n_threads = n_threads()

    def runs(self) -> tuple[list[range], Array]:
        """Return the subtrees that become tasks, and the substructures above all of them."""
        starts, parents = self.dissection.starts, self.dissection.parents
        first = self.dissection.first_of_subtrees()
        limit = starts[-1] // (PARTS * self.n_threads)
        is_top = (starts[1:] - starts[first] > limit) & np.array([bool(c) for c in self.children])
        is_top[-1] = True
        return [range(first[t], t + 1) for t in np.flatnonzero(~is_top & is_top[parents]).tolist()], is_top

    def part(self, run: range, below: tuple[Remainder, ...] = ()) -> Part:
        """Return a part: consecutive substructures with their columns, or one with contributions of its children."""
        starts = self.dissection.starts[run.start : run.stop + 1]
        numbers = tuple(tuple(c - run.start for c in self.children[t]) for t in run)
        if len(run) == 1:
            numbers = (tuple(range(-len(below), 0)),)
        K, M = (_columns(A, int(starts[0]), int(starts[-1])) for A in (self.K, self.M))
        return Part(starts, numbers, K, M, self.omega2, self.multipliers, below)


def _columns(A: sp.csc_array, first: int, last: int) -> sp.csc_array:
    entries = slice(A.indptr[first], A.indptr[last])
    indptr = A.indptr[first : last + 1] - A.indptr[first]
    return sp.csc_array((A.data[entries], A.indices[entries], indptr), shape=(A.shape[0], last - first))
