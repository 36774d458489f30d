"""The document of an acceptance: what is judged, against what, what the body is good for, and how it is written.

The bar 100 x 10 x 10 mm of steel is the oracle: its mass, its compliance and its Euler load are known in closed form.
"""

import io
import json
import re
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from PIL import Image

from cms.assessment.quality import reduction_check
from cms.assessment.quality.body_check import check_body
from cms.assessment.quality.errors import QualityError
from cms.body.linear_range import LINEAR, STIFFENED
from cms.body.modal_file.file import read, write
from cms.cli import main
from cms.cli.verdicts.check import check_file
from cms.jobs.acceptance import accept as module_of_accept
from cms.jobs.acceptance.accept import FullModel, accept, compare_with_model
from cms.jobs.acceptance.document import document_of, write_acceptance
from cms.jobs.acceptance.origin import source_files
from cms.jobs.acceptance.range_of_use import range_of_use
from cms.pipeline import reduce_job
from fe_models.foundation.documents.document import TextTable
from fe_models.foundation.documents.html import html_page
from fe_models.foundation.documents.pdf import pdf_pages
from fe_models.meshes.numbering import Numbering
from tests.bodies import box_mesh
from tests.decks import JOB, write_deck

LENGTH, SIDE, YOUNG, DENSITY = 100.0, 10.0, 210000.0, 7.85e-9


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A bar as a deck, its job, its modal file."""
    folder = tmp_path_factory.mktemp("bar")
    write_deck(folder / "bar.inp", box_mesh(8, 1, 1, LENGTH, SIDE, SIDE, kind="hexahedron20"))
    (folder / "bar.toml").write_text(JOB)
    write(reduce_job(folder / "bar.toml"), folder / "bar.h5")
    return folder


@pytest.fixture(scope="module")
def accepted(folder):
    return accept(folder / "bar.h5", FullModel(job=folder / "bar.toml"))


def test_own_body_against_its_job(accepted, folder):
    names = [record.name for record in accepted.records]
    assert {"symmetry", "same-body", "frequency-error", "mesh-error"} <= set(names)
    assert accepted.verdict in ("pass", "warn")
    assert accepted.compared_with.endswith("its mode set")
    assert accepted.range.band.is_compared
    assert [(Path(each.path).name, each.state) for each in accepted.sources] == [("bar.inp", "unchanged")]
    (mesh,) = (record for record in accepted.records if record.name == "mesh-error")
    assert 0 < mesh.value == accepted.mesh_error.largest


def test_a_body_whose_mesh_is_not_refined_has_the_mesh_errors_of_its_file(folder):
    """And a body without them has none."""
    body = read(folder / "bar.h5")
    found, without = accept(body), accept(replace(body, errors=replace(body.errors, mesh=np.zeros(0), mesh_sign="")))
    assert len(body.errors.mesh) > 0
    assert found.mesh_error.largest == found.as_dict()["mesh_error"]["largest"] == body.errors.mesh[:6].max() > 0
    assert f"by up to {100 * body.errors.mesh[:6].max():.2g} %" in found.mesh_error.words
    assert np.isnan(without.mesh_error.largest)
    assert without.as_dict()["mesh_error"]["largest"] is None
    page = html_page(document_of(found))
    assert "mesh error of the lowest frequencies, estimated" in page
    for error in (body.errors.frequency[-1], body.errors.mesh[-1]):
        assert f"+{100 * error:.2g}" in page


def test_the_body_is_checked_once(folder, monkeypatch):
    """By itself, and beside the full model of its job."""
    asked = []
    for module in (module_of_accept, reduction_check):
        monkeypatch.setattr(module, "check_body", lambda reduced, of=check_body: asked.append(reduced) or of(reduced))
    for full in (FullModel(), FullModel(job=folder / "bar.toml")):
        asked.clear()
        records = accept(folder / "bar.h5", full).records
        assert len(asked) == 1
        names = [record.name for record in records]
        assert len(set(names)) == len(names)


def test_a_file_by_itself_is_accepted_with_a_band_of_custom_only(folder):
    found = accept(folder / "bar.h5")
    assert found.verdict == "pass"
    assert "no full model" in found.words
    assert not found.range.band.is_compared
    body = read(folder / "bar.h5")
    assert found.range.band.highest == pytest.approx(body.free_frequencies[2] / 1.5)  # three vibration modes
    unknown = {key: words for key, words in body.provenance.items() if key != "mode set n_modes"}
    assert range_of_use(replace(body, provenance=unknown)).band.highest == pytest.approx(body.free_frequencies[0])


def test_loads_and_speed_of_the_range_are_those_of_a_clamped_bar(folder):
    """F = 2 E I phi / L² turns the end of a cantilever by phi; Euler's load is pi² E I / (4 L²)."""
    body = read(folder / "bar.h5")  # nodal frame at "left": that end is held
    found = range_of_use(body)
    inertia = SIDE**4 / 12
    loads = {(load.interface, load.direction): load for load in found.loads}
    bending = loads["right", "force z"]
    assert bending.governed_by == "rotation"
    assert bending.linear == pytest.approx(LINEAR.rotation * 2 * YOUNG * inertia / LENGTH**2, rel=0.03)
    assert bending.deflection == pytest.approx(bending.linear * LENGTH**3 / (3 * YOUNG * inertia), rel=0.04)
    assert bending.stiffened == pytest.approx(bending.linear * STIFFENED.rotation / LINEAR.rotation)
    along = loads["right", "force x"]
    assert along.governed_by == "change of stiffness"
    assert along.linear == pytest.approx(LINEAR.load * np.pi**2 * YOUNG * inertia / (4 * LENGTH**2), rel=0.05)
    first = 1.875104**2 / (2 * np.pi) * np.sqrt(YOUNG * inertia / (DENSITY * SIDE**2 * LENGTH**4))
    assert found.speed is not None
    assert found.speed.lowest_held == pytest.approx(first, rel=0.02)
    assert found.speed.linear == pytest.approx(LINEAR.speed * 2 * np.pi * found.speed.lowest_held)


