"""Derivatives of the law of wheels on rails by the motion of its marker, states and multipliers, in closed form.

The numbers (1) to (7) are those of `law`. Along the track its axes rotate by its curvature k, and by the slope c' of
its cant angle c: t' = k (cos c n + sin c b), n' = -k cos c t - c' b, b' = -k sin c t + c' n. At the nearest point
ds = t·dW/(1 - k beside), with the distance beside the track in the horizontal plane.
"""

from typing import NamedTuple

import numpy as np

from fe_models.foundation.kernels.jit import jit
from floatframe.components.rails.creep import N_CREEP_INPUTS, Creepage, creep_slopes
from floatframe.components.rails.law import (
    N_FIELDS,
    N_HEAD,
    N_WHEEL,
    Contact,
    combined,
    contact_fields,
    contact_of_part,
    four_rows,
    patch_of_contact,
    place_of_wheel,
    spin_of_wheels,
    vector_sum,
)
from floatframe.components.rails.splines import basis, basis_curvatures, basis_slopes, cell, cell_slope
from floatframe.model.elements.pairs import inner_product, vector_product

__all__ = ["tangent_of_wheels"]


class Step(NamedTuple):
    """A change of the inputs of the law."""

    r: tuple  #: of the marker
    axle: tuple
    velocity: tuple
    omega: tuple
    spin: float  #: of the state
    wheel: int  #: the wheel whose multiplier changes by one, or below zero


@jit
def unit_step(axle, column, n_states):
    """Return the change of the inputs for a unit change of variable `column`."""
    kind, i = column // 3, column % 3
    e, zero = (1.0 if i == 0 else 0.0, 1.0 if i == 1 else 0.0, 1.0 if i == 2 else 0.0), (0.0, 0.0, 0.0)
    turned = vector_product(e, axle)
    spin = 1.0 if 12 <= column < 12 + n_states else 0.0
    return Step(
        e if kind == 0 else zero,
        turned if kind == 1 else zero,
        e if kind == 2 else zero,
        e if kind == 3 else zero,
        spin,
        column - 12 - n_states,
    )


@jit
def deviation_curvature(data, signal, s):
    """Return the second derivative of a deviation of the rails at s."""
    at, n = int(data[16]), int(data[19])
    if n == 0:
        return 0.0
    i, t = cell(s, data[17], data[18], n)
    w0, w1, w2, w3 = basis_curvatures(t)
    at = at + 4 * i + signal
    per = cell_slope(s, data[17], data[18], n)
    return (w0 * data[at] + w1 * data[at + 4] + w2 * data[at + 8] + w3 * data[at + 12]) * per * per


@jit
def contact_field_slopes(data, table, v, roll, sine, by_v, by_roll, by_sine):
    """Write the derivatives of `contact_fields` by shift, roll and sine of the yaw."""
    n_v, n_r, n_y, n_f = int(data[table]), int(data[table + 3]), int(data[table + 6]), int(data[table + 8])
    sign = 1.0 if sine >= 0 else -1.0
    i, t = cell(v, data[table + 1], data[table + 2], n_v)
    j, q = cell(roll, data[table + 4], data[table + 5], n_r)
    k, e = cell(sign * sine, 0.0, data[table + 7], n_y)
    per_v = cell_slope(v, data[table + 1], data[table + 2], n_v)
    per_r = cell_slope(roll, data[table + 4], data[table + 5], n_r)
    per_y = sign * cell_slope(sign * sine, 0.0, data[table + 7], n_y)
    w_v, w_r, (y_0, y_1, y_2, y_3) = basis(t), basis(q), basis(e)
    d_v, d_r, (z_0, z_1, z_2, z_3) = basis_slopes(t), basis_slopes(q), basis_slopes(e)
    by_v[:], by_roll[:], by_sine[:] = 0.0, 0.0, 0.0
    for a in range(4):
        for b in range(4):
            x, y, z = per_v * d_v[a] * w_r[b], per_r * w_v[a] * d_r[b], per_y * w_v[a] * w_r[b]
            at = table + 9 + (((i + a) * (n_r + 2) + j + b) * (n_y + 2) + k) * n_f
            row_0, row_1, row_2, row_3 = four_rows(data, at, n_f)
            for f in range(n_f):
                value = (y_0 * row_0[f] + y_1 * row_1[f]) + (y_2 * row_2[f] + y_3 * row_3[f])
                by_v[f] += x * value
                by_roll[f] += y * value
            for f in range(n_f):
                by_sine[f] += z * ((z_0 * row_0[f] + z_1 * row_1[f]) + (z_2 * row_2[f] + z_3 * row_3[f]))


