"""Pages of modes: what swings in them is the mode, about the equilibrium."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GROUND, FlexibleBody, Marker, SphericalJoint, System, linearize, system_modes
from floatframe.errors import ResultsError
from floatframe.model.rotations import rotation_exp, rotation_matrix
from floatframe.pictures.mode_film import LARGEST_TURN, SWING, mode_scene
from floatframe.pictures.viewer.modes_view import view_modes
from tests.floatframe.pictures.viewer.pages import ReadPage
from tests.synthetic import synthetic_reduced_body

QUARTERS = np.exp(0.5j * np.pi * np.arange(4))
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def hung(**options):
    reduced = replace(synthetic_reduced_body(), surface=TETRAHEDRON, **options)
    pin = SphericalJoint("pin", GROUND, Marker("part", reduced.interfaces[0].name))
    system = System([FlexibleBody("part", reduced)], [pin], units=reduced.units)
    linear = linearize(system)
    return system, linear.equilibrium, system_modes(linear)


def test_a_body_swings_in_the_page_as_in_the_film(tmp_path):
    """Both about one shape: the page by its own amplitudes, the film by displaced states; sizes are chosen apart."""
    system, rest, modes = hung()
    view_modes(system, rest, modes, tmp_path / "modes.html")
    read = ReadPage(tmp_path / "modes.html")
    body, surface = read.record["bodies"][0], read.record["surfaces"][0]
    re, im, a_re, a_im = (read.array(body["modes"][key]) for key in ("re", "im", "a_re", "a_im"))
    shapes, nodes = read.array(surface["shapes"]), read.array(surface["nodes"])
    r, R, a = read.array(body["r"])[0], rotation_matrix(read.array(body["p"])[0]), read.array(body["a"])[0]
    for k in (0, len(modes.eigenvalues) - 1):
        shape = modes.shapes[:, k]
        u = re[k] + 1j * im[k]
        factor = np.vdot(shape[:6], u) / np.vdot(shape[:6], shape[:6])
        assert_allclose(u, factor * shape[:6], rtol=0, atol=1e-6 * np.abs(u).max())
        assert_allclose((a_re[k] + 1j * a_im[k]) @ np.linalg.pinv(np.eye(len(a))), factor * shape[6:], rtol=0,
                        atol=1e-5 * np.abs(factor * shape[6:]).max())  # fmt: skip
        scene = mode_scene(system, rest, modes, k + 1, QUARTERS)
        film = scene.surfaces[0].nodes[:, np.unique(TETRAHEDRON)]
        still = r + (nodes + (a @ shapes).reshape(-1, 3)) @ R.T
        own = []
        for turned in QUARTERS:
            x = np.real(u * turned)
            d = ((a + np.real((a_re[k] + 1j * a_im[k]) * turned)) @ shapes).reshape(-1, 3)
            own.append(r + R @ x[:3] + (nodes + d) @ (R @ rotation_exp(x[3:])).T)
        far = np.abs(film - still).max()
        ratio = np.abs(np.array(own) - still).max() / far
        assert 0.05 < ratio < 20
        # to first order both are the same motion, by the ratio of their sizes
        first = (np.array(own)[0] - np.array(own)[2]) / ratio
        assert_allclose(first, film[0] - film[2], rtol=0, atol=0.1 * far)
    assert len(read.record["modes"]) == len(modes.eigenvalues)


def test_the_farthest_node_swings_by_a_share_of_the_machine(tmp_path):
    system, rest, modes = hung()
    view_modes(system, rest, modes, tmp_path / "modes.html", n_modes=2)
    read = ReadPage(tmp_path / "modes.html")
    assert len(read.record["modes"]) == 2
    body, surface = read.record["bodies"][0], read.record["surfaces"][0]
    u = read.array(body["modes"]["re"])[1] + 1j * read.array(body["modes"]["im"])[1]
    a = read.array(body["modes"]["a_re"])[1] + 1j * read.array(body["modes"]["a_im"])[1]
    nodes = read.array(surface["nodes"])
    d = u[:3] + np.cross(u[3:], nodes) + (a @ read.array(surface["shapes"])).reshape(-1, 3)
    far = np.linalg.norm(d, axis=1).max()
    size = read.record["view"]["size"]
    turn = np.abs(u[3:]).max()
    assert_allclose(max(far / (SWING * size), turn / LARGEST_TURN), 1.0, rtol=1e-3)  # what is reached first


def test_what_cannot_be_shown_is_refused(tmp_path):
    system, rest, modes = hung(stress=None)
    with pytest.raises(ResultsError, match="no body of the system has stress modes"):
        view_modes(system, rest, modes, tmp_path / "no.html", color="von-mises")
    with pytest.raises(ResultsError, match="no modes to show"):
        view_modes(system, rest, modes, tmp_path / "no.html", n_modes=0)
    assert not (tmp_path / "no.html").exists()
