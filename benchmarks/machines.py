"""What a second of motion of each machine costs, in processor time, and how that of the kart grows with its modes.

python -m benchmarks.machines [--formulations]

`--formulations`: each machine in absolute and in relative coordinates, how far its bodies are apart and what both cost.

Each system is run over a short part of its motion after a few steps that load compiled code; the run of the files'
step and method, without results on disk.
"""

import logging
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import cms
import floatframe as ff
from floatframe.engine.compiling.system import compiled_system
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


def seconds_a_second(path: Path, t: float) -> tuple[ff.System, float, float]:
    """Return a system, its step, and the processor time of a second of its motion."""
    system, run = read_system(path)
    assert run is not None
    ff.integrate(system, run.integrator, 3 * run.h, run.h)
    begun = time.process_time()
    ff.integrate(system, run.integrator, t, run.h, output_every=run.output_every)
    return system, run.h, (time.process_time() - begun) / t


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
            told[f"a second of {machine}, {system_name} [s]"] = seconds_a_second(path, t)[2]
    return told


def main() -> None:
    """Print two tables."""
    logging.disable(logging.WARNING)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if "--formulations" in sys.argv[1:]:
            return formulations(folder)
        print("machine, system: bodies, velocities, unknowns of joints and forces, step [s], processor time a second")
        for machine, jobs, system_name, t in RUNS:
            system, h, cost = seconds_a_second(prepared(machine, jobs, folder) / f"{system_name}.toml", t)
            model = compiled_system(system).model
            sizes = f"{len(system.bodies)}, {int(model.bodies.u0[-1])}, {int(model.connections.w0[-1])}"
            print(f"{machine}, {system_name}: {sizes}, {h:g}, {cost:.2f}", flush=True)
        print("kart: modes of the chassis, processor time a second")
        kart = folder / "kart"
        job = (kart / "chassis.toml").read_text(encoding="utf-8")
        given = next(line for line in job.splitlines() if line.startswith("n_modes"))
        for n in KART_MODES:
            (kart / "chassis.toml").write_text(job.replace(given, f"n_modes = {n}"), encoding="utf-8")
            reduced = cms.reduce_job(kart / "chassis.toml")
            cms.write(replace(reduced, name="chassis"), kart / "chassis.h5")
            _, _, cost = seconds_a_second(kart / "kart.toml", 1.0)
            print(f"{reduced.n_q}, {cost:.2f}", flush=True)


if __name__ == "__main__":
    main()
