"""Blocks of fronts as tasks (subtrees at the bottom, single fronts at the top), and threads that process them."""

import heapq
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cms.linear_algebra.sparse_cholesky.analysis import Fronts, inverse
from fe_models.foundation.arrays import IntArray

if TYPE_CHECKING:
    from cms.linear_algebra.sparse_cholesky.front_kernels import Tree
    from fe_models.foundation.arrays import Array

__all__ = ["Blocks", "blocks_of", "for_each"]

PARTS = 32  #: a subtree with more than 1 / PARTS of the total work is divided
ENTRY = 100.0  #: time per factor entry for work other than arithmetic, in operations


@dataclass(frozen=True, eq=False)
class Blocks:
    """Blocks of consecutive fronts: a subtree, several neighbouring subtrees, or one front above other blocks."""

    fronts: Fronts
    first: IntArray  #: first front of each block, (n_blocks + 1,)
    above: IntArray  #: block that contains the parent of the roots of each block, (n_blocks,); -1: none

    def __len__(self) -> int:
        return len(self.above)

    @cached_property
    def below(self) -> list[list[int]]:
        """Child blocks of each block, in order."""
        below: list[list[int]] = [[] for _ in self.above]
        for k, above in enumerate(self.above):
            if above >= 0:
                below[above].append(k)
        return below

    @cached_property
    def tree(self) -> "Tree":
        """Fronts in the form that the kernels use."""
        from cms.linear_algebra.sparse_cholesky.front_kernels import Tree

        fronts = self.fronts
        return Tree(fronts.first, fronts.begin, fronts.rows, fronts.above, fronts.place, fronts.stored)

    @property
    def stored(self) -> IntArray:
        """Start of each block among the stored numbers of the factor, and their end."""
        return self.fronts.stored[self.first]

    def room(self, k: int, size: IntArray) -> tuple[int, int, int]:
        """Return array sizes for a block: its largest front, its stack, and the update matrices that remain.

        size: size of the update matrix of each front, (n_fronts,).
        """
        from cms.linear_algebra.sparse_cholesky.front_kernels import room

        return room(self.tree, self.first[k], self.first[k + 1], size)

    @cached_property
    def work(self) -> "Array":
        """Factorisation time of each block, (n_blocks,), in operations."""
        return np.add.reduceat(front_work(self.fronts), self.first[:-1])

    @cached_property
    def by_distance(self) -> IntArray:
        """Priority of each block, (n_blocks,): blocks with the most work on the path to the root come first."""
        path = self.work.copy()
        for k in reversed(range(len(self))):
            if self.above[k] >= 0:
                path[k] += path[self.above[k]]
        return inverse(np.argsort(-path, kind="stable"))

    @cached_property
    def by_height(self) -> IntArray:
        """Priority of each block in the back substitution, (n_blocks,): the longest path below comes first."""
        height = self.work.copy()
        for k, above in enumerate(self.above):
            if above >= 0:
                height[above] = max(height[above], self.work[above] + height[k])
        return inverse(np.argsort(-height, kind="stable"))

    @cached_property
    def by_depth(self) -> IntArray:
        """Priority of each block, (n_blocks,), that minimises waiting update matrices: one subtree after the other."""
        return np.arange(len(self))

    def turns(self, *, on_disk: bool) -> IntArray:
        """Return the priorities for the factorisation, for the shortest time or for the smallest memory."""
        return self.by_depth if on_disk else self.by_distance

    def n_working(self, n_threads: int, *, on_disk: bool = False) -> int:
        """Return the peak number of values besides the factor: active fronts and waiting update matrices.

        Blocks run in the order of `for_each`, each for a time proportional to its operations. On disk, the panels of
        active blocks are included.
        """
        turns = self.turns(on_disk=on_disk) if n_threads > 1 else self.by_depth
        size = self.fronts.below.astype(np.int64) ** 2
        rooms = [self.room(k, size) for k in range(len(self))]
        panels = np.diff(self.stored) if on_disk else np.zeros(len(self), np.int64)
        waits = [len(below) for below in self.below]
        ready = [(int(turns[k]), k) for k in range(len(self)) if not waits[k]]
        heapq.heapify(ready)
        busy: list[tuple[float, int]] = []
        now, held, most = 0.0, 0, 0
        while ready or busy:
            while ready and len(busy) < n_threads:
                _, k = heapq.heappop(ready)
                held += rooms[k][0] + rooms[k][1] + int(panels[k])
                most = max(most, held)
                heapq.heappush(busy, (now + self.work[k], k))
            now, k = heapq.heappop(busy)
            held -= rooms[k][0] + rooms[k][1] + int(panels[k]) - rooms[k][2] + sum(rooms[c][2] for c in self.below[k])
            if self.above[k] >= 0:
                waits[self.above[k]] -= 1
                if not waits[self.above[k]]:
                    heapq.heappush(ready, (int(turns[self.above[k]]), int(self.above[k])))
        return most


