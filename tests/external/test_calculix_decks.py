"""The decks of CalculiX's own test suite: which are read, and whether their bodies have its frequencies."""

import shutil

import pytest

from fe_models.foundation.errors import ReportedError
from tests.external.calculix import FOLDER, LIST, body_of, difference, is_linear_body, names, static_difference, text_of

pytestmark = [
    pytest.mark.external,
    pytest.mark.skipif(not FOLDER.is_dir() or shutil.which("ccx") is None, reason="needs calculix-ccx and its tests"),
]

#: decks whose solids differ from those of ccx by more than 0.1 %, and why
OTHERWISE = {
    "dloadlinI.inp": "C3D8I on distorted cells is corrected in another way",
    "dloadlinIf.inp": "C3D8I on distorted cells is corrected in another way",
    "cube2.inp": "motions without stiffness, by reduced integration: numerical zeros",
    "cubenewt.inp": "motions without stiffness, by reduced integration: numerical zeros",
}
READ_AT_LEAST = 0.98  #: share of the list


def test_the_list_of_decks_follows_its_rule():
    assert [name for name in names() if is_linear_body(text_of(name))] == LIST.read_text().split()


def test_decks_are_read_or_refused_by_name(tmp_path):
    read = []
    for name in LIST.read_text().split():
        path = tmp_path / name
        path.write_text(text_of(name))
        try:
            body_of(path)
            read.append(name)
        except ReportedError:
            continue
    assert len(read) >= READ_AT_LEAST * len(LIST.read_text().split())


def test_solids_have_the_frequencies_of_ccx(tmp_path):
    compared, wrong = 0, {}
    for name in LIST.read_text().split():
        try:
            kinds, error = difference(name, tmp_path)
        except ReportedError:
            continue
        if kinds != ["solids"] or error is None:
            continue
        compared += 1
        if (error > 1e-3) != (name in OTHERWISE):
            wrong[name] = error
    assert wrong == {}
    assert compared > 100


@pytest.mark.parametrize("name", ["beamplane.inp", "beamstraight.inp"])
def test_nonlinear_constraints_have_the_displacements_of_ccx_under_small_forces(tmp_path, name):
    """For these ccx finds no frequencies; its static step is nonlinear, and linear to 1e-6 under forces so small."""
    assert static_difference(name, tmp_path) < 2e-6
