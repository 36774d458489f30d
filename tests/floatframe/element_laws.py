"""Laws of elements by themselves: evaluated with NumPy's numbers, and their energy's rate by a complex step."""

import numpy as np

from fe_models.foundation.units import unit_system
from floatframe.model.elements import ElementLaw, Placed

STEP = 1e-30


def marker_motion(r, A=None, v=(0, 0, 0), omega=(0, 0, 0)):
    """Return the eighteen numbers of the motion of a marker."""
    return np.concatenate([np.asarray(r, float), np.eye(3).ravel() if A is None else np.ravel(A), v, omega])


def moved(x, factor):
    """Return the markers after the time `factor`, to first order."""
    y = x.astype(np.result_type(x, type(factor)))
    for k in range(len(x)):
        y[k, :3] += factor * x[k, 12:15]
        y[k, 3:12] += factor * np.cross(x[k, 15:18], x[k, 3:12].reshape(3, 3).T).T.ravel()
    return y


def evaluate(law: ElementLaw, t, x, z, function=None):
    """Return wrench, z_dot and the outputs by name."""
    kind = np.result_type(x, z, float)
    wrench, z_dot = np.zeros((len(x), 6), kind), np.zeros(len(z), kind)
    seen = np.zeros(len(law.outputs), kind)
    function = function or law.function
    getattr(function, "py_func", function)(t, x, z, np.zeros(0), law.data, wrench, z_dot, np.zeros(0), seen)
    return wrench, z_dot, dict(zip(law.outputs, seen, strict=True))


def power_defect(law: ElementLaw, t, x, z):
    """Return d(energy)/dt - power in + power lost + power on the bodies, and the throughput it is compared with."""
    wrench, z_dot, seen = evaluate(law, t, x, z)
    later = evaluate(law, t, moved(x, 1j * STEP), z + 1j * STEP * z_dot)[2]
    rate = later[law.energy].imag / STEP
    onto = float((wrench * x[:, 12:18]).sum())
    given = seen[law.power_in] if law.power_in else 0.0
    parts = [rate, -given, seen[law.power_lost], onto]
    return sum(parts), sum(abs(part) for part in parts)


def placed(x, on_ground=None):
    """Return markers as placed."""
    where = tuple(on_ground or (k == 0 for k in range(len(x))))
    return Placed(x[:, :3], x[:, 3:12].reshape(-1, 3, 3), where, unit_system("m-kg-s"))
