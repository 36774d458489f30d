"""A lifting surface: its forces against the definition of lift and drag, a gliding body against SciPy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import floatframe as ff
from floatframe.components.aerodynamics import LiftingSurface
from floatframe.model.rotations import rotation_exp
from tests.floatframe.components.aerodynamics.examples import NUMBERS, WING, glider, surface
from tests.floatframe.element_laws import evaluate, marker_motion, placed


def answered(v, turn=(0, 0, 0), **changes):
    law = surface(**changes).law(placed(np.array([marker_motion([0, 0, 0])]), on_ground=(False,)))
    x = marker_motion([1.0, 2.0, 3.0], v=v)
    x[3:12] = rotation_exp(np.array(turn)).ravel()
    return evaluate(law, 0.0, np.array([x]), np.zeros(0))


@pytest.mark.parametrize("turn", [(0, 0, 0), (0.3, -0.2, 0.5)])
def test_lift_is_normal_to_the_flow_and_drag_along_it(turn):
    """In axes of the surface, wherever it points: alpha = 0.06, with a component along the span that does nothing."""
    A = rotation_exp(np.array(turn))
    V, alpha = 40.0, 0.06
    flow = V * np.array([np.cos(alpha), 0, -np.sin(alpha)])
    wrench, _, seen = answered(A @ (flow + np.array([0, 3.0, 0])), turn)
    q, C = 0.5 * 1.2 * V**2 * 12, 5 * 0.16
    lift, drag = q * C, q * (0.03 + 0.05 * C**2)
    expected = lift * np.array([np.sin(alpha), 0, np.cos(alpha)]) - drag * flow / V
    assert_allclose(A.T @ wrench[0, :3], expected, rtol=1e-12, atol=1e-9)
    assert_allclose([seen["lift"], seen["drag"], seen["alpha"], seen["speed"]], [lift, drag, alpha, V], rtol=1e-12)
    assert_allclose(seen["power lost"], drag * V, rtol=1e-12)
    moved = answered(A @ flow + np.array([5, -7, 1]), turn, wind=[5, -7, 1])[0]
    assert_allclose(moved, wrench, rtol=1e-12, atol=1e-9)


def test_lift_stays_beyond_its_largest_coefficient_and_there_is_none_at_rest():
    assert answered([10.0, 0, -8.0])[2]["lift coefficient"] == 1.5
    assert answered([10.0, 0, 8.0], most_lift=0.7)[2]["lift coefficient"] == -0.7
    assert not answered([0.0, 0, 0])[0].any()


def test_a_body_that_keeps_level_glides_as_scipy_says_while_its_lift_fades():
    system = glider()
    assert ff.analyses.check_element(system, "wing").findings == ()
    motion = ff.integrate(system, ff.GeneralizedAlpha(0.9, 1e-11), 1.5, 1e-3)

    def rates(t, y):
        u, w = y
        s = np.clip((t - 0.5) / 0.5, 0, 1)
        factor = 1 - 0.8 * s**3 * (10 - 15 * s + 6 * s * s)
        C = 5 * (np.arctan2(-w, u) + 0.1 - 0.02 * t) * factor
        q = 0.6 * 12 * np.hypot(u, w)
        D = 0.03 + 0.05 * C**2
        return [(-q * (C * w + D * u)) / 500, q * (C * u - D * w) / 500 - 9.81]

    exact = solve_ivp(rates, (0, 1.5), [30.0, -1.0], rtol=1e-10, atol=1e-10).y[:, -1]
    assert exact[1] < -3.0
    assert_allclose(motion.state(len(motion.t) - 1).u[[0, 2]], exact, rtol=2e-6)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"area": 0.0}, "area: expected"),
        ({"lift_slope": -1.0}, "lift_slope"),
        ({"most_lift": 0.0}, "most_lift"),
        ({"wind": [1.0]}, "wind"),
        ({"marker": 3}, "marker: expected a Marker"),
    ],
)
def test_numbers_out_of_their_range_are_refused(changes, message):
    with pytest.raises(ff.errors.ModelError, match=message):
        LiftingSurface("wing", **({"marker": WING} | NUMBERS | changes))
