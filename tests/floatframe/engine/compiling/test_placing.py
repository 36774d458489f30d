"""Bodies without a position begin at the nearest pose that their joints ask for."""

import logging
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

import cms
import fe_models as fm
from floatframe import (
    GROUND,
    FixedJoint,
    FlexibleBody,
    GeneralizedAlpha,
    Marker,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    SpringDamper,
    System,
    integrate,
    read_system,
)
from floatframe.analyses import consistent_state
from floatframe.analyses.system_check import check_system
from floatframe.engine.compiling.placing import placed_bodies
from floatframe.errors import ModelError
from floatframe.joints import CylindricalJoint, PointOnPlane, ScrewJoint
from floatframe.model.forces import Gravity
from floatframe.model.functions.time_functions import harmonic
from tests.floatframe.examples import CRANK

POST = np.array([0.7, -0.4, 0.9])
TURN = Rotation.from_rotvec([0.5, -0.8, 0.3]).as_matrix()


def parameters(R):
    """Euler parameters (w, x, y, z) of a rotation matrix."""
    x, y, z, w = Rotation.from_matrix(R).as_quat()
    return np.array([w, x, y, z])


def positions(system):
    """Positions of the bodies at the start, by name."""
    state = consistent_state(system).state
    return {body.name: state.r[i] for i, body in enumerate(system.bodies)}


def rotations(system):
    """Rotation matrices of the bodies as placed, by name."""
    return {b.name: Rotation.from_quat(np.roll(b.orientation, -1)).as_matrix() for b in placed_bodies(system)}


def rigid(name, **given):
    return RigidBody(name, 1.3, np.diag([0.02, 0.05, 0.06]), center_of_mass=(0.1, 0.02, -0.03), **given)


def chain(n, *, is_placed):
    """Oblique links on universal joints, listed from the tip to the post; each with an orientation of its own."""
    rng, here, bodies, joints, before = np.random.default_rng(4), POST, [], [], Marker(GROUND, position=POST)
    for k in range(n):
        R = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
        at, to = 0.3 * rng.normal(size=(2, 3))
        position = here - R @ at
        bodies.append(rigid(f"link {k}", orientation=parameters(R), position=position if is_placed else None))
        joints.append(SphericalJoint(f"joint {k}", before, Marker(f"link {k}", position=at)))
        before, here = Marker(f"link {k}", position=to), position + R @ to
    return System(bodies[::-1], joints, [Gravity((0.3, -0.2, -9.81))])


def test_a_chain_without_positions_moves_as_one_with_them():
    placed, free = chain(5, is_placed=True), chain(5, is_placed=False)
    expected, found = positions(placed), positions(free)
    for name, r in expected.items():
        assert_allclose(found[name], r, rtol=0, atol=1e-12)
    motions = [integrate(system, GeneralizedAlpha(), 0.02, 1e-3) for system in (placed, free)]
    assert_allclose(motions[1].body("link 4").r, motions[0].body("link 4").r, rtol=0, atol=1e-10)


def test_a_body_that_fits_its_joints_stays_bitwise_where_it_is_drawn():
    body = rigid("arm", orientation=parameters(TURN))
    joint = RevoluteJoint("pin", Marker(GROUND, position=TURN @ [0.2, 0.1, 0.0]), Marker("arm", position=(0.2, 0.1, 0)))
    (placed,) = placed_bodies(System([body], [joint]))
    assert_array_equal(placed.drawn_position, np.zeros(3))
    assert_array_equal(placed.orientation, body.orientation)


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_a_body_moves_by_a_small_gap_in_a_system_of_any_size(size):
    """A millionth of the system is a gap, not rounding."""
    arm, gap = size * np.array([0.2, -0.1, 0.3]), size * np.array([1e-6, -2e-6, 0.5e-6])
    joint = SphericalJoint("pin", Marker(GROUND, position=arm + gap), Marker("arm", position=arm))
    (body,) = placed_bodies(System([rigid("arm")], [joint]))
    assert_allclose(body.drawn_position, gap, rtol=0, atol=1e-12 * size)


@pytest.mark.parametrize("motions", [{}, {"angle": 0.0}, {"distance": 0.0}])
def test_a_screw_begins_with_coinciding_points(motions):
    axis, tip = np.array([1.0, 1.0, 0.0]) / np.sqrt(2), np.array([0.1, -0.2, 0.05])
    place = Marker(GROUND, position=POST)
    joint = ScrewJoint("screw", place, Marker("a", position=tip), axis=axis, lead=0.01, motions=motions)
    (body,) = placed_bodies(System([rigid("a")], [joint]))
    assert_allclose(body.position + tip, POST, rtol=0, atol=1e-15)


