"""The contact between wheel and road: its point, its velocities and the normal force.

Axes (ISO 8855): the road normal z_W points up, and the spin axis e of the wheel to its left. x_W = e × z_W / |e × z_W|
points forward, and y_W = z_W × x_W to the left in the road. In the plane of the wheel, u = x_W × e points up from the
contact point to the centre c. The inclination gamma, sin gamma = e · z_W, is positive if the top leans to the right.
"""

import numpy as np
from numba.extending import register_jitable

from floatframe.components.wheels.roads.surface import CENTRE, road_grip, road_height
from floatframe.model.elements.pairs import inner_product, vector_product

__all__ = ["AXIS", "CENTRE_AT", "COMMON", "DAMPING", "LOW_SPEED", "RADIUS", "ROAD", "SETTLING", "SIGMA_X", "SIGMA_Y"]
__all__ += ["STIFFNESS", "TURN_AT", "contact", "grip_at", "moved", "normal_force", "put_wrenches"]
__all__ += ["touching"]

# indices of the parameters that all tyres have; the parameters of each law begin at `COMMON`
RADIUS, STIFFNESS, DAMPING, LANDING, LOW_SPEED, SETTLING, SIGMA_X, SIGMA_Y = range(8)
AXIS = 8  #: index of the wheel's spin axis in axes of its marker (3)
CENTRE_AT, TURN_AT = 11, 14  #: indices of the assembled wheel's centre (3) and axes (9), in axes of the road
ROAD, COMMON = 23, 24  #: index of the first parameter of the road; index of the first parameter of a law

#: number of iterations for the contact point on uneven roads; each reduces the error by radius times curvature
FEET = 4


@register_jitable(error_model="numpy")
def along(c, a, s, b):
    """Return c a + s b."""
    return c * a[0] + s * b[0], c * a[1] + s * b[1], c * a[2] + s * b[2]


@register_jitable(error_model="numpy")
def rotated_vector(x, m, a):
    """Return the vector A a in ground axes, for a in axes of marker m."""
    return (
        x[m, 3] * a[0] + x[m, 4] * a[1] + x[m, 5] * a[2],
        x[m, 6] * a[0] + x[m, 7] * a[1] + x[m, 8] * a[2],
        x[m, 9] * a[0] + x[m, 10] * a[1] + x[m, 11] * a[2],
    )


@register_jitable(error_model="numpy")
def turned_back(x, m, a):
    """Return the vector A.T a in axes of marker m, for a in ground axes."""
    return (
        x[m, 3] * a[0] + x[m, 6] * a[1] + x[m, 9] * a[2],
        x[m, 4] * a[0] + x[m, 7] * a[1] + x[m, 10] * a[2],
        x[m, 5] * a[0] + x[m, 8] * a[1] + x[m, 11] * a[2],
    )


@register_jitable(error_model="numpy")
def contact(x, data):
    """Return frame, geometry and velocities of the contact between the wheel of marker 1 and the road of marker 0.

    (1) centre in axes of the road; point of the road below it, with height, slopes and normal n
    (2) sin gamma = e · n; rho = h / cos gamma, with the distance h of the centre from the tangent plane there; the
        deflection is R_0 - rho. On uneven ground, the point moves to c - rho u, and (1) is repeated
    (3) velocities V_x, V_y, V_n of the rim at the contact point relative to the road, without the spin Omega e; rate
        of the deflection, exact on planes: -rho_dot = -(c_dot · n) / cos gamma - rho tan gamma gamma_dot

    Returns
    -------
    x_W, y_W, n
        Axes of the contact, each as three numbers in ground axes.
    e
        Spin axis.
    point
        Contact point, in ground axes [m].
    deflection, rho, sine, cosine
        R_0 - rho and the loaded radius rho [m]; sine and cosine of the inclination.
    V_x, V_y, Omega, deflection_rate
        Velocities [m/s], spin relative to the road [rad/s].
    left
        Distance to the nearer end of the road [m].
    """
    R_0, at = data[RADIUS], int(data[ROAD])
    e = rotated_vector(x, 1, (data[AXIS], data[AXIS + 1], data[AXIS + 2]))
    apart = x[1, 0] - x[0, 0], x[1, 1] - x[0, 1], x[1, 2] - x[0, 2]
    c = turned_back(x, 0, apart)  # in axes of the road
    e_road = turned_back(x, 0, e)
    foot_x, foot_y = c[0], c[1]
    is_centre = data[at + 4] == CENTRE
    n_feet = FEET if data[at] != 0 and not is_centre else 1
    for _ in range(n_feet):
        height, z_x, z_y, left = road_height(data, at, foot_x, foot_y)
        length = np.sqrt(1.0 + z_x * z_x + z_y * z_y)
        n = -z_x / length, -z_y / length, 1.0 / length
        if is_centre:  # the disc touches if its centre is R_0 above the height, at any slope
            h = R_0 - (R_0 + height - c[2]) / length
        else:
            h = (c[0] - foot_x) * n[0] + (c[1] - foot_y) * n[1] + (c[2] - height) * n[2]
        sine = inner_product(e_road, n)  # (2)
        cosine = np.sqrt(1.0 - sine * sine + 1e-24)
        ahead = vector_product(e_road, n)
        x_road = ahead[0] / cosine, ahead[1] / cosine, ahead[2] / cosine
        up = vector_product(x_road, e_road)
        rho = h / cosine
        foot_x, foot_y = c[0] - rho * up[0], c[1] - rho * up[1]
    x_W, normal, u = rotated_vector(x, 0, x_road), rotated_vector(x, 0, n), rotated_vector(x, 0, up)
    y_W = vector_product(normal, x_W)
    point = x[1, 0] - rho * u[0], x[1, 1] - rho * u[1], x[1, 2] - rho * u[2]
    arm = -rho * u[0], -rho * u[1], -rho * u[2]  # (3)
    omega_a = x[0, 15], x[0, 16], x[0, 17]
    omega_b = x[1, 15], x[1, 16], x[1, 17]
    relative = along(1.0, omega_b, -1.0, omega_a)
    Omega = inner_product(relative, e)
    road = vector_product(omega_a, (point[0] - x[0, 0], point[1] - x[0, 1], point[2] - x[0, 2]))
    rim = vector_product(along(1.0, omega_b, -Omega, e), arm)
    V = (
        x[1, 12] + rim[0] - x[0, 12] - road[0],
        x[1, 13] + rim[1] - x[0, 13] - road[1],
        x[1, 14] + rim[2] - x[0, 14] - road[2],
    )
    rate = -inner_product(V, normal) / cosine
    V_x, V_y = inner_product(V, x_W), inner_product(V, y_W)
    return x_W, y_W, normal, e, point, R_0 - rho, rho, sine, cosine, V_x, V_y, Omega, rate, left


