"""Pages for users of neighbouring programs that start from files: their commands work in order, and write files."""

import shutil

import pytest

import cms
import fe_models as fm
from tests.docs.tutorials import walk_of
from tests.root import ROOT

DATA = ROOT / "tests" / "fe_models" / "files" / "data"
#: files that a reader brings along, and files that the commands write
PAGES = {
    "adams_simpack": (("rod.h5",), ("rod.pch", "rod.SID_FEM")),
    "ansys": (
        ("ansys/HexBeam.cdb", "ansys/HexBeam_clamped.full", "ansys/cp56.sub"),
        ("beam.toml", "held.h5", "cube.h5"),
    ),
    "nastran": (
        ("nastran/outboard.op4", "nastran/outboard.pch", "nastran/outboard.asm", "nastran/outboard.blk"),
        ("tip.h5", "copy.op4", "outboard.h5", "tip.asm", "tip_dmig.pch"),
    ),
    "sid_mbsim": (("rod.h5",), ("from_sid.h5", "from_mbsim.h5")),
}


@pytest.fixture(scope="module")
def rod(tmp_path_factory):
    line = fm.beams.straight_line((0, 0, 0), (0.3, 0, 0), 4)
    ends = [fm.beams.line_interface(line, name, fm.selections.NodeSet(name)) for name in ("start", "end")]
    section = fm.beams.BeamProperty(fm.beams.Circle(0.01), fm.Material("steel", E=210e9, nu=0.3, rho=7850.0))
    body = cms.couple(fm.beam_body(line, section, name="rod", units=cms.unit_system("m-kg-s"), interfaces=ends))
    path = tmp_path_factory.mktemp("body") / "rod.h5"
    cms.write(cms.reduce(body, cms.craig_bampton(body, n_modes=4), frame=cms.TisserandFrame()), path)
    return path


@pytest.mark.parametrize("page", PAGES)
def test_commands_of_a_page_write_their_files(page, rod, tmp_path):
    given, written = PAGES[page]
    folder = tmp_path / "folder"
    folder.mkdir()
    for name in given:
        shutil.copy(rod if name == "rod.h5" else DATA / name, folder)
    assert list(walk_of(page, folder).missing) == []
    assert [name for name in written if not (folder / name).stat().st_size] == []