def test_what_joints_leave_free_stays_as_drawn():
    """Along the axis of a slider and in the plane of a point; a body on a spring stays at the origin."""
    axis = np.array([0.48, -0.6, 0.64])
    post = Marker(GROUND, position=POST)
    slider = System([rigid("block")], [PrismaticJoint("rail", post, Marker("block", position=(0, 0, 0)), axis=axis)])
    assert_allclose(positions(slider)["block"], POST - (POST @ axis) * axis, rtol=0, atol=1e-12)
    foot = System([rigid("foot")], [PointOnPlane("floor", post, Marker("foot", position=(0, 0, 0)), axis=axis)])
    assert_allclose(positions(foot)["foot"], (POST @ axis) * axis, rtol=0, atol=1e-12)
    hung = System([rigid("bob")], forces=[SpringDamper("rope", post, Marker("bob", position=(0, 0, 0)), 50.0)])
    assert_array_equal(positions(hung)["bob"], np.zeros(3))


@pytest.mark.parametrize("is_b", [True, False])
def test_a_prescribed_distance_is_that_at_the_start(is_b, caplog):
    axis, post, own = np.array([0.48, -0.6, 0.64]), Marker(GROUND, position=POST), Marker("block", position=(0, 0, 0))
    ends = (post, own) if is_b else (own, post)
    rail = PrismaticJoint("rail", *ends, axis=axis, motions={"distance": harmonic(0.5, 3.0, 1.2)})
    expected = POST + (1 if is_b else -1) * 0.5 * np.sin(1.2) * axis
    system = System([rigid("block")], [rail])
    assert_allclose(placed_bodies(system)[0].drawn_position, expected, rtol=0, atol=1e-12)
    assert_allclose(positions(system)["block"], expected, rtol=0, atol=1e-12)
    assert not caplog.records


@pytest.mark.parametrize("is_b", [True, False])
@pytest.mark.parametrize("kind", [RevoluteJoint, CylindricalJoint])
def test_a_given_axis_turns_the_body_by_the_smallest_rotation(kind, is_b):
    """The axis of rotation is normal to both axes, and the angle is that between them."""
    axis, axis_b = np.array([0.48, -0.6, 0.64]), np.array([0.0, 0.6, 0.8])
    post, own = Marker(GROUND, position=POST, triad=TURN), Marker("arm", position=(0.2, -0.1, 0.3))
    ends, axes = ((post, own), (axis, axis_b)) if is_b else ((own, post), (axis_b, axis))
    system = System([rigid("arm")], [kind("pin", *ends, axis=axes[0], axis_b=axes[1])])
    R, there = rotations(system)["arm"], TURN @ axis
    assert_allclose(R @ axis_b, there, rtol=0, atol=1e-14)
    turn = Rotation.from_matrix(R).as_rotvec()
    assert_allclose(turn, np.cross(axis_b, there) * np.arccos(axis_b @ there) / np.linalg.norm(np.cross(axis_b, there)))
    state = consistent_state(system).state
    assert_allclose(state.p[0], placed_bodies(system)[0].orientation, rtol=0, atol=1e-12)


def test_opposite_axes_turn_the_body_by_half_a_turn():
    axis = np.array([0.48, -0.6, 0.64])
    joint = RevoluteJoint("pin", Marker(GROUND, position=POST), Marker("arm"), axis=axis, axis_b=-axis)
    assert_allclose(rotations(System([rigid("arm")], [joint]))["arm"] @ -axis, axis, rtol=0, atol=1e-14)


@pytest.mark.parametrize("off", [1e-3, 1e-6, 1e-7, 2e-8, 5e-9, 1e-12])
def test_nearly_opposite_axes_turn_the_body_by_a_rotation(off):
    """As of axes that are given with a few digits; the middle of both is known to the rounding over its size."""
    axis, normal = np.array([0.48, -0.6, 0.64]), np.array([-0.6, -0.48, 0.0]) / np.hypot(0.6, 0.48)
    axis_b = (-axis + off * normal) / np.linalg.norm(-axis + off * normal)
    joint = RevoluteJoint("pin", Marker(GROUND, position=POST), Marker("arm"), axis=axis, axis_b=axis_b)
    (body,) = placed_bodies(System([rigid("arm")], [joint]))
    R = Rotation.from_quat(np.roll(body.orientation, -1)).as_matrix()
    assert_allclose(R @ axis_b, axis, rtol=0, atol=min(3e-8, 1e-15 / off))


