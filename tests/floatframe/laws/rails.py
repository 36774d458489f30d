"""Closed forms of wheels on rails: vectors in place of components, splines of SciPy in place of the law's own."""

from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from floatframe.components import rails
from floatframe.components.rails.assembly import grid_of, shift_off_the_rail
from floatframe.components.rails.contact_table import FIELDS, Steel, contact_table
from floatframe.components.rails.creep import Creepage, Patch, fastsim, polach
from floatframe.components.rails.law import HEAD, LIFTED, WHEEL_HEAD
from tests.floatframe.element_laws import marker_motion
from tests.floatframe.laws.form import A, Form, State

__all__ = ["FORMS"]

PAIR = rails.Pair()
AT = {name: k for k, name in enumerate(HEAD)}
S = np.arange(0, 60.5, 0.5)
BUMPS = [1e-3 * np.sin(w * S + phase) for w, phase in ((0.9, 0.3), (0.7, 1.1), (1.1, 2.0), (0.8, 0.6))]
TRACK = rails.Track(rails.curve(300.0, 30.0, transition=24.0, cant=0.1, before=10.0, after=20.0),
                    rails.Irregularities(S, *BUMPS), start=(3.0, -2.0, 0.7), heading=0.6)  # fmt: skip


@cache
def table(laws):
    return contact_table(PAIR, smoothing=laws.smoothing, steel=Steel(laws.shear_modulus, laws.poisson),
                         grid=grid_of(PAIR))  # fmt: skip


def fields(laws, part, v, roll, sine):
    """Return the fields of a part by name: natural splines over shift and roll, an even one over the sine of yaw."""
    found = table(laws)
    v_0, v_1, n_v = found.grid.v
    r_0, r_1, n_r = found.grid.roll
    sines = np.linspace(0, np.sin(found.grid.yaw[0]), found.grid.yaw[1])
    values = found.values[part]
    values = CubicSpline(np.linspace(v_0, v_1, n_v), values, bc_type="natural")(np.clip(v, v_0, v_1))
    values = CubicSpline(np.linspace(r_0, r_1, n_r), values, bc_type="natural")(np.clip(roll, r_0, r_1))
    slope, bend = np.zeros(values.shape[1:]), np.zeros(values.shape[1:])
    values = CubicSpline(sines, values, bc_type=((1, slope), (2, bend)))(min(abs(sine), sines[-1]))
    return dict(zip(FIELDS, values, strict=True))


def nearest(point):
    """Return arc length and frame of the track beside a point."""
    s = 20.0
    for _ in range(60):
        frame = TRACK.frame(s)
        d = point - frame.origin
        s += float(d @ frame.axes[:, 0]) / (1 - frame.curvature * float(d @ frame.axes[:, 1]))
    return s, TRACK.frame(s)


def deviation(values, s):
    """Return a deviation and its slope; constant beyond the ends."""
    if not S[0] < s < S[-1]:
        return values[0 if s < S[0] else -1], 0.0
    spline = CubicSpline(S, values, bc_type="natural")
    return float(spline(s)), float(spline(s, 1))


def creep_force(laws, *at, V):
    xi, eta, phi, N, a, b, c11, c22, c23, c33 = at
    G, mu = laws.shear_modulus, laws.friction
    if laws.creep == "polach":
        return polach.py_func(Creepage(xi, eta, phi), Patch(*at[3:], G, mu), laws.polach, V)
    if laws.creep == "fastsim":
        options = np.array([laws.strips, laws.strips, 0.0])
        return fastsim.py_func(Creepage(xi, eta, phi), Patch(*at[3:], G, mu), options)
    c = np.sqrt(a * b)
    F = -c * c * G * np.array([c11 * xi, c22 * eta + c * c23 * phi, -c * c23 * eta + c * c * c33 * phi])
    e = np.hypot(F[0], F[1]) / (mu * N)
    return F * (1 if laws.creep == "kalker" else 1 - e / 3 + e * e / 27 if e < 3 else 1 / e)


