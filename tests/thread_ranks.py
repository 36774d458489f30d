"""Ranks among the threads of one process, where MPI is not installed."""

import threading
from queue import Queue

import numpy as np

from fe_models.foundation.ranks.ranks import OneRank

PATIENCE = 300  #: seconds until a rank that waits for another one hangs


class FakeComm:
    """What ranks ask of mpi4py, among threads of one process."""

    def __init__(self, rank, queues):
        self.rank, self.queues = rank, queues

    def Send(self, x, dest):
        self.queues[self.rank, dest].put(np.array(x))

    def Recv(self, x, source):
        x[:] = self.queues[source, self.rank].get(timeout=PATIENCE)

    def bcast(self, value, root):
        n = int(len(self.queues) ** 0.5)
        if self.rank == root:
            for other in range(n):
                if other != root:
                    self.queues[root, other].put(value)
            return value
        return self.queues[root, self.rank].get(timeout=PATIENCE)

    def alltoall(self, values):
        for other, value in enumerate(values):
            self.queues[self.rank, other].put(value)
        return [self.queues[other, self.rank].get(timeout=PATIENCE) for other in range(len(values))]


class FakeRanks(OneRank):
    """One of several ranks, each a thread."""

    def __init__(self, rank, size, queues):
        super().__init__()
        self.rank, self.size, self.comm = rank, size, FakeComm(rank, queues)


def on_threads(size, work):
    """Return what work(ranks) gives on each of so many ranks; raise the first error of them."""
    queues = {(a, b): Queue() for a in range(size) for b in range(size)}
    answers = [None] * size

    errors = []

    def run(rank):
        try:
            answers[rank] = work(FakeRanks(rank, size, queues))
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=run, args=(rank,)) for rank in range(size)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=PATIENCE)
    if errors:
        raise errors[0]
    return answers


class ThreadRanks(OneRank):
    """Rank 0 of several, which asks all of them."""

    def __init__(self, size):
        super().__init__()
        self.size = size
        self.stores = [self.store, *({} for _ in range(size - 1))]

    def everywhere(self, function, *arguments):
        def work(ranks):
            ranks.store = self.stores[ranks.rank]
            return function(ranks, *arguments)

        return on_threads(self.size, work)
