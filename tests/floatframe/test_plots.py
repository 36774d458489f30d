import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from floatframe import GROUND, FlexibleBody, GeneralizedAlpha, Gravity, Marker, RevoluteJoint, RigidBody, System
from floatframe.energy_balance import balance_defect, energy_scale
from floatframe.integration import integrate
from floatframe.interface_motion import elastic_displacement, interface_path
from floatframe.plots import (
    plot_drift,
    plot_elastic_displacement,
    plot_energies,
    plot_energy_defect,
    plot_modal_coordinates,
    plot_overview,
    plot_positions,
    plot_reactions,
)
from floatframe.rotations import rotation_matrix
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


def test_an_interface_path_is_the_frame_and_the_deformed_place(body, motion):
    part = motion.body("part")
    interface = body.interfaces[1]
    path = interface_path(part, interface)
    for k in (0, 57, 200):
        u = sum(part.q[k, j] * interface.Psi[:3, j] for j in range(body.n_q))
        assert_allclose(elastic_displacement(part, interface)[k], u, rtol=0, atol=1e-12 * np.abs(u).max() + 1e-300)
        assert_allclose(path[k], part.r[k] + rotation_matrix(part.p[k]) @ (interface.position + u), rtol=1e-12)


def test_a_pinned_interface_stays_where_it_is(body, motion):
    path = interface_path(motion.body("part"), body.interface("big_end"))
    assert_allclose(path, np.broadcast_to(path[0], path.shape), rtol=0, atol=1e-9)


def test_plots_draw_the_numbers_of_the_motion(body, motion):
    energies = motion.energies
    drawn = curves(plot_energies(motion))
    assert_array_equal(drawn["kinetic"], energies.kinetic)
    assert_array_equal(drawn["total"], energies.total)
    assert_array_equal(plot_energy_defect(motion).lines[0].get_ydata(), balance_defect(motion) / energy_scale(motion))
    assert_array_equal(curves(plot_modal_coordinates(motion))["part q2"], motion.body("part").q[:, 1])
    assert_array_equal(curves(plot_reactions(motion))["pin"], np.linalg.norm(motion.reaction("pin").force, axis=1))
    label = f"part {body.interfaces[1].name}"
    displacement = elastic_displacement(motion.body("part"), body.interfaces[1])
    drawn = curves(plot_elastic_displacement(motion, {"part": body}))
    assert_array_equal(drawn[label], np.linalg.norm(displacement, axis=1))
    drawn = curves(plot_positions(motion, {"part": body}))
    assert_array_equal(drawn[f"{label} x"], interface_path(motion.body("part"), body.interfaces[1])[:, 0])
    assert "part big_end x" not in drawn  # it is pinned


def test_axes_tell_what_and_in_which_unit(motion):
    ax = plot_energies(motion)
    assert ax.get_xlabel() == "time [s]"
    assert ax.get_title(loc="left") == "energy [N m]"
    assert plot_drift(motion).get_yscale() == "log"


def test_of_many_curves_the_largest_are_drawn():
    body = synthetic_reduced_body(n_q=12, units="m-kg-s")
    system = System([FlexibleBody("part", body, q_dot=np.arange(12.0))])
    ax = plot_modal_coordinates(integrate(system, GeneralizedAlpha(), t_end=1e-3, h=1e-4))
    assert len(ax.lines) == 8
    assert "the largest 8 of 12" in [text.get_text() for text in ax.texts]


def test_the_overview_has_a_panel_for_each_kind_of_result(body, motion):
    titles = [ax.get_title(loc="left") for ax in plot_overview(motion, {"part": body}).axes]
    assert [title.split(" [")[0] for title in titles] == [
        "position", "energy", "elastic displacement of interfaces", "error of the energy balance / largest energy",
        "force in joints and springs", "drift of joints",
    ]  # fmt: skip
    assert any(ax.get_title(loc="left").startswith("modal") for ax in plot_overview(motion).axes)
    rigid = System([RigidBody("ball", 1.0, np.eye(3), velocity=(1, 0, 0))])
    fewer = plot_overview(integrate(rigid, GeneralizedAlpha(), t_end=0.01, h=1e-3))
    assert len(fewer.axes) == 3
