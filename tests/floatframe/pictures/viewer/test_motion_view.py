"""Pages of motions: the numbers in them against the motion, what they say, what they refuse."""

import re
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import ConvexHull

import cms
from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
    static_equilibrium,
    view,
)
from floatframe.components import wheels
from floatframe.errors import ModelError, ResultsError
from floatframe.model.rotations import rotation_matrix
from floatframe.model.shapes import Arrow, Box, MarkerShapes, Road, Shape, Stretched, Wheel
from floatframe.model.shapes.drawn import SPRING
from floatframe.pictures.animation import motion_scene
from floatframe.pictures.film_times import film_times
from floatframe.results.element_motion import element_motion
from floatframe.results.place_motion import largest_von_mises, nodal_stress
from floatframe.results.recovery import nodal_displacements, nodal_positions
from tests.cms.reduction.geometric_stiffness.examples import bar_of_beams
from tests.floatframe.model.elements.laws import Spring
from tests.floatframe.pictures.viewer.examples import SIZE, swinging
from tests.floatframe.pictures.viewer.pages import ReadPage


@pytest.fixture(scope="module")
def moved():
    system = swinging()
    return system, integrate(system, GeneralizedAlpha(0.8), 0.4, 2e-3, output_every=4)


@pytest.fixture(scope="module")
def page(moved, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "motion.html"
    return view(moved[1], path, system=moved[0]), ReadPage(path)


def test_nodes_in_the_page_are_those_of_the_motion(moved, page):
    system, motion = moved
    read = page[1]
    body = system.body("arm").reduced
    times = read.array(read.record["time"])
    assert_allclose(times, motion.t, rtol=1e-6, atol=0)
    rows = np.unique(body.surface)
    for row in (0, 17, len(times) - 1):
        expected = nodal_positions(motion, "arm", body, row)[rows]
        assert_allclose(read.places(0, row), expected, rtol=0, atol=1e-4 * SIZE)
        elastic = np.abs(expected - motion.body("arm").r[row]).max() - np.abs(body.nodes).max()
        assert abs(elastic) > 1e-3  # the elastic part counts in this comparison


def test_stress_in_the_page_is_that_of_the_motion(moved, page):
    system, motion = moved
    body = system.body("arm").reduced
    rows = np.unique(body.surface)
    size = np.abs(nodal_stress(motion, "arm", body, 0)[rows]).max()
    for row in (0, 25):
        found = page[1].stress(0, row)
        assert_allclose(found, nodal_stress(motion, "arm", body, row)[rows], rtol=0, atol=1e-3 * size)
    color = next(each for each in page[1].record["colors"] if each["key"] == "von-mises")
    expected = largest_von_mises(motion, "arm", body, rows=rows)[0].max()
    assert_allclose(color["largest"], color["factor"] * expected, rtol=1e-9)


def test_rigid_bodies_turn_in_the_page_as_in_the_motion(moved, page):
    motion, read = moved[1], page[1]
    wheel = read.record["bodies"][1]
    p, q = read.array(wheel["p"]), motion.body("wheel").p
    assert_allclose(np.abs((p * q).sum(axis=1)), 1.0, rtol=0, atol=1e-6)  # p and -p are one rotation
    assert_allclose(read.array(wheel["r"]), motion.body("wheel").r, rtol=1e-6, atol=1e-6)


def test_markers_and_arrows_are_where_the_motion_has_them(moved, page):
    system, motion = moved
    read = page[1]
    stay = next(each for each in read.record["between"] if each["kind"] == "force")
    carrier = read.record["carriers"][stay["first"]]
    interface = system.body("arm").reduced.interfaces[1]
    d = read.array(carrier["motion"])
    assert_allclose(carrier["position"], interface.position, rtol=1e-12)
    assert_allclose(d[:, :3], motion.body("arm").q @ interface.Psi[:3].T, rtol=0, atol=1e-4 * SIZE)
    arrow = next(each for each in read.record["forces"] if each["name"] == "hinge")
    expected = motion.reaction("hinge").force
    assert_allclose(read.array(arrow["values"]), expected, rtol=0, atol=1e-4 * np.abs(expected).max())


def test_shapes_and_surroundings_are_in_the_page(page):
    record = page[1].record
    wheel = Wheel(0.5, 0.2).pieces()
    own = [each for each in record["pieces"] if each["kind"] == "body"]
    assert [each["color"] for each in own] == [piece.color for piece in wheel]
    for each, piece in zip(own, wheel, strict=True):
        assert_allclose(page[1].array(each["nodes"]), piece.nodes, rtol=0, atol=1e-4)
        corner = page[1].array(each["corner"])
        assert np.array_equal(corner[page[1].array(each["triangles"])], piece.triangles)
    assert any(each["kind"] == "scene" and each["is_ground"] for each in record["pieces"])
    assert record["ground"] is None  # the road is the ground


def test_curves_are_those_of_the_motion(moved, page):
    motion, read = moved[1], page[1]
    energy = next(panel for panel in read.record["panels"] if panel["title"] == "energy")
    kinetic = next(curve for curve in energy["curves"] if curve["name"] == "kinetic")
    assert_allclose(read.array(kinetic["values"]), motion.energies.kinetic, rtol=1e-6)


def test_a_page_needs_nothing_from_outside(page):
    written, read = page
    assert written.size == written.path.stat().st_size < 2e6
    outside = {"src", "srcset", "action", "poster", "xlink:href", "background"}
    for tag, attributes in read.parser.tags:
        assert not outside & set(attributes), (tag, attributes)
        assert attributes.get("href", "data:").startswith("data:")
        assert tag not in ("iframe", "object", "embed", "base", "form")
    assert not re.search(
        r"@import|url\(\s*['\"]?(?!data:)|\bfetch\s*\(\s*['\"]http|importScripts|new WebSocket", read.text
    )
    assert "Copyright © 2010-2026 three.js authors" in read.text
    assert "Copyright (c) 2022 Leon Sorokin" in read.text


def test_the_second_order_of_stiffened_bodies_is_in_the_page(tmp_path):
    coupled = cms.couple(bar_of_beams(6))
    body = cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=3), quadratic=True)
    q = np.zeros(body.n_q)
    q[0] = 0.05 / np.abs(body.Phi[..., 0]).max()
    system = System([FlexibleBody("bar", body, q=q, omega_B=(0, 3.0, 1.0))])
    motion = integrate(system, GeneralizedAlpha(0.9), 0.02, 1e-4, output_every=20)
    view(motion, tmp_path / "bar.html", system=system)
    read = ReadPage(tmp_path / "bar.html")
    rows = np.unique(body.surface)
    size = float(np.linalg.norm(np.ptp(body.nodes, axis=0)))
    first_order = (motion.body("bar").q @ body.Phi.reshape(-1, body.n_q).T).reshape(len(motion.t), -1, 3)
    second = nodal_displacements(motion, "bar", body, np.arange(len(motion.t))) - first_order
    assert np.abs(second).max() > 1e-4 * size
    for row in (0, len(motion.t) - 1):
        expected = nodal_positions(motion, "bar", body, row)[rows]
        assert_allclose(read.places(0, row), expected, rtol=0, atol=2e-5 * size)