@pytest.mark.parametrize("is_b", [True, False])
def test_a_fixed_rotation_turns_the_body(is_b):
    R_AB, triad = Rotation.from_rotvec([2.1, 0.4, -1.0]).as_matrix(), Rotation.from_rotvec([0.2, 1.4, 0.3]).as_matrix()
    post, own = Marker(GROUND, position=POST, triad=TURN), Marker("arm", position=(0.2, -0.1, 0.3), triad=triad)
    ends, R = ((post, own), TURN @ R_AB @ triad.T) if is_b else ((own, post), TURN @ R_AB.T @ triad.T)
    system = System([rigid("arm")], [FixedJoint("weld", *ends, rotation=R_AB)])
    assert_allclose(rotations(system)["arm"], R, rtol=0, atol=1e-14)
    assert_allclose(positions(system)["arm"], POST - R @ [0.2, -0.1, 0.3], rtol=0, atol=1e-12)


@pytest.mark.parametrize("frame", [cms.NodalFrame("start"), cms.TisserandFrame()])
def test_a_flexible_body_is_placed_by_its_interface_in_any_frame(frame):
    """Deformed and turned at the start, drawn away from the origin, and stiffened, so that it moves in mean axes."""
    line = fm.beams.straight_line((0.3, -0.2, 0.5), (0.9, 0.1, 0.2), 3)
    ends = [fm.beams.line_interface(line, name, fm.selections.NodeSet(name)) for name in ("start", "end")]
    steel = fm.Material("steel", E=2.1e11, nu=0.3, rho=7850.0)
    full = cms.couple(
        fm.beam_body(
            line,
            fm.beams.BeamProperty(fm.beams.Rectangle(0.02, 0.03), steel),
            name="arm",
            units="m-kg-s",
            interfaces=ends,
        )
    )
    reduced = cms.reduce(full, cms.craig_bampton(full, 2), frame=frame)
    q = 1e-6 * np.arange(1.0, reduced.n_q + 1)
    post, other = Marker(GROUND, position=POST), Marker("block", position=(0.1, 0.2, 0.3))
    joints = [SphericalJoint("pin", post, other), SphericalJoint("knee", other, Marker("arm", "end"))]
    arm = FlexibleBody("arm", reduced, orientation=parameters(TURN), q=q)
    system = System([rigid("block"), arm], joints)
    state = consistent_state(system).state
    _, placed = placed_bodies(system)
    assert_allclose(state.r[1], placed.frame_position, rtol=0, atol=1e-12)
    assert_allclose(state.q, q, rtol=0, atol=1e-12)  # the joint moves the body and does not deform it
    end = reduced.interface("end")
    moved = end.position + end.Psi[:3] @ q
    assert np.linalg.norm(end.Psi[:3] @ q) > 1e-6
    expected = placed.frame_position + placed.frame_orientation @ moved
    assert_allclose(expected, POST, rtol=0, atol=1e-7)  # bending has a part of second order


def without_positions(text):
    """A system file whose bodies give no position, and whose joints have two markers."""
    text = "\n".join(line for line in text.splitlines() if not line.startswith("position = "))
    both = text.replace('body_b = "crank"\n', 'body_b = "crank"\nmarker_b = [0, 0, 0]\n')
    return both.replace("marker_a = [0.2, 0, 0]\n", "marker_a = [0.2, 0, 0]\nmarker_b = [0, 0, 0]\n")


def test_a_loop_of_a_file_closes_without_positions_in_silence(tmp_path, caplog):
    """The crank of the examples: the block slides until the rod reaches it, and the rod turns."""
    states = []
    for name, text in (("given", CRANK), ("free", without_positions(CRANK))):
        (tmp_path / f"{name}.toml").write_text(text, encoding="utf-8")
        system, _ = read_system(tmp_path / f"{name}.toml")
        states.append(positions(system))
    assert system.body("rod").position is None
    assert_allclose(states[1]["block"], states[0]["block"], rtol=0, atol=1e-10)
    assert_allclose(states[1]["rod"], states[0]["rod"], rtol=0, atol=1e-10)
    assert "from the position that its joints require" not in caplog.text


