"""Hydraulic circuits and the oleo strut in closed form, from the text of their classes; integrals by quadrature."""

from dataclasses import replace
from itertools import pairwise
from math import pi, sqrt

import numpy as np
from scipy.integrate import quad
from scipy.interpolate import CubicHermiteSpline

from floatframe.components.hydraulics import (
    Accumulator,
    CheckValve,
    Circuit,
    Cylinder,
    DirectionalValve,
    FlowSource,
    Fluid,
    Node,
    OleoStrut,
    Orifice,
    Pipe,
    Pump,
    ReliefValve,
    Resistance,
    Supply,
    Tank,
    circuit_law,
)
from floatframe.model.functions.time_functions import TimeFunction
from tests.floatframe.element_laws import STEP
from tests.floatframe.laws.form import AXIS, A, B, Form, Pair, State, friction, pair, wave, wave_at

__all__ = ["FORMS"]

OIL = Fluid(870.0, 1.4e9, 101325.0, viscosity=0.03, air=0.012, air_exponent=1.3, vapour_pressure=900.0)
p_a = OIL.ambient


def volume(p):
    """Return v(p): liquid, air and vapour."""
    width = (OIL.ambient - OIL.vapour_pressure) / 50
    return ((1 - OIL.air) * np.exp(-(p - p_a) / OIL.bulk_modulus) + OIL.air * (p_a / p) ** (1 / OIL.air_exponent)
            + np.exp((OIL.vapour_pressure - p) / width))  # fmt: skip


def slope(f, p):
    """Return the derivative of a function by a complex step."""
    return f(p + 1j * STEP).imag / STEP


def integral(f, low, high):
    """Return an integral to rounding, in pieces of a tenth of the logarithm of the limits."""
    knots = np.geomspace(low, high, 24)
    return sum(quad(f, a, b, epsabs=0, epsrel=1e-13)[0] for a, b in pairwise(knots))


def work(p):
    """Return h(p), the integral of v from the ambient pressure on."""
    return integral(volume, p_a, p)


def stop(depth, rate, k, d):
    """Return force, energy and lost power of a stop."""
    if depth <= 0:
        return 0.0, 0.0, 0.0
    force = max(k * depth * (1 + d * rate), 0.0)
    return force, 0.5 * k * depth**2, (force - k * depth) * rate


# The strut ------------------------------------------------------------------------------------------------------------


STRUT = {
    "gas_volume": 2.1e-3, "charge": 1.3e6, "gas_area": 4.2e-3, "oil_area": 3.1e-3, "stroke": 0.4,
    "extended_length": 1.7, "stop_stiffness": 4e6, "exponent": 1.15, "discharge": 0.8, "friction": 210.0,
    "friction_area": 1.7e-4, "friction_speed": 0.13, "stop_damping": 0.3,
}  # fmt: skip
SPREAD = 3e-6  #: of the areas over the stroke; waves of WAVE, positive over it


