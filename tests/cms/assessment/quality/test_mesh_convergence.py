import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.errors import JobError
from cms.jobs.studies import MeshConvergence, mesh_convergence
from tests.changed_file import changed_file
from tests.cms.command import run_cms
from tests.fe_models.small_solids import plate_file

JOB = """
[body]
mesh = "plate.step"
units = "mm-t-s"

[mesh_size]
size = 9.0
curvature = 0

[materials.steel]
young = 210000.0
poisson = 0.3
density = 7.85e-9

[interfaces.bore]
kind = "rigid"
faces = "cylinder r=6"

[reduction]
set = "normal"
n_modes = 2
"""


@pytest.fixture
def job_file(tmp_path):
    plate_file(tmp_path / "plate.step")

    def write(*changes):
        return changed_file(tmp_path / "plate.toml", JOB, *changes)

    return write


def test_an_error_of_first_order_is_found_exactly():
    f, c = np.array([100.0, 250.0]), np.array([3.0, 9.0])
    n_dof = (1000, 8000)  # half the size
    result = MeshConvergence((2.0, 1.0), n_dof, np.array([f + 2 * c, f + c]))
    assert_allclose(result.ratio, 2, rtol=1e-14, atol=0)
    assert_allclose(result.frequencies[1] * (1 - result.error), f, rtol=1e-14, atol=0)


def test_the_estimate_holds_the_frequencies_of_a_much_finer_mesh(job_file):
    result = mesh_convergence(job_file(), n_modes=4)
    finer = mesh_convergence(job_file(("size = 9.0", "size = 5.0")), ratio=1.2, n_modes=4)
    true = result.frequencies[1] / finer.frequencies[1] - 1
    assert (true > 0).all()  # frequencies fall with refinement, and
    assert (result.error > true).all()  # the estimate errs on the safe side,
    assert (result.error < 0.1).all()  # and says something
    ratio = (result.estimates[1].errors.frequency / true)[true > 1e-3]
    assert len(ratio) == 3
    assert ((ratio > 0.5) & (ratio < 3)).all()  # so does that from the stress
    assert result.sizes[1] < result.size_for(1.1 * result.estimates[1].worst) < 1.1 * result.sizes[1]


def test_cells_of_first_order_have_no_less_error_than_their_report_finds(job_file):
    result = mesh_convergence(job_file(("curvature = 0", "order = 1")), n_modes=3)
    assert result.first_order > 0.1
    assert (result.error >= result.first_order).all()


def test_the_command_says_sizes_and_errors(job_file):
    path = job_file()
    run = run_cms("converge", path, "--modes", "3", "--json")
    record = json.loads(run.stdout)
    assert record["sizes"] == [13.5, 9.0]
    assert len(record["estimated_error"]) == len(record["mesh_error"]) == 3
    assert record["size_factor"] == pytest.approx((0.01 / max(record["mesh_error"])) ** (1 / record["rate"]))
    (verdict,) = record["records"]
    assert verdict["value"] == max(record["mesh_error"])
    assert (verdict["tolerance"], verdict["verdict"]) == (0.01, "pass" if verdict["value"] <= 0.01 else "warn")
    assert f"size {9 * record['size_factor']:.3g}, if the error falls" in verdict["reason"]
    words = run_cms("converge", path, "--modes", "3").stdout
    assert "size 13.5 mm [Hz]" in words
    assert "the error is that of size 9 mm, estimated with order 1" in words


def test_what_has_one_size_or_a_senseless_ratio_is_refused(job_file, tmp_path):
    with pytest.raises(JobError, match=r"ratio: expected a number between 1\.1 and 4"):
        mesh_convergence(job_file(), ratio=1.0)
    with pytest.raises(JobError, match="modes: expected 1 or more"):
        mesh_convergence(job_file(), n_modes=0)
    (tmp_path / "plate.msh").write_bytes(b"nothing")
    path = job_file(("plate.step", "plate.msh"), ("[mesh_size]\nsize = 9.0\ncurvature = 0\n", ""))
    with pytest.raises(JobError, match="which have one size; expected a CAD file"):
        mesh_convergence(path)