def test_a_loop_that_closes_far_from_where_bodies_hang_is_told(caplog):
    """Two bars of 0.5 m between posts 0.6 m apart, turned by a third of the angle that closes them."""
    turns = {"first": [0, 0, 0.3], "second": [0, 0, -0.3]}
    bars = [rigid(name, orientation=parameters(Rotation.from_rotvec(turn).as_matrix())) for name, turn in turns.items()]
    joints = [
        RevoluteJoint("left", Marker(GROUND, position=POST), Marker("first", position=(0, 0, 0))),
        SphericalJoint("middle", Marker("first", position=(0.5, 0, 0)), Marker("second", position=(0, 0, 0))),
        SphericalJoint("right", Marker(GROUND, position=(1.3, -0.4, 0.9)), Marker("second", position=(0.5, 0, 0))),
    ]
    with caplog.at_level(logging.WARNING):
        made = consistent_state(System(bars, joints)).state
    assert_allclose(made.r[1] - made.r[0], [0.3, 0.4, 0.0], rtol=0, atol=1e-9)  # a triangle of 0.5, 0.5 and 0.6
    assert "has no position: closing its joints moved it by" in caplog.text
    flat = [replace(bar, orientation=(1, 0, 0, 0)) for bar in bars]  # either side would do
    with pytest.raises(ModelError, match=r"No position is given for 'first', 'second': in a loop, give orientations"):
        consistent_state(System(flat, joints))


def test_a_body_without_position_is_never_refused_for_its_distance():
    joint = SphericalJoint("pin", Marker(GROUND, position=1e4 * POST), Marker("arm", position=(0.2, 0.0, 0.0)))
    assert_allclose(positions(System([rigid("arm")], [joint]))["arm"], 1e4 * POST - [0.2, 0, 0], rtol=1e-12, atol=0)


def test_the_check_says_where_bodies_stand_and_what_no_joint_asks_for():
    axis = (0.0, 0.0, 1.0)
    bodies = [rigid("arm"), rigid("block"), rigid("free"), rigid("given", position=POST)]
    post = Marker(GROUND, position=(0.5, 0.25, -1.0))
    joints = [SphericalJoint("pin", post, Marker("arm", position=(0, 0, 0))),
              PrismaticJoint("rail", post, Marker("block", position=(0, 0, 0)), axis=axis)]  # fmt: skip
    found = {record.name: record for record in check_system(System(bodies, joints))}["no position"]
    assert found.reason == (
        "'arm' begins at [0.5, 0.25, -1] m; 'block' begins at [0.5, 0.25, 0] m, as drawn in the direction that its "
        "joints leave free; 'free' begins at [0, 0, 0] m, as drawn: no joint asks for a position"
    )


def test_a_body_with_an_orientation_keeps_it_where_a_joint_gives_another():
    """The start then turns it to the joint, from where it was given."""
    joint = FixedJoint("weld", Marker(GROUND, position=POST), Marker("arm", position=(0.2, 0, 0)), rotation=np.eye(3))
    near = parameters(Rotation.from_rotvec([0.2, -0.1, 0.1]).as_matrix())
    system = System([rigid("arm", orientation=near)], [joint])
    assert_array_equal(placed_bodies(system)[0].orientation, near)
    assert_allclose(np.abs(consistent_state(system).state.p[0]), [1, 0, 0, 0], rtol=0, atol=1e-9)


def test_a_body_with_a_joint_to_the_ground_as_a_whole_stands_as_drawn():
    """Its joint lies where its marker is; the others hang at it, although the block has a marker on the ground."""
    rail = PrismaticJoint("rail", Marker(GROUND, position=(0.0, 0.1, 0.2)), Marker("block"), axis=(1, 0, 0))
    joints = [
        RevoluteJoint("main", GROUND, Marker("crank", position=(0.1, 0.1, 0.2))),
        SphericalJoint("pin", Marker("crank", position=(0.4, 0.1, 0.2)), Marker("rod", position=(0.0, 0.2, 0.0))),
        SphericalJoint("gudgeon", Marker("block"), Marker("rod", position=(0.8, 0.2, 0.0))),
        rail,
    ]
    system = System([rigid("block"), rigid("rod"), rigid("crank")], joints)
    placed = {body.name: body.drawn_position for body in placed_bodies(system)}
    assert_array_equal(placed["crank"], np.zeros(3))
    assert_allclose(placed["rod"], [0.4, -0.1, 0.2], rtol=0, atol=1e-14)
    assert_allclose(placed["block"], [1.2, 0.1, 0.2], rtol=0, atol=1e-14)
