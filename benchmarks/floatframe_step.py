"""Time per step of the motion: one flexible body on a hinge, and a chain of ten, with 8, 20 and 50 modes.

    python benchmarks/floatframe_step.py [steps] [runs]

Bodies are made of random point masses with 4 to 4000 rad/s, h = 1e-3, gravity; the chain hangs on hinges about
alternating axes. Printed per case: processor time per step (the best of `runs`, by default five, of the compiled loop,
results of every 100th step kept), Newton iterations and factorisations per step, and the time with geometric stiffness
(of small random displacements of second order, so that the motion is nearly the same) by that without, the runs of both
in turn; and the time of new factors (linearisation and factorisation) by that of an iteration, see `price`. The first
line is the time of the first call (compilation, or loading it from the cache).
"""

import sys
import time
from pathlib import Path

import numpy as np

from floatframe.engine.compiling.system import compiled_system

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from floatframe import GROUND, FlexibleBody, GeneralizedAlpha, Gravity, Marker, RevoluteJoint, System
from floatframe.engine.kernels.work import new_work
from tests.floatframe.point_masses import random_point_masses, stiffened_body

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


def counts_of(memory, work):
    """Return iterations and factorisations so far."""
    return np.array([int(memory.n_iterations), int(work.counted.factorisations)])


def measure(systems, n_steps, n_runs):
    """Return the least time per step of each system, the systems taken in turn, and the counts of the first."""
    method = GeneralizedAlpha(0.8)
    memories = [method.start(system, 0.0) for system in systems]
    works = [new_work(compiled_system(system).model) for system in systems]
    best, counts = [np.inf] * len(systems), []
    for _ in range(n_runs):
        for k, (system, work) in enumerate(zip(systems, works, strict=True)):
            before = counts_of(memories[k], work)
            start = time.thread_time()
            memories[k], _, done, failure = method.advance(
                system, memories[k], work, t0=0.0, h=H, first=0, n_steps=n_steps, every=100
            )
            best[k] = min(best[k], (time.thread_time() - start) / n_steps)
            assert failure is None, failure
            if k == 0:
                counts = (counts_of(memories[k], work) - before) / done
    return best, counts


def price(system, n_steps, n_runs):
    """Return the time of new factors over that of an iteration, and how far the measured times are from the fit.

    The time of a step is fitted as a + b iterations + c factorisations to runs of several tolerances, in which factors
    are renewed at once, by their usual rule, or as seldom as convergence allows.
    """
    model, best = compiled_system(system).model, {}
    for _ in range(n_runs):
        for tolerance in (1e-6, 1e-8, 1e-11):
            for cost in (0.0, 1.0, 1e3):
                method = GeneralizedAlpha(0.8, tolerance=tolerance)
                memory, work = method.start(system, 0.0), new_work(model)
                memory, *_ = method.advance(system, memory, work, t0=0.0, h=H, first=0, n_steps=10, every=100)
                work.solver.price[...], work.solver.is_due[...] = cost, 1
                before, start = counts_of(memory, work), time.thread_time()
                memory, *_ = method.advance(system, memory, work, t0=0.0, h=H, first=10, n_steps=n_steps, every=10**6)
                seconds, counts = (time.thread_time() - start) / n_steps, (counts_of(memory, work) - before) / n_steps
                known = best.get((tolerance, cost))
                if known is None or seconds < known[0]:
                    best[tolerance, cost] = seconds, *counts
    rows = np.array(list(best.values()))
    seconds, A = rows[:, 0], np.column_stack([np.ones(len(rows)), rows[:, 1:]])
    fit = np.linalg.lstsq(A / seconds[:, None], np.ones(len(rows)))[0]
    return fit[2] / fit[1], np.abs(A @ fit / seconds - 1).max()


def figures(short):
    """Return what the watch keeps."""
    told = {}
    for n_bodies, n_q in ((1, 20), (10, 8)) if short else ((1, 8), (1, 20), (1, 50), (10, 8), (10, 20), (10, 50)):
        (plain, stiffened), counts = measure([chain(n_bodies, n_q, s) for s in (False, True)], 1000 // n_bodies, 5)
        case = f"bodies: {n_bodies}, modes: {n_q}"
        told[f"step with geometric stiffness over that without, {case}"] = stiffened / plain
        told[f"iterations of a step, {case}"] = counts[0]
        told[f"a step, {case} [µs]"] = 1e6 * plain
    return told


def main():
    n_steps = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    n_runs = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    start = time.perf_counter()
    measure([chain(1, 2)], 10, 1)
    print(f"first call {time.perf_counter() - start:.1f} s")
    print("bodies  modes  us/step  us/step/body  iterations  factorisations  stiffened by plain  factors by iteration")
    for n_bodies in (1, 10):
        for n_q in (8, 20, 50):
            systems = [chain(n_bodies, n_q, stiffening) for stiffening in (False, True)]
            (plain, stiffened), counts = measure(systems, n_steps, n_runs)
            per_step = plain * 1e6
            ratio, misfit = price(systems[0], 200, n_runs)
            counted = f"{counts[0]:11.2f} {counts[1]:15.3f} {stiffened / plain:19.2f} {ratio:13.1f} ({misfit:.1%})"
            print(f"{n_bodies:6d} {n_q:6d} {per_step:8.1f} {per_step / n_bodies:13.1f} {counted}", flush=True)


if __name__ == "__main__":
    main()
