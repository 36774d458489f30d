"""A tyre test rig: wheels placed and moved by hand, their laws called as functions of Python."""

import numpy as np

from fe_models.foundation.units import unit_system
from floatframe.components.wheels.outputs import OUTPUTS
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.markers import Marker
from floatframe.model.elements import Placed

ROAD, WHEEL = Marker(GROUND), Marker("wheel")
SI = unit_system("m-kg-s")


def turn(axis, angle):
    """Return the rotation about axis 0, 1 or 2."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    A = np.eye(3)
    A[i, i] = A[j, j] = np.cos(angle)
    A[i, j], A[j, i] = -np.sin(angle), np.sin(angle)
    return A


def placed(height=0.3, A=None, units=SI):
    A = np.eye(3) if A is None else A
    return Placed(
        r=np.array([[0, 0, 0], [0, 0, height]]), A=np.array([np.eye(3), A]), on_ground=(True, False), units=units
    )


def motion(height=0.3, v=(0, 0, 0), omega=(0, 0, 0), A=None, at=(0, 0), road=None):
    """Return x of a road at rest (or as given, (18,)) and a wheel."""
    x = np.zeros((2, 18))
    x[:, 3:12] = np.eye(3).ravel()
    if road is not None:
        x[0] = road
    x[1, :3] = (*at, height)
    if A is not None:
        x[1, 3:12] = np.asarray(A).ravel()
    x[1, 12:15], x[1, 15:] = v, omega
    return x


def answer(law, x, z=None, kind=float, function=None):
    """Return outputs by name, wrenches and rates of a law for a motion."""
    n_z = len(law.states)
    z = np.zeros(n_z) if z is None else np.asarray(z)
    wrench, z_dot, seen = np.zeros((2, 6), kind), np.zeros(n_z, kind), np.zeros(len(OUTPUTS), kind)
    call = getattr(function or law.function, "py_func", function or law.function)
    call(0.0, x.astype(kind), z.astype(kind), np.zeros(0, kind), law.data, wrench, z_dot, np.zeros(0, kind), seen)
    return dict(zip(OUTPUTS, seen, strict=True)), wrench, z_dot
