"""Linear and brush tyres against closed forms; standstill; energy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.components import wheels
from floatframe.errors import ModelError
from tests.floatframe.components.wheels.rig import ROAD, WHEEL, answer, motion, placed, turn

R0, K, F0 = 0.3, 2e5, 4000.0
V = 20.0


def linear(**changes):
    numbers = {"radius": R0, "stiffness": K, "slip_stiffness": 8e4, "cornering_stiffness": 6e4} | changes
    return wheels.LinearTyre("tyre", ROAD, WHEEL, **numbers)


def brush(**changes):
    numbers = {"radius": R0, "stiffness": K, "nominal_load": F0, "slip_stiffness": 6e4, "contact_length": 0.16}
    return wheels.BrushTyre("tyre", ROAD, WHEEL, **(numbers | {"flattening": 0.0, "friction": 0.9} | changes))


def rolled(law, load=F0, slip=(0.0, 0.0)):
    """Return outputs of a wheel that rolls at V_r = V with theoretical slips."""
    x = motion(R0 - load / K, v=(V * (1 - slip[0]), V * slip[1], 0), omega=(0, V / R0, 0))
    return answer(law, x)[0]


def test_forces_of_a_linear_tyre_are_proportional_until_friction_shortens_them_together():
    law = linear(flattening=0.0, trail=0.03).law(placed())
    small = answer(law, motion(0.28, v=(V, 0.2, 0), omega=(0, 1.005 * V / R0, 0)))[0]
    assert_allclose([small["Fx"], small["Fy"]], [8e4 * 0.005, -6e4 * 0.01], rtol=1e-9)
    assert_allclose(small["Mz"], 0.03 * 600, rtol=1e-9)
    large = answer(law, motion(0.28, v=(V, 2.0, 0), omega=(0, 1.05 * V / R0, 0)))[0]
    F = np.array([8e4 * 0.05, -6e4 * 0.1])
    assert_allclose([large["Fx"], large["Fy"]], F / np.linalg.norm(F) * large["Fz"], rtol=1e-9)
    assert_allclose(large["Mz"], 0.03 * 6000 / np.linalg.norm(F) * large["Fz"], rtol=1e-9)


def test_camber_pushes_to_the_side_it_leans_to():
    A = turn(0, 0.05)  # top to the right: force to the right, negative y
    law = linear(camber_stiffness=2000.0).law(placed(0.28, A))
    seen = answer(law, motion(0.28, v=(V, 0, 0), omega=(0, V / R0, 0), A=A))[0]
    assert_allclose(seen["Fy"], -2000 * np.sin(0.05), rtol=1e-6)


@pytest.mark.parametrize("load", [1000.0, F0, 7000.0])
def test_the_brush_tyre_has_the_slope_the_sliding_limit_and_the_cubic_of_its_closed_form(load):
    """C = C_0 F_z/F_0 at small slip; mu F_z beyond 3 mu F_z/C; between them 1 - (1 - sigma/sigma_s)³."""
    law, C, mu = brush().law(placed()), 6e4 * load / F0, 0.9
    limit = 3 * mu * load / C
    for axis in (0, 1):
        unit = np.eye(2)[axis]
        force = [
            rolled(law, load, s * unit)[("Fx", "Fy")[axis]] * (1, -1)[axis] for s in (1e-6, 0.4 * limit, 1.5 * limit)
        ]
        assert_allclose(force[0] / 1e-6, C, rtol=1e-4)
        assert_allclose(force[1], mu * load * (1 - 0.6**3), rtol=1e-9)
        assert_allclose(force[2], mu * load, rtol=1e-9)


def test_combined_slip_of_the_brush_tyre_is_a_friction_circle_along_the_slip():
    law = brush().law(placed())
    for angle in np.linspace(0, 2 * np.pi, 9):
        slip = 0.3 * np.array([np.cos(angle), np.sin(angle)])
        seen = rolled(law, F0, slip)
        assert_allclose([seen["Fx"], seen["Fy"]], 0.9 * F0 * np.array([slip[0], -slip[1]]) / 0.3, rtol=1e-9, atol=1e-6)


def test_force_and_moment_of_the_brush_tyre_are_the_integrals_over_its_contact():
    """Second road: bristles integrated along the contact, stuck until mu q, the rest sliding."""
    law, a, mu, C = brush().law(placed()), 0.08, 0.9, 6e4
    c_p = C / (2 * a**2)
    s = np.linspace(0, 2 * a, 200001)  # from the leading edge
    q = 3 * F0 / (4 * a) * (1 - ((a - s) / a) ** 2)
    for tangent in (0.02, 0.08, 0.15, 0.3):
        pressed = np.minimum(c_p * s * tangent, mu * q)
        seen = rolled(law, F0, (0.0, tangent))
        assert_allclose(-seen["Fy"], np.trapezoid(pressed, s), rtol=1e-6)
        # the side force -y at x = a - s ahead of the centre: M_z = -int x p
        assert_allclose(seen["Mz"], -np.trapezoid((a - s) * pressed, s), rtol=1e-5, atol=1e-5 * F0 * a)


def test_contact_length_and_trail_grow_with_the_root_of_the_load():
    law = brush().law(placed())
    trail = [-(s := rolled(law, load, (0.0, 1e-5)))["Mz"] / s["Fy"] for load in (1000.0, 4000.0)]
    assert_allclose(trail, [0.08 / 3 / 2, 0.08 / 3], rtol=1e-3)


@pytest.mark.parametrize("make", [linear, brush])
def test_steady_slip_is_the_same_with_relaxation_and_without(make):
    with_, without = make(relaxation_x=0.2, relaxation_y=0.4).law(placed()), make().law(placed())
    x = motion(0.28, v=(V, 0.4, 0), omega=(0, 1.01 * V / R0, 0))
    seen, _, _ = answer(without, x)
    transport = seen["Vx"] if make is linear else seen["Vx"] - seen["Vsx"]
    z = np.array([-0.2 * seen["Vsx"], 0.4 * seen["Vsy"]]) / transport
    relaxed, _, z_dot = answer(with_, x, z)
    assert_allclose(z_dot, 0, atol=1e-12)
    for key in ("Fx", "Fy", "Mz", "My"):
        assert_allclose(relaxed[key], seen[key], rtol=1e-9)


@pytest.mark.parametrize("make", [linear, brush])
def test_at_a_standstill_the_tread_is_a_spring_that_does_not_leak(make):
    law = make(relaxation_x=0.2, relaxation_y=0.4, settling_time=0.0).law(placed())
    x = motion(0.28)
    seen, _, z_dot = answer(law, x, [1e-3, -2e-3])
    assert_allclose(z_dot, 0, atol=1e-15)
    assert seen["Fx"] > 0
    assert seen["Fy"] > 0
    _, _, z_dot = answer(law, motion(0.28, v=(1e-4, 2e-4, 0)), [0.0, 0.0])
    assert_allclose(z_dot, [-1e-4, 2e-4], rtol=1e-6)


@pytest.mark.parametrize("make", [linear, brush])
def test_a_tyre_that_slides_sideways_without_rolling_is_not_stretched_without_end(make):
    """Integrate the tread alone at V_x = 0, V_y = 1 m/s: it settles at twice the slip of sliding."""
    law = make(relaxation_x=0.2, relaxation_y=0.4).law(placed())
    x, z = motion(0.28, v=(0, 1.0, 0)), np.zeros(2)
    slip = (0.9 if make is brush else 1.0) * F0 * (3 / 6e4 if make is brush else 1 / 6e4)
    for _ in range(4000):
        z = z + 2e-4 * answer(law, x, z)[2]
    seen, _, z_dot = answer(law, x, z)
    assert_allclose(z[1] / 0.4, 2 * slip, rtol=1e-3)
    assert abs(z_dot[1]) < 1e-3
    assert_allclose(-seen["Fy"], (0.9 if make is brush else 1.0) * seen["Fz"], rtol=1e-9)


def test_rolling_resistance_turns_with_the_direction_and_vanishes_at_rest():
    law = linear(rolling_resistance=0.015, flattening=1.0).law(placed())
    values = [answer(law, motion(0.28, v=(v, 0, 0), omega=(0, v / 0.28, 0)))[0]["My"] for v in (V, -V, 0.0)]
    assert_allclose(values, [-0.015 * R0 * F0, 0.015 * R0 * F0, 0.0], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("make", [linear, brush])
def test_steady_slip_loses_force_times_slip_velocity(make):
    law = make().law(placed())
    seen = answer(law, motion(0.28, v=(V, 0.5, 0), omega=(0, 1.02 * V / R0, 0)))[0]
    moment = seen["Mz"] * 0.0
    assert_allclose(seen["power_lost"], -seen["Fx"] * seen["Vsx"] - seen["Fy"] * seen["Vsy"] - moment, rtol=1e-9)
    assert seen["power_lost"] > 0


@pytest.mark.parametrize(
    ("make", "changes", "message"),
    [
        (linear, {"stiffness": 0.0}, "stiffness: expected a number above 0"),
        (linear, {"relaxation_y": -0.1}, "relaxation_y: expected a number of 0 or more"),
        (linear, {"friction": np.nan}, "friction: expected a finite number"),
        (linear, {"axis": (0, 0, 0)}, "axis: expected a direction"),
        (linear, {"road": "flat"}, "expected a FlatRoad or a GridRoad"),
        (linear, {"landing_depth": 0.0}, "landing_depth: expected a number above 0"),
        (brush, {"contact_length": 0.0}, "contact_length: expected a number above 0"),
        (brush, {"nominal_load": -1.0}, "nominal_load: expected a number above 0"),
    ],
)
def test_numbers_out_of_their_range_are_refused(make, changes, message):
    with pytest.raises(ModelError, match=message):
        make(**changes)


@pytest.mark.parametrize("make", [linear, brush])
def test_grip_multiplies_friction(make):
    road = wheels.FlatRoad(wheels.Grip([-1, 1], [0.3, 0.3]))
    wet = rolled(make(friction=0.9, road=road).law(placed()), slip=(-0.2, 0.1))
    other = rolled(make(friction=0.27).law(placed()), slip=(-0.2, 0.1))
    for key in ("Fx", "Fy", "Mz"):
        assert_allclose(wet[key], other[key], rtol=1e-12)
