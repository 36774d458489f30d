"""Circuits in equilibrium and about it: pressures under loads, contents that stay, oscillators on accumulators."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from floatframe import GROUND, Marker, PrismaticJoint, RigidBody, System, linearize, static_equilibrium, system_modes
from floatframe.components.hydraulics import (
    Accumulator,
    Circuit,
    Cylinder,
    DirectionalValve,
    Fluid,
    Node,
    Orifice,
    Resistance,
    Supply,
    Tank,
)
from floatframe.model.forces import Gravity

MASS, FALL, AREA, K, AMBIENT, RHO = 400.0, 9.81, 2e-3, 1.4e9, 101325.0, 870.0
DEAD, GAS_NODE, GAS, CHARGE, N, HOLE = 5e-5, 2e-5, 5e-4, 1.2e6, 1.4, 1.5e-5
OIL = Fluid(RHO, K, AMBIENT)
BASE, TOP = Marker(GROUND, position=(0, 0, 0)), Marker("mass", position=(0, 0, 0))
LOADED = AMBIENT + MASS * FALL / AREA


def lifted(parts, nodes, stroke=0.2, **options):
    body = RigidBody("mass", mass=MASS, inertia=np.eye(3), position=(0, 0, 0.3 + stroke))
    guide = PrismaticJoint("guide", BASE, TOP, axis=(0, 0, 1))
    numbers = {"stroke": 0.4, "retracted_length": 0.3, "head_dead_volume": DEAD} | options
    jack = Cylinder("jack", BASE, TOP, AREA, head="head", **numbers)
    return System([body], [guide], [Gravity((0, 0, -FALL))], elements=[Circuit("circuit", OIL, [jack, *parts], nodes)])


def pressures(system, equilibrium):
    linear = linearize(system, equilibrium)
    return dict(zip(linear.states, equilibrium.state.w[-3 * len(linear.states) :: 3], strict=True))


def oil(p):
    return GAS * (1 - (CHARGE / p) ** (1 / N))


def on_gas(pressure, area=HOLE):
    parts = [Orifice("hole", "head", "gas", area), Accumulator("ball", "gas", GAS, CHARGE, N)]
    return lifted(parts, {"head": Node(0.0, pressure), "gas": Node(GAS_NODE, pressure)})


def test_a_closed_circuit_rests_at_the_pressure_of_its_load_with_the_oil_it_was_filled_with():
    start = 2.6e6
    system = on_gas(start)
    rest = static_equilibrium(system)
    found = pressures(system, rest)
    assert_allclose(list(found.values()), LOADED, rtol=1e-9)
    filled = (DEAD + AREA * 0.2 + GAS_NODE + oil(start)) * np.exp((start - AMBIENT) / K)
    stroke = (filled / np.exp((LOADED - AMBIENT) / K) - DEAD - GAS_NODE - oil(LOADED)) / AREA
    assert_allclose(rest.state.r[0, 2] - 0.3, stroke, rtol=1e-8)


def test_a_mass_on_an_accumulator_swings_as_its_closed_form():
    """Without loss in the orifice omega = A/sqrt(m C), C the oil that leaves the jack over its pressure."""
    system = on_gas(LOADED, area=1.0)
    rest = static_equilibrium(system)
    stroke = rest.state.r[0, 2] - 0.3
    gas = GAS / N * (CHARGE / LOADED) ** (1 / N) / LOADED
    C = (DEAD + AREA * stroke + GAS_NODE + oil(LOADED)) / K + gas
    eigenvalues = system_modes(linearize(system, rest)).eigenvalues
    swing = eigenvalues[eigenvalues.imag > 0]
    assert_allclose(np.abs(swing), AREA / np.sqrt(MASS * C), rtol=1e-8)


def test_eigenvalues_with_a_metering_orifice_are_those_of_the_linear_equations():
    system = on_gas(LOADED)
    rest = static_equilibrium(system)
    stroke, r = rest.state.r[0, 2] - 0.3, np.exp((LOADED - AMBIENT) / K)
    C_1 = (DEAD + AREA * stroke) / K
    C_2 = (GAS_NODE + oil(LOADED)) / K + GAS / N * (CHARGE / LOADED) ** (1 / N) / LOADED
    G = 0.7 * HOLE * np.sqrt(2 / RHO / (1e-3 * AMBIENT)) / r  # laminar about rest
    rates = [[0, 1, 0, 0], [0, 0, AREA / MASS, 0], [0, -AREA / C_1, -G / C_1, G / C_1], [0, 0, G / C_2, -G / C_2]]
    exact = np.linalg.eigvals(rates)
    found = system_modes(linearize(system, rest)).eigenvalues
    swing, fast = found[found.imag > 0], found[np.abs(found) > 1e3]
    assert_allclose(swing, exact[exact.imag > 0], rtol=1e-7)
    assert_allclose(fast, exact[np.abs(exact) > 1e3], rtol=1e-7)


def test_a_jack_behind_a_shut_valve_sinks_by_the_compression_of_its_oil():
    """The valve shuts the jack off: its oil, filled at 1 MPa, takes the load."""
    valve = DirectionalValve("valve", "line", "tank", "head", "other", 1e-5, 0.0)
    nodes = {"head": Node(0.0, 1e6), "other": Node(1e-5)}
    system = lifted([valve, Supply("pump", "line", 1e7), Tank("outside", "tank")], nodes)
    rest = static_equilibrium(system)
    found = pressures(system, rest)
    assert_allclose(found["circuit.pressure head"], LOADED, rtol=1e-9)
    assert_allclose(found["circuit.pressure other"], AMBIENT, rtol=1e-9)
    stroke = ((DEAD + AREA * 0.2) * np.exp((1e6 - LOADED) / K) - DEAD) / AREA
    assert_allclose(rest.state.r[0, 2] - 0.3, stroke, rtol=1e-9)


def test_a_servo_valve_holds_the_stroke_it_is_asked_for_less_its_leakage():
    """u = gain (target - stroke): at rest the leakage of the piston of a loaded jack flows through the valve."""
    gain, target, leak, passage = 20.0, 0.25, 2e-13, 2e-6
    valve = DirectionalValve("valve", "line", "tank", "head", "rod", passage, target, 0.02, follow="jack", gain=gain)
    options = {"rod": "rod", "rod_area": 1.2e-3, "rod_dead_volume": DEAD, "leakage": leak}
    parts = [valve, Supply("pump", "line", 1e7), Tank("outside", "tank"), Resistance("drain", "rod", "tank", 5e-13)]
    system = lifted(parts, {"head": Node(pressure=3e6)}, **options)
    rest = static_equilibrium(system)
    found = pressures(system, rest)
    head, rod, u = (found[f"circuit.{key}"] for key in ("pressure head", "pressure rod", "spool valve"))
    assert_allclose((head - AMBIENT) * AREA - (rod - AMBIENT) * 1.2e-3, MASS * FALL, rtol=1e-9)
    assert_allclose(u, gain * (target - (rest.state.r[0, 2] - 0.3)), rtol=1e-7)

    def through(opening):
        flow = leak * (head - rod)
        drop = brentq(
            lambda d: opening * 0.7 * passage * np.sqrt(2 / RHO) * d / (d**2 + 101.325**2) ** 0.25 - flow, 0, 1e8
        )
        return 1e7 - drop - head

    assert u > 0
    assert_allclose(through(u), 0, atol=1e-5 * head)


@pytest.mark.parametrize("pressure", [1.3e6, 2e7])
def test_a_supply_sets_the_pressure_of_a_circuit(pressure):
    jacked = lifted([Orifice("hole", "line", "head", HOLE), Supply("pump", "line", pressure)], {}, stop_stiffness=1e8)
    rest = static_equilibrium(jacked)
    assert_allclose(pressures(jacked, rest)["circuit.pressure head"], pressure, rtol=1e-9)
    end = 0.0 if pressure < LOADED else 0.4
    over = ((pressure - AMBIENT) * AREA - MASS * FALL) / 1e8
    assert_allclose(rest.state.r[0, 2] - 0.3, end + over, rtol=0, atol=1e-9)
