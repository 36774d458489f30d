"""Amplitudes of point forces and load cases, and motors of joints, as inputs of a linearised system.

The equations are linear in such an amplitude a, so its column is the difference of the residuals for a + 1 and a:

    residual(a + 1) - residual(a) = -F,   rows(a + 1) - rows(a) = E
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.units import Units
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.interface_loads import amplitudes, loads_on_interfaces
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import set_iterate
from floatframe.engine.kernels.work import new_work
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import body_name
from floatframe.model.forces import WITH_AMPLITUDE, BodyLoad, PointForce, driven_forces
from floatframe.model.functions.time_functions import TimeFunction, constant
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_matrix
from floatframe.model.system import System
from floatframe.results.sensors.measurement import amplitude_unit
from floatframe.results.small_motions.small_motions import InputForce, SmallMotions
from floatframe.results.trajectory import Trajectory

__all__ = ["ForceInput", "force_column", "force_input_unit", "forces_of_amplitude"]


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ForceInput:
    """A force of the system as an input: change of its amplitude, or of the motor of a joint force.

    For a point force or load case, the input is a factor; for a joint force, it is the force or torque itself.

    Parameters
    ----------
    name
        Name of the input.
    force
        Name of a point force, a load case (`BodyLoad`) or a `JointForce`.
    """

    name: str
    force: str

    def force_units(self, units: Units) -> str:
        """Return the unit of the input, if it is known without the system."""
        return "1"


def force_of(system: System, channel: ForceInput) -> Any:
    """Return the force of the input; `ModelError` suggests the closest name if there is none."""
    known = driven_forces(system.forces)
    if channel.force not in known:
        names = [force.name for force in system.forces if hasattr(force, "name")]
        what = "has no amplitude or motor" if channel.force in names else "does not exist"
        raise ModelError(
            f"input {channel.name!r}: force {quoted(channel.force)} {what}; expected a point force, a load case or a "
            f"joint force{nearest(channel.force, list(known))}"
        )
    return known[channel.force]


def force_input_unit(system: System, channel: ForceInput) -> str:
    """Return the unit of the input."""
    return amplitude_unit(system.units, force_of(system, channel))


def force_column(small: SmallMotions, channel: ForceInput) -> tuple[Array, Array]:
    """Return the input's column of body forces, (n_u,), and its column in the rows, (n_w,)."""
    from floatframe.engine.kernels.entry import evaluate_and_linearize

    force = force_of(small.system, channel)
    key = WITH_AMPLITUDE[type(force)]
    given = getattr(force, key)
    now = given(0.0) if isinstance(given, TimeFunction) else float(key == "amplitude")
    found = []
    for value in (now, now + 1.0):
        changed = replace(force, **{key: constant(value)})
        forces = [changed if each is force else each for each in small.system.forces]
        system = replace(small.system, forces=forces, inputs=(), outputs=())  # holds the functions that the model calls
        model = compiled_system(system).model
        work = new_work(model)
        set_iterate(work, small.state, w=small.work.state.w)
        evaluate_and_linearize(model, work, 0.0, 0.0, 1.0)
        found.append((work.bodies.residual.copy(), work.connections.g.copy()))
    (residual, rows), (residual_1, rows_1) = found
    return residual - residual_1, rows_1 - rows


def forces_of_amplitude(system: System, now: Trajectory, channel: ForceInput) -> tuple[InputForce, ...]:
    """Return the input's loads on interfaces of a flexible body, or an entry that marks a load case on the body."""
    force = force_of(system, channel)
    if isinstance(force, BodyLoad):
        return (InputForce(body_name(force.body), "", np.zeros(6), force.load_case),)
    if not isinstance(force, PointForce) or force.marker.interface is None:
        return ()
    name = body_name(force.marker.body)
    i = [body.name for body in system.bodies].index(name)
    R = rotation_matrix(now.body(name).p)
    found = []
    for load in loads_on_interfaces(system, i)[1]:
        if load.force is force:
            one = replace(load, force=replace(force, amplitude=None))
            six = amplitudes(one, np.zeros(1), R)[0]
            interface = system.bodies[i].reduced.interfaces[load.interface]  # type: ignore[union-attr]
            # a follower force rotates with its marker, which rotates with the interface
            turn = interface.Psi[3:] @ now.body(name).q[0] if force.is_follower else np.zeros(3)
            turned = R[0] @ rotation_matrix(euler_parameters_of_rotation_vector(turn))
            found.append(InputForce(name, interface.name, np.concatenate([turned @ six[:3], turned @ six[3:]])))
    return tuple(found)
