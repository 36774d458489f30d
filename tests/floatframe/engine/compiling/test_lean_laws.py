"""Laws of elements by the lean compiler compute the same as by plain numba, to the last bit, or are left to it."""

import logging
import math
import sys

import numpy as np
import pytest
from numba import njit
from numba.core.runtime import _nrt_python
from numba.core.runtime.nrt import rtsys
from numba.extending import register_jitable
from numpy.testing import assert_allclose, assert_array_equal

from floatframe.engine.compiling.callbacks.law_functions import (
    c_function,
    callback,
    called_law,
    filled,
    lean_c_function,
)
from floatframe.engine.compiling.callbacks.law_source import digest_of
from floatframe.engine.compiling.callbacks.law_templates import complex_template, difference_template, value_template
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.compiler.choice import is_lean
from floatframe.model.rotations import rotation_exp
from tests.floatframe.engine.structure_preserving.element_parts import ELEMENT_PARTS

pytestmark = pytest.mark.skipif(not is_lean, reason="plain numba compiles all")

MARKERS, WIDTH, STATES, MULTIPLIERS, OUTPUTS, NUMBERS = 2, 18, 2, 1, 3, 7
HEAD = (MARKERS, WIDTH, STATES, MULTIPLIERS, OUTPUTS, NUMBERS, 3, 0)


@njit
def indices_from_the_end(t, x, z, lam, data, wrench, z_dot, g, outputs):
    for k in range(-3, 0):
        wrench[-1, k] = x[k + 1, k] * data[k]
    z_dot[-1], outputs[-1] = z[-2], x[-1][-2]


@njit
def slices(t, x, z, lam, data, wrench, z_dot, g, outputs):
    for k in range(-9, 10):
        for part in (data[k:], data[:k], data[2:k], data[k:-2]):
            outputs[0] += part.shape[0]
            for value in part:
                outputs[1] = 0.5 * outputs[1] + value
    wrench[0, :3] = x[1, 3:6]
    wrench[1, -2:] = z
    wrench[0, 3:] = data[::3]
    row = x[0].reshape(6, -1)
    outputs[2] = row[2, 1] + row.shape[1]


@njit
def whole_arrays(t, x, z, lam, data, wrench, z_dot, g, outputs):
    A = x[1, 3:12].reshape((3, 3))
    force = np.zeros(3, x.dtype)
    for k in range(3):
        force[k] = z[0] * data[k]
    wrench[1, :3] = A @ force + 2.0 * np.cross(force, x[1, :3])
    wrench[0, :3] -= x[0, :3].copy()
    z_dot[:] = np.array([z[1], -z[0]])


@njit
def divided(x, y=2.0, scale=(1.0, 3.0)):
    return (x / y - y / (x + 10.0)) * scale[1]


@register_jitable
def kinked(x, *more):
    if x.real > 0.0:
        return x * more[0]
    return more[1] - x


def of_factor(factor):
    @njit
    def scaled(x):
        return factor * x

    return scaled


tripled = of_factor(3.0)


@njit
def functions_of_its_own(t, x, z, lam, data, wrench, z_dot, g, outputs):
    for k in range(6):
        y = x[0, k]
        wrench[0, k] = divided(y) + divided(y, scale=(0.0, data[k]), y=3.0) + kinked(y, 2.0, data[1])
        wrench[1, k] = tripled(np.sin(y)) - np.sqrt(y * y + 1.0) ** 3 + np.arctan(y) * math.pi
    g[0] = lam[0] - np.exp(-x[0, 1] * x[0, 1]) * math.cos(t)


@njit
def whole_and_complex_numbers(t, x, z, lam, data, wrench, z_dot, g, outputs):
    for k in range(-7, 8):
        outputs[0] = 0.5 * outputs[0] + k // 2 + k % 3 - k * (k - 4)
    product = (x[0, 0] + 2j) * (data[0] - 1j) - 3j * data[1]
    wrench[0, 0], wrench[0, 1] = product.real * outputs[0], product.imag