def strut(oil_volume):
    """Return a strut with metered areas, in its stroke and beyond both ends; compressible if given."""
    area, recoil = wave(SPREAD, 4e-5), wave(2 * SPREAD, 3e-5)
    element = OleoStrut("s", A, B, OIL, area=area, recoil_area=recoil, oil_volume=oil_volume, axis=AXIS, **STRUT)
    e, least = element, 0.02 * STRUT["gas_volume"]

    def gas(V):
        """Pressure of the gas: the polytropic law, along its tangent below a fiftieth of its volume."""

        def law(w):
            return e.charge * (e.gas_volume / w) ** e.exponent

        return law(V) if V >= least else law(least) + slope(law, least) * (V - least)

    def closed(state):
        two = Pair(state.x)
        s, v = e.extended_length - two.way, -two.sliding
        V = e.gas_volume - e.gas_area * s
        rates = {}
        if oil_volume:
            p_o = state.z["oil pressure"]
            V += oil_volume * (volume(e.charge) - volume(p_o))
        p_g = gas(V)
        parts = (V, least, e.gas_volume) if V < least else (V, e.gas_volume)
        energy = sum(integral(lambda w: gas(w) - p_a, a, b) for a, b in pairwise(parts))
        if oil_volume:
            drop = p_o - p_g
            metered = wave_at(SPREAD, s, 4e-5) if drop > 0 else wave_at(2 * SPREAD, s, 3e-5)
            soft = drop / (drop**2 + (1e-3 * p_a) ** 2) ** 0.25
            q = e.discharge * metered * sqrt(2 / OIL.density) * soft
            rates["oil pressure"] = (e.oil_area * v - q) / (-oil_volume * slope(volume, p_o))
            content = integral(volume, e.charge, p_o) - (p_o - p_a) * volume(p_o) + (e.charge - p_a) * volume(e.charge)
            energy += oil_volume * content
        else:
            q = e.oil_area * v
            metered = wave_at(SPREAD, s, 4e-5) if v > 0 else wave_at(2 * SPREAD, s, 3e-5)
            p_o = p_g + np.sign(v) * OIL.density / 2 * (q / (e.discharge * metered)) ** 2
            above, width = p_o - OIL.vapour_pressure, (p_a - OIL.vapour_pressure) / 50
            p_o = OIL.vapour_pressure + (above + np.hypot(above, width)) / 2
        seal = friction(e.friction + e.friction_area * (p_g - p_a), e.friction_speed, v)
        top, bottom = (stop(d, r, e.stop_stiffness, e.stop_damping) for d, r in ((-s, -v), (s - e.stroke, v)))
        by_gas, oil, stops = (p_g - p_a) * e.gas_area, (p_o - p_g) * e.oil_area, bottom[0] - top[0]
        force = by_gas + oil + seal + stops
        seen = {"stroke": s, "rate": v, "force": force, "gas pressure": p_g, "oil pressure": p_o, "flow": q,
                "gas force": by_gas, "oil force": oil, "friction": seal, "stop force": stops, "power out": -force * v,
                "power lost": (p_o - p_g) * q + seal * v + top[2] + bottom[2],
                "energy": energy + top[1] + bottom[1], "stroke left": e.stroke - s}  # fmt: skip
        return two.force(force), rates, seen

    def placed(s):
        return 0.05 * np.cross(AXIS, np.eye(3)[0]) + (STRUT["extended_length"] - s) * AXIS

    states = tuple(
        State(pair(seed, offset=placed(s), relative=0.1 * np.eye(3)[0] - rate * AXIS), {"oil pressure": p})
        for seed, s, rate, p in (
            (1, 0.31, 0.7, 5e6), (2, 0.12, 0.5, 9e6), (3, 0.3, -0.6, 1.1e6), (4, 0.1, -0.4, 1.2e6),
            (5, 0.25, -9.0, 3e3), (6, 0.403, 0.1, 6e6), (7, -0.003, -0.2, 1.4e6), (8, 0.4955, 0.05, 2e8),
        )
    )  # fmt: skip
    silent = {} if oil_volume else dict.fromkeys((0, 1, 2), "incompressible oil")
    return Form(element, pair(9, offset=placed(0.1)), states, closed, silent, (area, recoil))


# The circuit ----------------------------------------------------------------------------------------------------------


SERVO = {"area": 2e-5, "time_constant": 0.02, "gain": 3.0, "overlap": 0.1, "discharge": 0.65, "leakage": 2e-13,
         "transition": 3e5}  # fmt: skip


