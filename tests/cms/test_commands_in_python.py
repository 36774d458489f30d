"""What the commands compare, accept, correlate, frf and view do is also at the door of `cms`."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from cms.assessment.compare import compare_sets
from cms.jobs.body_of_job import job_body
from cms.jobs.job import read_job
from tests.bodies import box_mesh
from tests.decks import JOB, write_deck


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A bar as a deck, its job, its modal file."""
    folder = tmp_path_factory.mktemp("bar")
    write_deck(folder / "bar.inp", box_mesh(8, 1, 1, 100.0, 10.0, 10.0, kind="hexahedron20"))
    (folder / "bar.toml").write_text(JOB)
    cms.write(cms.reduce_job(folder / "bar.toml"), folder / "bar.h5")
    return folder


def test_compare_takes_a_job(folder):
    found = cms.compare(folder / "bar.toml", ["guyan", "rubin"], "0:4:4", n_reference=2)
    expected = compare_sets(job_body(read_job(folder / "bar.toml")), ["guyan", "rubin"], [0, 4], n_reference=2)
    assert [each.name for each in found.sets] == [each.name for each in expected.sets]
    assert_allclose(found.full.frequencies_hz, expected.full.frequencies_hz, rtol=1e-12)
    with pytest.raises(cms.errors.CompareError, match="unknown mode set 'rubn'; did you mean 'rubin'"):
        cms.compare(folder / "bar.toml", ["rubn"])


def test_accept_takes_a_modal_file_and_a_job(folder):
    found = cms.accept(folder / "bar.h5", folder / "bar.toml", most_dofs=0)
    assert found.compared_with.endswith("its mode set")
    assert found.verdict in ("pass", "warn")
    assert cms.accept(folder / "bar.h5").compared_with == ""


def test_frf_far_below_the_modes_is_that_of_a_rigid_body(folder):
    reduced = cms.read(folder / "bar.h5")
    f = [1.0, 2.0]
    found = cms.frf(reduced, f).between("left", "right").H
    omega = 2 * np.pi * np.array(f)
    assert_allclose(found[:, 0, 0] * omega**2 * reduced.moments.m, [-1, -1], rtol=1e-4)


def test_view_mode_draws_a_picture(folder, tmp_path):
    drawn = cms.view_mode(cms.read(folder / "bar.h5"), 1, tmp_path / "mode.png")
    assert drawn.path.read_bytes()[:4] == b"\x89PNG"
    with pytest.raises(cms.errors.BodyError, match="expected a mode between 1 and"):
        cms.view_mode(cms.read(folder / "bar.h5"), 1000, tmp_path / "mode.png")
