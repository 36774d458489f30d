"""Contact of a wheel with a road: geometry, velocities, normal force."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.components import wheels
from floatframe.errors import ModelError
from tests.floatframe.components.wheels.rig import ROAD, WHEEL, answer, motion, placed, turn

R0, K = 0.3, 2e5


def tyre(**changes):
    numbers = {"radius": R0, "stiffness": K, "slip_stiffness": 8e4, "cornering_stiffness": 6e4} | changes
    return wheels.LinearTyre("tyre", ROAD, WHEEL, **numbers)


def law_of(height=0.28, A=None, **changes):
    return tyre(**changes).law(placed(height, A))


def test_an_upright_wheel_is_pressed_by_k_d():
    seen, wrench, _ = answer(law_of(), motion(0.285))
    assert_allclose([seen["Fz"], seen["deflection"], seen["loaded_radius"]], [K * 0.015, 0.015, 0.285], rtol=1e-12)
    assert_allclose(wrench[1], [0, 0, K * 0.015, 0, 0, 0], atol=1e-9)
    assert_allclose(wrench[0], [0, 0, -K * 0.015, 0, 0, 0], atol=1e-9)


def test_a_lifted_wheel_feels_nothing():
    seen, wrench, z_dot = answer(law_of(relaxation_x=0.1, relaxation_y=0.2), motion(0.31, v=(5, 1, 0)), [0.01, 0.02])
    assert not wrench.any()
    assert seen["Fz"] == 0
    assert z_dot[0] < 0
    assert z_dot[1] < 0


def test_damping_never_pulls():
    law = law_of(damping=1e5)
    assert answer(law, motion(0.299, v=(0, 0, 1.0)))[0]["Fz"] == 0
    assert_allclose(answer(law, motion(0.299, v=(0, 0, -1.0)))[0]["Fz"], K * 0.001 + 1e5, rtol=1e-12)


def test_a_leaning_wheel_touches_where_its_plane_meets_the_road():
    """Top to the right by gamma: the contact lies to the left of the centre by h tan gamma, rho = h/cos gamma."""
    gamma, h = 0.2, 0.285
    A = turn(0, gamma)
    seen, _, _ = answer(law_of(A=A), motion(h, A=A))
    assert_allclose(seen["gamma"], gamma, rtol=1e-12)
    assert_allclose(seen["loaded_radius"], h / np.cos(gamma), rtol=1e-12)
    assert_allclose([seen["px"], seen["py"], seen["pz"]], [0, h * np.tan(gamma), 0], atol=1e-15)


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.5])
def test_axes_of_the_contact_follow_the_wheel(yaw):
    """A wheel that runs ahead at V with a side speed W has V_x = V, tan alpha = W/V whichever way it heads."""
    A, V, W, Omega = turn(2, yaw), 8.0, 0.4, 30.0
    x = motion(0.285, v=A @ [V, W, 0], omega=A @ [0, Omega, 0], A=A)
    seen, wrench, _ = answer(law_of(flattening=0.0), x)
    assert_allclose([seen["Vx"], seen["Vsy"], seen["Vsx"]], [V, W, V - R0 * Omega], rtol=1e-12)
    kappa = -(V - R0 * Omega) / V
    assert_allclose([seen["kappa"], seen["alpha"]], [kappa, np.arctan(W / V)], rtol=1e-9)
    limit = seen["Fz"]
    F = np.array([8e4 * kappa, -6e4 * W / V])
    F *= min(1.0, limit / np.linalg.norm(F))
    assert_allclose(A.T @ wrench[1, :3], [*F, seen["Fz"]], rtol=1e-9)


def test_a_spinning_wheel_keeps_its_contact_axes():
    for phi in (0.5, 3.0):
        A = turn(1, phi)
        seen, _, _ = answer(law_of(), motion(0.285, v=(8, 0.1, 0), omega=(0, 28, 0), A=A))
        assert_allclose([seen["Vx"], seen["Vsy"], seen["gamma"]], [8, 0.1, 0], atol=1e-12)


def test_wrenches_on_wheel_and_road_balance():
    """Force and moment about one point: that of a moving, turned road too."""
    rng = np.random.default_rng(3)
    road = np.concatenate([rng.normal(size=3) * 0.1, turn(2, 0.3).ravel(), rng.normal(size=6)])
    law = law_of(relaxation_x=0.2, relaxation_y=0.4, trail=0.03, rolling_resistance=0.02)
    x = motion(road[2] + 0.28, v=rng.normal(size=3), omega=(0.3, 20, 0.2), A=turn(0, 0.1), at=(0.4, 0.2), road=road)
    _, wrench, _ = answer(law, x, [1e-3, 2e-3])
    assert_allclose(wrench[0, :3], -wrench[1, :3], rtol=1e-12)
    about_road = wrench[1, 3:] + np.cross(x[1, :3] - x[0, :3], wrench[1, :3])
    assert_allclose(wrench[0, 3:], -about_road, rtol=1e-9)


def test_only_the_motion_over_the_road_counts():
    """A road and a wheel that are turned and carried along together: outputs stay, wrenches turn with them."""
    B, v, omega = turn(2, 0.4) @ turn(0, 0.5), np.array([3.0, -1, 2]), np.array([0.2, 0.5, -0.4])
    law = law_of(relaxation_x=0.2, relaxation_y=0.4, trail=0.03, rolling_resistance=0.02, damping=100.0)
    x = motion(0.285, v=(6, 0.5, -0.1), omega=(0.1, 22, 0.3), A=turn(0, 0.05))
    moved = np.zeros_like(x)
    for m in range(2):
        r = B @ x[m, :3]
        moved[m, :3] = r + np.array([7, 8, 9])
        moved[m, 3:12] = (B @ x[m, 3:12].reshape(3, 3)).ravel()
        moved[m, 12:15] = B @ x[m, 12:15] + v + np.cross(omega, r)
        moved[m, 15:] = B @ x[m, 15:] + omega
    seen, wrench, z_dot = answer(law, x, [1e-3, 2e-3])
    seen_2, wrench_2, z_dot_2 = answer(law, moved, [1e-3, 2e-3])
    for key in ("Fx", "Fy", "Fz", "Mx", "My", "Mz", "kappa", "alpha", "gamma", "Vsx", "power_lost"):
        assert_allclose(seen_2[key], seen[key], rtol=1e-9, atol=1e-9, err_msg=key)
    assert_allclose(z_dot_2, z_dot, rtol=1e-9)
    assert_allclose(wrench_2[1], np.concatenate([B @ wrench[1, :3], B @ wrench[1, 3:]]), rtol=1e-9, atol=1e-9)


def test_on_a_slope_the_road_acts_along_its_normal():
    m = 0.3
    road = wheels.profile_road([-10.0, 10.0], [-10 * m, 10 * m])
    c, h = np.array([1.0, 0.0, 0.0]), 0.28
    n = np.array([-m, 0, 1]) / np.hypot(1, m)
    c = np.array([2.0, 0, 2 * m]) + h * n
    law = tyre(road=road).law(placed(h))
    seen, wrench, _ = answer(law, motion(c[2], at=c[:2]))
    assert_allclose(seen["deflection"], R0 - h, rtol=1e-10)
    assert_allclose(wrench[1, :3], K * (R0 - h) * n, atol=1e-8)
    assert_allclose([seen["px"], seen["pz"]], [2.0, 2 * m], rtol=1e-10)


def test_over_a_wave_the_foot_lies_where_the_normal_meets_the_centre():
    """z = a cos(w x): minimise the distance of the centre by SciPy instead."""
    from scipy.optimize import minimize_scalar

    a, w = 0.05, 1.5
    x = np.linspace(-3, 3, 1201)
    road = wheels.profile_road(x, a * np.cos(w * x))
    law = tyre(road=road).law(placed(0.34))
    for at in (0.3, 0.8, 1.5):
        z = a * np.cos(w * at) + 0.29

        def distance(s, at=at, z=z):
            return np.hypot(s - at, a * np.cos(w * s) - z)

        best = minimize_scalar(distance, bounds=(at - 0.2, at + 0.2), method="bounded")
        seen, _, _ = answer(law, motion(z, at=(at, 0)))
        assert_allclose(seen["loaded_radius"], best.fun, rtol=1e-5)
        assert_allclose(seen["px"], best.x, atol=1e-3)


def test_an_enveloped_edge_pushes_along_the_line_from_edge_to_centre():
    h, at = 0.08, 3.0
    road = wheels.step(at, h, length=6.0).enveloped(R0, step=0.001)
    law = tyre(road=road).law(placed(0.3))
    back, d = 0.12, 0.004
    direction = np.array([-back, np.sqrt(R0**2 - back**2)]) / R0
    z = h + np.sqrt(R0**2 - back**2) - d / direction[1]
    _, wrench, _ = answer(law, motion(z, at=(at - back, 0)))
    assert_allclose(wrench[1, [0, 2]] / np.linalg.norm(wrench[1, :3]), direction, atol=2e-3)
    assert_allclose(np.linalg.norm(wrench[1, :3]), K * d, rtol=2e-3)


def test_what_is_left_of_the_road_is_shown():
    law = tyre(road=wheels.profile_road([0.0, 50.0], [0.0, 0.0])).law(placed(0.28))
    left = [answer(law, motion(0.28, at=(x, 0)))[0]["road_left"] for x in (10.0, 45.0, 52.0)]
    assert_allclose(left, [10, 5, -2], rtol=1e-12)


@pytest.mark.parametrize("kind", ["linear", "brush", "magic"])
def test_a_complex_step_gives_the_derivatives(kind):
    """Against central differences, at a generic state of a leaning, slipping wheel."""
    rng = np.random.default_rng(5)
    if kind == "linear":
        law = law_of(relaxation_x=0.2, relaxation_y=0.4, trail=0.02, camber_stiffness=900.0, damping=50.0, friction=0.9)
    elif kind == "brush":
        law = wheels.BrushTyre(
            "t", ROAD, WHEEL, radius=R0, stiffness=K, nominal_load=4000, slip_stiffness=6e4, contact_length=0.15,
            relaxation_x=0.2, relaxation_y=0.3, damping=50.0,
        ).law(placed(0.28))  # fmt: skip
    else:
        properties = wheels.read_tyre_file(wheels.shipped_tyre("passenger_car_61"))
        law = wheels.MagicFormulaTyre("t", ROAD, WHEEL, properties).law(placed(0.28))
    z = np.array([2e-3, -3e-3])
    for speed in (12.0, 0.3):
        x = motion(0.285, v=(speed, 0.2, -0.1), omega=(0.1, speed / 0.29, 0.2), A=turn(0, 0.1))
        direction, dz = rng.normal(size=x.shape), rng.normal(size=2) * 1e-2
        _, wrench, z_dot = answer(law, x + 1e-30j * direction, z + 1e-30j * dz, kind=complex)
        h = 1e-6
        up, down = (answer(law, x + s * h * direction, z + s * h * dz) for s in (1, -1))
        for exact, k in ((wrench, 1), (z_dot, 2)):
            differences = (up[k] - down[k]) / (2 * h)
            assert_allclose(exact.imag / 1e-30, differences, rtol=1e-5, atol=1e-5 * np.abs(differences).max())


@pytest.mark.parametrize(
    ("height", "A", "message"),
    [
        (-0.3, None, "below the road"),
        (0.3, turn(0, np.pi / 2), "along the road's normal"),
    ],
)
def test_a_wheel_upside_down_or_on_its_side_is_refused(height, A, message):
    with pytest.raises(ModelError, match=message):
        law_of(height, A)


def test_the_envelope_of_another_wheel_is_refused():
    road = wheels.step(1.0, 0.05, length=3.0).enveloped(0.25)
    with pytest.raises(ModelError, match=r"radius of the wheel is 0\.3"):
        tyre(road=road)


def test_ground_that_is_too_steep_for_a_wheel_is_refused_until_it_is_enveloped():
    road = wheels.profile_road([0, 1, 1.01, 2], [0, 0, 0.1, 0.1])
    with pytest.raises(ModelError, match="slope of 10"):
        tyre(road=road)
    tyre(road=road.enveloped(R0))
