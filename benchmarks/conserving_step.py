"""A step of the conserving, decaying and variational schemes, and of a run with events, by a generalized-alpha step.

    OMP_NUM_THREADS=1 python -m benchmarks.conserving_step

A flexible body alone, on a spherical joint, rigid ones with a bushing, a gear, a user force; a linkage of
rigid bodies with an event. Processor time of a long run less that of a short one right before it, so that what is done
once does not count; runs take turns, the median of each counts.
"""

import argparse
import logging
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Gravity,
    JointForce,
    Marker,
    RevoluteJoint,
    RigidBody,
    System,
    UserForce,
    integrate,
)
from floatframe.components.mechanisms import four_bar
from floatframe.forces import Bushing
from floatframe.integrators import EnergyDecaying, EnergyMomentum, Variational
from floatframe.joints import CoordinateCoupler, JointCoordinate
from floatframe.simulation import Event
from tests.floatframe.integrators.examples import pendulum
from tests.floatframe.model.bodies.examples import spinning

H = 0.005
GIVEN = "generalized-alpha"
SCHEMES = {
    GIVEN: GeneralizedAlpha(),
    "energy-momentum": EnergyMomentum(),
    "energy-decaying": EnergyDecaying(),
    "variational": Variational(),
}
HINGES = [RevoluteJoint(f"hinge {name}", Marker(GROUND), Marker(name), axis=(0, 0, 1)) for name in ("a", "b")]
ANGLES = [JointCoordinate(hinge.name, "angle") for hinge in HINGES]


def mounted() -> System:
    """Return a rigid body on a bushing."""
    engine = RigidBody("engine", 10.0, np.diag([0.5, 0.6, 0.7]), center_of_mass=(0.1, 0, 0.1), omega_B=(2.0, 1.0, 3.0))
    stiffness = [4e3, 5e3, 6e3, 60.0, 70.0, 80.0]
    return System([engine], [], [Bushing("mount", Marker(GROUND), Marker("engine"), stiffness), Gravity((0, 0, -9.81))])


def wheels() -> list[RigidBody]:
    """Return two wheels."""
    return [RigidBody("a", 2.0, np.diag([0.1, 0.1, 0.2]), omega_B=(0, 0, 3.0)), RigidBody("b", 1.0, 0.05 * np.eye(3))]


def geared() -> System:
    """Return two wheels on hinges, a spring at one of them, and a gear between them."""
    spring = JointForce("spring", "hinge a", "angle", stiffness=5.0)
    gear = CoordinateCoupler("gear", list(zip(ANGLES, (2.0, 1.0), strict=True)))
    return System(wheels(), HINGES, [spring], couplers=[gear])


def controlled() -> System:
    """Return a wheel on a hinge with a controller that has a state."""
    force = UserForce("loop", {"phi": ANGLES[0]}, {"phi": "-8*phi - 0.5*phi_dot - 2*e"}, {"e": "phi"}, {"e": 0.0})
    return System(wheels()[:1], HINGES[:1], [force])


SYSTEMS: dict[str, Callable[[], System]] = {
    "free body, 4 modes": spinning,
    "pendulum, 3 modes": pendulum,
    "body on a bushing": mounted,
    "two wheels and a gear": geared,
    "wheel and user force": controlled,
}
EVERY = 10  #: steps to an output


def seconds(system: System, method, n_steps: int, every: int) -> tuple[float, int]:
    """Return the processor time of a run, and Newton's iterations in it."""
    began = time.process_time()
    motion = integrate(system, method, n_steps * H, H, output_every=every)
    return time.process_time() - began, int(motion.head.summary["n_iterations"])


def times_of_a_step(runs: dict, n_steps: int, n_turns: int, every: int = EVERY) -> dict[str, tuple[float, float]]:
    """Return for each run (system, method) processor time [s] and iterations of a step."""
    taken: dict[str, list[float]] = {name: [] for name in runs}
    counts = dict.fromkeys(runs, 0)
    for _ in range(n_turns):
        for name, (system, method) in runs.items():
            short, _ = seconds(system, method, n_steps // 10, every)
            long, counts[name] = seconds(system, method, n_steps, every)
            taken[name].append(long - short)
    n = n_steps - n_steps // 10
    return {name: (float(np.median(taken[name])) / n, counts[name] / n_steps) for name in runs}


def watched() -> dict[str, System]:
    """Return a four-bar linkage without an event, with one that never happens, and with one that happens at times."""
    plain = four_bar()
    system = System(plain.bodies, plain.joints, [Gravity((0, -9.81, 0))], redundant="minimum-norm")
    angle = f"{system.joints[0].name}.angle"
    return {
        "no event": system,
        "an event that never happens": replace(system, events=(Event("never", angle, level=1e9, stop=True),)),
        "an event that happens at times": replace(system, events=(Event("often", angle, level=-1.0, record=True),)),
    }


def figures(short: bool) -> dict[str, float]:
    """Return ratios of times of a step."""
    n_steps, n_turns = (10_000, 3) if short else (40_000, 5)
    found = {}
    for title, made in SYSTEMS.items():
        system = made()
        times = times_of_a_step({name: (system, method) for name, method in SCHEMES.items()}, n_steps, n_turns)
        for name in SCHEMES:
            found[f"{name}, {title}, a step [µs]"] = times[name][0] * 1e6
            if name != GIVEN:
                found[f"{name} by {GIVEN}, {title}"] = times[name][0] / times[GIVEN][0]
    for every in (1, EVERY):
        runs = {name: (system, SCHEMES[GIVEN]) for name, system in watched().items()}
        times = times_of_a_step(runs, n_steps, n_turns, every)
        first, *others = times
        found[f"linkage, output every {every}, {first}, a step [µs]"] = times[first][0] * 1e6
        for name in others:
            found[f"linkage, output every {every}, {name} by {first}"] = times[name][0] / times[first][0]
    return found


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--short", action="store_true", help="shorter runs")
    arguments = parser.parse_args()
    logging.disable(logging.WARNING)
    for name, value in figures(arguments.short).items():
        print(f"{name:60s} {value:9.2f}")


if __name__ == "__main__":
    main()
