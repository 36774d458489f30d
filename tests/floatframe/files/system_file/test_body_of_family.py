"""Bodies of a system file that are interpolated from a family: `at`."""

import pytest
from numpy.testing import assert_array_equal

import cms
import fe_models as fm
from cms.reduction import parametric_body, write_parametric_body
from floatframe.errors import ModelError, SystemFileError
from floatframe.files.system_file.read_system import read_system

SYSTEM = """
[system]
units = "m-kg-s"

[bodies.arm]
file = "arms.h5"
at = {length = 1.1}

[joints.pin]
type = "revolute"
body_a = "ground"
body_b = "arm"
marker_b = "start"
axis = [0, 1, 0]
"""


def reduced(length):
    line = fm.beams.straight_line((0, 0, 0), (length, 0, 0), 4)
    ends = [fm.beams.line_interface(line, name, fm.selections.NodeSet(name)) for name in ("start", "end")]
    section = fm.beams.BeamProperty(fm.beams.Circle(0.01), fm.Material("steel", E=210e9, nu=0.3, rho=7850.0))
    body = cms.couple(fm.beam_body(line, section, name="arm", units=cms.unit_system("m-kg-s"), interfaces=ends))
    return cms.reduce(body, cms.craig_bampton(body, n_modes=2), geometric=False, stress=False)


@pytest.fixture(scope="module")
def family(tmp_path_factory):
    """The file of a family of arms beside a system file, and the family."""
    folder = tmp_path_factory.mktemp("arms")
    arms = parametric_body({"length": (1.0, 1.2)}, [reduced(1.0), reduced(1.2)])
    write_parametric_body(arms, folder / "arms.h5")
    (folder / "system.toml").write_text(SYSTEM)
    return folder / "system.toml", arms


def test_a_body_of_a_system_comes_from_a_family(family):
    path, arms = family
    system, _ = read_system(path)
    assert_array_equal(system.body("arm").reduced.K, arms.at(length=1.1).K)
    assert str(path.with_name("arms.h5")) in system.files


def test_a_sweep_changes_the_parameter_of_the_family_by_its_key_path(family):
    path, _ = family
    system, _ = read_system(path, {"bodies.arm.at.length": 1.05})
    assert_array_equal(system.body("arm").reduced.interface("end").position, [1.05 / 2, 0, 0])
    with pytest.raises((ModelError, SystemFileError), match=r"bodies\.arm\.at: .* length = 1\.3: outside"):
        read_system(path, {"bodies.arm.at.length": 1.3})


def test_a_family_that_has_changed_is_read_again(family):
    path, arms = family
    first = read_system(path)[0].body("arm").reduced
    other = parametric_body({"length": (1.0, 1.3)}, [arms.samples[0], reduced(1.3)])
    write_parametric_body(other, path.with_name("arms.h5"))
    try:
        again = read_system(path)[0].body("arm").reduced
    finally:
        write_parametric_body(arms, path.with_name("arms.h5"))
    assert_array_equal(again.K, other.at(length=1.1).K)
    assert abs(again.K - first.K).max() > 0
