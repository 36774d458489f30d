"""The slider-crank of the user guide: fewer than 25 lines, and the motion is that of the mechanism."""

import re

import numpy as np
from numpy.testing import assert_allclose

from floatframe.model.functions.time_functions import cycloidal_spin_up
from floatframe.sensors import measured
from tests.root import ROOT

GUIDE = ROOT / "docs" / "user_guide.md"


def test_slider_crank_with_a_flexible_rod_takes_fewer_than_25_lines_and_moves_as_one():
    block = re.search(r"<!-- slider-crank -->\n```python\n(.*?)```", GUIDE.read_text(), re.DOTALL)
    text = block.group(1)
    assert len([line for line in text.splitlines() if line.strip()]) < 25
    names: dict = {}
    exec(compile(text, "user_guide.md", "exec"), names)  # the example itself is what is tested
    motion = names["motion"]
    drive = cycloidal_spin_up(100.0, 0.05)
    angle = np.array([drive(t) for t in motion.t])
    rigid = 0.15 * np.cos(angle) + np.sqrt(0.35**2 - (0.15 * np.sin(angle)) ** 2)
    x = measured(names["system"], motion)["block"].columns["x"]
    bent = np.abs(motion.body("rod").q).max()
    assert bent > 0
    assert_allclose(x, rigid, rtol=0, atol=2e-3)  # the rod bends: its ends come nearer by less than that
    # what the drive puts in is what the mechanism has, less what it damps
    energies = motion.energies
    assert_allclose(energies.balance, energies.balance[0], rtol=0, atol=2e-3 * energies.kinetic.max())
