"""Cables and lifting surfaces in closed form; tyres of property files beside themselves.

What these compute has its own oracle, `tests.floatframe.components.wheels.magic_formula_oracle`; here each number has
to matter.
"""

from math import atan2

import numpy as np

from floatframe.components import wheels
from floatframe.components.aerodynamics import LiftingSurface
from floatframe.components.cables import Cable
from floatframe.components.wheels import magic_formula as formula
from floatframe.components.wheels.contact import SIGMA_X, SIGMA_Y, STIFFNESS
from floatframe.model.bodies.markers import Marker
from tests.floatframe.element_laws import evaluate, placed
from tests.floatframe.laws.contacts import rolling
from tests.floatframe.laws.form import AXIS, A, B, Form, State, pair, plain, wave, wave_at

__all__ = ["FORMS"]


def cable(by_length):
    """Return a cable over three points: taut, pushed by its damper, slack."""
    k, c, preload = 3e3, 400.0, 200.0
    points = [np.concatenate([pair(seed), pair(seed + 50)[1:]]) for seed in range(5)]
    start = points[0]
    parts = [np.linalg.norm(np.diff(x[:, :3], axis=0), axis=1).sum() for x in points]
    free = 0.9 * parts[1] if by_length else parts[0] - preload / k
    given = {"length": free} if by_length else {"preload": preload}
    element = Cable("c", (A, B, Marker("c")), k, c, **given)

    def closed(state):
        d, v = np.diff(state.x[:, :3], axis=0), np.diff(state.x[:, 12:15], axis=0)
        lengths = np.linalg.norm(d, axis=1)
        e = d / lengths[:, None]
        stretch, rate = lengths.sum() - free, (e * v).sum()
        T = max(k * stretch + c * rate, 0.0) if stretch > 0 else 0.0
        wrench = np.zeros((3, 6))
        wrench[:2, :3] += T * e
        wrench[1:, :3] -= T * e
        energy = 0.5 * k * max(stretch, 0.0) ** 2
        lost = (T - k * stretch) * rate if stretch > 0 else 0.0
        return wrench, {}, {"tension": T, "length": lengths.sum(), "slack": max(-stretch, 0.0), "energy": energy,
                            "power lost": lost}  # fmt: skip

    return Form(element, start, tuple(State(x) for x in points), closed)


def lifting_surface():
    """Return a surface in wind, below its largest lift and beyond it."""
    area, slope, rho, most, zero_drag, induced = 1.3, 4.9, 1.2, 1.4, 0.03, 0.05
    wind = np.array([3.0, -2.0, 1.0])
    element = LiftingSurface("s", B, area, slope, rho, wave(0.01), most, zero_drag, induced, wave(0.02, 0.9), wind)

    def closed(state):
        axes = state.x[0, 3:12].reshape(3, 3)
        v = state.x[0, 12:15] - wind
        ahead, up = v @ axes[:, 0], v @ axes[:, 2]
        V, alpha = np.hypot(ahead, up), atan2(-up, ahead)
        C = slope * (alpha - wave_at(0.01, state.t)) * wave_at(0.02, state.t, 0.9)
        C = min(max(C, -most), most)
        lift, drag = (0.5 * rho * V**2 * area * c for c in (C, zero_drag + induced * C**2))
        flow = axes @ [ahead, 0.0, up] / V
        force = lift * np.cross(flow, axes[:, 1]) - drag * flow
        wrench = np.zeros((1, 6))
        wrench[0, :3] = force
        return wrench, {}, {"lift": lift, "drag": drag, "power lost": -force @ state.x[0, 12:15]}

    states = []
    for seed, alpha in ((1, 0.1), (2, -0.05), (3, 0.6), (4, -0.5)):
        x = pair(seed)[1:]
        axes = x[0, 3:12].reshape(3, 3)
        x[0, 12:15] = wind + axes @ [20 * np.cos(alpha), 3.0, -20 * np.sin(alpha)]
        states.append(State(x))
    return Form(element, pair(9)[1:], tuple(states), closed, functions=(element.factor, element.zero_lift))


def itself(element, start, states, silent):
    """Return an element beside its own law, unchanged."""
    law = element.law(placed(start, (False,) * len(start)))

    def closed(state):
        z = np.array([state.z[name] for name in law.states])
        wrench, z_dot, seen = evaluate(law, state.t, state.x, z, plain(law.function))
        return wrench, dict(zip(law.states, z_dot, strict=True)), seen

    return Form(element, start, tuple(states), closed, silent)


def magic_formula(version):
    """Return a tyre of a property file beside itself: both senses of turning, leaning, near a standstill, lifted."""
    tyre = wheels.read_tyre_file(wheels.shipped_tyre(f"passenger_car_{version}"))
    options = {"pressure": 2.4e5} if version == 61 else {}
    element = wheels.MagicFormulaTyre("t", A, B, tyre, is_combined=True, axis=AXIS, **options)
    landing = (1 - tyre.coefficients["QRE0"]) * tyre.radius + 3e-4  # half way to the landing depth
    states = [
        State(rolling(seed, *how, lean=lean, R=tyre.radius, axis=AXIS), {"u": u, "v": v})
        for seed, (how, lean, u, v) in enumerate((
            ((0.02, 15.0, 0.3, 0.02), 0.08, 3e-3, 0.02), ((0.024, 25.0, 0.2, -0.03), -0.06, -9e-3, -0.05),
            ((0.018, -12.0, 0.5, 0.1), 0.05, 0.012, 0.07), ((0.022, 0.6, 0.4, 0.3), 0.04, 8e-3, 0.03),
            ((-0.01, 9.0, 0.1, 0.01), 0.05, 2e-3, 3e-3), ((landing, 1.0, 0.1, 0.01), 0.05, 2e-3, 3e-3),
            ((0.02, 9.0, 0.1, 0.01), 0.3, 2.0, 30.0), ((0.02, 9.0, 0.1, 0.01), -0.3, -2.0, -30.0),
            ((0.07, 9.0, 0.1, 0.01), 0.1, 3e-3, 4e-3),
        ))
    ]  # fmt: skip
    silent = {11 + k: "as placed: for statics" for k in range(12)}
    silent |= {
        STIFFNESS: "that of the file at its pressure counts",
        SIGMA_X: "whether there is one",
        SIGMA_Y: "the same",
    }
    silent |= {getattr(formula, key): "as any number above 0" for key in ("IS_COMBINED", "SIGMA_FROM_FILE")}
    of_other = ("LGAZ", "LSGKP", "LSGAL", "IS_61") if version == 61 else ("PRESSURE", "C_LONG", "C_LAT", "QSY7", "LKYC")
    silent |= {getattr(formula, key): "of the other version, or a sign of this one" for key in of_other}
    return itself(element, rolling(9, 0.01, 0.0, 0.0, 0.0, R=tyre.radius, axis=AXIS), states, silent)


FORMS = {
    "magic formula 6.1": magic_formula(61),
    "magic formula 5.2": magic_formula(52),
    "cable": cable(by_length=False),
    "cable of a length": cable(by_length=True),
    "lifting surface": lifting_surface(),
}
