"""Time of a default step and of a default run here, by the same in another checkout of the project.

    python -m benchmarks.step_against CHECKOUT [pairs]

CHECKOUT is a worktree of another commit; its own code and its own bodies are used, so it must have
`benchmarks.floatframe_step`. Each pair (by default 20) is a process of either checkout, in turn, which measures
all systems of `systems`: 5 times 1000 compiled steps of generalized-alpha with rho_inf = 0.8 and h = 1 ms (a tenth of
it for the chain), and a run of 20 000 steps with every 100th step in the results. Printed is the least processor time
of all pairs per step, and the ratio of both checkouts; runs without the watch and with it, where a checkout has one.
A first process of either compiles, and does not count.
"""

import inspect
import json
import logging
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Gravity,
    Marker,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    System,
    integrate,
)
from floatframe.joints import UniversalJoint

GRAVITY = Gravity((0.0, -9.81, 0.0))
INERTIA = np.diag([1e-3, 0.01, 0.01])


def arm():
    """Return a rigid arm on a hinge."""
    body = RigidBody("arm", 1.0, INERTIA, position=(0.5, 0.0, 0.0))
    pin = RevoluteJoint("pin", GROUND, Marker("arm", position=(-0.5, 0.0, 0.0)))
    return System([body], [pin], [GRAVITY])


def slider_crank():
    """Return a loop of rigid bodies: a crank of 0.5 m, a rod of 1.3 m and a slider, which fall from the dead centre."""
    bodies = [
        RigidBody("crank", 1.0, INERTIA, position=(0.25, 0.0, 0.0)),
        RigidBody("rod", 1.0, INERTIA, position=(1.15, 0.0, 0.0)),
        RigidBody("slider", 1.0, INERTIA, position=(1.8, 0.0, 0.0)),
    ]
    tip, foot = Marker("crank", position=(0.25, 0.0, 0.0)), Marker("rod", position=(-0.65, 0.0, 0.0))
    joints = [
        RevoluteJoint("shaft", GROUND, Marker("crank", position=(-0.25, 0.0, 0.0))),
        UniversalJoint("pin", tip, foot, axis=(0.0, 0.0, 1.0), axis_b=(0.0, 1.0, 0.0)),
        SphericalJoint("ball", Marker("rod", position=(0.65, 0.0, 0.0)), Marker("slider")),
        PrismaticJoint("guide", Marker(GROUND, position=(1.8, 0.0, 0.0)), Marker("slider"), axis=(1.0, 0.0, 0.0)),
    ]
    return System(bodies, joints, [GRAVITY])


def systems():
    """Yield the name of each system, a function that makes it, and its number of bodies with modes (1 if none)."""
    from benchmarks.floatframe_step import chain

    yield "rigid arm", arm, 1
    yield "rigid slider-crank", slider_crank, 1
    for n_bodies in (1, 10):
        for n_modes in (8, 20, 50):
            yield f"bodies: {n_bodies}, modes: {n_modes}", lambda b=n_bodies, n=n_modes: chain(b, n), n_bodies


def own_times():
    """Return for each system the time of a compiled step, of a step of a run, and of the same with the watch [s]."""
    from benchmarks.floatframe_step import H, measure

    has_watch = "watch" in inspect.signature(integrate).parameters
    told = {}
    for name, make, n_bodies in systems():
        best, _ = measure([make()], 1000 // n_bodies, 5)
        told[name] = [best[0]]
        system, n_steps = make(), 20000 // n_bodies
        for options in ({"watch": "off"}, {"watch": "tell"}) if has_watch else ({},):
            begun = time.process_time()
            integrate(system, GeneralizedAlpha(0.8), n_steps * H, H, output_every=100, **options)
            told[name].append((time.process_time() - begun) / n_steps)
    return told


def times_in(checkout):
    """Return `own_times` of a checkout, measured by a process of its own."""
    command = [sys.executable, "-P", __file__, "--own"]  # -P: imports are of the checkout, not of this folder
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment, cwd=checkout)
    return json.loads(done.stdout.splitlines()[-1])


def least(times):
    """Return the least of several `own_times`, each of its own."""
    return {name: np.min([one[name] for one in times], axis=0) for name in times[0]}


def main():
    if sys.argv[1] == "--own":
        logging.getLogger("floatframe").setLevel(logging.ERROR)  # made-up bodies leave the range of linear frames
        print(json.dumps(own_times()))
        return
    checkouts, pairs = (Path(sys.argv[1]).resolve(), Path(__file__).resolve().parents[1]), 20
    if len(sys.argv) > 2:
        pairs = int(sys.argv[2])
    for checkout in checkouts:
        times_in(checkout)  # compiles
    measured = [], []
    for _ in range(pairs):
        for k in (0, 1):
            measured[k].append(times_in(checkouts[k]))
    there, here = (least(times) for times in measured)
    print("                          step [us]             run without watch [us a step]   with watch")
    print("system                there   here  ratio          there   here  ratio           here  ratio")
    for name in there:
        (step, run, *_), (own_step, off, tell) = 1e6 * there[name], 1e6 * here[name]
        print(f"{name:20s} {step:6.2f} {own_step:6.2f} {own_step / step:6.3f}        {run:7.2f} {off:6.2f}"
              f" {off / run:6.3f}        {tell:7.2f} {tell / run:6.3f}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
