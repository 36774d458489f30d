"""Cost of a step in absolute and in relative coordinates: chains of rigid and of flexible links.

    python benchmarks/relative_coordinates.py [--most 1000]

Processor time of a step of 1 ms and Newton's iterations in it, both formulations one after the other.
"""

import argparse
import time

import numpy as np

import cms
import fe_models as fm
from floatframe import GeneralizedAlpha, System
from floatframe.compiling.system import compiled_system
from floatframe.errors import FloatframeError
from floatframe.integrators import in_formulation
from floatframe.kernels.work import new_work
from floatframe.mechanisms import chain


def cost(system: System, formulation: str, n_steps: int, h: float = 1e-3) -> tuple[float, float]:
    """Return the processor time of a step [s] and its iterations, the kernels being compiled."""
    method = in_formulation(GeneralizedAlpha(), formulation)
    work = new_work(compiled_system(system).model)
    carry = method.start(system, 0.0)
    carry, _, _, failure = method.advance(system, carry, work, t0=0.0, h=h, first=0, n_steps=5, every=10**6)
    assert failure is None, failure
    before, began = carry.n_iterations, time.process_time()
    carry, _, _, failure = method.advance(system, carry, work, t0=0.0, h=h, first=5, n_steps=n_steps, every=10**6)
    seconds = time.process_time() - began
    assert failure is None, failure
    return seconds / n_steps, (carry.n_iterations - before) / n_steps


def beam(n_modes: int) -> cms.ReducedBody:
    """Return a slender aluminium-like beam with interfaces at its ends, geometric stiffness included."""
    mesh = fm.straight_line((0, 0, 0), (1, 0, 0), 8)
    ends = [fm.line_interface(mesh, name, fm.NodeIndices((k,))) for name, k in (("start", 0), ("end", 8))]
    material = fm.Material("soft", E=4e9, nu=0.3, rho=2700.0)
    section = fm.BeamProperty(fm.Rectangle(0.03, 0.02), material, orientation=(0, 1, 0))
    body = cms.couple(fm.beam_body(mesh, section, name="beam", units=cms.unit_system("m-kg-s"), interfaces=ends))
    return cms.reduce(body, cms.craig_bampton(body, n_modes=n_modes), geometric=True)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--most", type=int, default=300, help="bodies of the longest chain")
    most = parser.parse_args().most
    rng = np.random.default_rng(0)
    link = beam(2)
    print(f"{'chain':>20s} {'absolute':>20s} {'relative':>20s}")
    for rod, sizes in ((None, (1, 3, 10, 30, 60, 100, 300, 1000)), (link, (3, 10, 30))):
        for n in sizes:
            if n > most:
                continue
            system = chain(n, angles=tuple(0.3 * rng.normal(size=n)), rod=rod)
            told = []
            for formulation in ("absolute", "relative"):
                try:
                    seconds, iterations = cost(system, formulation, 50)
                    told.append(f"{1e6 * seconds:9.0f} us {iterations:5.1f} it")
                except FloatframeError as error:
                    told.append(f"{str(error)[:18]}")
            print(
                f"{n:4d} x {'rigid' if rod is None else f'{rod.n_q} modes':>12s} {told[0]:>20s} {told[1]:>20s}",
                flush=True,
            )


if __name__ == "__main__":
    main()
