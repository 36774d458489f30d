"""Restart records: the memory of an integrator, stored with the results to resume an interrupted run.

A record belongs to a step whose number is a multiple of `RESTART_STEPS`. At such steps every run computes its Newton
factors again, so that a resumed run takes the same steps as an uninterrupted one, bit for bit.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.memory import Memory, memory_at
from floatframe.engine.kernels.records import leaves
from floatframe.errors import ResultsError
from floatframe.integrators.integrator import Integrator
from floatframe.model.system import System
from floatframe.simulation.events import events_of

__all__ = ["RESTART_STEPS", "memory_of_record", "restart_record", "system_digest"]

RESTART_STEPS = 400
STATE = ("r", "p", "q", "u")


def restart_record(memory: Memory, n_done: int) -> dict[str, Array]:
    """Return the memory of the integrator after n_done steps as named arrays."""
    return memory._asdict() | {"n_done": np.array(n_done)}


def memory_of_record(record: Mapping[str, Array], system: System) -> tuple[Memory, int]:
    """Return the integrator's memory and the number of steps done; `ResultsError` if the system differs."""
    compiled = compiled_system(system)
    n_w = int(compiled.model.connections.w0[-1])
    expected = memory_at(compiled.placed, compiled.placed.u, np.zeros(n_w), n_angles=len(compiled.model.angles.sign))
    for name, array in {**expected._asdict(), "n_done": np.array(0)}.items():
        if name not in record or (record[name].shape != array.shape and name != "a"):
            raise ResultsError("restart: the record is of a system with other bodies; resume the system that was run")
    if record["a"].ndim != 1:  # "a" holds accelerations, or multipliers in the conserving schemes
        raise ResultsError("restart: the record lacks the memory of the method; run the system again")
    values: dict[str, Any] = {name: record[name] for name in Memory._fields}
    return expected.changed(**values), int(record["n_done"])


def system_digest(system: System, integrator: Integrator) -> str:
    """Return the sha256 of all data that determine a motion: compiled system, start, method and parameters."""
    parameters = asdict(integrator)  # type: ignore[call-overload]
    digest = hashlib.sha256(repr((type(integrator).__name__, parameters)).encode())
    if events_of(system):
        digest.update(repr(events_of(system)).encode())
    for controller in system.controllers:
        digest.update(repr(controller.identity).encode())
    compiled = compiled_system(system)
    for each in compiled.laws:
        digest.update(repr(each.digest).encode())
    arrays = dict(leaves(compiled.model)) | {name: getattr(compiled.placed, name) for name in STATE}
    for name in ("elements.address", "laws.address", "laws.tangent"):  # addresses change from process to process
        del arrays[name]
    for part in arrays.values():
        array = np.ascontiguousarray(part)
        digest.update(repr((array.shape, array.dtype.str)).encode() + array.tobytes())
    return digest.hexdigest()
