import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from cms.errors import BodyError
from cms.linear_algebra.solvers.eigen import eigenmodes
from cms.modes.mode_sets.mesh_field import coupled_field
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from tests import bodies
from tests.fe_models.small_frames import SI, STEEL, straight, supported_frequencies

ROUNDOFF = 1e-12
WIDTH, HEIGHT = 0.05, 0.07


def line(start, end, n, name, places, **options):
    mesh = fm.beams.straight_line(start, end, n)
    ends = [fm.beams.line_interface(mesh, label, fm.selections.NodeSet(at)) for label, at in places.items()]
    item = fm.beams.BeamProperty(fm.beams.Rectangle(WIDTH, HEIGHT), STEEL, **options)
    return cms.couple(fm.beam_body(mesh, item, name=name, units=SI, interfaces=ends))


def solid_bar(length, kind):
    mesh = bodies.box_mesh(8, 2, 2, length, WIDTH, HEIGHT, "hexahedron20")
    make = {"rigid": fm.rigid_interface, "distributing": fm.distributing_interface}[kind]
    ends = [
        make(mesh, name, fm.selections.Plane((x, 0, 0), (1, 0, 0))) for name, x in (("left", 0.0), ("right", length))
    ]
    return cms.couple(fm.solid_body(mesh, STEEL, name="bar", units=SI, interfaces=ends))


def test_a_beam_welded_from_two_is_the_beam_in_one_piece():
    first = line((0, 0, 0), (0.4, 0, 0), 4, "first", {"near": "start", "middle": "end"})
    second = line((0.4, 0, 0), (1, 0, 0), 6, "second", {"middle": "start", "far": "end"})
    welded = fm.weld([first, second], [(("first", "middle"), ("second", "middle"))], name="whole")
    whole = straight(10, fm.beams.Rectangle(WIDTH, HEIGHT))
    assert [interface.name for interface in welded.interfaces] == ["near", "far"]
    assert welded.n_dof == whole.n_dof
    assert_allclose(supported_frequencies(welded, [], 20)[6:], supported_frequencies(whole, [], 20)[6:], rtol=1e-9)
    near, free = welded.interface("near").dofs, supported_frequencies(whole, np.arange(6), 6)
    assert_allclose(supported_frequencies(welded, near, 6), free, rtol=1e-9)


