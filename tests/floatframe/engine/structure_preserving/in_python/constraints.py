"""Constraints of joints over a step: values at its end, and loads that do no work while the joints are closed.

Formulas: `floatframe.engine.structure_preserving.kernels.rows`.
"""

import math

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.kernels.model import Model
from floatframe.model.joints.rows import DISTANCE, DOT, POINT, SCREW, SLIDE, TURN, TURN_B, kind_of
from floatframe.model.joints.rows.kinds import EQUAL_TURN
from floatframe.model.rotations import dot
from tests.floatframe.engine.structure_preserving.in_python.functions import value_of
from tests.floatframe.engine.structure_preserving.in_python.markers import Load, MarkerStep

Pair = tuple[MarkerStep, MarkerStep]
Loads = tuple[Load | None, Load | None]


class Span:
    """The times at the ends of a step and of its forces, and the memory of connections there.

    w, (n_w,): in the rows of coordinates their values, angles counted through full turns; of states; of the speeds of
    approach of contacts. Of other rows it is not read.
    angle, angle_rate, (n_angles,): counted angles where the step begins, and their rates; none: between -pi and pi.
    """

    def __init__(
        self,
        t_0: float,
        t_1: float,
        t_force: float,
        w: Array | None = None,
        angle: Array | None = None,
        angle_rate: Array | None = None,
    ) -> None:
        self.t_0, self.t_1, self.t_force = t_0, t_1, t_force
        self.w = np.zeros(0) if w is None else w
        self.angle, self.angle_rate = angle, angle_rate

    def rotation(self, first: int) -> Array:
        """Return the predicted rotation vector in the counted angles from `first` on at t_force, (3,)."""
        if self.angle is None or self.angle_rate is None:
            return np.zeros(3)
        own = slice(first, first + 3)
        return np.asarray(self.angle[own] + (self.t_force - self.t_0) * self.angle_rate[own])

    @property
    def h(self) -> float:
        """Length."""
        return self.t_1 - self.t_0


def is_driven(model: Model, k: int) -> bool:
    """Whether row k prescribes a motion."""
    return bool(model.rows.motion[k] >= 0)


def held(model: Model, k: int, t: float) -> float:
    """Return the value that row k holds at time t."""
    return value_of(model, int(model.rows.motion[k]), t)[0] if is_driven(model, k) else float(model.rows.c[k])


def turn_direction(model: Model, k: int, t: float) -> Array:
    """Return the direction of marker A (TURN_B: of B, with A rotating backwards) of a prescribed angle at time t."""
    angle = held(model, k, t) * (-1 if int(model.rows.kind[k]) == TURN_B else 1)
    return math.cos(angle) * model.rows.x[k] + math.sin(angle) * model.rows.z[k]


def constraint_value(model: Model, k: int, pair: Pair, span: Span) -> Array:
    """Return the value of row k at the end of a step; zero where the joint is closed."""
    a, b = pair
    kind, x, y = int(model.rows.kind[k]), model.rows.x[k], model.rows.y[k]
    d = b.x_1 - a.x_1
    if kind == POINT:
        return dot(d, x)
    if kind == SLIDE:
        return dot(a.ends(x)[1], d) - held(model, k, span.t_1)
    if kind == DISTANCE:
        length = held(model, k, span.t_1)
        return 0.5 * (dot(d, d) / length - length)
    if kind == SCREW:
        slope = float(model.rows.c[k])
        along, angle = dot(a.ends(slide_axis(model, k))[1], d), end_angle(model, k, pair)
        turns = np.floor((np.real(along) / slope - np.real(angle)) / (2 * np.pi) + 0.5)
        return along - slope * (angle + 2 * np.pi * turns)
    if kind == EQUAL_TURN:
        one = dot(a.ends(x)[1], b.ends(model.rows.u[k])[1])
        return one - dot(a.ends(model.rows.z[k])[1], b.ends(y)[1])
    if kind in (TURN, TURN_B):
        holder, other = (a, b) if kind == TURN else (b, a)
        return dot(holder.ends(turn_direction(model, k, span.t_1))[1], other.ends(y)[1])
    assert kind == DOT
    return dot(a.ends(x)[1], b.ends(y)[1]) - float(model.rows.c[k])


def add_reaction(model: Model, k: int, pair: Pair, loads: Loads, span: Span, f: Array) -> None:
    """Add the loads of row k with multiplier f, (...,), whose work is f times the change of the row."""
    a, b = pair
    kind, x, y = int(model.rows.kind[k]), model.rows.x[k], model.rows.y[k]
    if kind_of(kind).is_length:
        direction = reaction_direction(model, k, pair, span)
        if kind in (SLIDE, SCREW):
            a.add_direction(loads[0], slide_axis(model, k), f[..., None] * (b.x_mean - a.x_mean))
        b.add_force(loads[1], f[..., None] * direction)
        a.add_force(loads[0], -f[..., None] * direction)
        if kind == SCREW:
            angle_loads(model, k, pair, loads, -float(model.rows.c[k]) * f)
        return
    if kind == TURN_B:
        add_product(pair[::-1], loads[::-1], turn_direction(model, k, span.t_force), y, f)
    elif kind == TURN:
        add_product(pair, loads, turn_direction(model, k, span.t_force), y, f)
    elif kind == EQUAL_TURN:
        add_product(pair, loads, x, model.rows.u[k], f)
        add_product(pair, loads, model.rows.z[k], y, -f)
    else:
        add_product(pair, loads, x, y, f)