def test_effective_masses_add_up_to_the_mass_of_the_bar(accepted):
    for found in accepted.masses:
        assert_allclose(found.total[:3], DENSITY * SIDE**2 * LENGTH, rtol=1e-9)
        assert_allclose(found.cumulative[-1] + found.remainder, 1.0, atol=1e-9)


def test_received_body_against_its_deck(folder, tmp_path):
    """A body with the mode set taken off its record is one that another program has made."""
    body = read(folder / "bar.h5")
    provenance = {key: words for key, words in body.provenance.items() if not key.startswith(("mode set", "full dofs"))}
    write(replace(body, provenance=provenance), tmp_path / "received.h5")
    deck = (folder / "bar.inp").read_text()
    materials = (
        f"*MATERIAL, NAME=steel\n*ELASTIC\n{YOUNG}, 0.3\n*DENSITY\n{DENSITY}\n*SOLID SECTION, ELSET=all, "
        "MATERIAL=steel\n*STEP\n*CONTACT PAIR, INTERACTION=none\na, b\n*END STEP\n"
    )
    whole = tmp_path / "whole.inp"
    whole.write_text(deck + materials)
    found = accept(tmp_path / "received.h5", FullModel(deck=whole, program="abaqus"), band=9000.0)
    by_name = {record.name: record for record in found.records}
    assert by_name["model-mass"].verdict == "pass"
    assert by_name["frequency-error"].data["full_hz"][0] > 0
    assert "recovered" in by_name["mac-nodal"].data
    assert found.left_out is not None
    assert {"CONTACT PAIR"} <= {each.name.lstrip("*") for each in found.left_out}

    heavier = tmp_path / "heavier.inp"
    heavier.write_text(deck + materials.replace(str(DENSITY), str(1.05 * DENSITY)))
    found = accept(tmp_path / "received.h5", FullModel(deck=heavier, program="abaqus"), band=9000.0)
    (mass,) = (record for record in found.records if record.name == "model-mass")
    assert mass.verdict == "fail"
    assert mass.value == pytest.approx(0.05 / 1.05, rel=0.05)
    assert found.verdict == "fail"


