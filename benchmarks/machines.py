"""What the steps of each machine cost beside the time of the motion, on average and at worst; growth with the modes.

python -m benchmarks.machines [--formulations]

`--formulations`: each machine in absolute and in relative coordinates, how far its bodies are apart and what both cost.

Each system makes the steps of its file over a short part of its motion, one step a call, three times; the least
processor time of a step counts. The start, with the first step, is measured apart from the others.
"""

import logging
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

import cms
import floatframe as ff
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.work import new_work
from floatframe.files.system_file.read_system import read_system
from floatframe.machines import copy_machine

#: machine, its jobs, one of its systems, seconds of motion
RUNS = (
    ("kart", ("chassis",), "kart", 1.0),
    ("bogie", ("frame",), "straight", 0.5),
    ("railway-engine", ("carbody",), "s_curve", 1.0),
    ("landing-gear", ("piston", "wing"), "drop", 0.2),
    ("landing-gear", ("piston", "wing"), "aircraft", 0.5),
    ("antenna", ("petal", "strut"), "latching", 0.4),
    ("road-car", ("body",), "lane_change", 1.0),
)
#: further machines, for both formulations
MORE_RUNS = (
    ("motor-bogie", ("frame",), "six_steps", 0.1),
    ("landing-gear", ("piston", "leg", "nose_leg", "wing"), "taxi", 0.2),
    ("landing-gear", ("piston", "leg", "nose_leg", "wing"), "braking", 0.5),
    ("landing-gear", (), "retraction", 1.0),
    ("bogie", ("frame",), "curve", 0.5),
    ("road-car", ("body",), "circle", 0.5),
    ("steering-linkage", (), "steering", 0.5),
    ("straight-line", (), "linkage", 0.5),
)
KART_MODES = (0, 10, 20, 40, 80)  #: vibration modes of the chassis beside its static ones


def prepared(name: str, jobs: tuple[str, ...], folder: Path) -> Path:
    """Copy a machine, reduce its parts; return the folder."""
    place = folder / name
    if not place.exists():
        copy_machine(name, place)
        for job in jobs:
            cms.write(cms.reduce_job(place / f"{job}.toml"), place / f"{job}.h5")
    return place


class Cost(NamedTuple):
    """What a machine costs."""

    system: ff.System
    h: float  #: step [s]
    start: float  #: processor time of the start with the first step [s]
    second: float  #: processor time of the steps of a second of motion [s]
    worst: float  #: processor time of the slowest step, divided by h


def cost_of(path: Path, t: float) -> Cost:
    """Return what the steps of a system cost over t seconds."""
    system, run = read_system(path)
    assert run is not None
    method, h, spent = run.integrator, run.h, []
    model = compiled_system(system).model
    for _ in range(3):
        begun = time.process_time()
        memory, work = method.start(system, 0.0), new_work(model)
        own = []
        for k in range(round(t / h)):
            if k == 1:
                start = time.process_time() - begun
            now = time.thread_time()
            memory, _, _, failure = method.advance(system, memory, work, t0=0.0, h=h, first=k, n_steps=1, every=10)
            own.append(time.thread_time() - now)
            assert failure is None, failure
        spent.append(own)
    least = np.min(spent, axis=0)[1:]
    return Cost(system, h, start, least.mean() / h, least.max() / h)


def in_both(path: Path, t: float) -> str:
    """Return how far bodies come, how far apart in both formulations, by halving the step, and both costs."""
    system, run = read_system(path)
    integrator, h = (run.integrator, run.h) if run else (ff.GeneralizedAlpha(), 1e-3)
    steps = max(1, round(t / h))
    found, costs = [], []
    for formulation, parts in (("absolute", 1), ("relative", 1), ("absolute", 2)):
        try:
            ff.integrate(system, integrator, 3 * h, h / parts, formulation=formulation)
            begun = time.process_time()
            motion = ff.integrate(system, integrator, steps * h, h / parts, formulation=formulation)
        except ff.errors.FloatframeError as error:
            return f"{formulation}: {str(error).splitlines()[0]}"
        costs.append((time.process_time() - begun) / (steps * h))
        found.append(np.array([motion.body(body.name).r[::parts] for body in system.bodies]))
    way = np.abs(found[0] - found[0][:, :1]).max()
    apart, halved = (np.abs(other - found[0]).max() for other in found[1:])
    return f"{way:.2g} m | {apart:.1e} m | {halved:.1e} m | {costs[0]:.2f}, {costs[1]:.2f} s"


def formulations(folder: Path) -> None:
    """Print a row for each machine."""
    print("| machine, system | step, time | way | apart | step halved | a second: absolute, relative |")
    for machine, jobs, system_name, t in RUNS + MORE_RUNS:
        path = prepared(machine, jobs, folder) / f"{system_name}.toml"
        _, run = read_system(path)
        h = run.h if run else 1e-3
        print(f"| {machine}, {system_name} | {1e3 * h:g} ms, {t:g} s | {in_both(path, t)} |", flush=True)


def figures(short: bool) -> dict[str, float]:
    """Return what the watch keeps."""
    logging.disable(logging.WARNING)
    with tempfile.TemporaryDirectory() as name:
        told = {}
        for machine, jobs, system_name, t in RUNS[:3] if short else RUNS:
            path = prepared(machine, jobs, Path(name)) / f"{system_name}.toml"
            cost = cost_of(path, t)
            told[f"a second of {machine}, {system_name} [s]"] = cost.second
            told[f"slowest step of {machine}, {system_name}, over its h"] = cost.worst
    return told


def main() -> None:
    """Print two tables."""
    logging.disable(logging.WARNING)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if "--formulations" in sys.argv[1:]:
            return formulations(folder)
        print(
            "| machine, system | bodies, velocities, unknowns of joints and forces | step | start | a second | worst |"
        )
        for machine, jobs, system_name, t in RUNS:
            cost = cost_of(prepared(machine, jobs, folder) / f"{system_name}.toml", t)
            model = compiled_system(cost.system).model
            sizes = f"{len(cost.system.bodies)}, {int(model.bodies.u0[-1])}, {int(model.connections.w0[-1])}"
            figures = f"{1e3 * cost.h:g} ms | {cost.start:.2f} s | {cost.second:.2f} s | {cost.worst:.2f}"
            print(f"| {machine}, {system_name} | {sizes} | {figures} |", flush=True)
        print("kart: modes of the chassis, processor time a second")
        kart = folder / "kart"
        job = (kart / "chassis.toml").read_text(encoding="utf-8")
        given = next(line for line in job.splitlines() if line.startswith("n_modes"))
        for n in KART_MODES:
            (kart / "chassis.toml").write_text(job.replace(given, f"n_modes = {n}"), encoding="utf-8")
            reduced = cms.reduce_job(kart / "chassis.toml")
            cms.write(replace(reduced, name="chassis"), kart / "chassis.h5")
            print(f"{reduced.n_q}, {cost_of(kart / 'kart.toml', 1.0).second:.2f}", flush=True)


if __name__ == "__main__":
    main()