def circuit(servo):
    """Return a circuit with every component and every number of it; its valve follows a stroke, or an opening."""
    given = {"opening": wave(0.02, 0.2), "follow": "jack"} if servo else {"opening": wave(0.1, -0.1), "gain": None}
    parts = [
        Cylinder("jack", A, B, 2e-3, 1.2e-3, "head", "rod", stroke=0.4, retracted_length=0.5, head_dead_volume=1e-5,
                 rod_dead_volume=3e-5, leakage=1e-12, friction=80.0, friction_speed=0.2, damping=40.0,
                 stop_stiffness=1e7, stop_damping=0.2),
        Pump("unit", "line", "tank", A, B, 3e-6, axis=AXIS, leakage=1e-12, drag=0.02),
        DirectionalValve("valve", "line", "tank", "head", "rod", **(SERVO | given)),
        Pipe("pipe", "supply", "line", 3.0, 1e-4, segments=3, friction_factor=0.03, wall_modulus=5e8, flow=1e-4),
        Orifice("damper", "rod", "gas", 1e-5, 0.6, 5e4, opening=wave(0.1, 0.1)),
        Orifice("bleed", "rod", "tank", 2e-6),
        Resistance("plug", "gas", "tank", 1e-11),
        Accumulator("ball", "gas", 1e-3, 3e6, 1.3, oil_limit=8e-4),
        CheckValve("check", "line", "gas", 1e-5, full=2e6, cracking=5e4, discharge=0.75, leakage=1e-13),
        ReliefValve("relief", "gas", "tank", 2e-5, full=6e6, cracking=4e6, transition=9e5),
        FlowSource("drip", "tank", "gas", wave(1e-5)),
        Supply("pressure", "supply", wave(2e6, 5e6)),
        Tank("outside", "tank"),
    ]  # fmt: skip
    nodes = {"gas": Node(2e-5, 5e6), "line": Node(4e-6, 9e6), "head": Node(pressure=3e6), "rod": Node(pressure=4e6)}
    element = Circuit("c", OIL, parts, nodes)
    jack, pump, valve, pipe, damper, bleed, plug, ball, check, relief, *_ = parts

    def opened(z, t, stroke):
        """Rate of the spool."""
        u = wave_at(0.02, t, 0.2) if servo else wave_at(0.1, t, -0.1)
        if servo:
            u = valve.gain * (u - stroke)
        return (float(np.clip(u, -1, 1)) - z["spool valve"]) / valve.time_constant

    def orifice(part, area, discharge, transition, dp, leakage=0.0):
        d = transition or 1e-3 * p_a
        return part * discharge * area * sqrt(2 / OIL.density) * dp / (dp**2 + d**2) ** 0.25 + leakage * dp

    def through(each, dp):
        """Flow of a check valve, opened as a cubic."""
        s = float(np.clip((dp - each.cracking) / (each.full - each.cracking), 0, 1))
        return orifice(s * s * (3 - 2 * s), each.area, each.discharge, each.transition, dp, each.leakage)

    def oil(p):
        """Oil in the accumulator and its slope: the polytropic law, rounded by cubics over 1 % of both corners."""
        V, c, n, most = ball.gas_volume, ball.charge, ball.exponent, ball.oil_limit
        top = c * (1 - most / V) ** -n

        def law(y):
            return V * (1 - (c / y) ** (1 / n))

        if p <= 0.99 * c:
            return 0.0, 0.0
        if p >= 1.01 * top:
            return most, 0.0
        if p < 1.01 * c:
            y = 1.01 * c
            spline = CubicHermiteSpline([0.99 * c, y], [0.0, law(y)], [0.0, slope(law, y)])
        elif p > 0.99 * top:
            y = 0.99 * top
            spline = CubicHermiteSpline([y, 1.01 * top], [law(y), most], [slope(law, y), 0.0])
        else:
            return law(p), slope(law, p)
        return float(spline(p)), float(spline(p, 1))

    def oil_integral(p):
        corners = ball.charge * np.array([1, (1 - ball.oil_limit / ball.gas_volume) ** -ball.exponent])
        knots = sorted({p, *(y for k in (0.99, 1.01) for y in k * corners if y < p)})
        return sum(quad(lambda y: oil(y)[0], a, b, epsabs=0, epsrel=1e-13)[0]
                   for a, b in pairwise(knots))  # fmt: skip

    def flows(state):
        """Return flows by name, end nodes and what is lost, all pressures, and the motion of the cylinder."""
        z, t = state.z, state.t
        p = {name.removeprefix("pressure "): value for name, value in z.items() if name.startswith("pressure ")}
        p |= {"supply": wave_at(2e6, t, 5e6), "tank": p_a}
        u = z["spool valve"]
        found = {}
        for a, b, sign in (("line", "head", 1), ("rod", "tank", 1), ("line", "rod", -1), ("head", "tank", -1)):
            part = max((sign * u - valve.overlap) / (1 - valve.overlap), 0)
            ports = {"line": "pressure", "tank": "tank", "head": "a", "rod": "b"}
            dp = p[a] - p[b]
            q = orifice(part, valve.area, valve.discharge, valve.transition, dp, valve.leakage)
            found[f"valve {ports[a]}-{ports[b]}"] = a, b, q
        found["damper"] = "rod", "gas", orifice(wave_at(0.1, t, 0.1), damper.area, damper.discharge,
                                                damper.transition, p["rod"] - p["gas"])  # fmt: skip
        found["bleed"] = "rod", "tank", orifice(1.0, bleed.area, 0.7, None, p["rod"] - p_a)
        found["plug"] = "gas", "tank", plug.conductance * (p["gas"] - p_a)
        found["check"] = "line", "gas", through(check, p["line"] - p["gas"])
        found["relief"] = "gas", "tank", through(relief, p["gas"] - p_a)
        found["drip"] = "tank", "gas", wave_at(1e-5, t)
        speed = Pair(state.x).turning
        found["unit"] = "line", "tank", pump.displacement * speed + pump.leakage * (p["line"] - p_a)
        found["jack"] = "head", "rod", jack.leakage * (p["head"] - p["rod"])
        ends = ["supply", "pipe 1", "pipe 2", "line"]
        for k in range(3):
            found[f"pipe {k + 1}"] = ends[k], ends[k + 1], z[f"flow pipe {k + 1}"]
        return found, p

    def along(x):
        line = x[1, :3] - x[0, :3]
        e = line / np.linalg.norm(line)
        return line, e, np.linalg.norm(line) - jack.retracted_length, e @ (x[1, 12:15] - x[0, 12:15])

    def contents(p, name, stroke, rate):
        """Return volume, its growth by motion, its slope over the pressure, and the energy of walls and gas."""
        part = pipe.area * pipe.length / 3
        parts = {"line": 0.5, "supply": 0.5, "pipe 1": 1.0, "pipe 2": 1.0}.get(name, 0.0) * part
        C = parts / pipe.wall_modulus
        V = parts + {"gas": 2e-5, "line": 4e-6}.get(name, 0.0) + C * (p - p_a)
        growth, by_p, energy = 0.0, C, 0.5 * C * (p - p_a) ** 2
        if name == "head":
            V, growth = V + jack.head_area * stroke + jack.head_dead_volume, jack.head_area * rate
        if name == "rod":
            V, growth = V + jack.rod_area * (jack.stroke - stroke) + jack.rod_dead_volume, -jack.rod_area * rate
        if name == "gas":
            U, dU = oil(p)
            V, by_p, energy = V + U, by_p + dU, energy + (p - p_a) * U - oil_integral(p)
        return V, growth, by_p, energy

    def closed(state):
        found, p = flows(state)
        z = state.z
        _, e, stroke, rate = along(state.x)
        two, h = Pair(state.x), {name: work(value) for name, value in p.items()}
        lost = sum(q * (h[a] - h[b]) for name, (a, b, q) in found.items()
                   if not name.startswith("pipe") and name not in ("unit", "drip"))  # fmt: skip
        seen = {f"flow {name}": q for name, (_, _, q) in found.items() if name != "jack"}
        # the cylinder
        seal = friction(jack.friction, jack.friction_speed, rate) + jack.damping * rate
        low = stop(-stroke, -rate, jack.stop_stiffness, jack.stop_damping)
        high = stop(stroke - jack.stroke, rate, jack.stop_stiffness, jack.stop_damping)
        force = (p["head"] - p_a) * jack.head_area - (p["rod"] - p_a) * jack.rod_area - seal + low[0] - high[0]
        lost += seal * rate + low[2] + high[2]
        seen |= {"stroke jack": stroke, "rate jack": rate, "force jack": force, "leakage jack": found["jack"][2]}
        # the pump
        torque = pump.displacement * (h["line"] - h["tank"]) - pump.drag * two.turning
        leak = pump.leakage * (p["line"] - p_a)
        lost += leak * (h["line"] - h["tank"]) + pump.drag * two.turning**2
        seen |= {"torque unit": torque, "speed unit": two.turning, "oil ball": oil(p["gas"])[0],
                 "spool valve": z["spool valve"]}  # fmt: skip
        wrench = np.vstack([two.force_at(force * e, state.x[1, :3]), two.torque(torque)])
        wrench[0, 3:], wrench[1, 3:] = 0.0, 0.0  # along the line of the markers
        # pipes
        part = pipe.length / 3
        inertia = OIL.density * part / pipe.area
        viscous = 8 * pi * OIL.viscosity * part / pipe.area**2
        turbulent = pipe.friction_factor * part / (2 * sqrt(pipe.area / pi)) * OIL.density / (2 * pipe.area**2)
        rates, energy = {"spool valve": opened(z, state.t, stroke)}, low[1] + high[1]
        for k in range(1, 4):
            a, b, q = found[f"pipe {k}"]
            drop = viscous * q + turbulent * q * abs(q)
            rates[f"flow pipe {k}"] = (h[a] - h[b] - drop) / inertia
            lost += q * drop
            energy += 0.5 * inertia * q * q
        # nodes: the content (V + ...)/v grows by the inflow
        given, content = found["drip"][2] * (h["gas"] - h["tank"]), 0.0
        for name, pressure in p.items():
            Q = sum(q * ((b == name) - (a == name)) for a, b, q in found.values())
            V, growth, by_p, held = contents(pressure, name, stroke, rate)
            v = volume(pressure)
            seen[f"pressure {name}"] = pressure
            if name in ("supply", "tank"):
                given += (pressure - p_a) * growth - Q * h[name]
                continue
            rates[f"pressure {name}"] = (Q - growth / v) / (by_p / v - V * slope(volume, pressure) / v**2)
            energy += V * (h[name] / v - (pressure - p_a)) + held
            content += V / v
        seen |= {"power in": given, "power lost": lost, "energy": energy, "content": content,
                 "power out": force * rate + torque * two.turning}  # fmt: skip
        return wrench, rates, seen

    def at_rest(state):
        """The same, but flows into nodes with orifices and valves Q sqrt(Q² + Q_0²)/Q_0."""
        wrench, rates, seen = closed(state)
        found, p = flows(state)
        laminar = dict.fromkeys(p, 0.0)
        root = sqrt(2 / OIL.density)
        resisting = {"damper": damper, "bleed": bleed, "check": check, "relief": relief}
        for name, (a, b, _) in found.items():
            each = valve if name.startswith("valve") else resisting.get(name)
            if each is not None:
                full = each.discharge * each.area * root * sqrt(each.transition or 1e-3 * p_a)
                laminar[a], laminar[b] = laminar[a] + full, laminar[b] + full
        _, _, stroke, rate = along(state.x)
        for name, pressure in p.items():
            if laminar[name] > 0 and name not in ("supply", "tank"):
                Q = sum(q * ((b == name) - (a == name)) for a, b, q in found.values())
                V, _, by_p, _ = contents(pressure, name, stroke, rate)
                v, soft = volume(pressure), Q * sqrt(Q * Q + laminar[name] ** 2) / laminar[name]
                rates[f"pressure {name}"] = soft / (by_p / v - V * slope(volume, pressure) / v**2)
        return wrench, rates, seen

    states = []
    for seed, stroke, gas, line, spool, rod in (
        (1, 0.21, 5e6, 8e6, 0.4, 4.1e6), (2, -0.003, 2.98e6, 3.1e6, -0.6, 4e6), (3, 0.403, 3.01e6, 4e6, 0.7, 2e5),
        (4, 0.1, 7e6, 5e6, 0.05, p_a + 150.0), (5, 0.3, 2.45e7, 2.6e7, -0.8, 3e3), (6, 0.2, 2.8e7, 2.85e7, 0.3, 8e6),
    ):  # fmt: skip
        z = {"pressure head": 3.3e6, "pressure rod": rod, "pressure gas": gas, "pressure line": line,
             "pressure pipe 1": 1.1 * line, "pressure pipe 2": 0.9 * line, "flow pipe 1": 1e-4, "flow pipe 2": -2e-4,
             "flow pipe 3": 3e-4, "spool valve": spool}  # fmt: skip
        offset = (0.5 + stroke) * np.array([2.0, -1.0, 2.0]) / 3
        states.append(State(twice(pair(seed, offset=offset)), z))
    placed = twice(pair(9, offset=(0.5 + 0.2) * np.array([2.0, -1.0, 2.0]) / 3))
    return placed, element, closed, at_rest, tuple(states)


