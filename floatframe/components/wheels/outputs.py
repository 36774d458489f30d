"""The outputs of every tyre, which sensors can read."""

import numpy as np
from numba.extending import register_jitable

__all__ = ["OUTPUTS", "show", "show_energy"]

#: outputs of the contact with units: loads on the wheel in contact axes, slips as the law uses them (with relaxation)
OUTPUTS = {
    "Fx": "N", "Fy": "N", "Fz": "N", "Mx": "N m", "My": "N m", "Mz": "N m",
    "kappa": "1", "alpha": "rad", "gamma": "rad", "deflection": "m", "loaded_radius": "m",
    "Vx": "m/s", "Vsx": "m/s", "Vsy": "m/s", "px": "m", "py": "m", "pz": "m",
    "energy": "J", "power_lost": "W", "road_left": "m", "clamped": "1", "off_road": "m",
}  # fmt: skip


@register_jitable(error_model="numpy")
def show(outputs, F, M, slips, shape, speeds, point):
    """Write forces, moments, slips (kappa, tan alpha, sin gamma), deflection, loaded radius, velocities and point."""
    for k in range(3):
        outputs[k] = F[k]
        outputs[3 + k] = M[k]
        outputs[11 + k] = speeds[k]
        outputs[14 + k] = point[k]
    outputs[6] = slips[0]
    outputs[7] = np.arctan(slips[1])
    outputs[8] = np.arctan(slips[2] / np.sqrt(1.0 - slips[2] * slips[2] + 1e-24))
    outputs[9] = shape[0]
    outputs[10] = shape[1]


@register_jitable(error_model="numpy")
def show_energy(outputs, energy, lost, left, clamped):
    """Write the energy stored, the power lost, the length of road left and the number of clamped inputs."""
    outputs[17] = energy
    outputs[18] = lost
    outputs[19] = left
    outputs[20] = clamped
    outputs[21] = -left
