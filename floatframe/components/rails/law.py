"""The compiled law of wheels on rails, from the motion of a marker and the data of the element to its wrench.

For each wheel, with side = +1 on the left and -1 on the right, and outward = side · left:

(1)  W = r + side c A_y, the centre of the wheel on its axle; position s on the track, with axes t, n, b
(2)  u = side (W - o)·n - half the distance of the running circles - side δy(s),  h = (W - o)·b - r_0 - δz(s),
     sin(roll) = a·b and sin(yaw) = -a·t of the outward axle a; v = u + r_0 sin(roll), the shift at the rail
(3)  contact of each part from the table; depth d = (q - h) cos(angle)
(4)  N = K d^(3/2) (1 + damping d_dot) where d > 0, or from the multiplier of 0 = h - q
(5)  at P = W + x t + side y n + z b: creepages of v + omega x (P - r), creep forces by the selected law
(6)  force N (b cos - outward sin) + F_x t + F_y e_y; moment of the force at P about the marker, and M about the normal
(7)  with a spin inertia I, the body of the marker does not rotate with the wheels: their angular velocity Omega about
    the axle is a state, I Omega' = M·a, and the body receives the remaining moment minus omega × I Omega a
"""

from typing import NamedTuple

import numpy as np

from fe_models.foundation.kernels.jit import jit
from floatframe.components.rails.creep import Creepage, Patch, creep_force
from floatframe.components.rails.splines import basis, basis_slopes, cell
from floatframe.model.elements.pairs import inner_product, vector_product

__all__ = [
    "CONTACT_OUTPUTS",
    "HEAD",
    "N_FIELDS",
    "N_HEAD",
    "N_WHEEL",
    "WHEEL_HEAD",
    "WHEEL_OUTPUTS",
    "Contact",
    "Place",
    "combined",
    "contact_fields",
    "contact_of_part",
    "deviation",
    "four_rows",
    "patch_of_contact",
    "place_of_wheel",
    "spin_of_wheels",
    "vector_sum",
    "wheels_on_rails",
]


#: parameters at the beginning of the data
HEAD = (
    "n_wheels", "n_parts", "creep", "option_0", "option_1", "option_2", "option_3", "option_4", "shear_modulus",
    "friction",
    "low_speed", "damping", "is_constraint", "height", "cells_at", "n_cells", "irregular_at", "irregular_from",
    "irregular_step", "irregular_n",
    "spin_inertia",
)  # fmt: skip
#: parameters of each wheel
WHEEL_HEAD = ("side", "arm", "half", "radius", "table_at", "u_off")
LIFTED = 0.025  #: height of a tread above its rail above which the wheel counts as derailed [m]
N_HEAD, N_WHEEL, N_FIELDS, N_CELL = len(HEAD), len(WHEEL_HEAD), 13, 8

#: outputs of each wheel, with units
WHEEL_OUTPUTS = (
    ("shift", "m"), ("N", "N"), ("Q", "N"), ("Y", "N"), ("Y_over_Q", "1"), ("wear", "N"), ("s", "m"), ("off", "m"),
)  # fmt: skip
#: outputs of each contact part of a wheel
CONTACT_OUTPUTS = (
    ("N", "N"), ("angle", "rad"), ("radius", "m"), ("a", "m"), ("b", "m"), ("xi", "1"), ("eta", "1"), ("spin", "1/m"),
    ("Fx", "N"), ("Fy", "N"), ("M", "N m"), ("depth", "m"),
)  # fmt: skip
GAUSS_X = np.polynomial.legendre.leggauss(4)[0]
GAUSS_W = np.polynomial.legendre.leggauss(4)[1]


@jit
def along_cell(data, at, x, y):
    """Return the distance of a point ahead of the start of a cell, along the tangent at the start."""
    return (x - data[at + 1]) * np.cos(data[at + 3]) + (y - data[at + 2]) * np.sin(data[at + 3])