def test_rows_and_nodes_are_left_out_until_a_page_fits_and_it_says_so(moved, tmp_path):
    system, motion = moved
    arm = system.body("arm")
    big = replace_nodes(arm.reduced, 6000)
    large = System([replace(arm, reduced=big), system.body("wheel")], system.joints, system.forces, scene=system.scene)
    page = view(motion, tmp_path / "small.html", system=large, largest=1.5)
    assert page.size <= 1.5e6
    read = ReadPage(tmp_path / "small.html")
    shown = read.record["surfaces"][0]["nodes"]["shape"][0]
    assert 200 < shown < 6000
    assert any(f"surface of {shown:,} nodes, thinned from 6,000" in note for note in page.notes)
    # nodes that are left are nodes of the body, with their own modes
    rows = [
        np.linalg.norm(big.nodes - node, axis=1).argmin() for node in read.array(read.record["surfaces"][0]["nodes"])
    ]
    assert len(set(rows)) == shown
    expected = nodal_positions(motion, "arm", big, 17)[rows]
    assert_allclose(read.places(0, 17), expected, rtol=0, atol=1e-4 * SIZE)


def replace_nodes(reduced, n):
    """The body with a sphere of n nodes, on which its modes are smooth fields."""
    k = np.arange(n) + 0.5
    polar, around = np.arccos(1 - 2 * k / n), np.pi * (1 + 5**0.5) * k
    nodes = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=1)
    phases = np.arange(1, reduced.n_q + 1)
    Phi = 0.1 * np.sin(nodes[:, :, None] * phases)
    return replace(
        reduced, nodes=nodes, node_ids=np.arange(n), Phi=Phi, surface=ConvexHull(nodes).simplices,
        stress=np.repeat(Phi, 2, axis=1) * 1e9, kept=None,
    )  # fmt: skip


