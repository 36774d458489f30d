"""Results of 100 random systems and of every part by every scheme, as this process compiles or interprets kernels.

    FLOATFRAME_COMPILER=interpreted python -m tests.floatframe.engine.kernels.compiler.computed FILE SYSTEM ...

writes the results of systems by number to an .npz file. System k consists of the random motion of seed k, its recursive
equations of motion if it is a tree, and the parts of the table in docs/integrators.md whose turn it is, so that the 100
systems cover every joint, drive, coupler, force, body and element by every scheme that takes it.
"""

import logging
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import floatframe as ff
from fe_models.foundation.arrays import Array
from floatframe.engine.tree.recursive import relative_model
from floatframe.errors import FloatframeError
from floatframe.integrators.integrator import Integrator
from tests.campaign.random_motions import random_motion
from tests.floatframe.engine.structure_preserving.compared import ALL, BY_IDA
from tests.floatframe.engine.structure_preserving.part_table import REFUSED
from tests.floatframe.engine.structure_preserving.parts import METHODS

__all__ = ["CELLS", "N_SYSTEMS", "computed_systems"]

N_SYSTEMS = 100
STEPS, PART_STEPS = 4, 2  #: of a random motion, and of a part
#: schemes that choose their steps by tolerances, of which a motion needs many, and the part of the time that they run
BY_TOLERANCE, SHORT = ("`RelativeOde`", "`Ida`"), 1e-3
#: (scheme, part) of all schemes with the parts that they take; by IDA, which has no kernels of its own, some of them
CELLS = [
    (scheme, part) for part in ALL for scheme in METHODS
    if part not in REFUSED.get(scheme, {}) and (scheme != "`Ida`" or part in BY_IDA)
]  # fmt: skip


Results = Iterator[tuple[str, Array]]  #: names and values


def computed_systems(numbers: list[int]) -> dict[str, Array]:
    """Return the results of some systems by the name of the system, the run and the array."""
    logging.disable(logging.WARNING)
    try:
        return {f"{k} {name}": array for k in numbers for name, array in results(k)}
    finally:
        logging.disable(logging.NOTSET)


def results(k: int) -> Results:
    """Yield name and values of the arrays of a system."""
    case = random_motion(k)
    formulation = {"formulation": case.formulation} if isinstance(case.method, ff.GeneralizedAlpha) else {}
    yield from motion("random motion", case.system, case.method, case.h, STEPS, **formulation)
    bare = ff.System(case.system.bodies, case.system.joints, [ff.Gravity((0.3, -0.4, -9.81))], case.system.units)
    try:
        model = relative_model(bare)
        z, z_dot = model.positions()
        yield "recursion: mass matrix", model.mass_matrix(z)
        yield "recursion: accelerations", np.zeros(0) if model.driven else model.forward_dynamics(z, z_dot)
        for name, array in zip(("by z", "by rates", "M"), model.derivatives(z, z_dot, z_dot), strict=True):
            yield f"recursion: {name}", array
    except FloatframeError as error:
        yield f"recursion: {error}", np.zeros(0)
    for scheme, part in CELLS[k::N_SYSTEMS]:
        each = ALL[part]
        method = each.ode if each.ode and scheme == "`RelativeOde`" else METHODS[scheme]
        h = each.h * (SHORT if scheme in BY_TOLERANCE else 1.0)
        yield from motion(f"{part} by {scheme}", each.make(), method, h, PART_STEPS)


def motion(name: str, system: ff.System, method: Integrator, h: float, n: int, **options: str) -> Results:
    """Yield the arrays of a motion, or the message of its refusal."""
    try:
        trajectory = ff.integrate(system, method, n * h, h, watch="off", **options)
    except FloatframeError as error:
        yield f"{name}: {type(error).__name__}", np.zeros(0)
        return
    for array in ("position", "euler_parameters", "q", "u", "u_dot", "w"):
        yield f"{name}: {array}", trajectory.source.read(array)


if __name__ == "__main__":
    np.savez(Path(sys.argv[1]), **computed_systems([int(word) for word in sys.argv[2:]]))