@jit
def place_on_track(data, x, y):
    """Return the track at its nearest point: s, origin (x, y), heading, cant, curvature, first of its cell."""
    cells, n = int(data[14]), int(data[15])
    best, near = 1e300, 0
    for i in range(n):
        dx, dy = x.real - data[cells + N_CELL * i + 1], y.real - data[cells + N_CELL * i + 2]
        if dx * dx + dy * dy < best:
            best, near = dx * dx + dy * dy, i
    while near > 0 and along_cell(data, cells + N_CELL * near, x, y).real < 0:
        near -= 1
    while near < n - 1 and along_cell(data, cells + N_CELL * (near + 1), x, y).real >= 0:
        near += 1
    at = cells + N_CELL * near
    k_0, slope, psi_0 = data[at + 4], data[at + 5], data[at + 3]
    d = along_cell(data, at, x, y)
    ox = 0 * d
    oy = 0 * d
    psi = 0 * d + psi_0
    # solves (point - origin)·t = 0 by Newton's method; quadratic convergence from an error of curvature times offset
    for _ in range(4):
        ox = 0 * d + data[at + 1]
        oy = 0 * d + data[at + 2]
        for i in range(4):
            sigma = 0.5 * d * (GAUSS_X[i] + 1)
            angle = psi_0 + k_0 * sigma + 0.5 * slope * sigma * sigma
            ox = ox + 0.5 * d * GAUSS_W[i] * np.cos(angle)
            oy = oy + 0.5 * d * GAUSS_W[i] * np.sin(angle)
        psi = psi_0 + k_0 * d + 0.5 * slope * d * d
        c, s = np.cos(psi), np.sin(psi)
        ahead = (x - ox) * c + (y - oy) * s
        if k_0 == 0.0 and slope == 0.0:
            d = d + ahead
            ox, oy = ox + ahead * c, oy + ahead * s
            break
        beside = (y - oy) * c - (x - ox) * s
        k = k_0 + slope * d
        step = ahead / (1 - k * beside)
        d = d + step
        # the origin is updated with the last step
        ox, oy = ox + step * c, oy + step * s
    psi = psi_0 + k_0 * d + 0.5 * slope * d * d
    return data[at] + d, ox, oy, psi, data[at + 6] + data[at + 7] * d, k_0 + slope * d, at


@jit
def deviation(data, signal, s):
    """Return a deviation of the rails at s and its slope, for the signals left y, left z, right y, right z."""
    at, n = int(data[16]), int(data[19])
    if n == 0:
        return 0 * s, 0 * s
    i, t = cell(s, data[17], data[18], n)
    w0, w1, w2, w3 = basis(t)
    v0, v1, v2, v3 = basis_slopes(t)
    at = at + 4 * i + signal
    value = w0 * data[at] + w1 * data[at + 4] + w2 * data[at + 8] + w3 * data[at + 12]
    slope = (v0 * data[at] + v1 * data[at + 4] + v2 * data[at + 8] + v3 * data[at + 12]) / data[18]
    if (i == 0 and t.real == 0.0) or (i == n - 2 and t.real == 1.0):
        slope = 0 * slope
    return value, slope


@jit
def contact_fields(data, table, v, roll, sine, field):
    """Write the fields of all parts at a shift v = u + r_0 roll, a sine of the roll and a sine of the yaw."""
    n_v, n_r, n_y, n_f = int(data[table]), int(data[table + 3]), int(data[table + 6]), int(data[table + 8])
    if sine.real < 0:
        sine = -sine
    i, t = cell(v, data[table + 1], data[table + 2], n_v)
    j, q = cell(roll, data[table + 4], data[table + 5], n_r)
    k, e = cell(sine, 0.0, data[table + 7], n_y)
    w_v, w_r, (y_0, y_1, y_2, y_3) = basis(t), basis(q), basis(e)
    for f in range(n_f):
        field[f] = 0 * v
    for a in range(4):
        for b in range(4):
            w = w_v[a] * w_r[b]
            at = table + 9 + (((i + a) * (n_r + 2) + j + b) * (n_y + 2) + k) * n_f
            row_0, row_1, row_2, row_3 = four_rows(data, at, n_f)
            for f in range(n_f):
                field[f] += w * ((y_0 * row_0[f] + y_1 * row_1[f]) + (y_2 * row_2[f] + y_3 * row_3[f]))


@jit
def four_rows(data, at, n):
    """Return four rows of n numbers, one after the other, that begin at an index."""
    return data[at : at + n], data[at + n : at + 2 * n], data[at + 2 * n : at + 3 * n], data[at + 3 * n : at + 4 * n]


class Place(NamedTuple):
    """A wheel on the track, equations (1) and (2); vectors in ground axes."""

    s: complex  #: position on the track [m]
    cell: int  #: place of the cell of the track in the data
    t: tuple  #: axes of the track: along, to the left, up
    n: tuple
    b: tuple
    d: tuple  #: from the track to the centre of the wheel [m]
    curvature: complex  #: of the track [1/m]
    stretch: complex  #: ds divided by the path of the wheel along the rail
    along_y: complex  #: slopes of the deviations along the path of the wheel
    along_z: complex
    v: complex  #: outward shift at the height of the rail [m]
    h: complex  #: height of the wheel [m]
    roll: complex
    sine: complex  #: of the yaw