def twice(x):
    """Return the markers of a cylinder and those of a pump: the same places."""
    return np.concatenate([x, x])


def layout(law, names):
    """Return by their places in the data what the numbers of a circuit are: "node gas: VOLUME", "pipe 1: 2", ..."""
    data, found = law.data, {}
    for k, name in enumerate(names):
        at = int(data[circuit_law.NODES]) + circuit_law.NODE_WIDTH * k
        for key in ("VOLUME", "COMPLIANCE", "FUNCTION", "FIRST", "COUNT", "LAMINAR"):
            found[at + getattr(circuit_law, key)] = f"node {name}: {key}"
    for k in range(int(data[circuit_law.N_COMPONENTS])):
        at = int(data[circuit_law.COMPONENTS]) + circuit_law.COMPONENT_WIDTH * k
        for j, key in enumerate(("KIND", "A", "B", "SEEN", "STATE", "MARKER_A", "MARKER_B")):
            found[at + j] = f"component {k} of kind {int(data[at])}: {key}"
    return found


def circuit_forms():
    """Return the forms of circuits, in motion and at rest."""
    found = {}
    for name, servo in (("circuit", False), ("circuit with a servo valve", True)):
        placed, element, closed, at_rest, states = circuit(servo)
        given = [getattr(part, key, None) for part in element.components for key in ("flow", "opening", "pressure")]
        functions = tuple(each for each in given if isinstance(each, TimeFunction))
        form = Form(element, placed, states, closed, functions=functions)
        found[name] = replace(form, silent=unread(form))
        names = [each.removeprefix("pressure ") for each in form.law().outputs if each.startswith("pressure ")]
        laminar = [place for place, what in layout(form.law(), names).items() if what.endswith("LAMINAR")]
        found[f"{name} at rest"] = replace(
            form, closed=at_rest, silent={}, functions=(), is_rest=True,
            places=lambda data, laminar=tuple(laminar[:-2]): laminar,
        )  # fmt: skip
    return found


