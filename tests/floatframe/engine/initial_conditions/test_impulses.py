"""A drive that begins with a rate while its bodies rest: velocities that fit, words where a run fails by the blow."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from benchmarks.field_beams import parts, segments
from floatframe import GROUND, GeneralizedAlpha, Marker, PrismaticJoint, RigidBody, System, integrate
from floatframe.components.mechanisms import misaligned_four_bar
from floatframe.engine.initial_conditions.impulses import words_of_begun_drives
from floatframe.engine.initial_conditions.initial import consistent_state
from floatframe.errors import ConvergenceError
from floatframe.model.functions.time_functions import cycloidal_spin_up, polynomial_of_time

H, AT_ONCE = 4e-3, polynomial_of_time([0.0, -0.6])


@pytest.mark.parametrize("describe", [parts(1), segments(5)], ids=["parts", "segments"])
def test_bodies_begin_with_velocities_that_fit_a_drive_that_begins_with_a_rate(describe):
    system = misaligned_four_bar(describe, turn=AT_ONCE)
    begun = consistent_state(system).state
    if not len(begun.q):  # the first segment is clamped to the drive
        assert_allclose(begun.u[5], -0.6, rtol=1e-9)
    assert words_of_begun_drives(system, 0.0, begun, H) == ""


def test_a_run_that_a_drive_begins_with_a_blow_tells_so_with_its_rate_and_what_to_do():
    """Rigid segments on stiff springs: the first one is at 0.6 rad/s at once, the others wait for the wave.

    Steps follow them for all that; Newton's method without room for its iterations does not.
    """
    system = misaligned_four_bar(segments(5), turn=AT_ONCE)
    told = (
        r"the drive of 'angle' of joint 'A' begins at t = 0 with 0\.6 rad/s, which differs by 0\.6 rad/s from the "
        r"given velocities of its bodies\. .* Begin the drive gradually \(cycloidal_spin_up\)"
    )
    with pytest.raises(ConvergenceError, match=told) as error:
        integrate(system, GeneralizedAlpha(0.3, max_iterations=2), 0.2, H)
    assert str(error.value).count("begins at t = 0") == 1
    softly = misaligned_four_bar(segments(5), turn=cycloidal_spin_up(-0.6, 0.1))
    assert integrate(softly, GeneralizedAlpha(0.3), 0.2, H).is_complete


def test_steps_that_do_not_follow_the_blow_lead_where_shorter_ones_do():
    """To a thousandth of a millimetre of 7 cm: unresolved springs between the segments are not kicked by the start."""
    ends = []
    system = misaligned_four_bar(segments(5), turn=AT_ONCE)
    for h in (H, H / 2):
        motion = integrate(system, GeneralizedAlpha(0.3), 0.1, h, watch="off")
        ends.append(np.concatenate([motion.body(body.name).r[-1] for body in system.bodies]))
    assert_allclose(ends[0], ends[1], rtol=0, atol=1e-6)


def test_what_fits_is_not_told():
    soft = misaligned_four_bar(segments(5), turn=cycloidal_spin_up(-0.6, 0.1))
    assert words_of_begun_drives(soft, 0.0, None, H) == ""
    assert words_of_begun_drives(System([RigidBody("b", 1.0, np.eye(3))]), 0.0, None, H) == ""


@pytest.mark.parametrize(
    ("speed", "told"),
    [(0.0, "with 2 m/s, which differs by 2 m/s from"), (1.5, "with 2 m/s, which differs by 0.5 m/s from"), (2.0, "")],
)
def test_a_slide_is_told_in_lengths(speed, told):
    guide = PrismaticJoint(
        "guide", GROUND, Marker("b"), axis=(1, 0, 0), motions={"distance": polynomial_of_time([0.0, 2.0])}
    )
    system = System([RigidBody("b", 1.0, np.eye(3), velocity=(speed, 0, 0))], [guide])
    words = words_of_begun_drives(system, 0.0, None, H)
    assert told in words if told else words == ""
