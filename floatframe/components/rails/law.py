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

import numba
import numpy as np

from floatframe.components.rails.splines import basis, basis_slopes, cell

__all__ = [
    "CONTACT_OUTPUTS",
    "HEAD",
    "WHEEL_HEAD",
    "WHEEL_OUTPUTS",
    "Creepage",
    "Patch",
    "creep_force",
    "fastsim",
    "fastsim_of_flexibilities",
    "linear_creep",
    "polach",
    "saturated_creep",
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


@numba.njit(cache=True)
def along_cell(data, at, x, y):
    """Return the distance of a point ahead of the start of a cell, along the tangent at the start."""
    return (x - data[at + 1]) * np.cos(data[at + 3]) + (y - data[at + 2]) * np.sin(data[at + 3])


@numba.njit(cache=True)
def place_on_track(data, x, y):
    """Return the track at its nearest point: s, origin (x, y), heading, cant angle and its slope, curvature."""
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
    return data[at] + d, ox, oy, psi, data[at + 6] + data[at + 7] * d, k_0 + slope * d


@numba.njit(cache=True)
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


@numba.njit(cache=True)
def contact_fields(data, table, part, v, roll, sine, field):
    """Write the fields of one part at a shift v = u + r_0 roll, a sine of the roll and a sine of the yaw."""
    n_v, n_r, n_y, n_f = int(data[table]), int(data[table + 3]), int(data[table + 6]), int(data[table + 8])
    if sine.real < 0:
        sine = -sine
    i, t = cell(v, data[table + 1], data[table + 2], n_v)
    j, q = cell(roll, data[table + 4], data[table + 5], n_r)
    k, e = cell(sine, 0.0, data[table + 7], n_y)
    w_v, w_r, w_y = basis(t), basis(q), basis(e)
    for f in range(N_FIELDS):
        field[f] = 0 * v
    start = table + 9 + part * N_FIELDS
    for a in range(4):
        for b in range(4):
            w_vr = w_v[a] * w_r[b]
            at = start + (((i + a) * (n_r + 2) + j + b) * (n_y + 2) + k) * n_f
            for c in range(4):
                w = w_vr * w_y[c]
                for f in range(N_FIELDS):
                    field[f] += w * data[at + f]
                at += n_f


@numba.njit(cache=True)
def wheels_on_rails(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the wrench of all wheels of the element on its marker, see the module docstring."""
    n_parts = int(data[1])
    law, options = int(data[2]), data[3:8]
    G, mu, low_speed, damping = data[8], data[9], data[10], data[11]
    is_constraint = data[12] == 1.0
    n_w_out, n_c_out = 8, 12
    rx, ry, rz = x[0, 0], x[0, 1], x[0, 2]
    ax, ay, az = x[0, 4], x[0, 7], x[0, 10]  # the axle, to the left
    vx, vy, vz = x[0, 12], x[0, 13], x[0, 14]
    wx_, wy_, wz_ = x[0, 15], x[0, 16], x[0, 17]
    ox_, oy_, oz_ = wx_, wy_, wz_
    zero = 0 * (rx + vx + (lam[0] if is_constraint else 0.0))
    inertia = data[20]
    spin_rate = zero
    if inertia > 0:  # the body does not rotate with the wheels, whose angular velocity about the axle is a state
        spin_rate = z[0]
        more = spin_rate - (wx_ * ax + wy_ * ay + wz_ * az)
        ox_, oy_, oz_ = wx_ + more * ax, wy_ + more * ay, wz_ + more * az
    field = np.empty(N_FIELDS, dtype=x.dtype)
    energy = zero
    lost = zero
    worst = zero - 1.0
    for wheel in range(int(data[0])):
        at = N_HEAD + wheel * N_WHEEL
        side, arm, half, radius, table, u_off = (
            data[at],
            data[at + 1],
            data[at + 2],
            data[at + 3],
            int(data[at + 4]),
            data[at + 5],
        )
        wx, wy, wz = rx + arm * ax, ry + arm * ay, rz + arm * az
        s, cx, cy, psi, cant, k = place_on_track(data, wx, wy)
        c, sn = np.cos(psi), np.sin(psi)
        cc, cs = np.cos(cant), np.sin(cant)
        # t = (c, sn, 0), n = (-sn cc, c cc, -cs), b = (-sn cs, c cs, cc)
        nx, ny, nz = -sn * cc, c * cc, -cs
        bx, by, bz = -sn * cs, c * cs, cc
        dx, dy, dz = wx - cx, wy - cy, wz - data[13]
        beside = dx * nx + dy * ny + dz * nz
        signal = 0 if side > 0 else 2
        off_y, slope_y = deviation(data, signal, s)
        off_z, slope_z = deviation(data, signal + 1, s)
        stretch = 1 / (1 - k * beside)  # ds divided by the path of the wheel along the rail
        slope_y, slope_z = slope_y * stretch, slope_z * stretch
        u = side * (beside - off_y) - half
        h = dx * bx + dy * by + dz * bz - radius - off_z
        roll = side * (ax * bx + ay * by + az * bz)
        sine = -side * (ax * c + ay * sn)
        v = u + radius * roll  # the shift at the height of the rail
        speed = vx * c + vy * sn
        ahead = 1.0 if speed.real >= 0 else -1.0
        V = np.sqrt(speed * speed + low_speed * low_speed)
        first = wheel * (n_w_out + n_parts * n_c_out)
        N_all = zero
        Q = zero
        Y = zero
        wear = zero
        lift = zero
        for part in range(n_parts):
            contact_fields(data, table, part, v, roll, sine, field)
            slope = field[1]
            cos = 1 / np.sqrt(1 + slope * slope)
            sin = slope * cos
            depth = (field[0] - h) * cos
            if part == 0:
                lift = h - field[0]
            # the contact point, relative to the marker
            x_c, y_c, z_c = field[2] * sine, side * field[3], field[4]
            px = arm * ax + x_c * c + y_c * nx + z_c * bx
            py = arm * ay + x_c * sn + y_c * ny + z_c * by
            pz = arm * az + y_c * nz + z_c * bz
            ux = vx + oy_ * pz - oz_ * py
            uy = vy + oz_ * px - ox_ * pz
            uz = vz + ox_ * py - oy_ * px
            # normal of the contact (into the wheel) and the transverse direction
            mx, my, mz = bx * cos - side * nx * sin, by * cos - side * ny * sin, bz * cos - side * nz * sin
            ex, ey, ez = nx * cos + side * bx * sin, ny * cos + side * by * sin, nz * cos + side * bz * sin
            N = zero
            if is_constraint and part == 0:
                g[wheel] = h - field[0]
                N = lam[wheel] / cos
            elif depth.real > 0:
                N = np.exp(field[6]) * depth * np.sqrt(depth)
                energy += 0.4 * N * depth
                if damping > 0:
                    factor = 1 - damping * (ux * mx + uy * my + uz * mz)
                    if factor.real < 0:
                        factor = 0 * factor
                    N = N * factor
            out = first + n_w_out + part * n_c_out
            outputs[out + 1] = np.arctan(slope)
            outputs[out + 2] = field[5]
            outputs[out + 11] = depth
            if N.real <= 0:
                # a constrained wheel can also be pulled; there are no creep forces then
                if is_constraint and part == 0:
                    wrench[0, 0] += N * mx
                    wrench[0, 1] += N * my
                    wrench[0, 2] += N * mz
                    wrench[0, 3] += N * (py * mz - pz * my)
                    wrench[0, 4] += N * (pz * mx - px * mz)
                    wrench[0, 5] += N * (px * my - py * mx)
                    outputs[out] = N
                    N_all += N
                    Q += N * cos
                    Y += N * sin
                continue
            third = np.log(N) / 3
            a, b = np.exp(field[7] + third), np.exp(field[8] + third)
            xi = (ux * c + uy * sn) / V
            eta = (ux * ex + uy * ey + uz * ez) / V
            spin = (ox_ * mx + oy_ * my + oz_ * mz) / V
            c11, c22, c23, c33 = np.exp(field[9]), np.exp(field[10]), np.exp(field[11]), np.exp(field[12])
            creepage, patch = Creepage(ahead * xi, ahead * eta, spin), Patch(N, a, b, c11, c22, c23, c33, G, mu)
            fx, fy, moment = creep_force(law, creepage, patch, options, V)
            fx, fy = ahead * fx, ahead * fy
            # component of the normal force along the rail due to irregularities
            up = N * cos
            ft = fx + up * (side * slope * slope_y - slope_z)
            force_x = N * mx + ft * c + fy * ex
            force_y = N * my + ft * sn + fy * ey
            force_z = N * mz + fy * ez
            wrench[0, 0] += force_x
            wrench[0, 1] += force_y
            wrench[0, 2] += force_z
            wrench[0, 3] += py * force_z - pz * force_y + moment * mx
            wrench[0, 4] += pz * force_x - px * force_z + moment * my
            wrench[0, 5] += px * force_y - py * force_x + moment * mz
            tread = -(fx * xi + fy * eta + moment * spin)
            outputs[out] = N
            outputs[out + 3] = a
            outputs[out + 4] = b
            outputs[out + 5] = xi
            outputs[out + 6] = eta
            outputs[out + 7] = spin
            outputs[out + 8] = fx
            outputs[out + 9] = fy
            outputs[out + 10] = moment
            N_all += N
            Q += force_x * bx + force_y * by + force_z * bz
            Y -= side * (force_x * nx + force_y * ny + force_z * nz)
            wear += tread
            lost += tread * V
        outputs[first] = v
        outputs[first + 1] = N_all
        outputs[first + 2] = Q
        outputs[first + 3] = Y
        if Q.real > 1.0 or Q.real < -1.0:
            outputs[first + 4] = Y / Q
        outputs[first + 5] = wear
        outputs[first + 6] = s
        off = v - u_off
        if (lift - LIFTED).real > off.real:
            off = lift - LIFTED
        outputs[first + 7] = off
        if off.real > worst.real:
            worst = off
    last = int(data[0]) * (n_w_out + n_parts * n_c_out)
    if inertia > 0:  # the wheels take the part I Omega' a + omega x I Omega a of the moment
        about = wrench[0, 3] * ax + wrench[0, 4] * ay + wrench[0, 5] * az
        z_dot[0] = about / inertia
        momentum = inertia * spin_rate
        wrench[0, 3] -= about * ax + momentum * (wy_ * az - wz_ * ay)
        wrench[0, 4] -= about * ay + momentum * (wz_ * ax - wx_ * az)
        wrench[0, 5] -= about * az + momentum * (wx_ * ay - wy_ * ax)
        energy += 0.5 * momentum * spin_rate
    outputs[last] = worst
    outputs[last + 1] = energy
    outputs[last + 2] = lost


# creep forces of an elliptic contact: linear, linear with saturation, Polach, FASTSIM ---------------------------------
# Each is a function law(creepage, patch, options) -> (F_x, F_y, M) on the wheel; `options` are further parameters of a
# law. x points in the rolling direction, z away from the rail. Numbers may be float64 or complex128 (a step along the
# imaginary axis gives derivatives); comparisons use real parts.


class Creepage(NamedTuple):
    """Velocity of the wheel surface relative to the rail, divided by the rolling speed."""

    xi: complex  #: longitudinal
    eta: complex  #: lateral
    phi: complex  #: spin [rad/m]


class Patch(NamedTuple):
    """An elliptic contact."""

    N: complex  #: normal force [N]
    a: complex  #: semi-axis in the rolling direction [m]
    b: complex  #: the other semi-axis [m]
    c11: complex  #: Kalker's coefficients
    c22: complex
    c23: complex
    c33: complex
    G: float  #: shear modulus [Pa]
    mu: float  #: friction coefficient


SMALL = 1e-8  #: creepage below which the direction in Polach's law is smoothed


@numba.njit(cache=True)
def linear_creep(creepage, patch, options):
    """Return Kalker's linear forces, without a friction limit."""
    (xi, eta, phi), G = creepage, patch.G
    c2 = patch.a * patch.b
    c = np.sqrt(c2)
    return (
        -c2 * G * patch.c11 * xi,
        -c2 * G * (patch.c22 * eta + c * patch.c23 * phi),
        c2 * c * G * (patch.c23 * eta - c * patch.c33 * phi),
    )


@numba.njit(cache=True)
def saturated_creep(creepage, patch, options):
    """Return the linear forces, with resultant F limited to mu N (e - e²/3 + e³/27), e = F/(mu N) <= 3 (Shen 1983)."""
    fx, fy, m = linear_creep(creepage, patch, options)
    N, mu = patch.N, patch.mu
    e2 = (fx * fx + fy * fy) / (mu * mu * N * N)
    if e2.real < 1e-20:
        return fx, fy, m
    e = np.sqrt(e2)
    factor = 1 - e / 3 + e2 / 27 if e.real < 3 else 1 / e
    return fx * factor, fy * factor, m * factor


@numba.njit(cache=True)
def polach(creepage, patch, options, V):
    """Return Polach's forces (1999, 2005); options = (k_A, k_S, A, B), V the rolling speed.

    (1)  friction falls with the slip speed w = V |creepage|: mu (A + (1 - A) exp(-B w))
    (2)  eta_c = eta + phi a if its magnitude is larger, else eta;  nu_c = |(xi, eta_c)|
    (3)  e = (1/4) pi G a b C_jj nu_c/(mu N),  C_jj² = ((C11 xi)² + (C22 eta)²)/|(xi, eta)|²
    (4)  F = (2 mu N/pi) (k_A e/(1 + (k_A e)²) + atan(k_S e)), opposite to the creepage
    (5)  lateral force of spin: (9/16) a mu N K (1 + 6.3 (1 - exp(-a/b))) phi/nu_c,
         K = |e_M| (d³/3 - d²/2 + 1/6) - (1 - d²)^(3/2)/3 < 0,  d = (e_M² - 1)/(e_M² + 1),
         e_M = (8/3) G b sqrt(a b) C23 eta_c/((1 + 6.3 (1 - exp(-a/b))) mu N)
    """
    xi, eta, phi = creepage
    N, a, b, c11, c22, c23, _, G, mu = patch
    k_a, k_s, low, fall = options[0], options[1], options[2], options[3]
    eta_c = eta
    turned = eta + phi * a
    if abs(turned.real) > abs(eta.real):
        eta_c = turned
    plain2 = xi * xi + eta * eta + SMALL * SMALL
    nu = np.sqrt(plain2)
    nu_c = np.sqrt(xi * xi + eta_c * eta_c + SMALL * SMALL)
    f = mu * (low + (1 - low) * np.exp(-fall * V * nu)) * N
    c2 = ((c11 * xi) ** 2 + (c22 * eta) ** 2 + c11 * c22 * SMALL * SMALL) / plain2
    e = 0.25 * np.pi * G * a * b * np.sqrt(c2) * nu_c / f
    F = 2 * f / np.pi * (k_a * e / (1 + (k_a * e) ** 2) + np.arctan(k_s * e))
    fx = -F * xi / nu_c
    fy = -F * eta / nu_c
    shape = 1 + 6.3 * (1 - np.exp(-a / b))
    e_m = 8 / 3 * G * b * np.sqrt(a * b) * c23 * eta_c / (shape * f)
    if e_m.real < 0:
        e_m = -e_m
    d = (e_m * e_m - 1) / (e_m * e_m + 1)
    root = np.sqrt(1 - d * d + 1e-30)
    K = e_m * (d * d * d / 3 - d * d / 2 + 1 / 6) - root * root * root / 3
    fy = fy + 9 / 16 * a * f * K * shape * phi / nu_c
    return fx, fy, 0 * fx


@numba.njit(cache=True)
def fastsim_of_flexibilities(creepage, patch, flexibilities, cells):
    """Return the forces of Kalker's simplified theory (1982) with flexibilities (L1, L2, L3) [m³/N].

    The surface displacement is L times the local traction. Each of m_y strips has m_x cells; cells = (m_x, m_y). From
    the leading edge of a strip, u = x/a decreases from sqrt(1 - v²), v = y/b:

    (1)  dt_x = (xi/L1 - phi b v/L3) a du,  dt_y = (eta/L2 + phi a u/L3) a du  without slip
    (2)  if |t| exceeds the bound mu p, p = 2 N (1 - u² - v²)/(pi a b), it is reduced to the bound
    (3)  force = sum of t over cells of equal width in their strip, with the tractions at their middle
    """
    (xi, eta, phi), (L1, L2, L3), (m_x, m_y) = creepage, flexibilities, cells
    N, a, b, mu = patch.N, patch.a, patch.b, patch.mu
    fx = 0 * (xi + N)
    fy = 0 * (xi + N)
    m = 0 * (xi + N)
    bound_0 = 2 * mu * N / (np.pi * a * b)
    gx, gx_v = xi / L1 * a, phi * b / L3 * a
    gy, gy_u = eta / L2 * a, phi * a / L3 * a
    dv = 2.0 / m_y
    for j in range(m_y):
        v = -1 + (j + 0.5) * dv
        edge = np.sqrt(1 - v * v)
        du = 2 * edge / m_x
        tx = 0 * fx
        ty = 0 * fx
        sx = 0 * fx
        sy = 0 * fx
        sm = 0 * fx
        for i in range(m_x):
            u = edge - (i + 0.5) * du
            step = du if i > 0 else 0.5 * du
            middle = u + 0.5 * step
            tx = tx - (gx - gx_v * v) * step
            ty = ty - (gy + gy_u * middle) * step
            bound = bound_0 * (1 - u * u - v * v)
            t2 = tx * tx + ty * ty
            if t2.real > (bound * bound).real:
                cut = bound / np.sqrt(t2)
                tx = tx * cut
                ty = ty * cut
            sx = sx + tx
            sy = sy + ty
            sm = sm + a * u * ty - b * v * tx
        cell = a * b * du * dv
        fx = fx + sx * cell
        fy = fy + sy * cell
        m = m + sm * cell
    return fx, fy, m


@numba.njit(cache=True)
def fastsim(creepage, patch, options):
    """Return FASTSIM's forces with flexibilities from the linear coefficients; options = (cells along, strips).

    L1 = 8 a/(3 G C11), L2 = 8 a/(3 G C22), L3 = pi a sqrt(a/b)/(4 G C23): forces at vanishing creepage are the linear
    ones.
    """
    a, G = patch.a, patch.G
    L1 = 8 * a / (3 * G * patch.c11)
    L2 = 8 * a / (3 * G * patch.c22)
    L3 = np.pi * a * np.sqrt(a / patch.b) / (4 * G * patch.c23)
    cells = int(options[0].real), int(options[1].real)
    return fastsim_of_flexibilities(creepage, patch, (L1, L2, L3), cells)


@numba.njit(cache=True)
def creep_force(law, creepage, patch, options, V):
    """Return (F_x, F_y, M) at a rolling speed V, by the law with a number in `CREEP_LAWS`."""
    if law == 0:
        return linear_creep(creepage, patch, options)
    if law == 1:
        return saturated_creep(creepage, patch, options)
    if law == 2:
        return polach(creepage, patch, options, V)
    return fastsim(creepage, patch, options)
