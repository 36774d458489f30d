"""The loads on the interfaces of a flexible body: wrenches of connections and point forces."""

from dataclasses import dataclass

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.model import marker_shapes
from floatframe.model.forces import PointForce
from floatframe.model.system import System

__all__ = ["Load", "Wrench", "amplitudes", "in_body", "interface_number", "loads_on_interfaces"]


@dataclass(frozen=True, eq=False)
class Wrench:
    """Indices of the wrench that a connection applies to an interface."""

    interface: int
    sign: float
    force: int  #: first column of the force in the wrench array w, -1 for none
    moment: int  #: first column of the moment in the wrench array w, -1 for none


@dataclass(frozen=True, eq=False)
class Load:
    """A point force on an interface."""

    interface: int
    force: PointForce
    triad: Array  #: axes of the marker in the undeformed body, body frame, (3, 3)
    number: int = -1  #: index among the point forces of the system


def loads_on_interfaces(system: System, body: int) -> tuple[list[Wrench], list[Load]]:
    """Return the wrench indices of connections on the interfaces of a flexible body, and the point forces on them."""
    model, reduced = compiled_system(system).model, system.bodies[body].moved  # type: ignore[union-attr]
    forces = [force for force in system.forces if isinstance(force, PointForce)]
    load_of = {int(m): k for k, m in enumerate(model.loads.marker)}
    wrenches, loads = [], []
    for m in np.flatnonzero((model.markers.body == body) & (model.markers.psi0 >= 0)).tolist():
        shapes = marker_shapes(model, model.markers.psi, m)
        interface = interface_number(reduced, shapes, model.markers.position[m])
        if interface < 0:  # not at an interface: marker of a sliding joint on its line
            continue
        c = int(model.markers.connection[m])
        if c >= 0:
            w0 = int(model.connections.w0[c])
            first = [w0 + int(part[m]) if part[m] >= 0 else -1 for part in (model.markers.force, model.markers.moment)]
            wrenches.append(Wrench(interface, float(model.markers.sign[m]), *first))
        elif int(m) in load_of:
            k = load_of[int(m)]
            loads.append(Load(interface, forces[k], np.asarray(model.markers.triad[m]), k))
    return wrenches, loads


def interface_number(reduced: ReducedBody, psi: Array, position: Array) -> int:
    """Return the number of the interface with these shapes and this position, -1 if there is none."""
    same = [np.array_equal(each.Psi, psi) and np.array_equal(each.position, position) for each in reduced.interfaces]
    return same.index(True) if any(same) else -1


def amplitudes(load: Load, t: Array, R: Array) -> Array:
    """Return force and moment of a point force over time in body axes, (n_t, 6).

    A follower force is constant in the axes of the undeformed marker.
    """
    force = load.force
    factor = np.ones(len(t)) if force.amplitude is None else np.array([force.amplitude(x) for x in t])
    six = []
    for vector in (force.force, force.torque):
        if force.is_follower:
            six.append(np.broadcast_to(load.triad @ vector, (len(t), 3)))
        else:
            six.append(in_body(R, np.broadcast_to(vector, (len(t), 3))))
    return factor[:, None] * np.concatenate(six, axis=1)


def in_body(R: Array, vectors: Array) -> Array:
    """Return vectors given in ground axes in body axes, (n_t, 3)."""
    return np.asarray(np.einsum("tba,tb->ta", R, vectors))