class PlaceStep(NamedTuple):
    """The change of a `Place`, but for what the contact does not read."""

    t: tuple
    n: tuple
    b: tuple
    along_y: float
    along_z: float
    v: float
    h: float
    roll: float
    sine: float


@jit
def place_step(data, wheel, place, axle, step):
    """Return the change of the place of a wheel, equations (1) and (2)."""
    at = N_HEAD + wheel * N_WHEEL
    side, arm, radius = data[at], data[at + 1], data[at + 3]
    t, n, b, d, k = place.t, place.n, place.b, place.d, place.curvature
    cos_cant, sin_cant = b[2], -n[2]
    cant, turning = data[place.cell + 7], data[place.cell + 5]
    centre = step.r[0] + arm * step.axle[0], step.r[1] + arm * step.axle[1], step.r[2] + arm * step.axle[2]
    beside = d[1] * t[0] - d[0] * t[1]
    ds = inner_product(centre, t) / (1 - k * beside)
    dt = combined(ds * k * cos_cant, n, ds * k * sin_cant, b, 0.0, t)
    dn = combined(-ds * k * cos_cant, t, -ds * cant, b, 0.0, n)
    db = combined(-ds * k * sin_cant, t, ds * cant, n, 0.0, b)
    moved = combined(1.0, centre, -ds, t, 0.0, t)
    by_n = inner_product(moved, n) + inner_product(d, dn)
    by_b = inner_product(moved, b) + inner_product(d, db)
    signal = 0 if side > 0 else 2
    stretch = place.stretch
    by_stretch = stretch * (turning * ds * inner_product(d, n) + k * by_n)  # the change of stretch over stretch
    along_y = deviation_curvature(data, signal, place.s) * stretch * ds + place.along_y * by_stretch
    along_z = deviation_curvature(data, signal + 1, place.s) * stretch * ds + place.along_z * by_stretch
    roll = side * (inner_product(step.axle, b) + inner_product(axle, db))
    sine = -side * (inner_product(step.axle, t) + inner_product(axle, dt))
    v = side * (by_n - place.along_y / stretch * ds) + radius * roll
    return PlaceStep(dt, dn, db, along_y, along_z, v, by_b - place.along_z / stretch * ds, roll, sine)


@jit
def contact_step(field, fields, place, moved, contact, side, arm, step):
    """Return the change of a `Contact`, equation (3), for changes `fields` of the fields and `moved` of the place."""
    cos, sin = contact.cos, contact.sin
    d_cos, d_sin = -sin * cos * cos * fields[1], cos * cos * cos * fields[1]
    depth = (fields[0] - moved.h) * cos + (field[0] - place.h) * d_cos
    along = fields[2] * place.sine + field[2] * moved.sine
    lever = vector_sum(
        combined(along, place.t, side * fields[3], place.n, fields[4], place.b),
        combined(field[2] * place.sine, moved.t, side * field[3], moved.n, field[4], moved.b),
    )
    P = lever[0] + arm * step.axle[0], lever[1] + arm * step.axle[1], lever[2] + arm * step.axle[2]
    m = vector_sum(
        combined(d_cos, place.b, -side * d_sin, place.n, cos, moved.b), combined(-side * sin, moved.n, 0, P, 0, P)
    )
    e = vector_sum(
        combined(d_cos, place.n, side * d_sin, place.b, cos, moved.n), combined(side * sin, moved.b, 0, P, 0, P)
    )
    return Contact(d_cos, d_sin, depth, P, m, e)


