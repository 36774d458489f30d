"""Files that a mesh or deck includes are on record with their digest, beside the file itself."""

from hashlib import sha256

import pytest

from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models import Material, read_mesh, solid_body, unit_system
from fe_models.errors import MeshError
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.files.read_mesh import read_geometry
from fe_models.foundation.stages import Stages

INP = "*NODE, INPUT=nodes.txt\n*INCLUDE, INPUT=more.txt\n*MATERIAL, NAME=M\n*ELASTIC\n2e11, .3\n*DENSITY\n7850.\n"
BDF = "BEGIN BULK\nINCLUDE 'nodes.txt'\nINCLUDE 'more.txt'\nPSOLID,1,1\nMAT1,1,2.+11,,.3,7850.\nENDDATA\n"
FILES = {
    "box.inp": {
        "box.inp": INP + "*SOLID SECTION, ELSET=a, MATERIAL=M\n",
        "nodes.txt": "1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n",
        "more.txt": "*ELEMENT, TYPE=C3D4, ELSET=a\n1,1,2,3,4\n",
    },
    "box.bdf": {
        "box.bdf": BDF,
        "nodes.txt": "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\n",
        "more.txt": "CTETRA,1,1,1,2,3,4\n",
    },
}


@pytest.mark.parametrize("name", FILES)
def test_included_files_are_on_record(tmp_path, name):
    for each, text in FILES[name].items():
        (tmp_path / each).write_text(text)
    path = tmp_path / name
    expected = {
        str(tmp_path / each): sha256((tmp_path / each).read_bytes()).hexdigest() for each in ("nodes.txt", "more.txt")
    }
    mesh = read_mesh(path)
    assert mesh.included == expected
    assert read_geometry(path).included == expected
    assert mesh.digest == sha256(path.read_bytes()).hexdigest()
    body = solid_body(mesh, Material("m", E=2e11, nu=0.3, rho=7850.0), name="b", units=unit_system("m-kg-s"))
    path.with_suffix(".toml").write_text(job_text(parse_deck(path), DeckOptions("m-kg-s", {}), name))
    for made in (body, uncoupled_body(read_job(path.with_suffix(".toml")), Stages())):
        assert {key: value for key, value in made.provenance.items() if key.startswith("file ")} == {
            f"file {each}": digest for each, digest in expected.items()
        }


@pytest.mark.parametrize(("suffix", "include"), [(".inp", "*INCLUDE, INPUT={}.inp\n"), (".bdf", "INCLUDE '{}.bdf'\n")])
def test_ten_files_may_include_each_other_and_eleven_may_not(tmp_path, suffix, include):
    deck = FILES[f"box{suffix}"]
    for k in range(10):
        (tmp_path / f"{k}{suffix}").write_text(include.format(k + 1))
    last = tmp_path / f"10{suffix}"
    last.write_text("*NODE\n" * (suffix == ".inp") + deck["nodes.txt"] + deck["more.txt"])
    assert len(read_mesh(tmp_path / f"0{suffix}").nodes) == 4
    (tmp_path / f"11{suffix}").write_text(last.read_text())
    last.write_text(include.format(11))
    with pytest.raises(MeshError, match=rf"11{suffix} includes itself, or files nest too deeply"):
        read_mesh(tmp_path / f"0{suffix}")


def test_what_statements_above_cend_include_may_be_missing(tmp_path):
    """They run the program and describe no body; a file that bulk data include must be there."""
    grids = "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\n"
    path = tmp_path / "bar.bdf"
    path.write_text(f"SOL 101\nINCLUDE 'dmap.alter'\nCEND\nBEGIN BULK\n{grids}ENDDATA\n")
    assert len(parse_deck(path).mesh.nodes) == 2
    path.write_text(f"SOL 101\nCEND\nBEGIN BULK\nINCLUDE 'dmap.alter'\n{grids}ENDDATA\n")
    with pytest.raises(MeshError, match=r"INCLUDE dmap\.alter"):
        parse_deck(path)
