"""Tests of the engine in the coordinates of joints: `pytest --formulation relative` runs those of these rooms again.

What is not given a formulation takes "relative" then: motions by generalized-alpha and its cases, equilibria and small
motions. Schemes that are absolute alone stay as they are, and so do what a test asks for by name, and driven motions.
"""

import functools
import inspect
from pathlib import Path

import pytest

from tests.root import ROOT

#: rooms of tests/floatframe that run a system as a whole
ROOMS = (
    "analyses", "components/bearings", "components/cables", "components/clearances", "components/friction",
    "engine/compiling", "engine/initial_conditions", "integrators", "model/bodies", "model/elements", "model/forces",
    "model/joints", "results", "simulation",
)  # fmt: skip

#: of their files, those that every change runs again: forces in joints and by users, couplers, events, stops, sensors
SHORT = tuple(
    f"tests/floatframe/{name}.py"
    for name in (
        "model/joints/test_coordinate_coupler", "model/forces/test_joint_forces", "simulation/test_events",
        "simulation/test_stops", "results/test_place_motion_and_export",
    )
)  # fmt: skip

KINDS = "a joint of the tree beside a constraint of another kind: both are constraints in absolute coordinates, and "
BESIDE = "compares a run of another process, which is not told of the formulation, bit for bit"
CLOSED = "measures the order of a drift of joints, and those of the tree are closed to 4e-15"
ZEROS = "counts zero eigenvalues: 6 and 4 here at the two speeds, 5 there"
NEAR = "compares responses at once with those in an equilibrium to 3e-6 and 1e-8: single values differ by 4e-8 here"
SPIN_UP = "bends by the exact beam to 0.5 % there, to 0.57 and 0.60 % here, with the same steps"

#: tests that do not hold in relative coordinates, with what is known of each: every one of them fails there, or it does
#: not belong here
EXCEPTIONS: dict[str, str] = {
    "analyses/test_linear_sensors.py::test_inputs_act_as_forces_of_their_size_at_once_and_in_equilibrium[motor]": NEAR,
    "analyses/test_linear_sensors.py::test_inputs_act_as_forces_of_their_size_at_once_and_in_equilibrium[stiffness]":
        NEAR,
    "analyses/test_rotors.py::test_states_are_no_rounding_of_motions_that_joints_hold":
        "asks for motions that the rail holds, and the coordinate of the joint is the only motion here",
    "analyses/test_moving_bases.py::test_response_of_a_reaction_is_that_of_the_motion_under_a_harmonic_drive":
        "compares a moment that is exactly zero there, and 7e-12 here",
    "analyses/test_steady_motion.py::test_the_bicycle_weaves_and_capsizes_as_the_benchmark_says[5.0]": ZEROS,
    "analyses/test_steady_motion.py::test_the_bicycle_weaves_and_capsizes_as_the_benchmark_says[8.0]": ZEROS,
    "engine/compiling/test_spinning_beams.py::test_spin_up_bends_and_shortens_as_the_exact_beam[tangent]": SPIN_UP,
    "engine/compiling/test_spinning_beams.py::test_spin_up_bends_and_shortens_as_the_exact_beam[mean axis]": SPIN_UP,
    "engine/compiling/test_spinning_beams.py::test_spin_up_of_a_body_of_solids": SPIN_UP,
    "model/elements/test_public_elements.py::test_three_multipliers_hold_a_flexible_pendulum_as_a_spherical_joint_does":
        KINDS + "agree to 1e-11 there, to 3e-7 here",
    "integrators/test_pendulum.py::test_without_stabilisation_velocities_of_the_joint_close_to_second_order": CLOSED,
    "integrators/test_turning.py::test_an_arm_that_turns_too_far_in_a_step_is_refused_by_name":
        "a hinge of the tree follows any turn in a step, so nothing is refused",
    "model/joints/test_sliding.py::test_on_a_rigid_line_it_is_the_point_on_a_line_and_the_prismatic_joint[True]":
        KINDS + "agree to 1e-8 there, to 6e-6 here",
    "simulation/test_restart.py::test_killed_run_is_readable_and_can_be_resumed[2-0.6]": BESIDE,
    "simulation/test_stops.py::test_a_latch_between_free_flexible_bodies_keeps_momentum_and_loses_what_carnot_says":
        "linear momentum is kept to 1e-8 there, to 1.3e-7 here",
    "simulation/test_validity.py::test_an_equilibrium_tells_a_load_near_buckling_and_the_far_bend_above_it":
        "above buckling the load is told, but no far bend; why is not known",
    "results/test_results_file.py::test_steps_one_by_one_are_the_same_motion_to_the_tolerance":
        "steps one by one by the absolute method, which the test calls itself",
    "results/test_results_file.py::test_a_killed_run_leaves_a_readable_file": BESIDE,
}  # fmt: skip


def take_relative() -> None:
    """Make the relative formulation that of all that is not given one."""
    import floatframe.simulation.integrate as integration
    from floatframe import linearize, static_equilibrium
    from floatframe.analyses import steady_rotation
    from floatframe.integrators.generalized_alpha import GeneralizedAlpha

    for function in (linearize, static_equilibrium, steady_rotation):
        inspect.unwrap(function).__kwdefaults__["formulation"] = "relative"
    given = integration.in_formulation

    @functools.wraps(given)
    def chosen(integrator, formulation):
        if formulation is None and isinstance(integrator, GeneralizedAlpha):
            formulation = "relative"
        return given(integrator, formulation)

    integration.in_formulation = chosen


def select(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep tests of the engine, and expect those that are exceptions to fail."""
    folders = [ROOT / "tests" / "floatframe" / room for room in ROOMS]
    chosen = [item for item in items if any(Path(item.path).is_relative_to(folder) for folder in folders)]
    config.hook.pytest_deselected(items=[item for item in items if item not in set(chosen)])
    for item in chosen:
        reason = EXCEPTIONS.get(f"{Path(item.path).relative_to(ROOT / 'tests' / 'floatframe')}::{item.name}")
        if reason is not None:
            item.add_marker(pytest.mark.xfail(strict=True, reason=reason))
    items[:] = chosen
