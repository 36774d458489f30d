"""Solids of a job: bricks with incompatible modes, and what the file says of cells of first order."""

import pytest

from cms.assessment.quality.body_check import check_body
from cms.errors import JobError
from cms.jobs.body_of_job import job_body
from cms.jobs.job import read_job
from cms.pipeline import reduce_job
from fe_models.foundation.ranks.spread_matrix import SpreadMatrix, whole_matrix
from tests.bodies import box_mesh
from tests.decks import JOB, write_deck
from tests.thread_ranks import ThreadRanks


def job_of(folder, kind, key=""):
    """The job of a slender bar of one row of cells."""
    write_deck(folder / "bar.inp", box_mesh(10, 1, 1, 100.0, 10.0, 10.0, kind))
    path = folder / "bar.toml"
    path.write_text(JOB.replace('units = "mm-t-s"', f'units = "mm-t-s"\n{key}'))
    return read_job(path)


def mesh_order(reduced):
    return next(record for record in check_body(reduced) if record.name == "mesh-order")


def test_the_file_says_how_much_too_stiff_its_cells_are_and_bricks_that_bend_are_not(tmp_path):
    plain = reduce_job(job_of(tmp_path, "hexahedron"))
    bending = reduce_job(job_of(tmp_path, "hexahedron", "incompatible_modes = true"))
    record = mesh_order(plain)
    assert record.verdict == "warn"
    assert "10 hexahedron: lowest frequencies" in record.reason
    assert "incompatible modes" in record.action
    ratio = plain.free_frequencies.min() / bending.free_frequencies.min() - 1
    assert 0.1 < ratio < record.value < ratio + 0.05
    assert mesh_order(bending).verdict == "info"
    assert bending.provenance["cells hexahedron with"] == "incompatible modes"
    assert mesh_order(reduce_job(job_of(tmp_path, "tetra10"))).reason == "the file names no cells of first order"


def test_a_body_made_without_a_report_says_that_it_was_not_measured(tmp_path):
    from dataclasses import replace

    plain = reduce_job(job_of(tmp_path, "tetra"))
    told = {key: value for key, value in plain.provenance.items() if key != "first-order error"}
    assert "does not say how much" in mesh_order(replace(plain, provenance=told)).reason


def test_the_key_is_refused_where_there_are_no_such_bricks(tmp_path):
    with pytest.raises(JobError, match=r"body\.incompatible_modes: the mesh has no bricks of eight nodes, but tetra10"):
        reduce_job(job_of(tmp_path, "tetra10", "incompatible_modes = true"))
    job = tmp_path / "shell.toml"
    text = JOB.replace('units = "mm-t-s"', 'units = "mm-t-s"\nincompatible_modes = true')
    job.write_text(text.replace("[interfaces.left]", "[shells.a]\nthickness = 1.0\n[interfaces.left]"))
    with pytest.raises(JobError, match="belongs to a mesh of solid cells"):
        read_job(job)


def test_ranks_assemble_a_job_of_one_solid_mesh(tmp_path):
    job = job_of(tmp_path, "hexahedron")
    body = job_body(job, ranks=ThreadRanks(2))
    assert isinstance(body.K, SpreadMatrix)
    assert isinstance(body.M, SpreadMatrix)
    assert (whole_matrix(body.K) != job_body(job).K).nnz == 0