class Contact(NamedTuple):
    """A part of a wheel at its rail, equation (3); vectors in ground axes."""

    cos: complex  #: of the contact angle
    sin: complex
    depth: complex  #: [m]
    P: tuple  #: contact point, relative to the marker [m]
    m: tuple  #: normal of the contact, into the wheel
    e: tuple  #: transverse direction


@jit
def combined(x, a, y, b, z, c):
    """Return x a + y b + z c of three vectors."""
    return (
        x * a[0] + y * b[0] + z * c[0],
        x * a[1] + y * b[1] + z * c[1],
        x * a[2] + y * b[2] + z * c[2],
    )


@jit
def vector_sum(a, b):
    """Return a + b of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@jit
def place_of_wheel(data, wheel, r, axle):
    """Return the place of a wheel for the position of the marker and the direction of the axle."""
    at = N_HEAD + wheel * N_WHEEL
    side, arm, half, radius = data[at], data[at + 1], data[at + 2], data[at + 3]
    wx, wy, wz = r[0] + arm * axle[0], r[1] + arm * axle[1], r[2] + arm * axle[2]
    s, cx, cy, psi, cant, k, at_cell = place_on_track(data, wx, wy)
    c, sn = np.cos(psi), np.sin(psi)
    cc, cs = np.cos(cant), np.sin(cant)
    t, n, b = (c, sn, 0 * c), (-sn * cc, c * cc, -cs), (-sn * cs, c * cs, cc)
    d = wx - cx, wy - cy, wz - data[13]
    beside = inner_product(d, n)
    signal = 0 if side > 0 else 2
    off_y, slope_y = deviation(data, signal, s)
    off_z, slope_z = deviation(data, signal + 1, s)
    stretch = 1 / (1 - k * beside)
    h = inner_product(d, b) - radius - off_z
    roll = side * inner_product(axle, b)
    sine = -side * inner_product(axle, t)
    v = side * (beside - off_y) - half + radius * roll
    return Place(s, at_cell, t, n, b, d, k, stretch, slope_y * stretch, slope_z * stretch, v, h, roll, sine)


@jit
def contact_of_part(field, place, side, arm, axle):
    """Return the contact of a part of a wheel with these fields."""
    slope = field[1]
    cos = 1 / np.sqrt(1 + slope * slope)
    sin = slope * cos
    depth = (field[0] - place.h) * cos
    lever = combined(field[2] * place.sine, place.t, side * field[3], place.n, field[4], place.b)
    P = arm * axle[0] + lever[0], arm * axle[1] + lever[1], arm * axle[2] + lever[2]
    m = combined(cos, place.b, -side * sin, place.n, 0 * cos, place.n)
    e = combined(cos, place.n, side * sin, place.b, 0 * cos, place.n)
    return Contact(cos, sin, depth, P, m, e)


@jit
def patch_of_contact(field, N, G, mu):
    """Return the ellipse of a contact with these fields, equation (5)."""
    third = np.log(N) / 3
    a, b = np.exp(field[7] + third), np.exp(field[8] + third)
    return Patch(N, a, b, np.exp(field[9]), np.exp(field[10]), np.exp(field[11]), np.exp(field[12]), G, mu)


@jit
def spin_of_wheels(z, inertia, omega, axle):
    """Return the angular velocity of the wheels: that of the marker or, with an inertia, the state about the axle."""
    if inertia > 0:
        more = z[0] - inner_product(omega, axle)
        return omega[0] + more * axle[0], omega[1] + more * axle[1], omega[2] + more * axle[2]
    return omega


@jit
def wheels_on_rails(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the wrench of all wheels of the element on its marker, see the module docstring."""
    n_parts = int(data[1])
    law, options = int(data[2]), data[3:8]
    G, mu, low_speed, damping = data[8], data[9], data[10], data[11]
    is_constraint = data[12] == 1.0
    n_w_out, n_c_out = len(WHEEL_OUTPUTS), len(CONTACT_OUTPUTS)
    r, axle = (x[0, 0], x[0, 1], x[0, 2]), (x[0, 4], x[0, 7], x[0, 10])  # the axle, to the left
    velocity, omega = (x[0, 12], x[0, 13], x[0, 14]), (x[0, 15], x[0, 16], x[0, 17])
    inertia = data[20]
    spin = spin_of_wheels(z, inertia, omega, axle)
    zero = 0 * (r[0] + velocity[0] + (lam[0] if is_constraint else 0.0))
    fields = np.empty((n_parts, N_FIELDS), dtype=x.dtype)
    energy = zero
    lost = zero
    worst = zero - 1.0
    for wheel in range(int(data[0])):
        at = N_HEAD + wheel * N_WHEEL
        side, arm, table, u_off = data[at], data[at + 1], int(data[at + 4]), data[at + 5]
        place = place_of_wheel(data, wheel, r, axle)
        speed = inner_product(velocity, place.t)
        ahead = 1.0 if speed.real >= 0 else -1.0
        V = np.sqrt(speed * speed + low_speed * low_speed)
        first = wheel * (n_w_out + n_parts * n_c_out)
        N_all = zero
        Q = zero
        Y = zero
        wear = zero
        lift = zero
        contact_fields(data, table, place.v, place.roll, place.sine, fields.reshape(fields.size))
        for part in range(n_parts):
            field = fields[part]
            contact = contact_of_part(field, place, side, arm, axle)
            P, m, e, depth = contact.P, contact.m, contact.e, contact.depth
            slip = vector_sum(velocity, vector_product(spin, P))
            if part == 0:
                lift = place.h - field[0]
            N = zero
            if is_constraint and part == 0:
                g[wheel] = lift
                N = lam[wheel] / contact.cos
            elif depth.real > 0:
                N = np.exp(field[6]) * depth * np.sqrt(depth)
                energy += 0.4 * N * depth
                if damping > 0:
                    factor = 1 - damping * inner_product(slip, m)
                    if factor.real < 0:
                        factor = 0 * factor
                    N = N * factor
            out = first + n_w_out + part * n_c_out
            outputs[out + 1] = np.arctan(field[1])
            outputs[out + 2] = field[5]
            outputs[out + 11] = depth
            if N.real <= 0 and not (is_constraint and part == 0):
                continue
            fx, fy, moment, ft = zero, zero, zero, zero
            if N.real > 0:  # a constrained wheel can also be pulled; there are no creep forces then
                xi, eta = inner_product(slip, place.t) / V, inner_product(slip, e) / V
                phi = inner_product(spin, m) / V
                creepage, patch = Creepage(ahead * xi, ahead * eta, phi), patch_of_contact(field, N, G, mu)
                fx, fy, moment = creep_force(law, creepage, patch, options, V)
                fx, fy = ahead * fx, ahead * fy
                # component of the normal force along the rail due to irregularities
                ft = fx + N * contact.cos * (side * field[1] * place.along_y - place.along_z)
                tread = -(fx * xi + fy * eta + moment * phi)
                outputs[out + 3] = patch.a
                outputs[out + 4] = patch.b
                outputs[out + 5] = xi
                outputs[out + 6] = eta
                outputs[out + 7] = phi
                outputs[out + 8] = fx
                outputs[out + 9] = fy
                outputs[out + 10] = moment
                wear += tread
                lost += tread * V
            force = combined(N, m, ft, place.t, fy, e)
            lever = vector_product(P, force)
            for i in range(3):
                wrench[0, i] += force[i]
                wrench[0, 3 + i] += lever[i] + moment * m[i]
            outputs[out] = N
            N_all += N
            Q += inner_product(force, place.b)
            Y -= side * inner_product(force, place.n)
        outputs[first] = place.v
        outputs[first + 1] = N_all
        outputs[first + 2] = Q
        outputs[first + 3] = Y
        if Q.real > 1.0 or Q.real < -1.0:
            outputs[first + 4] = Y / Q
        outputs[first + 5] = wear
        outputs[first + 6] = place.s
        off = place.v - u_off
        if (lift - LIFTED).real > off.real:
            off = lift - LIFTED
        outputs[first + 7] = off
        if off.real > worst.real:
            worst = off
    last = int(data[0]) * (n_w_out + n_parts * n_c_out)
    if inertia > 0:  # the wheels take the part I Omega' a + omega x I Omega a of the moment
        about = wrench[0, 3] * axle[0] + wrench[0, 4] * axle[1] + wrench[0, 5] * axle[2]
        z_dot[0] = about / inertia
        momentum = inertia * z[0]
        gyroscopic = vector_product(omega, axle)
        for i in range(3):
            wrench[0, 3 + i] -= about * axle[i] + momentum * gyroscopic[i]
        energy += 0.5 * momentum * z[0]
    outputs[last] = worst
    outputs[last + 1] = energy
    outputs[last + 2] = lost
