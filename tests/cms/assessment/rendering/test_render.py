import logging
import os
import subprocess
import sys
from dataclasses import fields, replace
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cms.assessment.rendering import (
    Lines,
    RenderError,
    Scene,
    SceneError,
    Surface,
    Triad,
    annotations,
    film,
    render,
    render_animation,
    render_picture,
)
from cms.assessment.rendering.annotations import drop_below, layout_of, round_ticks
from cms.assessment.rendering.camera import FILL, fitted_camera
from cms.assessment.rendering.drawing import draw_picture
from cms.assessment.rendering.film import average_of_blocks, write_film
from cms.assessment.rendering.matplotlib_view import matplotlib_view, smooth_neighbours
from cms.assessment.rendering.scene_file import read_scene, write_scene
from cms.assessment.rendering.shape import cie_lab, colormap, surface_edges
from cms.assessment.report import view
from cms.assessment.report.view import animate_mode, mode_scene, view_axes, view_mode
from cms.errors import BodyError, CmsError
from tests.synthetic import synthetic_reduced_body

SMALL = (320, 240)
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
QUADS = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
CUBE_TRIANGLES = np.concatenate([QUADS[:, [0, 1, 2]], QUADS[:, [0, 2, 3]]])
DIES = (sys.executable, "-c", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")  # as VTK does without OpenGL
HANGS = (sys.executable, "-c", "import time; time.sleep(600)")


def sphere(n=24):
    """A unit sphere: nodes and outward triangles."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, n), np.linspace(0, 2 * np.pi, 2 * n, endpoint=False), indexing="ij")
    nodes = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1).reshape(-1, 3)
    a = (np.arange(n - 1)[:, None] * 2 * n + np.arange(2 * n)).ravel()
    b = (np.arange(n - 1)[:, None] * 2 * n + (np.arange(2 * n) + 1) % (2 * n)).ravel()
    triangles = np.concatenate([np.stack([a, a + 2 * n, b], 1), np.stack([b, a + 2 * n, b + 2 * n], 1)])
    return nodes, triangles


def cube_scene(**changes):
    """A coloured cube, still."""
    scene = Scene(surfaces=(Surface(CUBE_TRIANGLES, CUBE, scalars=CUBE.sum(axis=1)),), title="cube", size=SMALL)
    return replace(scene, **changes)


def moving_scene(n_frames=5):
    """A cube that moves along x before a still one."""
    nodes = CUBE + np.linspace(0, 1, n_frames)[:, None, None] * np.array([1.0, 0, 0])
    surface = Surface(CUBE_TRIANGLES, nodes, scalars=np.linspace(0, 1, n_frames)[:, None] * np.ones(8))
    return Scene(
        surfaces=(surface, Surface(CUBE_TRIANGLES, CUBE, opacity=0.2)),
        lines=(Lines(np.array([[0, 1]]), nodes[:, :2]),),
        triads=(Triad(nodes[:, 0], np.tile(np.eye(3), (n_frames, 1, 1)), 0.3, "a"),),
        frame_notes=tuple(f"t = {k}" for k in range(n_frames)), scalar_title="x", scalar_unit="mm", size=SMALL,
    )  # fmt: skip


def read_image(path):
    from PIL import Image

    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def body_with_surface(**changes):
    """A synthetic body whose first eight nodes are a box with a surface."""
    body = synthetic_reduced_body()
    nodes = np.array(body.nodes)
    nodes[:8] = CUBE * [140.0, 30.0, 10.0]
    return replace(body, nodes=nodes, surface=CUBE_TRIANGLES, **changes)


@pytest.fixture
def dying_worker(monkeypatch):
    monkeypatch.setattr(render, "WORKER", DIES)


def drawn_by_vtk(scene, path):
    """Draw with VTK; skip visibly where a machine has no OpenGL, fail where everything is required."""
    drawing = render_picture(scene, path)
    if drawing.backend != "vtk":
        if os.environ.get("FLOATFRAME_REQUIRE_ALL") == "1":
            pytest.fail(f"VTK is required here: {drawing.note}")
        pytest.skip(drawing.note)
    return read_image(path)


def covered(image, scene):
    """The pixels of the view that are not background; without the axes in the lower left corner."""
    left, top, width, height = layout_of(scene).view
    view = image[top : top + height, left : left + width].astype(int)
    seen = np.abs(view - view[0, 0]).max(axis=2) > 12
    seen[-70:, :70] = False
    return seen


# Backends ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shows_numbers", [True, False])
def test_both_backends_cover_the_same_pixels_with_nearly_the_same_colours(shows_numbers, tmp_path):
    nodes, triangles = sphere()
    scene = Scene(surfaces=(Surface(triangles, nodes, scalars=nodes[:, 2] if shows_numbers else None),),
                  size=(480, 360), direction=np.array([-1.0, 0.4, -0.3]))  # fmt: skip
    one = drawn_by_vtk(scene, tmp_path / "vtk.png")
    draw_picture(scene, tmp_path / "matplotlib.png", matplotlib_view)
    other = read_image(tmp_path / "matplotlib.png")
    seen_one, seen_other = covered(one, scene), covered(other, scene)
    assert seen_one.sum() > 10000
    assert (seen_one != seen_other).sum() < 0.01 * seen_one.sum()
    assert np.abs(one.astype(int) - other).mean() < 6


def test_a_sphere_is_drawn_as_the_circle_that_its_projection_is(tmp_path):
    nodes, triangles = sphere(48)
    scene = Scene(surfaces=(Surface(triangles, nodes, has_edges=False),), size=(480, 480))
    draw_picture(scene, tmp_path / "sphere.png", matplotlib_view)
    camera = fitted_camera(scene, layout_of(scene).view[2:])
    distance = np.linalg.norm(camera.eye)  # the sphere's centre is the origin
    radius = camera.pixels / np.sqrt(distance**2 - 1)  # of the circle in which the tangent cone meets the image plane
    area = covered(read_image(tmp_path / "sphere.png"), scene).sum()
    assert_allclose(area, np.pi * radius**2, rtol=0.02, atol=0)


def test_what_is_nearer_hides_what_is_behind(tmp_path):
    near = Surface(CUBE_TRIANGLES, CUBE, color="#ff0000", has_edges=False)
    far = Surface(CUBE_TRIANGLES, CUBE + np.array([0.0, 3.0, 0.0]), color="#0000ff", has_edges=False)
    for surfaces in ((near, far), (far, near)):
        scene = Scene(surfaces=surfaces, size=SMALL, direction=np.array([0.0, 1.0, 0.0]))
        draw_picture(scene, tmp_path / "cubes.png", matplotlib_view)
        image = read_image(tmp_path / "cubes.png")
        left, top, width, height = layout_of(scene).view
        r, _, b = image[top + height // 2, left + width // 2].astype(int)
        assert r > 2 * b


# Where there is no OpenGL --------------------------------------------------------------------------------------------


def test_a_dying_worker_leads_to_matplotlib_and_the_user_is_told(dying_worker, tmp_path, caplog):
    with caplog.at_level(logging.WARNING):
        drawing = render_picture(cube_scene(), tmp_path / "cube.png")
    assert drawing.backend == "matplotlib"
    assert "SIGSEGV" in drawing.note
    assert "drawn with matplotlib instead" in caplog.text
    assert read_image(tmp_path / "cube.png").shape == (240, 320, 3)
    assert [path.name for path in tmp_path.iterdir()] == ["cube.png"]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="hides libraries by the search path of Linux")
def test_without_opengl_libraries_the_picture_is_still_drawn(tmp_path):
    hidden = tmp_path / "hidden"
    hidden.mkdir()
    for name in ("libGL.so.1", "libEGL.so.1", "libEGL.so", "libGLX.so.0", "libGLdispatch.so.0", "libOSMesa.so",
                 "libOSMesa.so.6", "libOSMesa.so.8"):  # fmt: skip
        (hidden / name).touch()  # found first and refused: an empty file is no library
    environment = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
    script = ("from tests.cms.assessment.rendering.test_render import cube_scene; "
              "from cms.assessment.rendering import render_picture;"
              f"print(render_picture(cube_scene(), {str(tmp_path / 'cube.png')!r}).backend)")  # fmt: skip
    done = subprocess.run([sys.executable, "-c", script], env=environment | {"LD_LIBRARY_PATH": str(hidden)},
                          capture_output=True, text=True, check=False)  # fmt: skip
    assert done.stdout.split() == ["matplotlib"], done.stderr
    assert "drawn with matplotlib instead" in done.stderr
    assert read_image(tmp_path / "cube.png").std() > 10


def test_a_silent_worker_is_given_up_and_ended(monkeypatch, tmp_path):
    monkeypatch.setattr(render, "WORKER", HANGS)
    monkeypatch.setattr(render, "SILENCE", 0.5)
    started = []
    popen = subprocess.Popen
    monkeypatch.setattr(subprocess, "Popen", lambda *a, **k: started.append(popen(*a, **k)) or started[0])
    drawing = render_picture(cube_scene(), tmp_path / "cube.png")
    assert drawing.backend == "matplotlib"
    assert "no frame within 0.5 s" in drawing.note
    assert started[0].returncode is not None


def test_a_python_that_cannot_be_started_leads_to_matplotlib(monkeypatch, tmp_path):
    monkeypatch.setattr(render, "WORKER", (str(tmp_path / "no python"),))
    drawing = render_picture(cube_scene(), tmp_path / "cube.png")
    assert "could not start" in drawing.note


def test_an_interrupt_ends_the_worker_and_leaves_the_old_file(monkeypatch, tmp_path):
    monkeypatch.setattr(render, "WORKER", (sys.executable, "-c", "print('1 9', flush=True); " + HANGS[2]))
    started = []
    popen = subprocess.Popen
    monkeypatch.setattr(subprocess, "Popen", lambda *a, **k: started.append(popen(*a, **k)) or started[0])
    target = tmp_path / "cube.gif"
    target.write_bytes(b"old")

    def interrupt(done, all_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        render_animation(moving_scene(), target, on_frame=interrupt)
    assert started[0].returncode is not None
    assert target.read_bytes() == b"old"
    assert [path.name for path in tmp_path.iterdir()] == ["cube.gif"]


def test_a_full_disk_is_told_and_leaves_the_old_file(dying_worker, monkeypatch, tmp_path):
    target = tmp_path / "cube.png"
    target.write_bytes(b"old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(render, "draw_picture", full)
    with pytest.raises(RenderError, match="No space left on device"):
        render_picture(cube_scene(), target)
    assert target.read_bytes() == b"old"


def test_a_folder_that_is_not_there_is_told(tmp_path):
    with pytest.raises(RenderError, match="cannot be written"):
        render_picture(cube_scene(), tmp_path / "no" / "cube.png")


# Films ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("has_ffmpeg", [True, False])
def test_a_gif_has_all_frames_its_rate_and_the_colours_of_the_frames(has_ffmpeg, dying_worker, monkeypatch, tmp_path):
    from PIL import Image

    if not has_ffmpeg:
        monkeypatch.setattr(film, "ffmpeg_path", lambda path: "")
    seen = []
    drawing = render_animation(moving_scene(), tmp_path / "a.gif", fps=20, on_frame=lambda *n: seen.append(n))
    assert seen == [(k, 5) for k in range(1, 6)]
    with Image.open(drawing.path) as gif:
        assert (gif.n_frames, gif.info["duration"], gif.info["loop"]) == (5, 50, 0)
        first = np.asarray(gif.convert("RGB")).astype(int)
    draw_picture(moving_scene(), tmp_path / "a.png", matplotlib_view)
    picture = read_image(tmp_path / "a.png").astype(int)
    assert_array_equal(first[0, 0], picture[0, 0])  # the background keeps its very colour
    assert np.abs(first - picture).mean() < 1.5


def test_an_mp4_has_all_frames(dying_worker, tmp_path):
    import imageio_ffmpeg

    drawing = render_animation(moving_scene(), tmp_path / "a.mp4", fps=10)
    n_frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(drawing.path))
    assert n_frames == 5
    assert_allclose(seconds, 0.5, rtol=0.05, atol=0)


def test_vtk_draws_the_frames_of_a_film(tmp_path):
    from PIL import Image

    seen = []
    drawing = render_animation(moving_scene(3), tmp_path / "a.gif", on_frame=lambda *n: seen.append(n))
    if drawing.backend == "vtk":
        assert seen == [(1, 3), (2, 3), (3, 3)]
    with Image.open(drawing.path) as gif:
        frames = []
        for k in range(3):
            gif.seek(k)
            frames.append(np.asarray(gif.convert("RGB")).astype(int))
    assert np.abs(frames[2] - frames[0]).mean() > 1  # it moves


def shaded_frames(n):
    """Frames of a shaded disc that moves before a grid."""
    y, x = np.mgrid[:240, :320]
    for k in range(n):
        frame = np.full((240, 320, 3), 250, np.uint8)
        frame[::20] = frame[:, ::20] = 210
        across = x - 60 - 200 * k / n
        disc = across**2 + (y - 120) ** 2 < 40**2
        frame[disc] = (np.stack([150 + across, 100 + y, 90 + 0 * y], axis=2))[disc]
        yield frame


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_a_film_shows_the_motion_of_its_frames(suffix, tmp_path):
    path, drawn = tmp_path / f"disc{suffix}", list(shaded_frames(50))
    write_film(drawn, path, fps=25)
    decode = [film.ffmpeg_path(path), "-loglevel", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    pixels = subprocess.run(decode, capture_output=True, check=True).stdout
    shown = np.frombuffer(pixels, np.uint8).reshape(-1, 240, 320, 3).astype(int)
    assert len(shown) == len(drawn)
    for k in (0, 20, 49):
        apart = [np.abs(shown[k] - other).mean() for other in drawn]
        assert int(np.argmin(apart)) == k
        assert apart[k] < 2


def test_the_size_of_a_film_is_bounded(tmp_path):
    """Noise cannot be compressed; without the limit of the rate it takes several times as much."""
    noise = np.random.default_rng(0).integers(0, 256, (50, 240, 320, 3)).astype(np.uint8)
    write_film(noise, tmp_path / "noise.mp4", fps=25)
    assert (tmp_path / "noise.mp4").stat().st_size < 1.1 * (2 + 1) * film.RATE / 8  # 2 s, and a buffer of 1 s
    write_film(shaded_frames(250), tmp_path / "disc.gif", fps=25)
    assert (tmp_path / "disc.gif").stat().st_size < 0.5e6


def test_a_film_that_ffmpeg_cannot_write_is_told(tmp_path):
    with pytest.raises(RenderError, match="ffmpeg could not write the film"):
        write_film(list(shaded_frames(2)), tmp_path / "nowhere" / "disc.mp4", fps=25)


@pytest.mark.parametrize("fps", [12, np.float64(12.0), Fraction(12)])
def test_a_rate_may_be_any_number(fps, tmp_path):
    write_film(shaded_frames(3), tmp_path / "disc.mp4", fps=fps)
    told = subprocess.run([film.ffmpeg_path(tmp_path), "-i", tmp_path / "disc.mp4"], capture_output=True, check=False)
    assert b"12 fps" in told.stderr


def test_frames_of_one_colour_make_a_film(tmp_path):
    write_film([np.full((40, 60, 3), 200, np.uint8)] * 3, tmp_path / "grey.gif", fps=25)
    assert (read_image(tmp_path / "grey.gif") == 200).all()


def test_average_of_blocks_keeps_the_mean():
    image = np.random.default_rng(0).integers(0, 256, (8, 12, 4)).astype(np.uint8)
    small = average_of_blocks(image, 2)
    assert small.shape == (4, 6, 3)
    assert_allclose(small[1, 2], image[2:4, 4:6, :3].mean(axis=(0, 1)), rtol=0, atol=1.0)


# Scenes --------------------------------------------------------------------------------------------------------------


def test_a_scene_survives_its_file(tmp_path):
    path = Lines(np.array([[0, 1], [1, 2]]), CUBE, last=[0, 1, 2, 2])
    scene = replace(moving_scene(4), lines=(*moving_scene(4).lines, path))  # with thirds, which no format holds exactly
    write_scene(scene, tmp_path / "scene.npz")
    again = read_scene(tmp_path / "scene.npz")
    for field in fields(Scene):
        value = getattr(scene, field.name)
        if field.name not in ("surfaces", "lines", "triads"):
            assert_array_equal(getattr(again, field.name), value)
    for part, part_again in zip((*scene.surfaces, *scene.lines, *scene.triads),
                                (*again.surfaces, *again.lines, *again.triads), strict=True):  # fmt: skip
        for field in fields(part):
            value, value_again = getattr(part, field.name), getattr(part_again, field.name)
            if isinstance(value, np.ndarray):
                assert_allclose(value_again, value, rtol=1e-6, atol=0)
            else:
                assert value_again == value


@pytest.mark.parametrize(("make", "words"), [
    (lambda: Surface(CUBE_TRIANGLES, CUBE[:5]), "expected nodes 0..4"),
    (lambda: Surface(CUBE_TRIANGLES, CUBE[:, :2]), r"expected positions \(n, 3\)"),
    (lambda: Surface(CUBE_TRIANGLES, CUBE * np.nan), "got NaN"),
    (lambda: Surface(CUBE_TRIANGLES, CUBE, scalars=np.zeros(3)), r"scalars: expected \(8,\)"),
    (lambda: Surface(CUBE_TRIANGLES, CUBE, opacity=0.0), "0 < opacity"),
    (lambda: Lines(np.array([[0, 9]]), CUBE), "expected points 0..7"),
    (lambda: Lines(np.array([[0, 1]]), CUBE, last=[0, 8]), "last: expected one of 8 points"),
    (lambda: Triad(np.zeros(3), np.zeros((2, 3, 3)), 1.0), "expected position"),
    (lambda: Scene(), "neither surfaces nor lines"),
    (lambda: cube_scene(up=np.array([1.0, -2.0, 1.0])), "a vector across the direction"),
    (lambda: replace(moving_scene(), surfaces=moving_scene(4).surfaces), "one number of frames"),
    (lambda: cube_scene(frame_notes=("a", "b")), "expected 1 frame notes"),
    (lambda: cube_scene(size=(100, 100)), "at least 200 x 200"),
    (lambda: render_picture(cube_scene(), "cube.jpg"), r"ends in \.png"),
    (lambda: render_animation(cube_scene(), "cube.png"), r"ends in \.gif or \.mp4"),
    (lambda: render_animation(cube_scene(), "cube.gif", fps=0.0), "fps: expected 1 to 120"),
])  # fmt: skip
def test_a_scene_that_cannot_be_drawn_is_refused_with_words(make, words):
    with pytest.raises(SceneError, match=words) as caught:
        make()
    assert isinstance(caught.value, CmsError)
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize("seed", range(6))
def test_the_camera_holds_every_point_and_wastes_no_room(seed):
    rng = np.random.default_rng(seed)
    nodes = rng.normal(size=(3, 8, 3)) * rng.uniform(0.1, 10, 3) + 100 * rng.normal(size=3)
    scene = Scene(surfaces=(Surface(CUBE_TRIANGLES, nodes),), direction=rng.normal(size=3), up=rng.normal(size=3))
    size = (700, 400)
    seen = fitted_camera(scene, size).project(nodes.reshape(-1, 3))[:, :2]
    margin = (1 - FILL) / 2 * np.array(size)
    assert (seen > margin - 0.5).all()
    assert (seen < size - margin + 0.5).all()
    used = np.ptp(seen, axis=0) / (FILL * np.array(size))
    assert used.max() > 0.97


def test_projection_keeps_up_up_and_right_right():
    camera = fitted_camera(cube_scene(direction=np.array([0.0, 1.0, 0.0])), SMALL)
    middle, right, above = camera.project(np.array([[0.5, 0.5, 0.5], [0.9, 0.5, 0.5], [0.5, 0.5, 0.9]]))
    assert_allclose(middle[:2], np.array(SMALL) / 2, rtol=0, atol=1e-6)
    assert right[0] > middle[0]
    assert above[1] < middle[1]


# Shape ---------------------------------------------------------------------------------------------------------------


def test_the_sharp_edges_of_a_cube_are_its_twelve_edges():
    edges, _, is_sharp = surface_edges(CUBE, CUBE_TRIANGLES)
    assert len(edges) == 18
    lengths = np.linalg.norm(CUBE[edges[:, 1]] - CUBE[edges[:, 0]], axis=1)
    assert_array_equal(is_sharp, np.isclose(lengths, 1.0))  # the six diagonals lie in flat faces


def test_free_edges_are_sharp():
    edges, beside, is_sharp = surface_edges(CUBE, CUBE_TRIANGLES[:1])
    assert len(edges) == 3
    assert is_sharp.all()
    assert_array_equal(beside, 0)


def test_shading_is_smoothed_over_flat_faces_and_not_over_edges():
    neighbours = smooth_neighbours(CUBE, CUBE_TRIANGLES).toarray()
    assert_array_equal(neighbours.sum(axis=1), 2)  # itself and the other half of its face
    assert_array_equal(neighbours[:6, 6:], np.eye(6))


def test_the_colour_map_has_even_steps():
    steps = np.linalg.norm(np.diff(cie_lab(colormap()), axis=0), axis=1)
    assert_allclose(steps, steps.mean(), rtol=0.06, atol=0)


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (-3.2, 7.9), (1e-9, 8.3e-9), (0.0, 73.3), (1e5, 1.001e5)])
def test_ticks_are_few_round_and_inside(low, high):
    ticks = round_ticks(low, high)
    assert 4 <= len(ticks) <= 12
    assert ticks[0] >= low - 1e-9 * (high - low)
    assert ticks[-1] <= high + 1e-9 * (high - low)
    step = np.diff(ticks)
    assert_allclose(step, step[0], rtol=1e-6, atol=0)


# Modes ---------------------------------------------------------------------------------------------------------------


def test_a_mode_is_drawn_at_nine_percent_of_the_diagonal_and_says_so():
    body = body_with_surface()
    scene = mode_scene(body, 3, np.array([0.0, 1.0, -1.0]))
    moved = scene.surfaces[0].nodes - body.nodes
    diagonal = np.linalg.norm([140.0, 30.0, 10.0])
    assert_allclose(
        np.linalg.norm(moved[:, :8], axis=2).max(axis=1),
        [0, 0.09 * diagonal, 0.09 * diagonal],
        rtol=1e-12,
        atol=1e-12 * diagonal,
    )
    direction = body.Phi[:8, :, 2].ravel()
    assert_allclose(
        moved[1, :8].ravel() / np.abs(moved[1, :8]).max(), direction / np.abs(direction).max(), rtol=0, atol=1e-12 * 140
    )
    assert_allclose(scene.surfaces[0].scalars[:, :8].max(axis=1), [0, 1, 1], rtol=1e-12, atol=0)
    assert "9 % of the body's diagonal" in " ".join(scene.captions)
    assert f"{body.frequencies[2]:.5g} Hz" in scene.title


def test_interfaces_move_with_the_mode():
    body = body_with_surface()
    scene = mode_scene(body, 2, np.array([0.0, 1.0]), scale=0.01)
    on_surface = np.linalg.norm(body.Phi[:8, :, 1], axis=1).max()
    factor = 0.01 * np.linalg.norm([140.0, 30.0, 10.0]) / on_surface
    for triad, interface in zip(scene.triads, body.interfaces, strict=True):
        assert_allclose(triad.position[0], interface.position, rtol=0, atol=0)
        assert_allclose(triad.position[1] - interface.position, factor * interface.Psi[:3, 1], rtol=1e-9, atol=1e-12)
        assert_allclose(triad.axes[1].T @ triad.axes[1], np.eye(3), rtol=0, atol=1e-12)


def test_a_mode_in_milliseconds_is_told_in_hertz():
    body = body_with_surface()
    fast = body_with_surface(units=synthetic_reduced_body(units="mm-kg-ms").units)
    assert f"{1e3 * body.frequencies[0]:.5g} Hz" in mode_scene(fast, 1, np.ones(1)).title


@pytest.mark.parametrize("extents", [(3, 2, 1), (1, 2, 3), (2, 1, 3), (1, 3, 2), (3, 1, 2), (2, 3, 1)])
def test_the_two_longer_sides_of_a_body_are_seen(extents):
    direction, up = view_axes(CUBE * extents)
    forward = direction / np.linalg.norm(direction)
    hidden = np.abs(forward)  # share of each axis that is lost along the line of sight
    assert_array_equal(np.argmax(hidden), np.argmin(extents))
    assert_array_equal(np.abs(up), np.eye(3)[np.argsort(extents)[1]])
    right = np.cross(forward, up)
    assert right[np.argmax(extents)] > 0.8  # the longest side runs to the right


def test_view_and_animation_of_a_mode_make_files(dying_worker, monkeypatch, tmp_path):
    monkeypatch.setattr(view, "FRAMES", 4)
    body = body_with_surface()
    assert view_mode(body, 1, tmp_path / "m.png").path.stat().st_size > 5000
    assert animate_mode(body, 1, tmp_path / "m.gif").path.stat().st_size > 5000


@pytest.mark.parametrize("mode", [0, 6, -1])
def test_a_mode_that_is_not_there_is_refused(mode, tmp_path):
    with pytest.raises(BodyError, match="expected a mode between 1 and 5"):
        view_mode(body_with_surface(), mode, tmp_path / "m.png")


def test_a_body_without_surface_is_refused(tmp_path):
    with pytest.raises(BodyError, match="no surface to draw"):
        view_mode(replace(synthetic_reduced_body(), surface=np.zeros((0, 3), int)), 1, tmp_path / "m.png")


@pytest.mark.parametrize("scale", [0.0, -1.0, np.nan])
def test_a_scale_that_cannot_be_is_refused(scale, tmp_path):
    with pytest.raises(SceneError, match="scale: expected a share"):
        view_mode(body_with_surface(), 1, tmp_path / "m.png", scale=scale)


def test_labels_of_coinciding_points_stand_below_each_other():
    boxes = []
    for left, top in ((0, 0), (5, 2), (8, 1), (40, 0), (2, 30)):
        box = (left, top, left + 20, top + 10)
        down = drop_below(box, boxes)
        boxes.append((box[0], box[1] + down, box[2], box[3] + down))
    assert [box[1] for box in boxes] == [0, 11, 22, 0, 33]
    for a in boxes:
        for b in boxes:
            assert a is b or a[2] < b[0] or b[2] < a[0] or a[3] < b[1] or b[3] < a[1]


def test_a_label_of_one_name_at_one_place_is_drawn_once(monkeypatch):
    """Two bodies have an interface "elbow" at their joint; one that is elsewhere keeps its label."""
    written = []
    pen = SimpleNamespace(
        textbbox=lambda place, text, font: (*place, place[0] + 30, place[1] + 10),
        rounded_rectangle=lambda *given, **options: None,
        text=lambda place, text, *style, **options: written.append(text),
    )
    monkeypatch.setattr(annotations, "draw_axes", lambda *given: None)
    places = {"elbow": (0.0, 0, 0), "wrist": (0.0, 0, 0), "elbow ": (0.0, 0, 0), "elbow  ": (200.0, 0, 0)}
    triads = tuple(Triad(np.array(place), np.eye(3), 0.3, name.strip()) for name, place in places.items())
    camera = SimpleNamespace(project=np.asarray, axes=np.eye(3))
    layout = SimpleNamespace(unit=10.0, view=(0, 0, 300, 300))
    annotations.draw_triads(pen, replace(moving_scene(), triads=triads), layout, camera, 0)
    assert written == ["elbow", "wrist", "elbow"]
