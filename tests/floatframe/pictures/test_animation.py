import sys
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cms.assessment.rendering import render
from cms.body.modal_file.file import digest, write
from floatframe import GeneralizedAlpha, System, integrate
from floatframe.errors import ResultsError
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_matrix
from floatframe.model.shapes import Road, Wheel
from floatframe.pictures.animation import animate, bodies_of, hides_flexible, motion_scene, trail
from floatframe.pictures.film_times import film_times, round_below, speed_words, time_words
from floatframe.pictures.stage import box_of, film_size, ground_grid, view_axes
from floatframe.results.head import BodyEntry, Head
from floatframe.results.results_file import MemorySource
from floatframe.results.trajectory import Trajectory
from tests.synthetic import synthetic_reduced_body

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
DIES = (sys.executable, "-c", "raise SystemExit(1)")  # pictures without OpenGL: matplotlib draws


@pytest.fixture(scope="module")
def body():
    return replace(synthetic_reduced_body(units="mm-t-s"), surface=TETRAHEDRON)


def motion(body, *, n_t=41, t_end=4.0, amplitude=1.0, names=("rod",), source="", run=None, seed=0):
    """A motion in memory: bodies that fly and tumble, the first flexible with the modes of a body."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, t_end, n_t)
    n_b, n_q = len(names), body.n_q
    r = rng.normal(size=(1, n_b, 3)) * 300 + t[:, None, None] * rng.normal(size=(1, n_b, 3)) * 200
    axis = rng.normal(size=(n_b, 3))
    p = np.array([[euler_parameters_of_rotation_vector(a * time) for a in axis] for time in t])
    q = amplitude * np.sin(t[:, None] * np.arange(1, n_q + 1))
    entries = tuple(
        BodyEntry(name, n_q if k == 0 else 0, 0 if k == 0 else n_q, 6 * k + (n_q if k else 0), source,
                  digest(source) if source else "")
        for k, name in enumerate(names)
    )  # fmt: skip
    n_u = 6 * n_b + n_q
    arrays = {
        "t": t, "position": r, "euler_parameters": p, "q": q, "u": np.zeros((n_t, n_u)), "u_dot": np.zeros((n_t, n_u)),
        "w": np.zeros((n_t, 0)), "diagnostics": np.zeros((n_t, 12)), "drift": np.zeros((n_t, 0, 4)),
    }  # fmt: skip
    head = Head("tumbling", body.units.name, entries, (), (), (0,), run or {})
    return Trajectory(head, MemorySource(arrays), is_complete=True)


# Times ---------------------------------------------------------------------------------------------------------------


def test_a_motion_of_seconds_is_shown_in_real_time():
    times = film_times(np.linspace(0, 4, 4001), fps=25, speed=None)
    assert times.speed == 1
    assert_allclose(len(times.rows) / times.fps, 4.0, rtol=1e-12, atol=0)
    assert_allclose(np.diff(times.rows), 40, rtol=0, atol=1)


@pytest.mark.parametrize("duration", [1e-5, 0.013, 0.7, 100.0, 86400.0])
def test_what_is_too_short_or_too_long_to_watch_gets_a_round_speed(duration):
    times = film_times(np.linspace(0, duration, 2001), fps=25, speed=None)
    assert 6 * 0.999 <= duration / times.speed <= 6 * 2.51
    assert round_below(times.speed * 1.0001) == pytest.approx(times.speed, rel=1e-12)


def test_the_rows_are_the_nearest_to_even_times_though_outputs_are_uneven():
    t = np.sort(np.random.default_rng(0).uniform(0, 3, 400))
    times = film_times(t, fps=20, speed=1.0)
    wanted = t[0] + (np.arange(len(times.rows)) + 0.5) / len(times.rows) * (t[-1] - t[0])
    nearest = np.abs(t[:, None] - wanted).argmin(axis=0)
    assert_array_equal(times.rows, nearest)


def test_no_row_is_shown_twice_and_the_film_keeps_its_length():
    times = film_times(np.linspace(0, 4, 9), fps=25, speed=1.0)
    assert_array_equal(np.diff(times.rows) > 0, True)
    assert len(times.rows) <= 9
    assert_allclose(len(times.rows) / times.fps, 4.0, rtol=1e-12, atol=0)


def test_many_nodes_get_fewer_frames():
    assert len(film_times(np.linspace(0, 10, 5001), fps=50, speed=1.0, n_nodes=400_000).rows) == 50


def test_one_row_is_one_frame():
    times = film_times(np.array([3.0]), fps=25, speed=None)
    assert_array_equal(times.rows, [0])


@pytest.mark.parametrize(("options", "words"), [
    ({"fps": 0.0, "speed": None}, "fps"), ({"fps": 25, "speed": 0.0}, "speed"), ({"fps": 25, "speed": np.nan}, "speed"),
])  # fmt: skip
def test_impossible_times_are_refused(options, words):
    with pytest.raises(ResultsError, match=f"{words}: expected a number above 0"):
        film_times(np.linspace(0, 1, 5), **options)


def test_a_motion_without_rows_is_refused():
    with pytest.raises(ResultsError, match="no rows"):
        film_times(np.zeros(0), fps=25, speed=None)


@pytest.mark.parametrize(("value", "expected"), [(1.0, 1.0), (0.99, 0.5), (4.9, 2.0), (5.0, 5.0), (7300.0, 5000.0)])
def test_round_below(value, expected):
    assert_allclose(round_below(value), expected, rtol=1e-12, atol=0)


def test_speeds_and_times_read_well():
    assert speed_words(1.0) == "in real time"
    assert speed_words(0.02) == "50 times slower than real time"
    assert speed_words(0.62) == "1.61 times slower than real time"
    assert speed_words(10.0) == "10 times faster than real time"
    assert time_words(np.array([0.0, 0.04, 0.08])) == ("t = 0.00 s", "t = 0.04 s", "t = 0.08 s")


# Scene ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("magnification", [1.0, 7.0])
def test_nodes_are_where_frame_and_modes_put_them(body, magnification):
    trajectory = motion(body)
    times = film_times(trajectory.t, fps=5, speed=1.0)
    scene = motion_scene(trajectory, {"rod": body}, times, magnification=magnification)
    moving = trajectory.body("rod")
    for frame, row in enumerate(times.rows):
        R = rotation_matrix(moving.p[row])
        for node in range(0, len(body.nodes), 7):
            u = sum(moving.q[row, k] * body.Phi[node, :, k] for k in range(body.n_q))
            place = moving.r[row] + R @ (body.nodes[node] + magnification * u)
            assert_allclose(scene.surfaces[0].nodes[frame, node], place, rtol=0, atol=1e-12 * np.abs(place).max())


@pytest.mark.parametrize("amplitude", [1e-6, 1e-4, 1e-2, 10.0, 3e4])
def test_colours_are_the_true_displacement_whatever_the_magnification(body, amplitude):
    trajectory = motion(body, amplitude=amplitude)
    times = film_times(trajectory.t, fps=5, speed=1.0)
    scene = motion_scene(trajectory, {"rod": body}, times, magnification=50.0)
    q = trajectory.body("rod").q[times.rows]
    metres = 1e-3 * np.linalg.norm(np.einsum("nak,fk->fna", body.Phi, q), axis=2)
    unit = {"m": 1.0, "mm": 1e-3, "\N{GREEK SMALL LETTER MU}m": 1e-6, "nm": 1e-9}[scene.scalar_unit]
    assert_allclose(scene.surfaces[0].scalars * unit, metres, rtol=0, atol=1e-12 * metres.max())
    assert 0.2 <= scene.surfaces[0].scalars.max() < 1000


@pytest.mark.parametrize("amplitude", [1e-8, 1e-5])
def test_what_nobody_would_see_is_enlarged_by_a_round_number_and_the_caption_says_so(body, amplitude):
    trajectory = motion(body, amplitude=amplitude)
    times = film_times(trajectory.t, fps=5, speed=1.0)
    scene = motion_scene(trajectory, {"rod": body}, times)
    true = motion_scene(trajectory, {"rod": body}, times, magnification=1.0)
    rest = motion_scene(trajectory, {"rod": body}, times, magnification=1e-9)
    drawn, small = (s.surfaces[0].nodes - rest.surfaces[0].nodes for s in (scene, true))
    factor = np.abs(drawn).max() / np.abs(small).max()
    assert_allclose(factor, round_below(factor * 1.0001), rtol=1e-3, atol=0)
    u = np.einsum("nak,fk->fna", body.Phi, trajectory.body("rod").q[times.rows])
    share = factor * np.abs(u).max() / np.linalg.norm(np.ptp(body.nodes, axis=0))
    assert 0.06 / 2.6 <= share <= 0.0601
    assert f"{round_below(factor * 1.0001):,.6g} times larger" in scene.captions[0]


def test_what_can_be_seen_is_drawn_as_it_is(body):
    diagonal = np.linalg.norm(np.ptp(body.nodes, axis=0))
    amplitude = 0.1 * diagonal / np.abs(body.Phi).max()
    trajectory = motion(body, amplitude=amplitude)
    scene = motion_scene(trajectory, {"rod": body}, film_times(trajectory.t, fps=5, speed=1.0))
    assert "larger" not in scene.captions[0]


def test_interfaces_ride_on_the_body(body):
    trajectory = motion(body)
    times = film_times(trajectory.t, fps=5, speed=1.0)
    scene = motion_scene(trajectory, {"rod": body}, times, magnification=1.0)
    moving = trajectory.body("rod")
    for triad, interface in zip(scene.triads, body.interfaces, strict=True):
        assert triad.label == interface.name
        for frame, row in enumerate(times.rows):
            R = rotation_matrix(moving.p[row])
            place = moving.r[row] + R @ (interface.position + interface.Psi[:3] @ moving.q[row])
            assert_allclose(triad.position[frame], place, rtol=0, atol=1e-12 * np.abs(place).max())
            assert_allclose(triad.axes[frame], R @ interface.triad, rtol=0, atol=1e-12)


def test_a_trail_shows_what_was_and_not_what_will_be():
    path = np.random.default_rng(0).normal(size=(100, 3))
    rows = np.array([10, 40, 41, 90])
    lines = trail(path, rows)
    for frame, row in enumerate(rows):
        kept = np.unique(np.concatenate([rows, np.arange(10, 90)]))
        assert_array_equal(lines.points_at(frame), path[np.minimum(kept, row)])


def test_a_body_without_picture_is_a_cube_at_its_origin(body):
    trajectory = motion(body, names=("rod", "block"))
    scene = motion_scene(trajectory, {"rod": body}, film_times(trajectory.t, fps=5, speed=1.0))
    cube = scene.surfaces[1]
    assert cube.nodes.shape[1:] == (8, 3)
    times = film_times(trajectory.t, fps=5, speed=1.0)
    assert_allclose(cube.nodes.mean(axis=1), trajectory.body("block").r[times.rows], rtol=0, atol=1e-9)
    assert cube.opacity == 1.0


def test_a_box_that_hides_a_node_of_a_flexible_body_is_found(body):
    diagonal = np.linalg.norm(np.ptp(body.nodes, axis=0))
    corners = 1e-6 * diagonal * np.array([[-1.0, -1, -1], [1, 1, 1]])
    for shift, hides in ((0.0, True), (1e-3 * diagonal, False)):
        frames = {"rod": (np.zeros((1, 3)), np.eye(3)[None]), "box": (body.nodes[:1] + shift, np.eye(3)[None])}
        assert hides_flexible("box", corners, frames, {"rod": body}) == hides


def test_the_box_of_a_rigid_body_has_its_inertia():
    rng = np.random.default_rng(3)
    points = rng.normal(size=(20, 3)) * [3, 2, 1]
    c = points.mean(axis=0)
    inertia = sum((p - c) @ (p - c) * np.eye(3) - np.outer(p - c, p - c) for p in points) * 0.05
    rigid = RigidBody("block", 1.0, inertia, center_of_mass=c)
    corners, triangles = box_of(rigid, 1.0)
    gauss = c + (corners - c) / np.sqrt(3)  # integrates second moments of a uniform box exactly
    from_box = sum((p - c) @ (p - c) * np.eye(3) - np.outer(p - c, p - c) for p in gauss) / 8
    assert_allclose(from_box, inertia, rtol=0, atol=1e-12 * np.abs(inertia).max())
    a, b, d = (corners[triangles[:, k]] - c for k in range(3))
    edges = [np.linalg.norm(corners[k] - corners[0]) for k in (1, 2, 4)]
    assert_allclose(np.einsum("ta,ta->", a, np.cross(b, d)) / 6, np.prod(edges), rtol=1e-12, atol=0)  # all outward


@pytest.mark.parametrize("up", [[0, 0, 1.0], [0, 1.0, 0], [1.0, 2.0, -0.5]])
def test_the_ground_lies_level_below_everything_with_round_spacing(up):
    points = np.random.default_rng(1).normal(size=(50, 3)) * [30, 70, 20] + 500
    up = np.array(up) / np.linalg.norm(up)
    ground, step = ground_grid(points, up)
    level = ground.points @ up
    assert_allclose(level, level[0], rtol=0, atol=1e-9 * 500)
    assert level[0] < (points @ up).min()
    assert step == round_below(step)
    flat = points - np.outer(points @ up - level[0], up)  # shadows of the points lie on the ground's rectangle
    ends = ground.points - ground.points.mean(axis=0)
    side = ground.points[ground.segments[0, 1]] - ground.points[ground.segments[0, 0]]
    side /= np.linalg.norm(side)
    for axis in (side, np.cross(up, side)):
        assert np.ptp(ends @ axis) > np.ptp(flat @ axis)


def test_a_plane_motion_is_seen_from_across_the_plane():
    angle = np.linspace(0, 2, 50)
    points = np.stack([np.cos(angle), np.zeros(50), np.sin(angle)], axis=1)
    direction, up = view_axes(points, np.array([0.0, 0.0, 2.0]))
    assert np.argmax(np.abs(direction)) == 1
    assert direction[2] < 0  # from above
    assert np.cross(direction, up)[0] > 0  # x runs to the right
    assert_allclose(up, [0, 0, 1], rtol=0, atol=1e-12)


@pytest.mark.parametrize(("high", "height"), [(0.1, 480), (0.6, 624), (3.0, 720)])
def test_a_film_is_as_high_as_what_it_shows(high, height):
    points = np.array([[0.0, 0.0, 0.0], [1.0, 5.0, 0.3 * high], [0.4, -2.0, high]])
    assert film_size(points, np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])) == (960, height)


def test_up_is_against_gravity_where_the_run_knows_it(body):
    trajectory = motion(body, run={"gravity": [0.0, -9810.0, 0.0]})
    times = film_times(trajectory.t, fps=5, speed=1.0)
    assert_allclose(motion_scene(trajectory, {"rod": body}, times).up, [0, 1, 0], rtol=0, atol=1e-12)
    unknown = motion(body)
    assert_allclose(motion_scene(unknown, {"rod": body}, times).up, [0, 0, 1], rtol=0, atol=1e-12)
    assert_allclose(motion_scene(unknown, {"rod": body}, times, up=[1, 0, 0]).up, [1, 0, 0], rtol=0, atol=1e-12)


# Files ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_a_motion_becomes_a_film(body, suffix, monkeypatch, tmp_path):
    monkeypatch.setattr(render, "WORKER", DIES)
    seen = []
    trajectory = motion(body, names=("rod", "block"), n_t=5)
    film = tmp_path / f"film{suffix}"
    drawing = animate(trajectory, {"rod": body}, film, on_frame=lambda *n: seen.append(n))
    assert drawing.path == film
    assert film.stat().st_size > 3000
    assert seen[-1] == (len(seen), len(seen))


def test_bodies_come_from_the_modal_files_of_the_run(body, tmp_path):
    path = tmp_path / "rod.h5"
    write(body, path)
    trajectory = motion(body, source=str(path))
    assert_array_equal(bodies_of(trajectory)["rod"].Phi, body.Phi)
    write(replace(body, name="other"), path)
    with pytest.raises(ResultsError, match="has changed since the motion was computed"):
        bodies_of(trajectory)


def test_bodies_that_do_not_fit_the_motion_are_refused(body):
    trajectory = motion(body)
    times = film_times(trajectory.t, fps=5, speed=1.0)
    with pytest.raises(ResultsError, match="no body 'rodd'; it has rod"):
        motion_scene(trajectory, {"rodd": body}, times)
    with pytest.raises(ResultsError, match="has 3 modes, but its motion has 5"):
        motion_scene(trajectory, {"rod": replace(synthetic_reduced_body(n_q=3), surface=TETRAHEDRON)}, times)


def test_shapes_of_bodies_and_surroundings_are_drawn_where_the_bodies_are():
    wheel = RigidBody("wheel", 1.0, np.eye(3), position=(0, 0, 0.3), omega_B=(0, 2.0, 0), shapes=[Wheel(0.3, 0.1)])
    system = System([wheel], scene=[Road([(-1, 0, 0), (1, 0, 0)], 1.0)])
    motion = integrate(system, GeneralizedAlpha(0.8), 0.2, 1e-2)
    times = film_times(motion.t, fps=25.0, speed=1.0, n_nodes=100)
    scene = motion_scene(motion, {"wheel": wheel}, times, system=system)
    tyre = next(surface for surface in scene.surfaces if surface.color == Wheel(0.3, 0.1).pieces()[0].color)
    angle = 2.0 * (motion.t[times.rows[-1]] - motion.t[times.rows[0]])
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    assert_allclose(tyre.nodes[-1], (tyre.nodes[0] - (0, 0, 0.3)) @ turn.T + (0, 0, 0.3), rtol=0, atol=1e-8)
    assert any(surface.color == Road([(-1, 0, 0), (1, 0, 0)], 1.0).pieces()[0].color for surface in scene.surfaces)
    assert "grid" not in scene.captions[0]
