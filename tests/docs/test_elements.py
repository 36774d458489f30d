"""An element with a state, creeping_mount.md, from a folder of a user: by file, in Python, against a closed form."""

import re
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import floatframe as ff
from floatframe.files.system_file.read_system import read_system
from floatframe.results.energy_balance import balance_defect, energy_scale
from floatframe.results.sensors import measured
from tests.floatframe.orders import slope
from tests.root import ROOT

PAGE = (ROOT / "tests" / "docs" / "creeping_mount.md").read_text(encoding="utf-8")
FILES = dict(re.findall(r"^<!-- file: (\S+) -->\n```\w+\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE))
K_0, K_1, T, M = 2e5, 3e5, 0.05, 100.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with the files of the page."""
    folder = tmp_path_factory.mktemp("page")
    for name, text in FILES.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    yield folder
    for name in [name for name in sys.modules if name.split(".")[0] == "rubber"]:
        del sys.modules[name]


@pytest.fixture(scope="module")
def by_file(folder):
    return read_system(folder / "mount.toml")


def test_the_script_and_the_system_file_give_one_motion(folder, by_file, monkeypatch, capsys):
    monkeypatch.syspath_prepend(str(folder))
    names = {}
    exec(compile(FILES["mount.py"], "mount.py", "exec"), names)
    assert capsys.readouterr().out == "()\n"
    system, run = by_file
    motion = ff.integrate(system, run.integrator, run.t_end, run.h)
    assert_array_equal(motion.body("engine").r, names["motion"].body("engine").r)
    assert len(names["modes"].eigenvalues) == 2  # one of a pair, and the creep
    found = measured(system, motion)
    assert set(found["mount"].columns) == {"tension", "energy", "lost", "creep"}
    assert_array_equal(found["tension"].columns["tension"], names["seen"].outputs["tension"])


def test_its_energy_balance_closes_with_the_square_of_the_step(by_file):
    system, run = by_file
    steps, defects = [1e-3, 5e-4, 2.5e-4], []
    for h in steps:
        motion = ff.integrate(system, run.integrator, run.t_end, h)
        defects.append(np.abs(balance_defect(motion)).max() / energy_scale(motion))
    assert abs(slope(steps, defects) - 2) < 0.15


def test_the_mount_is_as_stiff_as_the_closed_form_says(by_file):
    """K(w) = k_0 + k_1 i w T/(1 + i w T), where the weight has let it creep: k_0 carries."""
    system, _ = by_file
    rest = ff.static_equilibrium(system)
    assert_allclose(rest.state.r[0, 2], -M * 9.81 / K_0, rtol=1e-9)
    push = ff.sensors.Channel("push", ff.Marker("engine"), (0, 0, 1))
    place = ff.sensors.PlaceSensor("place", ff.Marker("engine"), "position")
    linear = ff.linearize(system, rest, inputs=[push], outputs=[ff.analyses.Column(place, "z")])
    f = np.array([0.3, 3.0, 30.0])
    s = 2j * np.pi * f
    exact = 1 / (K_0 + K_1 * s * T / (1 + s * T) + M * s**2)
    assert_allclose(ff.frequency_response(linear, f).values[:, 0, 0], exact, rtol=1e-9)