def test_an_equilibrium_is_one_still_row(tmp_path):
    rod = RigidBody("rod", 2.0, np.diag([1e-3, 0.2, 0.2]), center_of_mass=(0.5, 0, 0))
    system = System([rod], [RevoluteJoint("hinge", GROUND, Marker("rod"), axis=(0, 1, 0))], [Gravity((0, 0, -9.81))])
    view(static_equilibrium(system), tmp_path / "rest.html", system=system)
    read = ReadPage(tmp_path / "rest.html")
    assert read.record["facts"][0] == "equilibrium"
    w, _, y, _ = read.array(read.record["bodies"][0]["p"])[0]
    assert_allclose(2 * np.arctan2(y, w), np.pi / 2, atol=1e-6)  # the rod hangs down: x turned to -z
    assert read.record["panels"] == []


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"color": "stress"}, "expected one of displacement, von-mises, got 'stress'"),
        ({"largest": 0.5}, "its programs alone take"),
        ({"sensors": ["hinge.angel"]}, "hinge.angel"),
    ],
)
def test_what_cannot_be_shown_is_refused(moved, tmp_path, options, words):
    with pytest.raises((ResultsError, ModelError), match=words):
        view(moved[1], tmp_path / "no.html", system=moved[0], **options)
    assert not (tmp_path / "no.html").exists()


def test_stress_is_refused_where_no_body_has_it(moved, tmp_path):
    system, motion = moved
    arm = system.body("arm")
    without = replace(arm, reduced=replace(arm.reduced, stress=None))
    bare = System([without, system.body("wheel")], system.joints, system.forces)
    with pytest.raises(ResultsError, match=r"no body of the motion has stress modes \(arm\); reduce them again"):
        view(motion, tmp_path / "no.html", system=bare, color="von-mises")
    other = System([system.body("wheel")])
    with pytest.raises(ResultsError, match="give the system of the motion"):
        view(motion, tmp_path / "no.html", system=other)
    with pytest.raises(ResultsError, match="give system="):
        view(static_equilibrium(other), tmp_path / "no.html")


@dataclass(frozen=True, eq=False)
class ShownSpring(Spring):
    """A spring that shows itself, with the road under it and its force."""

    wrong: str = ""

    def drawn(self):
        if self.wrong:
            return {"marker": (MarkerShapes(Shape(Box((1, 1, 1))), marker=2),),
                    "output": (Arrow(("Fx", "lost", "lost")),),
                    "kind": (Box((1, 1, 1)),)}[self.wrong]  # fmt: skip
        wheel, road = Shape(Wheel(0.3, 0.1)), Shape(Road([(-1, 0, 0), (1, 0, 0)], 1.0))
        arrow = Arrow(("tension", "lost", "lost"), marker=1, is_in_marker_axes=True)
        return MarkerShapes(wheel, marker=1), MarkerShapes(road, marker=None), Stretched("coil"), arrow


def sprung(wrong=""):
    turned = (np.cos(0.3), 0, np.sin(0.3), 0)
    block = RigidBody("block", 2.0, np.eye(3), position=(0, 0, -1.0), orientation=turned)
    spring = ShownSpring("spring", Marker(GROUND), Marker("block", position=(0.1, 0, 0)), 50.0, 0.5, 0.8, wrong=wrong)
    return System([block], [], [Gravity((0, 0, -9.81))], elements=[spring])


