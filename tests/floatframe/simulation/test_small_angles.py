"""Runs tell where bushings and bearings turn further than small angles allow, and are silent where they may turn."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from floatframe import GeneralizedAlpha, Marker, RigidBody, System, integrate
from floatframe.components.bearings import Bearing
from floatframe.forces import Bushing

PLACE = np.array([40.0, -3.0, 7.0])
TRIAD = Rotation.from_rotvec([0.4, -0.7, 0.2]).as_matrix()


def turning(theta, *, stiffness=(1.0, 1.0, 1.0, 1.0, 1.0, 1.0), axes="a", bearing=None, spin=0.0):
    """A body far from the origin whose marker is turned by theta against that of the ground, in turned axes."""
    turn = Rotation.from_matrix(TRIAD @ Rotation.from_rotvec(theta).as_matrix() @ TRIAD.T).as_quat()
    body = RigidBody(
        "body", 2.0, np.diag([2.0, 2.0, 2.0]), position=PLACE, orientation=np.roll(turn, 1),
        omega_B=spin * TRIAD[:, 2],
    )  # fmt: skip
    a, b = Marker("ground", position=PLACE, triad=TRIAD), Marker("body", position=np.zeros(3), triad=TRIAD)
    forces = [] if bearing is not None else [Bushing("bush", a, b, np.array(stiffness), axes=axes)]
    elements = [] if bearing is None else [Bearing("oil", a, b, 1.0, **bearing)]
    return System([body], (), forces, elements=elements)


def notes_of(system, h=1e-6, n=2):
    motion = integrate(system, GeneralizedAlpha(0.8), n * h, h, watch="off")
    return {(note.body, note.kind): note for note in motion.validity}


@pytest.mark.parametrize("axes", ["a", "b", "half way"])
def test_angles_about_two_axes_are_told(axes, caplog):
    """Cardan angles by SciPy: as far off as the note says, and no note below the limit."""
    theta = np.array([0.35, 0.0, 0.3])
    (note,) = notes_of(turning(theta, axes=axes)).values()
    assert (note.body, note.kind) == ("forces.bush", "angles")
    cardan = Rotation.from_rotvec(theta).as_euler("XYZ")
    apart = np.abs(cardan - theta).max() / np.linalg.norm(theta)
    assert_allclose(note.largest, apart, rtol=0.05)
    assert note.largest > note.limit == 0.05
    assert "forces.bush, t = 0: it rotates so far about several axes that its angles, the components" in caplog.text
    assert notes_of(turning(0.4 * theta, axes=axes)) == {}


def test_a_bushing_that_turns_about_one_axis_is_silent():
    assert notes_of(turning([0.0, 0.0, 2.0])) == {}
    assert notes_of(turning([0.0, 0.0, 0.0], spin=6.0), h=0.05, n=60) == {}  # nearly three turns, which it counts


def test_a_bushing_without_angles_is_silent():
    assert notes_of(turning([1.0, 1.0, 1.0], stiffness=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0))) == {}


def test_a_small_tilt_near_a_full_turn_is_told():
    """The rotation vector of a spin of 350° with a tilt of 0.02 rad has a large part across the spin."""
    turned = turning([0.02, 0.0, 0.0], spin=-10.0)
    (note,) = notes_of(turned, h=0.002, n=300).values()
    assert note.kind == "angles"
    assert 0.5 < note.t_largest < 0.6283 + 0.06  # near the full turn


def test_the_tilt_of_a_bearing_is_told():
    for tilt, is_told in ((0.5, False), (0.7, True)):
        found = notes_of(turning([0.3 * tilt, 0.0, 0.0], bearing={"tilt_stiffness": 1.0}))
        assert found == {}
        found = notes_of(turning([tilt, 0.0, 0.0], bearing={"tilt_stiffness": 1.0}))
        assert (("elements.oil", "tilt") in found) is is_told
        if is_told:
            assert_allclose(found["elements.oil", "tilt"].largest, 1.0 - np.sin(tilt) / tilt, rtol=1e-6)
    assert notes_of(turning([0.7, 0.0, 0.0], bearing={})) == {}