@register_jitable(error_model="numpy")
def grip_at(x, data, point):
    """Return the friction factor of the road at a contact point, given in ground axes."""
    along_road = turned_back(x, 0, (point[0] - x[0, 0], point[1] - x[0, 1], point[2] - x[0, 2]))
    return road_grip(data, int(data[ROAD]), along_road[0])


@register_jitable(error_model="numpy")
def moved(x, data):
    """Return the displacement of a standing wheel since assembly: along x, along y, rotations about its axis and x.

    In axes of the road, for small motions: the rotation is half the skew-symmetric part of the relative rotation
    matrix.
    """
    axis = data[AXIS], data[AXIS + 1], data[AXIS + 2]
    c = turned_back(x, 0, (x[1, 0] - x[0, 0], x[1, 1] - x[0, 1], x[1, 2] - x[0, 2]))
    gone = c[0] - data[CENTRE_AT], c[1] - data[CENTRE_AT + 1], c[2] - data[CENTRE_AT + 2]
    e = turned_back(x, 0, rotated_vector(x, 1, axis))
    length = np.sqrt(e[0] * e[0] + e[1] * e[1])
    ahead = e[1] / length, -e[0] / length
    turn, lean = 0.0 * gone[0], 0.0 * gone[0]
    for k in range(3):  # assembled axes (columns), and the present axes
        old = data[TURN_AT + k], data[TURN_AT + 3 + k], data[TURN_AT + 6 + k]
        new = turned_back(x, 0, (x[1, 3 + k], x[1, 6 + k], x[1, 9 + k]))
        half = vector_product(old, new)
        turn += 0.5 * inner_product(half, e)
        lean += 0.5 * (half[0] * ahead[0] + half[1] * ahead[1])
    return gone[0] * ahead[0] + gone[1] * ahead[1], -gone[0] * ahead[1] + gone[1] * ahead[0], turn, lean


@register_jitable(error_model="numpy")
def touching(data, deflection):
    """Return the landing factor s² (3 - 2 s) with s = d / landing depth: 0 in the air, 1 beyond the landing depth.

    Damping and tread forces are multiplied by it. They build up without a jump, so that a step in which a wheel lands
    has a solution.
    """
    s = deflection / data[LANDING]
    if s.real <= 0.0:
        return 0.0 * s
    if s.real >= 1.0:
        return 1.0 + 0.0 * s
    return s * s * (3.0 - 2.0 * s)


@register_jitable(error_model="numpy")
def normal_force(data, deflection, landed, rate, cosine, spring):
    """Return F_z = (f(d) + c s d_dot) / cos gamma for d > 0, at least 0, with the landing factor s.

    The spring acts in the plane of the wheel. Divided by cos gamma, the normal force does the same work as the spring.
    """
    if deflection.real <= 0.0:
        return 0.0 * deflection
    force = (spring + data[DAMPING] * landed * rate) / cosine
    return force if force.real > 0.0 else 0.0 * force


@register_jitable(error_model="numpy")
def put_wrenches(x, wrench, frame, F, M):
    """Write the contact wrench on the wheel (marker 1) and its reaction on the road (marker 0).

    Parameters
    ----------
    frame
        x_W, y_W, n and point, from `contact`.
    F, M
        Force at the contact point and moment, in axes of the contact, (3,) each [N, N m].

    Returns
    -------
    power
        Power of the wrenches on both bodies [W].
    """
    x_W, y_W, n, point = frame
    force = (
        F[0] * x_W[0] + F[1] * y_W[0] + F[2] * n[0],
        F[0] * x_W[1] + F[1] * y_W[1] + F[2] * n[1],
        F[0] * x_W[2] + F[1] * y_W[2] + F[2] * n[2],
    )
    moment = (
        M[0] * x_W[0] + M[1] * y_W[0] + M[2] * n[0],
        M[0] * x_W[1] + M[1] * y_W[1] + M[2] * n[1],
        M[0] * x_W[2] + M[1] * y_W[2] + M[2] * n[2],
    )
    power = 0.0 * force[0]
    for m in range(2):
        sign = 1.0 if m == 1 else -1.0
        arm = point[0] - x[m, 0], point[1] - x[m, 1], point[2] - x[m, 2]
        turning = vector_product(arm, force)
        for k in range(3):
            wrench[m, k] = sign * force[k]
            wrench[m, 3 + k] = sign * (moment[k] + turning[k])
            power += wrench[m, k] * x[m, 12 + k] + wrench[m, 3 + k] * x[m, 15 + k]
    return power
