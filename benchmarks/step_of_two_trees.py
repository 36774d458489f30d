"""Time per step of the motion in two source trees, and the processor time that their kernels take to compile.

    python benchmarks/step_of_two_trees.py OLD NEW [pairs] [steps]

OLD and NEW are folders with a checkout each. The cases are those of floatframe_step.py without geometric stiffness, run
in a process for each tree, the trees in turn; `pairs` (by default 20) pairs of the better of two
runs of `steps` (1000) steps. Printed per case:
the least processor time per step of each tree, their ratio, and the middle of the ratios of all pairs, which tells how
far the machine can be trusted. Compilation is measured last, once per tree, in an empty cache.
"""

import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

WORKER = """
import sys
sys.path[:0] = [sys.argv[1], sys.argv[1] + "/benchmarks"]
from floatframe_step import chain, measure
systems = {}
for line in sys.stdin:
    n_bodies, n_q, n_steps = map(int, line.split())
    if (n_bodies, n_q) not in systems:
        systems[n_bodies, n_q] = chain(n_bodies, n_q)
    best, _ = measure([systems[n_bodies, n_q]], n_steps, 2)
    print(best[0], flush=True)
"""
COMPILE = """
import sys, time
sys.path.insert(0, sys.argv[1])
from floatframe.engine.kernels.entry import prepare
start = time.process_time()
assert prepare()
print(time.process_time() - start)
"""


def environment(tree, **more):
    return {**os.environ, "PYTHONPATH": str(tree), **more}


class Worker:
    """A process that runs cases of one tree."""

    def __init__(self, tree):
        command = [sys.executable, "-c", WORKER, str(tree)]
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment(tree), cwd=tree
        )

    def time_per_step(self, n_bodies, n_q, n_steps):
        """Return the least processor time per step [s]."""
        self.process.stdin.write(f"{n_bodies} {n_q} {n_steps}\n")
        self.process.stdin.flush()
        return float(self.process.stdout.readline())


def compile_time(tree):
    with tempfile.TemporaryDirectory() as cache:
        run = [sys.executable, "-c", COMPILE, str(tree)]
        done = subprocess.run(
            run, capture_output=True, text=True, check=True, env=environment(tree, NUMBA_CACHE_DIR=cache), cwd=tree
        )
    return float(done.stdout)


def main():
    trees = [Path(name).resolve() for name in sys.argv[1:3]]
    n_pairs = int(sys.argv[3]) if len(sys.argv) > 3 else 20
    n_steps = int(sys.argv[4]) if len(sys.argv) > 4 else 1000
    workers = [Worker(tree) for tree in trees]
    print("bodies  modes  old us/step  new us/step  new by old  middle of the pairs")
    for n_bodies in (1, 10):
        for n_q in (8, 20, 50):
            for worker in workers:
                worker.time_per_step(n_bodies, n_q, 20)
            pairs = [[worker.time_per_step(n_bodies, n_q, n_steps) for worker in workers] for _ in range(n_pairs)]
            old, new = (min(times) * 1e6 for times in zip(*pairs, strict=True))
            middle = statistics.median(second / first for first, second in pairs)
            print(f"{n_bodies:6d} {n_q:6d} {old:12.1f} {new:12.1f} {new / old:11.3f} {middle:20.3f}", flush=True)
    for worker in workers:
        worker.process.stdin.close()
        worker.process.wait()
    old, new = (compile_time(tree) for tree in trees)
    print(f"compilation: old {old:.1f} s, new {new:.1f} s of processor time, {new / old:.3f}")


if __name__ == "__main__":
    main()