def test_shapes_of_another_model_are_told_apart(folder):
    """A bar with a softer half has other shapes, and lower frequencies, at the same nodes."""
    from cms.jobs.body_of_job import uncoupled_body
    from cms.jobs.job import read_job
    from fe_models.elements.solids.body import solid_body
    from fe_models.foundation.stages import Stages
    from tests.bodies import STEEL

    body = read(folder / "bar.h5")
    same = replace(uncoupled_body(read_job(folder / "bar.toml"), Stages()), interfaces=())
    found = {record.name: record for record in compare_with_model(same, body, band=9000.0)}
    steel = replace(STEEL, E=YOUNG, rho=DENSITY)
    soft = replace(steel, name="soft", E=0.3 * YOUNG)
    mesh = box_mesh(8, 1, 1, LENGTH, SIDE, SIDE, kind="hexahedron20")
    other = solid_body(mesh, {"left half": steel, "right half": soft}, name="soft", units=body.units)
    wrong = {record.name: record for record in compare_with_model(other, body, band=9000.0)}
    assert wrong["model-mass"].verdict == "pass"
    assert wrong["mac-nodal"].value > 5 * found["mac-nodal"].value
    assert wrong["frequency-error"].value > 0.2


@pytest.mark.parametrize("what", ["shuffled", "of the wrong sign"])
def test_a_received_body_whose_inner_shapes_are_garbage_is_not_accepted(folder, what):
    """Mass, frequencies and interfaces are right; nodes between the interfaces move as others do."""
    body = read(folder / "bar.h5")
    inner = np.setdiff1d(np.arange(len(body.nodes)), np.concatenate([each.members for each in body.interfaces]))
    Phi = np.array(body.Phi)
    Phi[inner] = Phi[np.random.default_rng(1).permutation(inner)] if what == "shuffled" else -Phi[inner]
    provenance = {"program": "another"}
    deck = folder / "received.inp"
    deck.write_text(
        (folder / "bar.inp").read_text() + f"*MATERIAL, NAME=steel\n*ELASTIC\n{YOUNG}, 0.3\n*DENSITY\n{DENSITY}\n"
        "*SOLID SECTION, ELSET=all, MATERIAL=steel\n"
    )
    full = FullModel(deck=deck, program="calculix")
    right = accept(replace(body, provenance=provenance), full, most_dofs=0, band=9000.0)
    wrong = accept(replace(body, Phi=Phi, provenance=provenance), full, most_dofs=0, band=9000.0)
    assert right.verdict != "fail"
    failed = [{record.name for record in found.records if record.verdict == "fail"} for found in (right, wrong)]
    assert failed[1] - failed[0] - {"band-asked"} == {"mac-nodal"}


def test_a_body_that_is_not_that_of_its_job_is_not_accepted_by_name(folder, capsys):
    """Damping ten times that of the job, and stress in Pa in a file in MPa, for `accept --full` and `check --job`."""
    body = read(folder / "bar.h5")
    bad = replace(body, D=10 * np.asarray(body.D), stress=1e6 * np.asarray(body.stress))
    found = accept(bad, FullModel(job=folder / "bar.toml"), most_dofs=0)
    assert {record.name for record in found.records if record.verdict == "fail"} == {"damping-matrix", "stress-modes"}
    (damping,) = (record for record in found.records if record.name == "damping-matrix")
    assert "the job: 1 % of critical in every mode" in damping.reason
    write(bad, folder / "bad.h5")
    assert check_file(folder / "bad.h5", folder / "bar.toml", band=None, as_json=True, changes={}) == 1
    records = json.loads(capsys.readouterr().out)["records"]
    assert {r["name"] for r in records if r["verdict"] == "fail"} == {"damping-matrix", "stress-modes"}


def test_changed_and_missing_sources_are_told(folder, tmp_path):
    body = read(folder / "bar.h5")
    provenance = {**body.provenance, "mesh": "elsewhere/bar.inp"}
    assert [each.state for each in source_files(provenance, tmp_path)] == ["not found"]
    (tmp_path / "bar.inp").write_bytes((folder / "bar.inp").read_bytes() + b"** a comment\n")
    assert [each.state for each in source_files(provenance, tmp_path)] == ["CHANGED since"]