@njit
def doubled(x):
    return 2.0 * x


@njit
def array_of_another(t, x, z, lam, data, wrench, z_dot, g, outputs):
    wrench[0, 0] = doubled(data)[1]


@njit
def checked(x):
    if x.real > 0.0:
        raise ValueError
    return 2.0 * x


@njit
def errors(t, x, z, lam, data, wrench, z_dot, g, outputs):
    wrench[0, 0] = 1.0 * x[0, 1]
    wrench[0, 1] = checked(x[0, 0])
    wrench[0, 2] = 1.0 * x[0, 1]


ALL = (value_template, complex_template)
CONSTRUCTS = {
    indices_from_the_end: (*ALL, difference_template),
    slices: (value_template,),
    whole_arrays: (complex_template,),
    functions_of_its_own: ALL,
    whole_and_complex_numbers: (value_template,),
}
N_OUT = 6 * MARKERS + STATES + MULTIPLIERS
SIZES = {value_template: N_OUT + OUTPUTS} | dict.fromkeys(
    (complex_template, difference_template), N_OUT * (12 * MARKERS + STATES + MULTIPLIERS)
)
SHORT = ("friction.bristles",)
OTHERS = [name for name in ELEMENT_PARTS if name not in SHORT]


def motions(head, rng, start=None):
    """Return inputs of a law: markers in all places and directions, fast and slow."""
    n, width, n_z, n_lam = head[:4]
    rows = []
    for _ in range(24):
        row = [rng.uniform()]
        for _ in range(n):
            A = rotation_exp(10.0 ** -rng.integers(3) * rng.normal(size=3))
            rates = 10.0 ** rng.integers(-2, 2) * rng.normal(size=width - 12)
            row += [*(10.0 ** -rng.integers(4) * rng.normal(size=3)), *A.ravel(), *rates]
        size = np.ones(n_z) if start is None else np.maximum(np.abs(start), 0.1)
        row += [*(0.1 * size * rng.normal(size=n_z) + (0.0 if start is None else start)), *rng.normal(size=n_lam)]
        rows.append(row)
    return np.array(rows)


def outputs_of(whole, template, head, data, inputs):
    """Return what a C function writes."""
    n, width, n_z, n_lam, n_seen = head[:5]
    n_out = 6 * n + n_z + n_lam
    size = n_out + n_seen if template is value_template else n_out * ((width - 6) * n + n_z + n_lam)
    return called_law(int(whole.address), head, np.array([*data, *np.ones(5 + n_z + n_lam)]), inputs, size)


def assert_same(function, template, head, data, inputs):
    """Compare the lean compiler with plain numba, to the last bit."""
    lean, plain = lean_c_function("law", function, template, None), c_function(filled(template, function, 1), False)
    assert lean is not None
    ours, theirs = (outputs_of(whole, template, head, data, inputs) for whole in (lean, plain))
    assert_array_equal(ours, theirs)
    assert np.abs(ours).max() > 0.0


@pytest.mark.parametrize("function", CONSTRUCTS)
def test_constructs_of_python_mean_the_same(function):
    rng = np.random.default_rng(1)
    data, inputs = rng.normal(size=NUMBERS), motions(HEAD, rng)
    for template in CONSTRUCTS[function]:
        lean = lean_c_function("law", function, template, None)
        assert lean is not None
        ours, python = outputs_of(lean, template, HEAD, data, inputs), np.zeros((len(inputs), SIZES[template]))
        made = filled(template, function.py_func, 1)
        made.__globals__["carray"] = lambda array, shape: array[: np.prod(shape)].reshape(shape)
        for row, out in zip(inputs, python, strict=True):
            with np.errstate(over="ignore"):
                made(np.array(HEAD), row, np.array([*data, *np.ones(8)]), out)
        assert_allclose(ours, python, rtol=1e-13, atol=1e-13 * np.abs(python).max())
        assert np.abs(python).max() > 0.0