def unread(form):
    """Return the places of the numbers of a circuit that are none, or of no meaning where they stand."""
    law, at = form.law(), circuit_law
    names = [name.removeprefix("pressure ") for name in law.outputs if name.startswith("pressure ")]
    found = {at.ISLANDS: "there are none"}
    for place, what in layout(law, names).items():
        is_none = law.data[place] == -1 and not what.startswith("node")
        of_given = what.startswith(("node supply", "node tank")) and what.endswith(("VOLUME", "COMPLIANCE"))
        if is_none or of_given or what.endswith("LAMINAR"):
            found[place] = what
        if f"kind {at.ACCUMULATOR}: " in what and what.endswith((" KIND", " B")):
            found[place] = "what is no other kind is an accumulator, and has one node"
        if f"kind {at.ORIFICE}: KIND" in what and law.data[place + at.FIRST_NUMBER + 2] == at.BY_SPOOL_BACK:
            found[place + at.FIRST_NUMBER + 2] = "what is no other kind of opening is this one"
        if what == "node tank: FIRST":
            found[place] = "nothing flows at the ambient pressure that brings power"
            first, count = int(law.data[place]), int(law.data[place + 1])
            for k in range(int(law.data[at.ATTACHED]) + 2 * first, int(law.data[at.ATTACHED]) + 2 * (first + count), 2):
                found[k] = "the same"
                if 2 * law.data[k + 1] < len(law.outputs):  # else a place beyond the outputs
                    found[k + 1] = "the same"
    return {place: why for place, why in found.items() if law.data[place] != 0}


