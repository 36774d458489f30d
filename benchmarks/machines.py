"""What a second of motion of each machine costs, in processor time, and how that of the kart grows with its modes.

python -m benchmarks.machines

Each system is run over a short part of its motion after a few steps that load compiled code; the run of the files'
step and method, without results on disk.
"""

import logging
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import cms
import floatframe as ff
from floatframe.compiling.system import compiled_system
from floatframe.machines import copy_machine
from floatframe.system_file.read_system import read_system

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


def main() -> None:
    """Print two tables."""
    logging.disable(logging.WARNING)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
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
