"""The page as a browser shows it: offline, with the machine where the motion has it, on a desktop and on a phone."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GeneralizedAlpha, integrate, linearize, static_equilibrium, system_modes, view
from floatframe.pictures import view_modes
from floatframe.results.recovery import nodal_positions
from tests.cms.browser import browser, opened
from tests.floatframe.pictures.viewer.examples import SIZE, swinging

PLACES = """(t) => {
  View.pause(); View.seek(t);
  const s = View.surfaces[0], p = new THREE.Vector3(), found = [];
  for (let k = 0; k < s.count; k++) found.push(p.fromArray(s.moved, 3 * k).applyMatrix4(s.body.matrix).toArray());
  return found;
}"""
SEEN = """() => {
  View.show();
  const gl = document.getElementById("canvas"), image = document.createElement("canvas"), w = gl.width, h = gl.height;
  image.width = w; image.height = h;
  const context = image.getContext("2d");
  context.drawImage(gl, 0, 0);
  const data = context.getImageData(0, 0, w, h).data;
  let dark = 0;
  for (let k = 3; k < data.length; k += 4) if (data[k] > 200) dark += 1;
  return dark / (w * h);
}"""


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    system = swinging()
    motion = integrate(system, GeneralizedAlpha(0.8), 0.4, 2e-3, output_every=4)
    view(motion, folder / "motion.html", system=system, magnification=1.0)
    return folder, system, motion


def test_a_browser_shows_the_motion_offline_and_poses_it_as_computed(pages):
    folder, system, motion = pages
    body = system.body("arm").reduced
    rows = np.unique(body.surface)
    with browser() as started:
        page, complaints = opened(started, folder / "motion.html", width=920, height=480)
        for row in (0, 13, len(motion.t) - 1):
            found = np.array(page.evaluate(PLACES, float(motion.t[row])))
            expected = nodal_positions(motion, "arm", body, row)[rows]
            assert_allclose(found, expected, rtol=0, atol=1e-4 * SIZE)
        between = np.array(page.evaluate(PLACES, float(motion.t[13:15].mean())))
        middle = (nodal_positions(motion, "arm", body, 13) + nodal_positions(motion, "arm", body, 14))[rows] / 2
        assert_allclose(between, middle, rtol=0, atol=2e-3 * SIZE)  # half of a turn of 0.02 rad lies on the arc
        assert page.evaluate("document.body.dataset.ready") == "drawn"
        assert page.evaluate(SEEN) > 0.02  # something is drawn
        before = page.evaluate("View.camera.position.toArray()")
        page.click("[data-view=top]")
        assert np.linalg.norm(np.subtract(page.evaluate("View.camera.position.toArray()"), before)) > 0.1
        page.select_option("#color", "von-mises")
        assert "von Mises" in page.inner_text("#legend")
        page.click("#play")
        page.wait_for_function("View.frames > 4")
        page.click("#play")
        assert page.evaluate("document.querySelectorAll('.plot .now').length") >= 3
        assert complaints.errors == []
        assert complaints.requests == []
        page.close()
        # a narrow screen: nothing is wider than it, picture above plots
        page, complaints = opened(started, folder / "motion.html", width=390, height=800)
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        stage, side = (page.locator(each).bounding_box() for each in ("#stage", "#side"))
        assert stage["y"] + stage["height"] <= side["y"] + 1
        assert complaints.errors == []


@pytest.mark.long
def test_a_browser_shows_modes_and_equilibrium(pages):
    folder, system, _ = pages
    rest = static_equilibrium(system)
    view_modes(system, rest, system_modes(linearize(system, rest)), folder / "modes.html", n_modes=4)
    with browser() as started:
        page, complaints = opened(started, folder / "modes.html")
        assert page.locator("#modes button").count() == 5
        page.click("#modes button:nth-child(3)")
        assert page.evaluate("View.state.mode") == 1
        assert complaints.errors == []