def closed_form(element, wheels):
    """Return the law of wheels (side, arm) of an element, from the text of its module."""
    laws, seen_rails = element.laws, TRACK.irregularities.seen_by_wheels(PAIR.radius)
    signals = {1: (seen_rails.left_y, seen_rails.left_z), -1: (seen_rails.right_y, seen_rails.right_z)}
    half, off_at = 0.5 * PAIR.running_circles, shift_off_the_rail(PAIR)

    def closed(state):
        r, axes = state.x[0, :3], state.x[0, 3:12].reshape(3, 3)
        vel, omega = state.x[0, 12:15], state.x[0, 15:18]
        axle, carrier = axes[:, 1], omega
        if element.spin_inertia:
            omega = omega + (state.z["spin"] - omega @ axle) * axle
        force, moment, energy, lost, worst, seen = np.zeros(3), np.zeros(3), 0.0, 0.0, -1.0, {}
        for side, arm in wheels:
            W = r + arm * axle
            s, frame = nearest(W)
            t, n, b = frame.axes.T
            d = W - frame.origin
            beside = d @ n
            (off_y, along_y), (off_z, along_z) = (deviation(values, s) for values in signals[side])
            along_y, along_z = np.array([along_y, along_z]) / (1 - frame.curvature * beside)
            u, h = side * (beside - off_y) - half, d @ b - PAIR.radius - off_z
            roll, sine = side * axle @ b, -side * axle @ t
            v = u + PAIR.radius * roll
            speed = vel @ t
            ahead, V = 1.0 if speed >= 0 else -1.0, np.hypot(speed, laws.low_speed)
            total, wheel_force, wear = 0.0, np.zeros(3), 0.0
            prefix = "" if len(wheels) == 1 else "left_" if side > 0 else "right_"
            for k, part in enumerate(("tread", "flange")):
                of = fields(laws, k, v, roll, sine)
                angle = np.arctan(of["slope"])
                depth = (of["q"] - h) * np.cos(angle)
                lift = h - of["q"] if k == 0 else lift  # noqa: F821
                P = arm * axle + of["x"] * sine * t + side * of["y"] * n + of["z"] * b
                slip = vel + np.cross(omega, P)
                normal = b * np.cos(angle) - side * n * np.sin(angle)
                across = n * np.cos(angle) + side * b * np.sin(angle)
                seen |= {f"{prefix}{part}_angle": angle, f"{prefix}{part}_radius": of["radius"],
                         f"{prefix}{part}_depth": depth}  # fmt: skip
                if depth <= 0:
                    continue
                N = np.exp(of["stiffness"]) * depth**1.5
                energy += 0.4 * N * depth
                N = N * max(1 - laws.damping * slip @ normal, 0.0)
                a, b_axis = np.exp(of["a_1"]) * N ** (1 / 3), np.exp(of["b_1"]) * N ** (1 / 3)
                xi, eta, phi = slip @ t / V, slip @ across / V, omega @ normal / V
                kalker = [np.exp(of[name]) for name in ("c11", "c22", "c23", "c33")]
                F_x, F_y, M = creep_force(laws, ahead * xi, ahead * eta, phi, N, a, b_axis, *kalker, V=V)
                F_x, F_y = ahead * F_x, ahead * F_y
                uphill = N * np.cos(angle) * (side * of["slope"] * along_y - along_z)
                F = N * normal + (F_x + uphill) * t + F_y * across
                force, moment = force + F, moment + np.cross(P, F) + M * normal
                tread = -(F_x * xi + F_y * eta + M * phi)
                total, wheel_force, wear, lost = total + N, wheel_force + F, wear + tread, lost + tread * V
                named = {"N": N, "a": a, "b": b_axis, "xi": xi, "eta": eta, "spin": phi, "Fx": F_x, "Fy": F_y, "M": M}
                seen |= {f"{prefix}{part}_{key}": value for key, value in named.items()}
            Q, Y, off = wheel_force @ b, -side * wheel_force @ n, max(v - off_at, lift - LIFTED)
            worst = max(worst, off)
            named = {"shift": v, "N": total, "Q": Q, "Y": Y, "wear": wear, "s": s, "off": off}
            seen |= {f"{prefix}{key}": value for key, value in named.items()}
        rates = {}
        if element.spin_inertia:
            about, momentum = moment @ axle, element.spin_inertia * state.z["spin"]
            rates = {"spin": about / element.spin_inertia}
            moment = moment - about * axle - momentum * np.cross(carrier, axle)
            energy += 0.5 * momentum * state.z["spin"]
        seen |= {"off_track": worst, "energy": energy, "power_lost": lost}
        return np.concatenate([force, moment])[None], rates, seen

    return closed


