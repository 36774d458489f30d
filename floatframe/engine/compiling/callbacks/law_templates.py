"""C functions of the law of an element: its values, and its derivatives by complex steps or by differences.

    void f(const int64 *head, const double *inputs, const double *data, double *outputs)

head: the number of markers n, of values in the motion of a marker, of states, multipliers, outputs and data; the
markers on moving bodies as bits; 0.
inputs: t, motions, states, multipliers.
data: numbers of the law. For derivatives by differences, typical sizes of the inputs follow: of positions, velocities,
angular velocities, accelerations, angular accelerations, of each state and each multiplier (0: unknown).
outputs: wrenches, rates of states, constraints, outputs of the element. For derivatives: the derivatives of all these
but the last, row by row, by dr, dphi, dv, domega of each marker, states, multipliers. If the law depends on
accelerations, da and dalpha follow domega.

`law_functions` fills in the templates: `law` stands for the function of the user. With the lean compiler, `carray` and
`new_vector` come from `kernels/compiler/law.py`.
"""

import numpy as np
from numba import carray
from numba.extending import register_jitable

__all__ = ["complex_template", "difference_template", "given_template", "value_template"]

HEAD = 8
TINY = 1e-30  # step along the imaginary axis
STEP = 1e-6  # step of central differences, relative to the sizes of the inputs
SIZES = 5  # sizes of motions; those of states follow
LEAST = 1e-3  # size of states and multipliers if no other is known
ROUNDING = 2e-15  # fraction of a number below which a step is lost in roundoff


def law(*arguments):
    """Placeholder that the user's function replaces."""


@register_jitable
def new_vector(kind, n):
    """Return a new vector of numbers."""
    return np.empty(n, kind)


def value_template(digest):
    """Return the C function of the values of a law."""

    def value(head_at, inputs_at, data_at, outputs_at):
        head = carray(head_at, HEAD)
        n, width, n_z, n_lam, n_seen, n_data = head[0], head[1], head[2], head[3], head[4], head[5]
        o = 1 + n * width
        inputs = carray(inputs_at, o + n_z + n_lam)
        n_out = 6 * n + n_z + n_lam
        out = carray(outputs_at, n_out + n_seen)
        out[:] = 0.0 if digest else 1.0
        x = inputs[1:o].reshape((n, width))
        wrench = out[: 6 * n].reshape((n, 6))
        law(
            inputs[0], x, inputs[o : o + n_z], inputs[o + n_z :], carray(data_at, n_data), wrench,
            out[6 * n : 6 * n + n_z], out[6 * n + n_z : n_out], out[n_out:],
        )  # fmt: skip

    return value


def given_template(digest):
    """Return the C function of the derivatives for a law whose derivatives the user provides."""

    def slopes(head_at, inputs_at, data_at, slopes_at):
        head = carray(head_at, HEAD)
        n, width, n_z, n_lam, n_data = head[0], head[1], head[2], head[3], head[5]
        o = 1 + n * width
        inputs = carray(inputs_at, o + n_z + n_lam)
        own = carray(slopes_at, (6 * n + n_z + n_lam, (width - 6) * n + n_z + n_lam))
        own[:, :] = 0.0 if digest else 1.0
        x = inputs[1:o].reshape((n, width))
        law(inputs[0], x, inputs[o : o + n_z], inputs[o + n_z :], carray(data_at, n_data), own)

    return slopes


