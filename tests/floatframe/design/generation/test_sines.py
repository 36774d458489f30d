"""The sine and cosine of generated C against arithmetic of many digits."""

import ctypes
import subprocess

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.design.generation.languages.c import SINE_COSINE

WRAPPED = """
void both(int n, const double *x, double *sine, double *cosine)
{
    for (int k = 0; k < n; k++) turn(x[k], sine + k, cosine + k);
}
"""


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sines")
    (folder / "sines.c").write_text("#include <math.h>\n" + SINE_COSINE.format(name="turn") + WRAPPED)
    command = ["cc", "-O2", "-std=c99", "-shared", "-fPIC", str(folder / "sines.c"), "-o", str(folder / "sines.so")]
    subprocess.run([*command, "-lm"], check=True)
    library = ctypes.CDLL(str(folder / "sines.so"))

    def run(x):
        x = np.ascontiguousarray(x, dtype=float)
        out = np.empty((2, len(x)))
        library.both(len(x), *(ctypes.c_void_p(each.ctypes.data) for each in (x, out[0], out[1])))
        return out

    return run


def angles():
    """Everywhere, about multiples of a quarter turn, up to where the library takes over."""
    rng = np.random.default_rng(0)
    quarters = rng.integers(-41000, 41000, 300) * (np.pi / 2)
    eighths = (rng.integers(-200, 200, 100) + 0.5) * (np.pi / 2)
    about = np.concatenate([quarters, eighths])
    return np.concatenate([
        rng.uniform(-7, 7, 500), rng.uniform(-65000, 65000, 500), about, np.nextafter(about, np.inf),
        np.nextafter(about, -np.inf), [0.0, -0.0, 1e-300, 1e-9, 65535.999, -65535.999, 65536.0, -1e6, 1e15],
    ])  # fmt: skip


def test_sine_and_cosine_are_exact_to_rounding(both):
    """To 2e-16; where they all but vanish by far more digits, which needs both parts of the quarter turn."""
    mpmath = pytest.importorskip("mpmath")
    x = angles()
    x = x[np.abs(x) < 65536]
    with mpmath.workdps(60):
        exact = [[f(mpmath.mpf(each)) for each in x.tolist()] for f in (mpmath.sin, mpmath.cos)]
        got = both(x).tolist()
        error = np.array([[float(a - b) for a, b in zip(*rows, strict=True)] for rows in zip(exact, got, strict=True)])
    assert np.abs(error).max() < 2e-16
    small = np.abs(np.array(exact, dtype=float)) < 1e-8
    assert small.sum() > 300
    assert np.abs(error[small]).max() < 1e-21


def test_far_from_zero_they_are_those_of_the_library(both):
    x = np.array([65536.0, -1e6, 1e15])
    assert_allclose(both(x), [np.sin(x), np.cos(x)], rtol=0, atol=2e-16)


def test_what_is_no_angle_is_no_number(both):
    assert np.isnan(both([np.nan, np.inf, -np.inf])).all()