def on_track(s, y, z, *, turn=(0, 0, 0), velocity=(15.0, 0.02, -0.01), omega=(0.01, 32.6, 0.04), beside=0.0):
    """Return the motion of an axle, given in the axes of the track at s; `beside`: its middle to the left of it."""
    frame = TRACK.frame(s)
    Q = frame.axes
    return marker_motion(frame.origin + Q @ [0, beside + y, z], Q @ Rotation.from_rotvec(turn).as_matrix(),
                         v=Q @ np.asarray(velocity, float), omega=Q @ np.asarray(omega, float))[None]  # fmt: skip


def places_of(sides, cell, s):
    """Return which numbers are doubled: of head and wheels, of the cell and the knots at s, of the heads of tables."""

    def places(data):
        first, cells, knots = len(HEAD), int(data[AT["cells_at"]]), int(data[AT["irregular_at"]])
        signals = [signal for side in sides for signal in ((0, 1) if side > 0 else (2, 3))]
        chosen = [*range(first + len(WHEEL_HEAD) * len(sides)), *range(cells + 8 * cell, cells + 8 * cell + 8)]
        chosen += [knots + 4 * (int(s / 0.5) + k) + signal for k in range(4) for signal in signals]
        chosen += [int(data[first + 4]) + k for k in range(9)]
        return [k for k in chosen if data[k] != 0]

    return places


def wheelset(creep):
    """Return a wheelset in a transition curve on irregular rails: in the middle, with a flange, backward, far off."""
    laws = rails.ContactLaws(creep=creep, friction=0.35, shear_modulus=7.9e10, poisson=0.27, smoothing=3e-5,
                             damping=2e-3, low_speed=0.3, strips=5)  # fmt: skip
    element = rails.Wheelset("w", A, PAIR, TRACK, laws)
    half = 0.5 * PAIR.running_circles
    states = [
        State(on_track(17.3, 2e-3, 0.4597, turn=(1e-3, 0.3, 4e-3))),
        State(on_track(17.3, 7.5e-3, 0.4612, turn=(-1e-3, 0.3, -6e-3), velocity=(0.4, 0.02, -0.4),
                       omega=(0.01, -0.9, 0.04))),
        State(on_track(120.0, -2e-3, 0.4590, turn=(5e-4, 0.1, 2e-3), velocity=(-9.0, 0.03, 0.02),
                       omega=(0.02, -19.0, 0.03))),
        State(on_track(44.0, 0.06, 0.430, turn=(0.02, 0.3, 0.06))),
    ]  # fmt: skip
    placed = on_track(17.3, 0.0, 0.46)
    silent = {AT["creep"]: "any number above 2 is FASTSIM"} if creep == "fastsim" else {}
    return Form(element, placed, tuple(states), closed_form(element, ((1, half), (-1, -half))),
                silent, places=places_of((1, -1), 2, 17.3))  # fmt: skip


def single_wheel(creep):
    """Return a wheel on the right rail that turns on a body, which itself does not."""
    laws = rails.ContactLaws(creep=creep, friction=0.4, polach=(0.8, 0.6, 0.5, 0.3), damping=1e-3, low_speed=0.2)
    element = rails.WheelOnRail("w", A, "right", PAIR, TRACK, laws, spin_inertia=60.0, spin=30.0)
    beside = -0.5 * PAIR.running_circles
    states = [
        State(on_track(17.3, 2e-3, 0.4597, turn=(1e-3, 0.2, 4e-3), omega=(0.3, 0.5, 0.4), beside=beside),
              {"spin": 31.0}),
        State(on_track(17.3, -8e-3, 0.4612, turn=(2e-3, 0.2, -6e-3), omega=(0.2, -0.3, 0.1), beside=beside),
              {"spin": 36.0}),
        State(on_track(120.0, -0.06, 0.430, turn=(-0.02, 0.3, -0.06), omega=(0.2, -0.3, 0.1), beside=beside),
              {"spin": 30.0}),
    ]  # fmt: skip
    silent = {AT["friction"]: "linear forces have no limit"} if creep == "kalker" else {}
    return Form(element, on_track(17.3, 0.0, 0.46, beside=beside), tuple(states), closed_form(element, ((-1, 0.0),)),
                silent, places=places_of((-1,), 2, 17.3))  # fmt: skip


FORMS = {
    "wheelset with fastsim": wheelset("fastsim"),
    "wheelset with saturated creep": wheelset("kalker-saturated"),
    "single wheel with Polach": single_wheel("polach"),
    "single wheel with linear creep": single_wheel("kalker"),
}
