import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from cms.errors import JobError
from cms.jobs.body_of_job import job_body, uncoupled_body
from cms.jobs.job import read_job
from fe_models.errors import InterfaceError
from fe_models.foundation.stages import Stages
from tests.changed_file import changed_file
from tests.fe_models.small_solids import PLATE_VOLUME, in_unit, plate_file

JOB = """
[body]
mesh = "plate.step"
units = "mm-t-s"

[mesh_size]
size = 20.0
order = 1

[materials.steel]
young = 210000.0
poisson = 0.3
density = 7.85e-9

[interfaces.bore]
kind = "rigid"
faces = "cylinder r=6"

[interfaces.end]
kind = "distributing"
faces = ["plane x=100"]

[load_cases.wind]
kind = "pressure"
faces = ["plane normal=z", "face 1"]
pressure = 2.0

[reduction]
set = "craig-bampton"
n_modes = 2
"""


@pytest.fixture
def job_file(tmp_path):
    plate_file(tmp_path / "plate.step")

    def write(*changes):
        return changed_file(tmp_path / "plate.toml", JOB, *changes)

    return write


def test_a_cad_job_makes_a_body_with_interfaces_and_loads_on_chosen_faces(job_file):
    reports = []
    body = uncoupled_body(read_job(job_file()), Stages(), on_report=reports.append)
    bore, end = body.interfaces
    assert_allclose(bore.reference, [20, 20, 5], rtol=0, atol=0.02)  # by the facets of twelve elements around it
    assert_allclose(np.hypot(*(body.nodes[bore.nodes, :2] - 20).T), 6, rtol=1e-9, atol=0)
    assert_allclose(end.reference, [100, 20, 5], rtol=1e-9, atol=0)
    assert_allclose(reports[0].volume, PLATE_VOLUME, rtol=2e-3, atol=0)
    (wind,) = body.load_cases
    force = wind.f.reshape(-1, 3).sum(axis=0)
    assert_allclose(force[:2], [2.0 * 10 * 40, 0], rtol=0, atol=1e-9 * 800)  # face 1 looks along -x
    assert_allclose(force[2], -2.0 * (4000 - np.pi * 36), rtol=2e-3, atol=0)
    assert body.provenance["geometry"].startswith("STEP in mm, taken to mm; 1 solid, 7 faces")
    assert body.provenance["mesh size"] == "20 mm, 12 elements around a circle, order 1"


def test_a_reduced_cad_body_has_the_mass_of_the_solid(job_file):
    reduced = cms.reduce_job(job_file())
    assert_allclose(reduced.moments.m, 7.85e-9 * PLATE_VOLUME, rtol=2e-3, atol=0)


WRONG = [
    ((("[mesh_size]\nsize = 20.0\norder = 1", ""),), "mesh_size: missing; a CAD file has to be meshed"),
    ((("size = 20.0", "size = -1.0"),), "mesh_size.size = -1.0: expected a number above 0"),
    ((("order = 1", "order = 3"),), r"mesh_size.order = 3: expected 1 \(tetra\) or 2"),
    ((("order = 1", "curvature = 2.0"),), "curvature: expected 3 to 1000 elements"),
    ((("order = 1", "smallest = 30.0"),), "smallest: expected at most the size 20"),
    ((('faces = "cylinder r=6"', "faces = []"),), "interfaces.bore.faces = .*expected the name of a group"),
    ((("[reduction]", '[shells.skin]\nthickness = 1.0\n[reduction]'),), "of a CAD file the solids are meshed"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "words"), WRONG)
def test_a_cad_job_that_cannot_be_is_refused(job_file, changes, words):
    with pytest.raises(JobError, match=words):
        read_job(job_file(*changes))


def test_a_mesh_size_beside_a_mesh_is_refused(job_file, tmp_path):
    (tmp_path / "plate.msh").write_bytes(b"nothing")
    with pytest.raises(JobError, match="mesh_size: belongs to a CAD file"):
        read_job(job_file(("plate.step", "plate.msh")))


def test_faces_that_are_not_there_are_named_with_those_that_are(job_file):
    with pytest.raises(InterfaceError, match="'cylinder r=7': no face of the body is such; it has cylinder r=6 hole"):
        job_body(read_job(job_file(("r=6", "r=7"))))


def test_a_file_in_metres_is_found_implausible_where_it_was_meant_in_millimetres(job_file, tmp_path):
    in_unit(tmp_path / "plate.step", "m")
    body = job_body(read_job(job_file(("size = 20.0", "size = 2e4"), ("r=6", "r=6000"), ("x=100", "x=100000"))))
    assert_allclose(np.ptp(body.nodes[:, 0]), 1e5, rtol=1e-9, atol=0)