@jit
def spin_step(z, inertia, omega, axle, step):
    """Return the change of the angular velocity of the wheels."""
    if inertia > 0:
        more = z[0] - inner_product(omega, axle)
        change = step.spin - inner_product(step.omega, axle) - inner_product(omega, step.axle)
        return vector_sum(step.omega, combined(change, axle, more, step.axle, 0.0, axle))
    return step.omega


@jit
def creep_slopes_of_contact(patch, by_place, by_inputs, slopes):
    """Write the derivatives of creep forces by xi, eta, phi, N, V, shift, roll and sine of the yaw, (3, 8).

    by_inputs are those by the inputs of `creep_force`. Of these the semi-axes change with the cube root of N, and they
    and Kalker's coefficients with the fields, their logarithms, whose derivatives are by_place.
    """
    numbers = patch.a, patch.b, patch.c11, patch.c22, patch.c23, patch.c33
    for r in range(3):
        slopes[r, 0], slopes[r, 1], slopes[r, 2] = by_inputs[r, 0], by_inputs[r, 1], by_inputs[r, 2]
        of_axes = by_inputs[r, 4] * patch.a + by_inputs[r, 5] * patch.b
        slopes[r, 3], slopes[r, 4] = by_inputs[r, 3] + of_axes / (3 * patch.N), by_inputs[r, 10]
        for p in range(3):
            total = 0.0
            for k in range(4, 10):
                total += by_inputs[r, k] * numbers[k - 4] * by_place[p][k + 3]
            slopes[r, 5 + p] = total