def complex_template(digest):
    """Return the C function that computes the derivatives by complex steps."""

    def slopes(head_at, inputs_at, data_at, slopes_at):
        head = carray(head_at, HEAD)
        n, width, n_z, n_lam, n_seen, n_data, moving = head[0], head[1], head[2], head[3], head[4], head[5], head[6]
        o = 1 + n * width
        inputs = carray(inputs_at, o + n_z + n_lam)
        n_out, per = 6 * n + n_z + n_lam, width - 6
        n_columns = per * n + n_z + n_lam
        own = carray(slopes_at, (n_out, n_columns))
        own[:, :] = 0.0 if digest else 1.0
        data = carray(data_at, n_data)
        y = new_vector(np.complex128, o - 1 + n_z + n_lam)
        for k in range(y.shape[0]):
            y[k] = inputs[1 + k]
        out = new_vector(np.complex128, n_out + n_seen)
        x = y[: o - 1].reshape((n, width))
        z, lam = y[o - 1 : o - 1 + n_z], y[o - 1 + n_z :]
        wrench, z_dot, g = out[: 6 * n].reshape((n, 6)), out[6 * n : 6 * n + n_z], out[6 * n + n_z : n_out]
        for k in range(n_columns):
            m, j = k // per, k % per
            if m < n:
                if not (moving >> m) & 1:
                    continue
                first = 1 + m * width
                if j < 3:
                    x[m, j] += TINY * 1j
                elif j < 6:  # dA = dphi × A, column by column
                    b, c = (j - 2) % 3, (j - 1) % 3
                    for i in range(3):
                        x[m, 3 + 3 * b + i] -= TINY * inputs[first + 3 + 3 * c + i] * 1j
                        x[m, 3 + 3 * c + i] += TINY * inputs[first + 3 + 3 * b + i] * 1j
                else:
                    x[m, 6 + j] += TINY * 1j
            else:
                y[o - 1 + k - per * n] += TINY * 1j
            for i in range(out.shape[0]):
                out[i] = 0.0
            law(inputs[0], x, z, lam, data, wrench, z_dot, g, out[n_out:])
            for i in range(n_out):
                own[i, k] = out[i].imag / TINY
            if m < n:
                for i in range(width):
                    x[m, i] = inputs[1 + m * width + i]
            else:
                y[o - 1 + k - per * n] = inputs[o + k - per * n]

    return slopes


def difference_template(digest):
    """Return the C function that computes the derivatives by central differences."""

    def slopes(head_at, inputs_at, data_at, slopes_at):
        head = carray(head_at, HEAD)
        n, width, n_z, n_lam, n_seen, n_data, moving = head[0], head[1], head[2], head[3], head[4], head[5], head[6]
        o = 1 + n * width
        inputs = carray(inputs_at, o + n_z + n_lam)
        n_out, per = 6 * n + n_z + n_lam, width - 6
        n_columns = per * n + n_z + n_lam
        own = carray(slopes_at, (n_out, n_columns))
        own[:, :] = 0.0 if digest else 1.0
        known = carray(data_at, n_data + SIZES + n_z + n_lam)
        data, sizes = known[:n_data], known[n_data:]
        y = new_vector(np.float64, o - 1 + n_z + n_lam)
        for k in range(y.shape[0]):
            y[k] = inputs[1 + k]
        out = new_vector(np.float64, n_out + n_seen)
        x = y[: o - 1].reshape((n, width))
        z, lam = y[o - 1 : o - 1 + n_z], y[o - 1 + n_z :]
        wrench, z_dot, g = out[: 6 * n].reshape((n, 6)), out[6 * n : 6 * n + n_z], out[6 * n + n_z : n_out]
        for k in range(n_columns):
            m, j = k // per, k % per
            if m < n and not (moving >> m) & 1:
                continue
            first = 1 + m * width
            at = o + k - per * n  # index of the input that varies
            if m < n and j < 3:
                at, size = first + j, sizes[0]
            elif m < n and j < 6:
                size = 1.0
            elif m < n:
                at, size = first + 6 + j, sizes[j // 3 - 1]
            else:
                size = sizes[SIZES + k - per * n]
                if size == 0.0:
                    size = max(abs(inputs[at]), LEAST)
            h = STEP * size
            if m >= n or j < 3 or j >= 6:
                h = max(h, ROUNDING * abs(inputs[at]))
            way = 2 * h
            for side in range(2):
                s = h if side == 0 else -h
                if m < n and 3 <= j < 6:  # A rotated by the rotation vector s e
                    b, c = (j - 2) % 3, (j - 1) % 3
                    sin, cos = np.sin(s), np.cos(s)
                    for i in range(3):
                        A_b, A_c = inputs[first + 3 + 3 * b + i], inputs[first + 3 + 3 * c + i]
                        x[m, 3 + 3 * b + i] = cos * A_b - sin * A_c
                        x[m, 3 + 3 * c + i] = sin * A_b + cos * A_c
                else:
                    y[at - 1] = inputs[at] + s
                    way = y[at - 1] - inputs[at] if side == 0 else way - (y[at - 1] - inputs[at])  # the rounded step
                out[:] = 0.0
                law(inputs[0], x, z, lam, data, wrench, z_dot, g, out[n_out:])
                for i in range(n_out):
                    own[i, k] = out[i] if side == 0 else (own[i, k] - out[i]) / way
            if m < n:
                for i in range(width):
                    x[m, i] = inputs[first + i]
            else:
                y[at - 1] = inputs[at]

    return slopes
