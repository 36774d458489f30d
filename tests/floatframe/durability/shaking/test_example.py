"""The example of docs/shake.md runs, and its figures are those of the page."""

import re

import numpy as np
from numpy.testing import assert_allclose

from tests.root import ROOT


def test_the_example_of_the_page_gives_the_figures_of_the_page():
    text = (ROOT / "docs" / "shake.md").read_text(encoding="utf-8")
    code = next(block for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "ShakeJob(\n" in block)
    found: dict = {}
    exec(code, found)
    result = found["result"]
    assert_allclose([found["amplitude"], found["swept"]], [39.14, 38.49], atol=0.005)
    assert_allclose([found["notch"].depth, found["notch"].first, found["notch"].last], [8.33, 36.77, 40.30], atol=0.005)
    assert_allclose([result.masses.frequencies[0], 100 * result.masses.share[0, 0]], [38.51, 61.3], atol=0.05)
    random = result.random[0]
    names = [output.name for output in random.outputs]
    rms = random.rms[[names.index("mirror acceleration x"), names.index("mean acceleration x")]] / result.model.gravity
    assert_allclose([*rms, random.miles[0].grms], [23.88, 5.27, 5.40], atol=0.005)
    # a cantilever: 3.516 sqrt(E I/(rho A L^4))/(2 pi), bending along x in the plane of the depth that the section
    #:has there
    inertia, area = 0.04 * 0.03**3 / 12, 0.04 * 0.03
    first = 3.51602 * np.sqrt(70e9 * inertia / (2700 * area * 0.8**4)) / (2 * np.pi)
    assert_allclose(result.masses.frequencies[0], first, rtol=2e-3)