def test_elements_show_themselves_at_their_markers_with_their_forces(tmp_path):
    system = sprung()
    motion = integrate(system, GeneralizedAlpha(0.8), 0.2, 1e-2)
    view(motion, tmp_path / "spring.html", system=system)
    read = ReadPage(tmp_path / "spring.html")
    tyre = next(each for each in read.record["pieces"] if each["color"] == Wheel(0.3, 0.1).pieces()[0].color)
    carrier = read.record["carriers"][tyre["carrier"]]
    assert (carrier["body"], carrier["position"]) == (0, [0.1, 0, 0])
    assert any(each["carrier"] == 0 and each["is_ground"] for each in read.record["pieces"])
    coil = next(each for each in read.record["between"] if each["kind"] == "force")
    assert (read.record["carriers"][coil["first"]]["body"], coil["second"]) == (-1, tyre["carrier"])
    arrow = next(each for each in read.record["forces"] if each["is_of_element"])
    found = element_motion(system, motion, "spring").outputs
    local = np.stack([found["tension"], found["lost"], found["lost"]], axis=1)
    expected = np.einsum("tab,tb->ta", rotation_matrix(motion.body("block").p), local)
    assert_allclose(read.array(arrow["values"]), expected, rtol=0, atol=1e-4 * np.abs(expected).max())
    # a film has shapes and coil too: the coil ends at both markers
    times = film_times(motion.t, fps=25.0, speed=1.0, n_nodes=100)
    scene = motion_scene(motion, {"block": system.bodies[0]}, times, system=system)
    wound = next(surface for surface in scene.surfaces if surface.color == SPRING)
    end = motion.body("block").r + rotation_matrix(motion.body("block").p) @ np.array([0.1, 0, 0])
    near = [np.linalg.norm(wound.nodes[k] - end[row], axis=1).min() for k, row in enumerate(times.rows)]
    assert max(near) < 0.02
    assert np.linalg.norm(wound.nodes, axis=2).min(axis=1).max() < 0.02


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ("marker", "marker 2: expected 0 to 1"),
        ("output", "no output 'Fx'"),
        ("kind", "expected MarkerShapes, Stretched or Arrow"),
    ],
)
def test_elements_that_show_what_they_have_not_are_refused(tmp_path, wrong, words):
    system = sprung(wrong)
    motion = integrate(system, GeneralizedAlpha(0.8), 0.02, 1e-2)
    with pytest.raises(ModelError, match=words):
        view(motion, tmp_path / "no.html", system=system)


def rolling(road, shapes=()):
    wheel = RigidBody("wheel", 20.0, np.diag([0.5, 0.9, 0.5]), position=(0, 0, 0.3), velocity=(2.0, 0, 0),
                      omega_B=(0, 2.0 / 0.3, 0), shapes=shapes)  # fmt: skip
    tyre = wheels.LinearTyre("tyre", Marker(GROUND), Marker("wheel"), 0.31, 2e5, 1e4, 1e4, damping=500.0, road=road)
    return System([wheel], [], [Gravity((0, 0, -9.81))], elements=[tyre])


def test_a_tyre_shows_its_wheel_its_road_and_the_force_of_the_ground(tmp_path):
    tyre_color = Wheel(0.31, 0.2).pieces()[0].color
    system = rolling(wheels.FlatRoad())
    motion = integrate(system, GeneralizedAlpha(0.8), 0.3, 1e-3, output_every=10)
    view(motion, tmp_path / "flat.html", system=system)
    read = ReadPage(tmp_path / "flat.html")
    assert read.record["ground"]["level"] == 0.0  # the road, not a grid below all that moves
    own = [each for each in read.record["pieces"] if each["kind"] == "body"]
    assert [each["color"] for each in own] == [piece.color for piece in Wheel(0.31, 0.2).pieces()]  # and no box
    arrow = next(each for each in read.record["forces"] if each["is_of_element"])
    force, at = read.array(arrow["values"]), read.array(arrow["at"])
    load = element_motion(system, motion, "tyre").outputs["Fz"]
    assert load.max() > 20.0 * 9.81
    assert_allclose(force[:, 2], load, rtol=0, atol=1e-4 * load.max())  # upwards: on the wheel
    assert_allclose(at[:, 2], 0.0, atol=1e-6)
    assert_allclose(at[:, 0], motion.body("wheel").r[:, 0], atol=1e-3)
    # shapes of the body take the place of the wheel that the tyre would show, and uneven ground that of the plane
    bump = wheels.GridRoad(np.linspace(-1, 3, 9), 0.0 * np.linspace(-1, 3, 9))
    other = rolling(bump, [Wheel(0.31, 0.15, n_spokes=7)])
    view(motion, tmp_path / "own.html", system=other)
    read = ReadPage(tmp_path / "own.html")
    assert read.record["ground"] is None
    assert sum(each["color"] == tyre_color for each in read.record["pieces"]) == 1
    assert any(each["is_ground"] for each in read.record["pieces"])