def front_work(fronts: Fronts) -> "Array":
    """Return the time of each front, (n_fronts,), in operations; it includes reading and writing of entries."""
    return fronts.front_operations + ENTRY * fronts.width * (fronts.width + fronts.below)


def blocks_of(fronts: Fronts) -> Blocks:
    """Cut the tree of fronts into blocks, independently of the number of threads."""
    n_fronts, above = len(fronts.above), fronts.above
    work = front_work(fronts)
    start = np.arange(n_fronts)  # index of the first front of each subtree
    for f in range(n_fronts):
        if above[f] >= 0:
            work[above[f]] += work[f]
            start[above[f]] = min(start[above[f]], start[f])
    limit = work[above < 0].sum() / PARTS
    first: list[int] = []
    parents: list[int] = []  # parents of the blocks, from the last block to the first
    f, run = n_fronts - 1, 0.0
    while f >= 0:
        is_large = work[f] > limit
        joins = bool(first) and not is_large and run > 0 and parents[-1] == above[f] and run + work[f] <= limit
        if joins:
            first[-1] = start[f]
            run += work[f]
        else:
            first.append(f if is_large else start[f])
            parents.append(above[f])
            run = 0.0 if is_large else work[f]
        f = f - 1 if is_large else start[f] - 1
    bounds = np.array([*reversed(first), n_fronts])
    parent = np.array(parents[::-1], dtype=np.int64)
    return Blocks(fronts, bounds, np.where(parent >= 0, np.searchsorted(bounds, parent, side="right") - 1, -1))


def for_each(
    blocks: Blocks, task: Callable[[int], None], n_threads: int, turns: IntArray, *, downwards: bool = False
) -> None:
    """Execute a task for every block, after its children (downwards: after its parent), in threads.

    Among the blocks that are ready, the one with the highest priority starts. A single thread goes subtree by subtree.
    """
    n = len(blocks)
    if n_threads == 1 or n == 1:
        for k in reversed(range(n)) if downwards else range(n):
            task(k)
        return
    waits = [int(above >= 0) for above in blocks.above] if downwards else [len(below) for below in blocks.below]
    ready = [(int(turns[k]), k) for k in range(n) if not waits[k]]
    heapq.heapify(ready)
    change = threading.Condition()
    failures: list[BaseException] = []
    begun: list[int] = []

    def after(k: int) -> list[int]:
        return blocks.below[k] if downwards else [int(blocks.above[k])] if blocks.above[k] >= 0 else []

    def worker() -> None:
        while True:
            with change:
                change.wait_for(lambda: ready or failures or len(begun) == n)
                if failures or len(begun) == n:
                    return
                _, k = heapq.heappop(ready)
                begun.append(k)
            try:
                task(k)
            except BaseException as error:  # is raised again in the calling thread
                with change:
                    failures.append(error)
                    change.notify_all()
                return
            with change:
                for other in after(k):
                    waits[other] -= 1
                    if not waits[other]:
                        heapq.heappush(ready, (int(turns[other]), other))
                change.notify_all()

    threads = [threading.Thread(target=worker) for _ in range(min(n_threads, n) - 1)]
    started: list[threading.Thread] = []
    try:
        for thread in threads:
            thread.start()
            started.append(thread)
        worker()
        for thread in started:
            thread.join()
    except BaseException as error:  # an interrupt while this thread waits: the other threads end after their tasks
        with change:
            failures.append(error)
            change.notify_all()
        for thread in started:
            thread.join()
    if failures:
        first = failures[0]
        failures.clear()  # tracebacks reference the arrays of the tasks
        try:
            raise first
        finally:
            del first