def add_product(pair: Pair, loads: Loads, e: Array, y: Array, f: Array) -> None:
    """Add the loads of f times the product of direction e of the first marker and y of the second."""
    a, b = pair
    (E_0, E_1), (D_0, D_1) = a.ends(e), b.ends(y)
    a.add_direction(loads[0], e, f[..., None] * 0.5 * (D_0 + D_1))
    b.add_direction(loads[1], y, f[..., None] * 0.5 * (E_0 + E_1))


def slide_axis(model: Model, k: int) -> Array:
    """Return the axis in A along which row k measures a distance."""
    x = model.rows.x[k]
    return np.cross(x, model.rows.z[k]) if int(model.rows.kind[k]) == SCREW else x


def reaction_direction(model: Model, k: int, pair: Pair, span: Span) -> Array:
    """Return the force on B of a unit multiplier of row k, which holds a distance."""
    a, b = pair
    kind, d = int(model.rows.kind[k]), b.x_mean - a.x_mean
    if kind == POINT:
        return np.broadcast_to(model.rows.x[k], np.shape(d))
    if kind == DISTANCE:
        return d / held(model, k, span.t_force)
    E_0, E_1 = a.ends(slide_axis(model, k))
    return 0.5 * (E_0 + E_1)


def rate_in_time(model: Model, k: int, pair: Pair, t: float) -> float:
    """Return the rate of row k at one configuration without motion: that of its prescribed motion."""
    if not is_driven(model, k):
        return 0.0
    a, b = pair
    kind = int(model.rows.kind[k])
    value, rate = value_of(model, int(model.rows.motion[k]), t)
    if kind == SLIDE:
        return -rate
    if kind == DISTANCE:
        d = b.x_1 - a.x_1
        return -0.5 * rate * (float(d @ d) / value**2 + 1)
    sense, (holder, other) = (-1, (b, a)) if kind == TURN_B else (1, (a, b))
    turning = math.cos(value) * model.rows.z[k] - sense * math.sin(value) * model.rows.x[k]
    return sense * rate * float(holder.ends(turning)[1] @ other.ends(model.rows.y[k])[1])


def end_angle(model: Model, k: int, pair: Pair) -> Array:
    """Return the angle of row k at the end of the step: of D, from Z towards -E."""
    a, b = pair
    D = b.ends(model.rows.y[k])[1]
    return arctan2(-dot(a.ends(model.rows.x[k])[1], D), dot(a.ends(model.rows.z[k])[1], D))


def arctan2(S: Array, C: Array) -> Array:
    """Return the angle of (C, S), with its first derivative along an imaginary part."""
    angle = np.arctan2(np.real(S), np.real(C))
    if not np.iscomplexobj(S):
        return np.asarray(angle)
    return np.asarray(angle + 1j * (np.real(C) * np.imag(S) - np.real(S) * np.imag(C)) / np.abs(S + 1j * C) ** 2)


def angle_parts(model: Model, k: int, pair: Pair) -> tuple[Array, ...]:
    """Return E, Z, D (means), S and C (means) and kappa of the angle of row k.

    The angle th with sin th = S = -E·D, cos th = C = Z·D: C_mean dS - S_mean dC = sin(dth), kappa = dth / sin(dth).
    """
    a, b = pair
    (E_0, E_1), (Z_0, Z_1) = a.ends(model.rows.x[k]), a.ends(model.rows.z[k])
    D_0, D_1 = b.ends(model.rows.y[k])
    S_0, S_1, C_0, C_1 = -dot(E_0, D_0), -dot(E_1, D_1), dot(Z_0, D_0), dot(Z_1, D_1)
    sine, cosine = C_0 * S_1 - S_0 * C_1, C_0 * C_1 + S_0 * S_1
    dth = arctan2(sine, cosine)
    is_small = np.abs(sine) < 1e-9
    kappa = np.where(is_small, 1.0, dth / np.where(is_small, 1.0, sine))
    return 0.5 * (E_0 + E_1), 0.5 * (Z_0 + Z_1), 0.5 * (D_0 + D_1), 0.5 * (S_0 + S_1), 0.5 * (C_0 + C_1), kappa


def angle_loads(model: Model, k: int, pair: Pair, loads: Loads, f: Array) -> None:
    """Add the loads of a torque f, (...,), along the angle of row k, whose work is f times its change."""
    a, b = pair
    E, Z, D, S, C, kappa = angle_parts(model, k, pair)
    f = f * kappa
    a.add_direction(loads[0], model.rows.x[k], -(f * C)[..., None] * D)
    a.add_direction(loads[0], model.rows.z[k], -(f * S)[..., None] * D)
    b.add_direction(loads[1], model.rows.y[k], -(f * C)[..., None] * E - (f * S)[..., None] * Z)


def angle_change(model: Model, k: int, pair: Pair) -> Array:
    """Return the change of the angle of row k over the step."""
    a, b = pair
    E, Z, D, S, C, kappa = angle_parts(model, k, pair)
    dE, dZ, dD = a.change(model.rows.x[k], E), a.change(model.rows.z[k], Z), b.change(model.rows.y[k], D)
    dS, dC = -(dot(dE, D) + dot(E, dD)), dot(dZ, D) + dot(Z, dD)
    return kappa * (C * dS - S * dC)


def slip_change(model: Model, k: int, pair: Pair) -> tuple[Array, Array, Array]:
    """Return the change of the distance of row k along its axis of A, the mean axis and the mean vector from A to B."""
    a, b = pair
    x = model.rows.x[k]
    E_0, E_1 = a.ends(x)
    E, d = 0.5 * (E_0 + E_1), b.x_mean - a.x_mean
    return dot(a.change(x, E), d) + dot(E, b.dx - a.dx), E, d
