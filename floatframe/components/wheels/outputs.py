"""The outputs that every tyre provides to sensors."""

import numpy as np
from numba.extending import register_jitable

__all__ = ["OUTPUTS", "show", "show_energy"]

#: of the contact, in its axes, acting on the wheel; slips as used by the law (with relaxation)
OUTPUTS = {
    "Fx": "N", "Fy": "N", "Fz": "N", "Mx": "N m", "My": "N m", "Mz": "N m",
    "kappa": "1", "alpha": "rad", "gamma": "rad", "deflection": "m", "loaded_radius": "m",
    "Vx": "m/s", "Vsx": "m/s", "Vsy": "m/s", "px": "m", "py": "m", "pz": "m",
    "energy": "J", "power_lost": "W", "road_left": "m", "clamped": "1", "off_road": "m",
}  # fmt: skip


@register_jitable(error_model="numpy")
def show(seen, F, M, slips, shape, speeds, point):
    """Write forces, moments, slips (kappa, tan alpha, sin gamma), deflection, loaded radius, velocities and point."""
    for k in range(3):
        seen[k] = F[k]
        seen[3 + k] = M[k]
        seen[11 + k] = speeds[k]
        seen[14 + k] = point[k]
    seen[6] = slips[0]
    seen[7] = np.arctan(slips[1])
    seen[8] = np.arctan(slips[2] / np.sqrt(1.0 - slips[2] * slips[2] + 1e-24))
    seen[9] = shape[0]
    seen[10] = shape[1]


@register_jitable(error_model="numpy")
def show_energy(seen, energy, lost, left, clamped):
    """Write the energy stored, the power lost, the length of road left and the number of clamped inputs."""
    seen[17] = energy
    seen[18] = lost
    seen[19] = left
    seen[20] = clamped
    seen[21] = -left