@jit
def tangent_of_wheels(t, x, z, lam, data, slopes):
    """Write the derivatives of `law.wheels_on_rails`: a tangent, see `floatframe.model.elements.element`."""
    law, options, inertia, n_states = int(data[2]), data[3:8], data[20], z.shape[0]
    G, mu, low_speed, damping = data[8], data[9], data[10], data[11]
    r, axle = (x[0, 0], x[0, 1], x[0, 2]), (x[0, 4], x[0, 7], x[0, 10])
    velocity, omega = (x[0, 12], x[0, 13], x[0, 14]), (x[0, 15], x[0, 16], x[0, 17])
    spin = spin_of_wheels(z, inertia, omega, axle)
    n_parts = int(data[1])
    all_fields, fields = np.empty((n_parts, N_FIELDS)), np.empty(N_FIELDS)  # values, and their change by a step
    by_v, by_roll, by_sine = np.empty(all_fields.shape), np.empty(all_fields.shape), np.empty(all_fields.shape)
    by_inputs, of_creep = np.empty((3, N_CREEP_INPUTS)), np.zeros((3, 8))
    M = (0.0, 0.0, 0.0)  # moment of all wheels on the marker
    for wheel in range(int(data[0])):
        at = N_HEAD + wheel * N_WHEEL
        side, arm, table = data[at], data[at + 1], int(data[at + 4])
        place = place_of_wheel(data, wheel, r, axle)
        speed = inner_product(velocity, place.t)
        ahead = 1.0 if speed >= 0 else -1.0
        V = np.sqrt(speed * speed + low_speed * low_speed)
        contact_fields(data, table, place.v, place.roll, place.sine, all_fields.reshape(all_fields.size))
        contact_field_slopes(
            data, table, place.v, place.roll, place.sine,
            by_v.reshape(by_v.size), by_roll.reshape(by_v.size), by_sine.reshape(by_v.size),
        )  # fmt: skip
        for part in range(n_parts):
            is_held, field = data[12] == 1.0 and part == 0, all_fields[part]
            by_place = by_v[part], by_roll[part], by_sine[part]
            contact = contact_of_part(field, place, side, arm, axle)
            if not is_held and contact.depth <= 0:
                continue
            P, m, e, cos = contact.P, contact.m, contact.e, contact.cos
            slip = vector_sum(velocity, vector_product(spin, P))
            elastic, factor = 0.0, 1.0  # (4): N = elastic factor
            if is_held:
                N = lam[wheel] / cos
            else:
                elastic = np.exp(field[6]) * contact.depth * np.sqrt(contact.depth)
                if damping > 0:
                    factor = 1 - damping * inner_product(slip, m)
                N = elastic * factor
                if N <= 0:
                    continue
            # (5)
            xi, eta = inner_product(slip, place.t) / V, inner_product(slip, e) / V
            phi = inner_product(spin, m) / V
            fx, fy, moment, uphill = 0.0, 0.0, 0.0, 0.0
            if N > 0:
                creepage, patch = Creepage(ahead * xi, ahead * eta, phi), patch_of_contact(field, N, G, mu)
                fx, fy, moment = creep_slopes(law, creepage, patch, options, V, by_inputs)
                fx, fy = ahead * fx, ahead * fy
                creep_slopes_of_contact(patch, by_place, by_inputs, of_creep)
                uphill = side * field[1] * place.along_y - place.along_z
            else:
                of_creep[:, :] = 0.0
            force = combined(N, m, fx + N * cos * uphill, place.t, fy, e)
            lever = vector_product(P, force)
            M = vector_sum(M, combined(1.0, lever, moment, m, 0.0, m))
            for column in range(slopes.shape[1]):
                step = unit_step(axle, column, n_states)
                moved = place_step(data, wheel, place, axle, step)
                for f in range(N_FIELDS):
                    fields[f] = by_place[0][f] * moved.v + by_place[1][f] * moved.roll + by_place[2][f] * moved.sine
                change = contact_step(field, fields, place, moved, contact, side, arm, step)
                turning = spin_step(z, inertia, omega, axle, step)
                slipping = vector_sum(vector_product(turning, P), vector_product(spin, change.P))
                slipping = vector_sum(step.velocity, slipping)
                if is_held:
                    slopes[6 + n_states + wheel, column] = moved.h - fields[0]
                    dN = ((1.0 if step.wheel == wheel else 0.0) - N * change.cos) / cos
                else:
                    dN = N * fields[6] + 1.5 * N / contact.depth * change.depth
                    if damping > 0:
                        dN -= elastic * damping * (inner_product(slipping, m) + inner_product(slip, change.m))
                dfx, dfy, d_moment, d_uphill = 0.0, 0.0, 0.0, 0.0
                if N > 0:
                    dV = speed / V * (inner_product(step.velocity, place.t) + inner_product(velocity, moved.t))
                    d_xi = (inner_product(slipping, place.t) + inner_product(slip, moved.t) - xi * dV) / V
                    d_eta = (inner_product(slipping, e) + inner_product(slip, change.e) - eta * dV) / V
                    d_phi = (inner_product(turning, m) + inner_product(spin, change.m) - phi * dV) / V
                    by = ahead * d_xi, ahead * d_eta, d_phi, dN, dV, moved.v, moved.roll, moved.sine
                    for k in range(8):
                        dfx += ahead * of_creep[0, k] * by[k]
                        dfy += ahead * of_creep[1, k] * by[k]
                        d_moment += of_creep[2, k] * by[k]
                    d_uphill = side * (fields[1] * place.along_y + field[1] * moved.along_y) - moved.along_z
                # (6)
                along = dfx + (dN * cos + N * change.cos) * uphill + N * cos * d_uphill
                d_force = vector_sum(
                    combined(dN, m, along, place.t, dfy, e),
                    combined(N, change.m, fx + N * cos * uphill, moved.t, fy, change.e),
                )
                d_lever = vector_sum(vector_product(change.P, force), vector_product(P, d_force))
                d_lever = vector_sum(d_lever, combined(d_moment, m, moment, change.m, 0.0, m))
                for i in range(3):
                    slopes[i, column] += d_force[i]
                    slopes[3 + i, column] += d_lever[i]
    if inertia > 0:  # (7)
        about, momentum, gyroscopic = inner_product(M, axle), inertia * z[0], vector_product(omega, axle)
        for column in range(slopes.shape[1]):
            step = unit_step(axle, column, n_states)
            dM = slopes[3, column], slopes[4, column], slopes[5, column]
            by = inner_product(dM, axle) + inner_product(M, step.axle)
            turned = vector_sum(vector_product(step.omega, axle), vector_product(omega, step.axle))
            carried = combined(momentum, turned, inertia * step.spin, gyroscopic, about, step.axle)
            slopes[6, column] = by / inertia
            for i in range(3):
                slopes[3 + i, column] -= by * axle[i] + carried[i]
