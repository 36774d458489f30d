"""Forces between two markers that depend on their relative motion: bushings and contacts.

The wrench w = (F on A, M on A, N with -N on B) has the rows w - law(motion) = 0; a contact has one unknown more, its
speed of approach. Their derivatives are taken along unit variations of r_B - r_A, the rotations of A and B, and the
rates of these three, one after the other.
"""

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.bushing import (
    bushing_energy,
    bushing_power,
    bushing_state,
    bushing_variation,
)
from floatframe.engine.kernels.connections.contact import (
    contact_energy,
    contact_power,
    contact_state,
    contact_variation,
)
from floatframe.engine.kernels.model import BUSHING

__all__ = ["pair_derivatives", "pair_energy", "pair_power", "pair_rows"]


@inner
def pair_state(model, work, c):
    """Write the wrench of connection c for the motion of its markers into work.pair."""
    if model.connections.law[c] == BUSHING:
        bushing_state(model, work, c)
    else:
        contact_state(model, work, c)


@inner
def pair_rows(model, work, c, c_k):
    """Write the residual of connection c."""
    pair_state(model, work, c)
    w0 = model.connections.w0[c]
    for k in range(model.connections.size[c]):
        work.connections.g[w0 + k] = c_k * (work.state.w[w0 + k] - work.pair.law[k])


@inner
def pair_derivatives(model, work, c, c_k):
    """Write P at both markers and V of connection c; both are zero before.

    The parts of the motion and where they stand in P: d = r_B - r_A moves with both markers, phi_A and phi_B with one;
    then the same of the rates.
    """
    size, pair = model.connections.size[c], work.pair
    P_a, P_b = work.connections.P[model.connections.a[c]], work.connections.P[model.connections.b[c]]
    pair_state(model, work, c)
    for r in range(size):
        work.connections.V[c, r, r] = 1.0
    for k in range(18):
        pair.motion[k] = 0.0
    for k in range(18):
        pair.motion[k] = 1.0
        if model.connections.law[c] == BUSHING:
            bushing_variation(model, work, c)
        else:
            contact_variation(model, work, c)
        pair.motion[k] = 0.0
        part, j = k // 3 % 3, 6 * (k // 9) + k % 3  # d, phi_A or phi_B; column of r or v in P
        for r in range(size):
            change = c_k * pair.change[r]
            if part == 0:
                P_a[r, j], P_b[r, j] = change, -change
            elif part == 1:
                P_a[r, 3 + j] = -change
            else:
                P_b[r, 3 + j] = -change


@inner
def pair_energy(model, work, c):
    """Return the energy of connection c."""
    if model.connections.law[c] == BUSHING:
        return bushing_energy(model, work, c)
    return contact_energy(model, work, c)


@inner
def pair_power(model, work, c):
    """Return the power that enters by tables of connection c, and the power dissipated by damping and friction."""
    if model.connections.law[c] == BUSHING:
        return bushing_power(model, work, c)
    return 0.0, contact_power(model, work, c)
