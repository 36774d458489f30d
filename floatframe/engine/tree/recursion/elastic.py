"""Motion of a marker in its flexible body to second order: what a joint at it adds (docs/recursive.md §2).

With Psi(q) = Psi - K_P q, th_dot = Psi_r q_dot, T the left Jacobian at th, all in axes of the body:

    rho_ddot = Psi_t q_ddot - (K_P q_dot)_t q_dot        nu = T th_dot
    nu_dot   = T th_ddot + c,   th_ddot = Psi_r q_ddot - (K_P q_dot)_r q_dot,   c = (dT/dth [th_dot]) th_dot
"""

from floatframe.engine.kernels.compiler.compilation import loops, small
from floatframe.engine.kernels.marker import shape
from floatframe.engine.kernels.vector import add, cross, dot, scaled, turned, turned_back, vector
from floatframe.engine.tree.kernels.elastic_turning import deformation_accelerations, turning_bias

__all__ = ["add_modal_forces", "marker_acceleration", "relative_acceleration"]


@loops
def marker_acceleration(model, marker_work, m):
    """Return rho_ddot and nu_dot of marker m, whose motion in its body is written."""
    markers, zero = marker_work.markers, (0.0, 0.0, 0.0)
    if model.markers.psi0[m] < 0:
        return zero, zero
    rho_ddot, th_ddot = deformation_accelerations(model, marker_work, m, model.markers.body[m])
    c = turning_bias(vector(markers.angle[m]), vector(markers.angle_dot[m]))
    return rho_ddot, add(turned(markers.T_left[m], th_ddot), c)


@small
def relative_acceleration(omega, alpha, rho, rho_dot, rho_ddot):
    """Return the acceleration of a point of a body less that of the frame origin, body axes."""
    moved = add(cross(omega, cross(omega, rho)), scaled(2.0, cross(omega, rho_dot)))
    return add(add(cross(alpha, rho), moved), rho_ddot)


@loops
def add_modal_forces(model, marker_work, m, f, t, sign, out):
    """Add sign times the modal forces of a wrench on marker m, at its point, axes of its body, to out, (n,)."""
    o = model.markers.psi0[m]
    if o < 0:
        return
    n = out.shape[0]
    psi = marker_work.markers.psi[o : o + 6 * n]
    s = turned_back(marker_work.markers.T_left[m], t)
    for k in range(n):
        d, th = shape(psi, n, k)
        out[k] += sign * (dot(d, f) + dot(th, s))
