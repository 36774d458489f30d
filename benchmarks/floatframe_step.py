"""Time per step of the motion: one flexible body on a hinge, and a chain of ten, with 8, 20 and 50 modes.

    python benchmarks/floatframe_step.py [steps]

Bodies are made of random point masses with 4 to 4000 rad/s, h = 1e-3, gravity; the chain hangs on hinges about
alternating axes. Printed per case: time per step (the best of five runs of the compiled loop, results of every 100th
step kept), Newton iterations and factorisations per step. The first line is the time of the first call (compilation,
or loading it from the cache). The last lines are the same bodies with geometric stiffness of random displacements of
second order, small ones, so that the motion is nearly the same.
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from floatframe import GROUND, FlexibleBody, GeneralizedAlpha, Gravity, Marker, RevoluteJoint, System
from floatframe.kernels.model import new_work
from tests.floatframe.bodies import random_point_masses, stiffened_body

H = 1e-3
AXES = ((0, 1, 0), (0, 0.8, 0.6))


def m_orthonormal_body(n_q, seed):
    points = random_point_masses(n_q, seed, n_points=200, softness=1.0)
    M = points.moments().M
    points = type(points)(points.m, points.c, points.phi @ np.linalg.inv(np.linalg.cholesky(M)).T)
    omega = np.geomspace(4.0, 4000.0, n_q)
    body = stiffened_body(points, np.diag(omega**2), D=np.diag(0.01 * omega), rotation_scale=0.1, size=1e-4)
    assert np.allclose(body.M, np.eye(n_q))
    return body


def chain(n_bodies, n_q, stiffening=False):
    part = m_orthonormal_body(n_q, 3)
    first, second = part.interface("end_b").position, part.interface("end_a").position
    bodies, joints = [], []
    previous = GROUND
    for k in range(n_bodies):
        place = k * (second - first) - first
        bodies.append(FlexibleBody(f"b{k}", part, position=place, stiffening=stiffening))
        joints.append(RevoluteJoint(f"j{k}", previous, Marker(f"b{k}", "end_b"), axis=AXES[k % 2]))
        previous = Marker(f"b{k}", "end_a")
    return System(bodies, joints, [Gravity((0, 0, -9.81))])


def measure(system, n_steps):
    method = GeneralizedAlpha(0.8)
    carry = method.start(system, 0.0)
    work = new_work(system.compiled.model)
    best, counts = np.inf, None
    for _ in range(int(sys.argv[2]) if len(sys.argv) > 2 else 5):
        before = work.counts.copy()
        start = time.perf_counter()
        carry, _, done, failure = method.advance(system, carry, work, t0=0.0, h=H, first=0, n_steps=n_steps, every=100)
        best = min(best, (time.perf_counter() - start) / n_steps)
        assert failure is None, failure
        counts = (work.counts - before) / done
    return best, counts


def main():
    n_steps = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    start = time.perf_counter()
    measure(chain(1, 2), 10)
    print(f"first call {time.perf_counter() - start:.1f} s")
    print("bodies  modes  us/step  us/step/body  iterations  factorisations  stiffened")
    for stiffening in (False, True):
        for n_bodies in (1, 10):
            for n_q in (8, 20, 50):
                seconds, counts = measure(chain(n_bodies, n_q, stiffening), n_steps)
                per_step = seconds * 1e6
                counted = f"{counts[2]:11.2f} {counts[1]:15.3f} {'yes' if stiffening else 'no':>10}"
                row = f"{n_bodies:6d} {n_q:6d} {per_step:8.1f} {per_step / n_bodies:13.1f} {counted}"
                print(row)


if __name__ == "__main__":
    main()
