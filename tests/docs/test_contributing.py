"""The recipes of CONTRIBUTING.md are followed here: what they show runs, the files they name are all there are."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import fe_models
from fe_models.files.read_mesh import MESH_FORMATS
from fe_models.foundation.formats import ReadFormat
from tests.bodies import bar
from tests.root import ROOT

PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


def shown(marker):
    """Return what the code under a marker of the page defines."""
    indent, code = re.search(
        rf"^( *)<!-- {marker} -->\n *```python\n(.*?)^ *```$", PAGE, re.DOTALL | re.MULTILINE
    ).groups()
    names = {}
    exec(compile(re.sub(rf"^{indent}", "", code, flags=re.MULTILINE), "CONTRIBUTING.md", "exec"), names)
    return names


def test_the_mode_set_that_is_shown_is_statically_complete():
    body = cms.couple(bar(nx=3))
    modes = shown("mode set")["static_modes_only"](body)
    span = np.linalg.qr(modes.columns)[0]
    expected = cms.modes.craig_bampton_ir(body, n_modes=0).columns
    assert_allclose(span @ (span.T @ expected), expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_the_importer_that_is_shown_reads_and_refuses(tmp_path, monkeypatch):
    monkeypatch.setitem(
        MESH_FORMATS, ".plain", ReadFormat("text", "plain", "mesh", (".plain",), read=shown("importer")["read_plain"])
    )
    file = tmp_path / "one.plain"
    file.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n\nt 0 1 2 3\n")
    mesh = fe_models.read_mesh(file)
    body = fe_models.solid_body(
        mesh, fe_models.Material("steel", 210e9, 0.3, 7850.0), name="one", units=fe_models.unit_system("m-kg-s")
    )
    assert_allclose(body.M.sum(), 3 * 7850 / 6, rtol=1e-12)
    file.write_text("v 0 0\n")
    with pytest.raises(fe_models.errors.MeshError, match="line 1: expected v x y z"):
        fe_models.read_mesh(file)


@pytest.mark.parametrize(
    ("marker", "name"), [("element", "hexahedron27"), ("joint", "ScrewJoint"), ("force", "SphereContact")]
)
def test_the_files_a_recipe_names_are_those_that_know_the_thing(marker, name):
    table = re.search(rf"<!-- {marker} -->\n\n(.*?)\n\n", PAGE, re.DOTALL)[1]
    named = set(re.findall(r"^\| `([^`]+)` \|", table, re.MULTILINE))
    there = {
        str(path.relative_to(ROOT))
        for package in ("fe_models", "cms", "floatframe")
        for path in (ROOT / package).rglob("*.py*")
        if path.suffix in {".py", ".pyi"} and re.search(rf"\b{name}\b", path.read_text(encoding="utf-8"))
    }
    assert there == named
