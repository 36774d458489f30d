"""Obstacles of a test track as profiles: step, ramp and bumps."""

import numpy as np

from floatframe.components.wheels.roads.road import Polyline
from floatframe.errors import ModelError
from floatframe.model.checked_values import number

__all__ = ["bump", "cosine_bump", "ramp", "step"]

PIECES = 64  #: number of straight pieces of a rounded bump


def step(at: float, height: float, *, length: float) -> Polyline:
    """Return a road from x = 0 to `length` [m] with an upright step at x = at; a negative height steps down."""
    at, length = place("step", at, length)
    return Polyline(np.array([0.0, at, at, length]), np.array([0.0, 0.0, 1.0, 1.0]) * number("step: height", height))


def ramp(at: float, height: float, run: float, *, length: float) -> Polyline:
    """Return a road that rises by `height` over `run`, beginning at x = at, and is level up to `length` [m]."""
    at, length = place("ramp", at, length)
    run = number("ramp: run", run, above=0.0)
    x = np.array([0.0, at, at + run, max(length, at + run)])
    return Polyline(x, np.array([0.0, 0.0, 1.0, 1.0]) * number("ramp: height", height))


def bump(at: float, height: float, width: float, *, length: float) -> Polyline:
    """Return a level road with a cleat of rectangular section from x = at to at + width [m]."""
    at, length = place("bump", at, length)
    end = at + number("bump: width", width, above=0.0)
    x = np.array([0.0, at, at, end, end, max(length, end)])
    return Polyline(x, np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0]) * number("bump: height", height))


def cosine_bump(at: float, height: float, width: float, *, length: float) -> Polyline:
    """Return a level road with the bump height (1 - cos(2 pi s/width))/2, 0 <= s = x - at <= width [m]."""
    at, length = place("cosine_bump", at, length)
    s = np.linspace(0.0, 1.0, PIECES + 1)
    rise = 0.5 * number("cosine_bump: height", height) * (1 - np.cos(2 * np.pi * s))
    x = at + s * number("cosine_bump: width", width, above=0.0)
    return Polyline(np.concatenate([[0.0], x, [max(length, x[-1])]]), np.concatenate([[0.0], rise, [0.0]]))


def place(where: str, at: float, length: float) -> tuple[float, float]:
    """Return the beginning of an obstacle and the length of its road, validated."""
    at, length = number(f"{where}: at", at, at_least=0.0), number(f"{where}: length", length, above=0.0)
    if at >= length:
        raise ModelError(f"{where}: at: expected a place on the road of length {length:g}, got {at:g}")
    return at, length