def test_mass_of_a_weld_is_exact_whatever_the_motion():
    first = line((0, 0, 0), (0.4, 0, 0), 2, "first", {"near": "start", "middle": "end"})
    second = line((0.4, 0.3, 0), (1, 0.2, 0.1), 2, "second", {"middle": "start"})
    body = fm.weld(
        [first, second, solid_bar(0.3, "rigid")],
        [
            (("first", "middle"), ("second", "middle")),
            (("bar", "left"), ("first", "near")),
        ],
        name="whole",
    )
    k = 4
    u = np.random.default_rng(0).normal(size=(body.n_dof, k))
    gram = body.element_model.mass_gram(body.mesh_displacement(u))
    energy = sum(gram[4 + a * k : 4 + (a + 1) * k, 4 + a * k : 4 + (a + 1) * k] for a in range(3))
    expected = u.T @ (body.M @ u)
    assert_allclose(energy, expected, rtol=0, atol=ROUNDOFF * np.abs(expected).max())
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs)
    assert_allclose(body.K @ Psi_R, 0, rtol=0, atol=ROUNDOFF * np.abs(body.K.data).max())
    stress = body.element_model.nodal_stress(body.mesh_displacement(u))
    assert stress.shape == (len(body.nodes), 6, k)
    moved = body.translations(Psi_R)
    has_motion = np.abs(moved).sum(axis=(1, 2)) > 0
    theta = np.array([0.3, -0.2, 0.5])
    expected = np.cross(theta, body.nodes[has_motion])
    assert_allclose((moved[:, :, 3:] @ theta)[has_motion], expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("kind", ["rigid", "distributing"])
def test_solid_and_beam_in_line_swing_like_a_beam_alone(kind):
    """A clamped bar, half brick and half beam: first bending frequencies within 1.5 % of the beam of Timoshenko."""
    half = 0.5
    beam = line((half, WIDTH / 2, HEIGHT / 2), (1, WIDTH / 2, HEIGHT / 2), 8, "beam", {"root": "start", "tip": "end"})
    bar = solid_bar(half, kind)
    body = fm.weld([bar, beam], [(("bar", "right"), ("beam", "root"))], name="mixed")
    modes = eigenmodes(body.K, body.M, n_modes=12)
    alone = supported_frequencies(straight(24, fm.beams.Rectangle(WIDTH, HEIGHT)), [], 12)[6:]
    assert_allclose(np.sqrt(modes.omega2[6:9]) / (2 * np.pi), alone[:3], rtol=1.5e-2)
    reduced = cms.reduce(body, cms.craig_bampton(body, n_modes=6), frame=cms.NodalFrame("left"))
    clamped = supported_frequencies(straight(24, fm.beams.Rectangle(WIDTH, HEIGHT)), np.arange(6), 4)
    assert_allclose(reduced.frequencies[:2], clamped[:2], rtol=2e-2)
    m = STEEL.rho * WIDTH * HEIGHT
    assert_allclose(reduced.moments.m, m, rtol=1e-9)
    J_z = m / 3 + m * WIDTH**2 / 12  # about the middle of the left face
    assert_allclose(reduced.moments.J0[2, 2], J_z, rtol=1e-9)


def test_either_side_of_a_joint_may_be_distributing():
    """The order of the two makes no difference; with the beam first, at an arm, PARDISO found the body singular."""
    beam = line((0, 0, 0), (1, 0, 0), 3, "beam", {"root": "start", "tip": "end"})
    bar = bodies.bar(3, 1, 1, height=0.06)
    ends = [
        fm.Interface(i.name, "distributing", i.nodes, i.reference + np.array([0.02, 0.01, -0.03]))
        for i in bar.interfaces
    ]
    bar = cms.couple(bodies.with_interfaces(bar, *ends))
    sides = (("bar", "right"), ("beam", "root"))
    found = [cms.craig_bampton(fm.weld([bar, beam], [joint], name="w"), n_modes=4) for joint in (sides, sides[::-1])]
    first, second = (modes.frequencies[np.isfinite(modes.frequencies)] for modes in found)
    assert_allclose(first, second, rtol=1e-9)


def test_stress_points_of_the_parts_stay_with_them():
    first = fm.beams.section_points(line((0, 0, 0), (1, 0, 0), 2, "first", {"a": "start", "b": "end"}), [1])
    second = line((1, 0, 0), (1, 1, 0), 2, "second", {"c": "start"})
    body = fm.weld([second, first], [(("first", "b"), ("second", "c"))], name="whole")
    points = body.stress_points
    assert points.names[0] == "first: line 1 start point 0"
    u = np.random.default_rng(0).normal(size=(body.n_dof, 2))
    stress = points.stress(body.mesh_displacement(u))
    skin = body.element_model.nodal_stress(body.mesh_displacement(u))
    for position, value in zip(points.positions[8:], stress[8:], strict=True):  # the far end: one line only
        node = np.flatnonzero((np.abs(body.nodes - position).max(axis=1) < 1e-12) & (np.abs(skin).sum(axis=(1, 2)) > 0))
        assert min(np.abs(skin[k] - value).max() for k in node) <= 1e-9 * np.abs(value).max()


def test_joints_far_apart_are_joined_by_a_rigid_arm():
    first = line((0, 0, 0), (1, 0, 0), 2, "first", {"a": "start", "b": "end"})
    second = line((1, 0.5, 0), (1, 1.5, 0), 2, "second", {"c": "start"})
    body = fm.weld([first, second], [(("first", "b"), ("second", "c"))], name="arm")
    u = np.zeros((body.n_dof, 1))
    u[body.n_dof - 1 - np.argmax(body.dofs[::-1, 0] == 0)] = 0  # no motion but of the leader below
    leader = first.n_dof - 1  # rotation z of "b": the last dof of the first body
    u[leader] = 1.0
    start = len(first.nodes)
    moved = body.translations(u)[start, :, 0]
    assert_allclose(moved, [-0.5, 0, 0], rtol=0, atol=1e-15)


def test_impossible_welds_are_refused():
    first = line((0, 0, 0), (1, 0, 0), 2, "first", {"a": "start", "b": "end"})
    second = line((1, 0, 0), (2, 0, 0), 2, "second", {"c": "start", "d": "end"})
    joint = (("first", "b"), ("second", "c"))
    for parts, joints, words in (
        ([first, first], [], "different names"),
        ([first, second], [(("first", "b"), ("third", "c"))], "no body 'third'"),
        ([first, second], [(("first", "b"), ("second", "e"))], "no interface 'e'"),
        ([first, second], [joint, joint], "joined already"),
        ([straight(2, interfaces=("start",))], [], "call cms.couple"),
    ):
        with pytest.raises(BodyError, match=words):
            fm.weld(parts, joints, name="w")


def test_a_field_over_the_mesh_comes_back_to_the_dofs_of_a_weld():
    """Skin nodes follow, and the reference node inside the body is found from its members."""
    beam = line((0.3, WIDTH / 2, HEIGHT / 2), (1, WIDTH / 2, HEIGHT / 2), 3, "beam", {"root": "start", "tip": "end"})
    body = fm.weld([solid_bar(0.3, "rigid"), beam], [(("bar", "right"), ("beam", "root"))], name="mixed")
    u = np.random.default_rng(0).normal(size=(body.n_dof, 2))
    back = coupled_field(body, body.mesh_displacement(u))
    assert_allclose(back.columns, u, rtol=0, atol=1e-9)
    assert max(back.departure.values()) < 1e-9
