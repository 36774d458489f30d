"""Cost of a step in absolute and in relative coordinates: chains of rigid and of flexible links.

    python benchmarks/relative_coordinates.py [--most 1000] [--precision]

Processor time of a step of 1 ms and Newton's iterations in it, both formulations one after the other. With --precision
also what a motion costs by its error: 30 flexible links fall for 0.384 s with several steps; rms errors of body frames
and of modal coordinates (over the rms of these) against steps of 25 us, both formulations of which are compared first.
"""

import argparse
import time

import numpy as np

import cms
import fe_models as fm
from floatframe import GeneralizedAlpha, System
from floatframe.components.mechanisms import chain
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.work import new_work
from floatframe.errors import FloatframeError
from floatframe.integrators.relative import in_formulation

FORMULATIONS = ("absolute", "relative")


def cost(system: System, formulation: str, n_steps: int, h: float = 1e-3) -> tuple[float, float]:
    """Return the processor time of a step [s] and its iterations, the kernels being compiled."""
    method = in_formulation(GeneralizedAlpha(), formulation)
    work = new_work(compiled_system(system).model)
    memory = method.start(system, 0.0)
    memory, _, _, failure = method.advance(system, memory, work, t0=0.0, h=h, first=0, n_steps=5, every=10**6)
    assert failure is None, failure
    before, began = memory.n_iterations, time.process_time()
    memory, _, _, failure = method.advance(system, memory, work, t0=0.0, h=h, first=5, n_steps=n_steps, every=10**6)
    seconds = time.process_time() - began
    assert failure is None, failure
    return seconds / n_steps, (memory.n_iterations - before) / n_steps


def beam(n_modes: int) -> cms.ReducedBody:
    """Return a slender aluminium-like beam with interfaces at its ends, geometric stiffness included."""
    mesh = fm.beams.straight_line((0, 0, 0), (1, 0, 0), 8)
    ends = [fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("start", 0), ("end", 8))]
    material = fm.Material("soft", E=4e9, nu=0.3, rho=2700.0)
    section = fm.beams.BeamProperty(fm.beams.Rectangle(0.03, 0.02), material, orientation=(0, 1, 0))
    body = cms.couple(fm.beam_body(mesh, section, name="beam", units=cms.unit_system("m-kg-s"), interfaces=ends))
    return cms.reduce(body, cms.craig_bampton(body, n_modes=n_modes), geometric=True)


def motion(system: System, formulation: str, h: float, tolerance: float, t_end: float = 0.384, every: float = 0.024):
    """Return places of body frames, modal coordinates, the processor time [s] and iterations of a step."""
    method = in_formulation(GeneralizedAlpha(tolerance=tolerance), formulation)
    work = new_work(compiled_system(system).model)
    memory, n_steps = method.start(system, 0.0), round(t_end / h)
    began = time.process_time()
    memory, rows, _, failure = method.advance(
        system, memory, work, t0=0.0, h=h, first=0, n_steps=n_steps, every=round(every / h)
    )
    seconds = time.process_time() - began
    assert failure is None, failure
    return rows.r, rows.q, seconds, memory.n_iterations / n_steps


def rms(x: np.ndarray) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(x**2)))


def precision(system: System) -> None:
    """Print what a motion costs by its error, both formulations in turn, the better of three runs."""
    fine = {each: motion(system, each, 2.5e-5, 1e-9) for each in FORMULATIONS}
    (r, q, *_), (r_other, q_other, *_) = fine["relative"], fine["absolute"]
    print(f"references differ by {rms(r - r_other):.1e} m, modes by {rms(q - q_other) / rms(q):.1e}")
    print(f"{'h':>8s} {'tolerance':>10s}" + "".join(f"{each:>44s}" for each in FORMULATIONS))
    for tolerance in (1e-8, 1e-6):
        for h in (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4):
            told = []
            runs = [[motion(system, each, h, tolerance) for each in FORMULATIONS] for _ in range(3)]
            for one in zip(*runs, strict=True):
                r_h, q_h, _, iterations = one[0]
                seconds = min(run[2] for run in one)
                errors = f"{rms(r_h - r):.1e} m {rms(q_h - q) / rms(q):.1e}"
                told.append(f"{errors} {1e3 * seconds:7.0f} ms {iterations:4.1f} it")
            print(f"{1e3 * h:5.2f} ms {tolerance:10.0e}" + "".join(f"{each:>44s}" for each in told), flush=True)


def figures(short: bool) -> dict[str, float]:
    """Return what the watch keeps."""
    told = {}
    for words, rod, n in (("rigid", None, 30), ("rigid", None, 100), ("8 modes each", beam(2), 30)):
        system = chain(n, angles=tuple(0.3 * np.random.default_rng(0).normal(size=n)), rod=rod)
        absolute, relative = (min(cost(system, each, 50)[0] for _ in range(5)) for each in FORMULATIONS)
        told[f"step in relative over absolute coordinates, chain of {n}, {words}"] = relative / absolute
    return told


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--most", type=int, default=300, help="bodies of the longest chain")
    parser.add_argument("--precision", action="store_true", help="also what a motion costs by its error")
    asked = parser.parse_args()
    most = asked.most
    rng = np.random.default_rng(0)
    link = beam(2)
    print(f"{'chain':>20s} {'absolute':>20s} {'relative':>20s}")
    for rod, sizes in ((None, (1, 3, 10, 30, 60, 100, 300, 1000)), (link, (3, 10, 30))):
        for n in sizes:
            if n > most:
                continue
            system = chain(n, angles=tuple(0.3 * rng.normal(size=n)), rod=rod)
            told = []
            for formulation in FORMULATIONS:
                try:
                    seconds, iterations = cost(system, formulation, 50)
                    told.append(f"{1e6 * seconds:9.0f} us {iterations:5.1f} it")
                except FloatframeError as error:
                    told.append(f"{str(error)[:18]}")
            print(
                f"{n:4d} x {'rigid' if rod is None else f'{rod.n_q} modes':>12s} {told[0]:>20s} {told[1]:>20s}",
                flush=True,
            )
    if asked.precision:
        precision(chain(30, angles=tuple(0.3 * np.random.default_rng(0).normal(size=30)), rod=link))


if __name__ == "__main__":
    main()
