import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from floatframe import GROUND, FlexibleBody, GeneralizedAlpha, Gravity, Marker, RevoluteJoint, RigidBody, System
from floatframe.pictures.overview import overview_pages, plot_deformation, plot_loads, plot_places
from floatframe.pictures.plots import plot_drift, plot_energy_balance
from floatframe.results.energy_balance import balance_defect, energy_scale
from floatframe.results.recovery import elastic_displacements, interface_positions
from floatframe.simulation.integrate import integrate
from tests.synthetic import synthetic_reduced_body


@pytest.fixture(scope="module")
def body():
    return synthetic_reduced_body(units="m-kg-s")


@pytest.fixture(scope="module")
def motion(body):
    """A flexible body that hangs on a pin and swings."""
    part = FlexibleBody("part", body, omega_B=np.array([0.0, 3.0, 0.0]))
    pin = RevoluteJoint("pin", GROUND, Marker("part", "big_end"), axis=(0, 1, 0))
    system = System([part], [pin], [Gravity((0, 0, -9.81))])
    return integrate(system, GeneralizedAlpha(), t_end=0.02, h=1e-4)


def curves(ax) -> dict[str, np.ndarray]:
    return {line.get_label(): line.get_ydata() for line in ax.lines}


def test_elastic_displacement_is_the_sum_over_modes(body, motion):
    interface, q = body.interfaces[1], motion.body("part").q
    u = elastic_displacements(motion, "part", body, interface.name)
    for k in (0, 57, 200):
        expected = sum(q[k, j] * interface.Psi[:3, j] for j in range(body.n_q))
        assert_allclose(u[k], expected, rtol=0, atol=1e-12 * np.abs(u).max())


def test_panels_draw_the_numbers_of_the_motion(body, motion):
    assert_array_equal(plot_energy_balance(motion).lines[0].get_ydata(), balance_defect(motion) / energy_scale(motion))
    assert_array_equal(curves(plot_deformation(motion, {}))["part q2"], motion.body("part").q[:, 1])
    assert_array_equal(curves(plot_loads(motion))["pin"], np.linalg.norm(motion.reaction("pin").force, axis=1))
    name = body.interfaces[1].name
    displacement = elastic_displacements(motion, "part", body, name)
    assert_array_equal(
        curves(plot_deformation(motion, {"part": body}))[f"part {name}"], np.linalg.norm(displacement, axis=1)
    )
    drawn = curves(plot_places(motion, {"part": body}))
    assert_array_equal(drawn[f"part {name} x"], interface_positions(motion, "part", body, name)[:, 0])
    assert "part big_end x" not in drawn  # it is pinned


def test_axes_tell_what_and_in_which_unit(motion):
    assert plot_loads(motion).get_xlabel() == "time [s]"
    assert plot_loads(motion).get_ylabel() == "force in joints and springs [N]"
    assert plot_drift(motion).get_yscale() == "log"


def test_of_many_curves_the_largest_are_drawn():
    body = synthetic_reduced_body(n_q=12, units="m-kg-s")
    system = System([FlexibleBody("part", body, q_dot=np.arange(12.0))])
    ax = plot_deformation(integrate(system, GeneralizedAlpha(), t_end=1e-3, h=1e-4), {})
    assert len(ax.lines) == 8
    assert ax.get_title(loc="right") == "the largest 8 of 12"


def test_the_overview_has_a_panel_for_each_kind_of_result(body, motion):
    labels = [ax.get_ylabel().split(" [")[0] for ax in overview_pages(motion, {"part": body})[0].axes]
    assert labels == [
        "position",
        "energy",
        "elastic displacement",
        "error of the energy balance / largest energy",
        "force in joints and springs",
        "drift of joints",
    ]
    assert any(ax.get_ylabel().startswith("modal") for ax in overview_pages(motion)[0].axes)
    rigid = System([RigidBody("ball", 1.0, np.eye(3), velocity=(1, 0, 0))])
    (fewer,) = overview_pages(integrate(rigid, GeneralizedAlpha(), t_end=0.01, h=1e-3))
    assert len(fewer.axes) == 3
