"""Cost of a step as systems grow, and memory as runs grow."""

import subprocess
import sys

import numpy as np
import pytest

from benchmarks.floatframe_growth import FIRST_STEP, growth_with_bodies

RUN = """
import resource, sys
from floatframe import GeneralizedAlpha, integrate
from floatframe.components import mechanisms
integrate(mechanisms.chain(10), GeneralizedAlpha(0.8), float(sys.argv[1]), 1e-3, output=sys.argv[2])
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.long
def test_the_cost_of_a_step_and_body_does_not_grow_with_the_number_of_bodies():
    seconds = growth_with_bodies((10, 200))
    assert seconds[200] <= 1.3 * seconds[10]


@pytest.mark.long
def test_memory_does_not_grow_with_the_length_of_a_run(tmp_path):
    """Peak of processes with runs of 2 s and 40 s, whose results take 20 times as much on disk."""
    peaks, sizes = [], []
    for t_end in (2.0, 40.0):
        path = tmp_path / f"{t_end}.h5"
        done = subprocess.run(
            [sys.executable, "-c", RUN, str(t_end), str(path)], capture_output=True, text=True, check=True
        )
        peaks.append(float(done.stdout) * 1024)
        sizes.append(path.stat().st_size)
    assert sizes[1] > 10 * sizes[0]
    assert peaks[1] - peaks[0] < 0.1 * (sizes[1] - sizes[0])
    assert np.all(np.array(peaks) < 1e9)


@pytest.mark.long
def test_the_first_step_ends_within_two_seconds_of_processor_time_of_the_start():
    run = [sys.executable, "-c", FIRST_STEP]
    subprocess.run(run, check=True, capture_output=True)  # leaves the compiled code in the cache
    seconds = [float(subprocess.run(run, check=True, capture_output=True, text=True).stdout) for _ in range(3)]
    assert min(seconds) < 2.0