def test_an_error_ends_the_law_and_is_printed(monkeypatch):
    printed = []
    monkeypatch.setattr(sys, "unraisablehook", lambda raised: printed.append(raised.exc_type))
    inputs = motions(HEAD, np.random.default_rng(1))
    lean = lean_c_function("law", errors, value_template, None)
    wrench = outputs_of(lean, value_template, HEAD, np.ones(NUMBERS), inputs)[:, :3]
    is_error = inputs[:, 1] > 0.0
    assert printed == [ValueError] * is_error.sum() != []
    assert_array_equal(wrench[~is_error], inputs[~is_error][:, [2, 1, 2]] * [1.0, 2.0, 1.0])
    assert_array_equal(wrench[is_error][:, :2], np.column_stack([inputs[is_error, 2], 0.0 * inputs[is_error, 2]]))


@pytest.mark.parametrize("name", [*SHORT, *(pytest.param(name, marks=pytest.mark.long) for name in OTHERS)])
def test_laws_of_elements_are_the_same(name):
    rng = np.random.default_rng(2)
    for placed in compiled_system(ELEMENT_PARTS[name].make()).laws:
        inputs = motions(placed.head, rng, np.array(placed.law.start))
        for function in dict.fromkeys((placed.law.function, placed.law.rest)):
            for template in (value_template, complex_template):
                if function is not None:
                    assert_same(function, template, placed.head, placed.law.data, inputs)


def test_arrays_that_functions_return_are_freed():
    _nrt_python.memsys_enable_stats()
    lean = lean_c_function("law", array_of_another, value_template, None)
    before = rtsys.get_allocation_stats()
    wrench = outputs_of(lean, value_template, HEAD, np.arange(7.0), motions(HEAD, np.random.default_rng(3)))
    after = rtsys.get_allocation_stats()
    assert_array_equal(wrench[:, 0], 2.0)
    assert after.alloc - before.alloc == after.free - before.free > 0


def test_code_on_disk_follows_closures():
    rng = np.random.default_rng(4)
    inputs = motions(HEAD, rng)

    def force_by(factor):
        scaled = of_factor(factor)

        @njit
        def law(t, x, z, lam, data, wrench, z_dot, g, outputs):
            wrench[0, 0] = scaled(x[0, 0])

        whole = lean_c_function("law", law, value_template, digest_of(law))
        return outputs_of(whole, value_template, HEAD, np.ones(NUMBERS), inputs)[:, 0]

    assert_array_equal(force_by(2.0), 0.5 * force_by(4.0))


@njit
def falling(n, x):
    return x if n == 0 else falling(n - 1, 0.5 * x)


@njit
def calls_itself(t, x, z, lam, data, wrench, z_dot, g, outputs):
    wrench[0, 0] = falling(3, x[0, 0])


@njit(fastmath=True)
def with_fast_mathematics(t, x, z, lam, data, wrench, z_dot, g, outputs):
    wrench[0, 0] = 0.125 * x[0, 0]


@pytest.mark.parametrize(
    ("function", "reason"),
    [(calls_itself, "falling calls itself"), (with_fast_mathematics, "with_fast_mathematics has the options fastmath")],
)
def test_other_laws_are_left_to_plain_numba_with_a_line_of_the_log(function, reason, caplog):
    inputs = motions(HEAD, np.random.default_rng(5))
    with caplog.at_level(logging.INFO):
        made = callback("element 'e'", function, "value", HEAD)
    assert f"element 'e': {function.__name__} is compiled by plain numba: {reason}" in caplog.text
    assert_array_equal(
        called_law(made.address, HEAD, np.ones(NUMBERS), inputs, N_OUT + OUTPUTS)[:, 0], 0.125 * inputs[:, 1]
    )