def test_documents_say_the_same(accepted, tmp_path, monkeypatch):
    """Every number of the page stands in the tables that JSON, HTML and PDF are written from; its charts are white."""
    Image.new("RGB", (8, 8), "white").save(white := io.BytesIO(), "png")
    monkeypatch.setattr("fe_models.foundation.documents.pdf.chart_png", lambda chart, width: white.getvalue())
    targets = [tmp_path / f"acceptance{suffix}" for suffix in (".json", ".html", ".pdf")]
    write_acceptance(accepted, *targets)
    record = json.loads(targets[0].read_text())
    assert record["verdict"] == accepted.verdict
    assert record["digest"] == accepted.digest
    assert record["range_of_use"]["band_hz"] == pytest.approx(accepted.range.band.highest)
    assert len(record["records"]) == len(accepted.records)
    page = targets[1].read_text()
    assert "https://" not in page.replace("http://www.w3.org", "")
    assert accepted.digest in page
    for key in ("identity", "origin", "checks", "modes", "interfaces", "mass", "range", "deck", "mesh"):
        assert f'<section id="{key}">' in page
    for record in accepted.records:
        assert record.title.replace(" %", "\u00a0%") in unescape(page)
    assert targets[2].read_bytes().startswith(b"%PDF")


def test_failed_checks_come_first_and_are_not_accepted(folder):
    body = read(folder / "bar.h5")
    moments = replace(body.moments, C1=1.2 * np.asarray(body.moments.C1))
    no_picture = np.zeros((0, 3), np.int64)
    found = accept(replace(body, moments=moments, surface=no_picture, numbering=Numbering()))
    assert found.verdict == "fail"
    assert "not accepted" in found.words
    document = document_of(found)
    (checks,) = (part for part in document.sections if part.key == "checks")
    (table,) = (block for block in checks.blocks if isinstance(block, TextTable))
    assert table.rows[0][0] == "fail"
    assert "not accepted" in html_page(document)
    assert len(pdf_pages(document)) > 10000


def test_command_writes_judges_and_refuses(folder, tmp_path, capsys, monkeypatch):
    target = tmp_path / "a.json"
    arguments = ["accept", str(folder / "bar.h5"), "-o", str(target)]
    assert run(monkeypatch, arguments) == 0
    assert "accepted" in capsys.readouterr().out
    assert json.loads(target.read_text())["verdict"] == "pass"
    assert run(monkeypatch, [*arguments[:2], "-o", str(tmp_path / "a.docx")]) == 2
    assert re.search(r"written as .pdf, .html, .json; got .docx", capsys.readouterr().err)
    assert run(monkeypatch, [*arguments, "--density", "steel=1"]) == 2
    assert "--deck" in capsys.readouterr().err
    assert run(monkeypatch, [*arguments, "--job", "a.toml", "--deck", "b.inp"]) == 2
    assert "got two" in capsys.readouterr().err
    assert run(monkeypatch, [*arguments, "--strict", "--full", str(folder / "bar.toml"), "--band", "60000"]) == 1
    assert "reservations" in capsys.readouterr().out or json.loads(target.read_text())["verdict"] == "fail"


@pytest.mark.parametrize(("share", "verdict"), [(0.99, "pass"), (1.01, "fail"), (1e9, "fail")])
def test_a_band_beyond_that_of_custom_is_not_accepted(folder, share, verdict):
    usable = accept(folder / "bar.h5").range.band.highest
    found = accept(folder / "bar.h5", band=share * usable)
    (record,) = (record for record in found.records if record.name == "band-asked")
    assert (record.verdict, found.verdict) == (verdict, verdict)
    assert record.value == pytest.approx(share)
    assert "by custom" in record.reason


def test_bad_requests(folder):
    with pytest.raises(QualityError, match="got both"):
        FullModel(job=folder / "bar.toml", deck=folder / "bar.inp")
    with pytest.raises(QualityError, match="above 0"):
        accept(folder / "bar.h5", band=-1.0)


def run(monkeypatch, arguments):
    """Run `cms` and return its exit code."""
    monkeypatch.setattr("sys.argv", ["cms", *arguments])
    try:
        return main() or 0
    except SystemExit as end:
        return end.code or 0