def closed_circuit():
    """Return a cylinder and an accumulator with an orifice between them, at rest: oil that nothing leaves.

    The piston leaks into the chamber around the rod alone, and there is none.
    """
    jack = Cylinder("jack", A, B, 2e-3, head="head", stroke=0.4, retracted_length=0.5, head_dead_volume=1e-5,
                    leakage=1e-12)  # fmt: skip
    damper = Orifice("damper", "head", "gas", 1e-5, transition=3e4)
    ball = Accumulator("ball", "gas", 1e-3, 3e6, 1.3)
    element = Circuit("c", OIL, [jack, damper, ball], {"gas": Node(2e-5, 5e6), "head": Node(pressure=6e6)})

    def chambers(x, z):
        """Return volume over v of both nodes, and the slope of that of the gas over its pressure."""

        def gas(p):
            return (2e-5 + ball.gas_volume * (1 - (ball.charge / p) ** (1 / ball.exponent))) / volume(p)

        stroke = np.linalg.norm(Pair(x).line) - jack.retracted_length
        head = (jack.head_area * stroke + jack.head_dead_volume) / volume(z["pressure head"])
        return head, gas(z["pressure gas"]), slope(gas, z["pressure gas"])

    placed = pair(9, offset=0.65 * AXIS)
    content = sum(chambers(placed, {"pressure head": 6e6, "pressure gas": 5e6})[:2])

    def closed(state):
        head, gas, by_p = chambers(state.x, state.z)
        dp = state.z["pressure head"] - state.z["pressure gas"]
        full = damper.discharge * damper.area * sqrt(2 / OIL.density)
        q, laminar = full * dp / (dp**2 + damper.transition**2) ** 0.25, full * sqrt(damper.transition)
        rates = {"pressure head": OIL.bulk_modulus * (1 - (head + gas) / content),
                 "pressure gas": q * sqrt(q * q + laminar**2) / laminar / by_p}  # fmt: skip
        two, line = Pair(state.x), Pair(state.x).line
        push = (state.z["pressure head"] - p_a) * jack.head_area * line / np.linalg.norm(line)
        wrench = two.force_at(push, state.x[1, :3])
        wrench[:, 3:] = 0.0
        return wrench, rates, {"flow damper": q, "content": head + gas, "leakage jack": 0.0}

    return Form(element, placed, tuple(
        State(pair(seed, offset=0.7 * AXIS), {"pressure head": p, "pressure gas": 5.1e6})
        for seed, p in ((1, 5e6), (2, 7e6))
    ), closed, is_rest=True, places=lambda data: [6, 7, *range(len(data) - 5, len(data))])  # fmt: skip


FORMS = {
    "strut": strut(None),
    "strut with compressible oil": strut(4e-4),
    "closed circuit at rest": closed_circuit(),
    **circuit_forms(),
}
