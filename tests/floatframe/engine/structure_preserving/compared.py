"""Parts by schemes, compared with generalized-alpha in small steps."""

from functools import cache

import numpy as np
import pytest

from floatframe import GeneralizedAlpha, integrate
from floatframe.errors import FloatframeError
from tests.floatframe.engine.structure_preserving.element_parts import ELEMENT_PARTS
from tests.floatframe.engine.structure_preserving.part_table import REFUSED
from tests.floatframe.engine.structure_preserving.parts import METHODS, PARTS

__all__ = ["ALL", "BY_IDA", "assert_runs_or_is_refused", "cells"]

FINE = GeneralizedAlpha(0.95, 1e-12)
ALL = PARTS | ELEMENT_PARTS
EXACT = 1e-5  #: by which schemes that control their error may differ from the fine steps
#: what every change runs by IDA, beside all that it refuses; it serves to check the other schemes, and takes a second a
#: part, so that the rest are long tests
BY_IDA = (
    "joint sliding", "joint prismatic (driven)", "joints that repeat constraints", "stiffened flexible body",
    "elastic contact", "law of three points", "clearances.hinge", "rails.wheelset",
)  # fmt: skip


def cells(parts):
    """Return (scheme, part) of all schemes with some parts, as parameters of a test."""
    return [
        pytest.param(name, part, marks=pytest.mark.long) if is_study(name, part) else (name, part)
        for name in METHODS for part in parts
    ]  # fmt: skip


def is_study(name, part):
    """Return whether a cell runs among the long tests alone."""
    return name == "`Ida`" and part not in BY_IDA and part not in REFUSED[name]


@cache
def system_of(part):
    """Return the system of a part, made once."""
    return ALL[part].make()


def ends(part, method, h, n, n_outputs, **options):
    """Return places and Euler parameters of all bodies at the beginning and at times after it."""
    system = system_of(part)
    motion = integrate(system, method, n * h, h, output_every=n // n_outputs, **options)
    return tuple(np.array([getattr(motion.body(b.name), key) for b in system.bodies]) for key in ("r", "p"))


@cache
def fine(part):
    """Return what all are compared with, at each quarter, and the longest way of a body.

    Errors of smooth motions are of second order, so steps of a sixth and a twelfth give the exact motion up to higher
    orders: fine + (fine - coarse) / 3, by Richardson. Motions with jumps take steps of a fortieth.
    """

    def divided(k):
        return ends(part, FINE, ALL[part].h / k, ALL[part].n * k, 4, watch="off")

    if ALL[part].is_smooth:
        r, p = (fine + (fine - coarse) / 3 for coarse, fine in zip(divided(6), divided(12), strict=True))
    else:
        r, p = divided(40)
    return r, p, max(np.abs(r - r[:, :1]).max(), 1e-3)


def error(part, method, halves, quarters=4):
    """Return the largest error of places over the way, and of Euler parameters, after some quarters of the time."""
    r, p = (each[:, -1] for each in ends(part, method, ALL[part].h / halves, ALL[part].n * halves * quarters // 4, 1))
    wanted_r, wanted_p, way = fine(part)
    r_0, p_0 = wanted_r[:, quarters], wanted_p[:, quarters]
    p = p * np.sign((p_0 * p).sum(axis=1, keepdims=True))
    return max(np.abs(r - r_0).max() / way, np.abs(p - p_0).max())


def assert_runs_or_is_refused(name, part):
    """Raise `AssertionError` unless a scheme refuses a part as it should, or takes it and moves it rightly."""
    if name == "`Ida`":
        pytest.importorskip("sksundae", reason="the extra 'ida' is not installed")
    given, refusal = ALL[part], REFUSED.get(name, {}).get(part)
    method = given.ode if given.ode and name == "`RelativeOde`" else METHODS[name]
    if refusal is not None:
        with pytest.raises(FloatframeError, match=name.strip("`") + ": " + refusal.words):
            integrate(system_of(part), method, 4 * given.h, given.h)
        return
    if name in ("`RelativeOde`", "`Ida`"):  # by tolerances
        assert error(part, method, 1, quarters=1 if name == "`Ida`" else 4) < EXACT
        return
    errors = [error(part, method, halves) for halves in (1, 2)]
    assert errors[1] < given.tolerance, errors
    assert errors[1] < 1e-8 or not given.is_smooth or 3 < errors[0] / errors[1] < 5.5, errors
