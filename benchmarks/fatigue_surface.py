"""Damage of many nodes from a long modal history: `python benchmarks/fatigue_surface.py [nodes] [times] [modes]`.

Stress shapes of a surface with hot spots: random tensors whose sizes fall off like those about notches (log-normal, a
factor e of spread), 20 modes of falling size; a history of band-limited noise about each natural frequency, some 40
output times a cycle of the slowest. Printed: time, share of nodes counted, time a node and time step, peak memory over
that of shapes and history; with every node counted (`--all`) as well.

    default: 20000 nodes x 20000 times x 20 modes; the large one: 1000000 100000 20
"""

import argparse
import resource
import sys
import time
from pathlib import Path

import numpy as np
import scipy.signal

sys.path.insert(0, str(Path(__file__).parents[1]))
from floatframe.durability.fatigue.history_damage import count_histories
from floatframe.durability.fatigue.load_blocks import LoadBlock
from floatframe.durability.fatigue.mean_stress import MeanStress
from floatframe.durability.fatigue.sn_curve import basquin_curve


def history(n_times: int, n_modes: int, rng: np.random.Generator) -> np.ndarray:
    """Return modal coordinates whose sizes and frequencies are those of a driven part, (n_times, n_modes)."""
    q = np.empty((n_times, n_modes))
    for k in range(n_modes):
        f = 0.05 * (1 + 0.25 * k)  # of half the sampling rate
        b, a = scipy.signal.butter(2, [0.8 * f, min(1.2 * f, 0.95)], "band")
        noise = scipy.signal.lfilter(b, a, rng.standard_normal(n_times))
        q[:, k] = noise / noise.std() / (1 + k)
    return q


def shapes(n_nodes: int, n_modes: int, rng: np.random.Generator) -> np.ndarray:
    """Return stress shapes with hot spots, (n_nodes, 6, n_modes)."""
    sizes = 20 * np.exp(rng.standard_normal(n_nodes))
    stress = np.empty((n_nodes, 6, n_modes))
    for first in range(0, n_nodes, 10_000):
        part = slice(first, first + 10_000)
        block = rng.standard_normal((len(sizes[part]), 6, n_modes))
        stress[part] = sizes[part, None, None] * block
    return stress


def peak() -> float:
    """Return the peak memory of the process [GB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("nodes", type=int, nargs="?", default=20_000)
    parser.add_argument("times", type=int, nargs="?", default=20_000)
    parser.add_argument("modes", type=int, nargs="?", default=20)
    parser.add_argument("--all", action="store_true", help="count every node too")
    given = parser.parse_args()
    rng = np.random.default_rng(0)
    stress, q = shapes(given.nodes, given.modes, rng), history(given.times, given.modes, rng)
    curve = basquin_curve(200.0, 1e6, 6, below="haibach", least_cycles=1e-3)
    law = MeanStress("goodman", 1e5)
    count_histories(stress[:8], [LoadBlock("warm", q[:200])], curve, mean_stress=law)  # compiled code
    before = peak()
    print(f"{given.nodes} nodes x {given.times} times x {given.modes} modes; shapes {stress.nbytes / 1e9:.2f} GB")
    for negligible in (1e-3, 0.0) if given.all else (1e-3,):
        wall, used = time.perf_counter(), time.process_time()
        found = count_histories(stress, [LoadBlock("road", q)], curve, mean_stress=law, negligible=negligible)
        wall, used = time.perf_counter() - wall, time.process_time() - used
        counted = int(found.is_counted.sum())
        print(
            f"negligible {negligible:g}: {wall:.1f} s ({used:.1f} s of processors), {counted} nodes counted "
            f"({counted / given.nodes:.1%}), {used / max(counted, 1) / given.times * 1e9:.1f} ns a counted node and "
            f"time, {peak() - before:.2f} GB more, {found.cycles[found.is_counted].mean():.0f} cycles a node"
        )


if __name__ == "__main__":
    main()
