"""Cables, lifting surfaces and expressions in closed form; tyres of property files beside themselves.

What these compute has its own oracle, `tests.floatframe.components.wheels.magic_formula_oracle`; here each number has
to matter.
"""

from math import atan2

import numpy as np
from scipy.spatial.transform import Rotation

from floatframe.components import wheels
from floatframe.components.aerodynamics import LiftingSurface
from floatframe.components.cables import Cable
from floatframe.components.wheels import magic_formula as formula
from floatframe.components.wheels.contact import SIGMA_X, SIGMA_Y, STIFFNESS
from floatframe.model.bodies.markers import Marker
from floatframe.model.elements.expressions import ExpressionElement
from tests.floatframe.element_laws import evaluate, placed
from tests.floatframe.laws.contacts import rolling
from tests.floatframe.laws.form import AXIS, A, B, Form, Pair, State, pair, plain, wave, wave_at

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


def expressions():
    """Return an element of expressions: every operation and condition, a function, a term, a state, all loads."""
    k, c, curve = 3.1, 0.7, wave(1.3)
    element = ExpressionElement(
        "e", {"a": A, "b": B}, parameters={"k": k, "c": c}, functions={"f": curve}, states={"s": 0.3},
        terms={"length": "sqrt(b_x^2 + b_y^2 + b_z^2)", "bent": "length*0.37 + f(b_vx) - 1/(2 + b_vz**2)"},
        forces={"b_Fx": "-k*b_x/length - c*b_vx + sin(t)*s", "b_Fy": "max(b_vy, 0.3) - 2.3*min(b_wx, -0.2)",
                "b_Fz": "atan2(b_y, b_x)*tanh(0.3*b_wz)", "b_Mx": "exp(-b_x^2)*cosh(s*0.4) + sign(b_vz)*abs(b_wy)",
                "b_My": "k*b_rx + c*b_ry + 5*b_rz", "b_Mz": "bent*(0.4 if b_vx < 0.1 else 1.7)"},
        rates={"s": "-2.5*s + cos(3*t) + bent"},
        outputs={"first": "log(length) + sinh(0.2*b_rz) + asin(0.3*tanh(b_x))",
                 "second": "acos(0.3*tanh(b_y)) + atan(b_z) + tan(0.1*b_wx) + length^1.5"},
    )  # fmt: skip

    def closed(state):
        two, t, s = Pair(state.x), state.t, state.z["s"]
        first, second = two.axes
        x, y, z = first.T @ two.line
        turn = state.x[1, 15:] - state.x[0, 15:]
        vx, vy, vz = first.T @ (state.x[1, 12:15] - state.x[0, 12:15] - np.cross(state.x[0, 15:], two.line))
        wx, wy, wz = first.T @ turn
        rx, ry, rz = Rotation.from_matrix(first.T @ second).as_rotvec()
        length = np.linalg.norm(two.line)
        bent = 0.37 * length + wave_at(1.3, vx) - 1 / (2 + vz**2)
        F = first @ [-k * x / length - c * vx + np.sin(t) * s, max(vy, 0.3) - 2.3 * min(wx, -0.2),
                     np.arctan2(y, x) * np.tanh(0.3 * wz)]  # fmt: skip
        M = first @ [np.exp(-(x**2)) * np.cosh(0.4 * s) + np.sign(vz) * abs(wy), k * rx + c * ry + 5 * rz,
                     bent * (0.4 if vx < 0.1 else 1.7)]  # fmt: skip
        wrench = np.array([[*-F, *(-M - np.cross(two.line, F))], [*F, *M]])
        seen = {"first": np.log(length) + np.sinh(0.2 * rz) + np.arcsin(0.3 * np.tanh(x)),
                "second": np.arccos(0.3 * np.tanh(y)) + np.arctan(z) + np.tan(0.1 * wx) + length**1.5}  # fmt: skip
        return wrench, {"s": -2.5 * s + np.cos(3 * t) + bent}, seen

    speeds = [(0.15, 0.5, -0.3), (0.05, 0.1, 0.4), (0.6, 0.4, 0.8), (-0.3, -0.2, -0.5)]
    states = [State(pair(seed, angle=0.3 * seed - 0.7, relative=speed), {"s": 0.5 * seed - 0.6})
              for seed, speed in enumerate(speeds)]  # fmt: skip
    silent = {0: "room for the results"}
    return Form(element, pair(9), tuple(states), closed, silent, (curve,))


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
    "expressions": expressions(),
}
