import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.errors import JobError
from cms.jobs.body_of_job import job_body
from cms.jobs.job import read_job
from fe_models import read_mesh, solid_body, unit_system
from fe_models.assembly.tables.shells import shell_properties
from fe_models.body import OrthotropicMaterial
from fe_models.errors import MaterialError
from tests.bodies import box_mesh
from tests.changed_file import changed_file

JOB = """
[body]
mesh = "box.vtk"
units = "m-kg-s"

[materials.spruce]
young = [11e9, 0.9e9, 0.5e9]
shear = [0.7e9, 0.6e9, 0.04e9]
poisson = [0.4, 0.45, 0.5]
density = 450
axes = [[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]]

[reduction]
set = "normal"
n_modes = 2
"""


@pytest.fixture
def job_file(tmp_path):
    import meshio

    mesh = box_mesh(2, 1, 1, 0.4, 0.2, 0.1, "hexahedron")
    meshio.write(tmp_path / "box.vtk", meshio.Mesh(mesh.nodes, [("hexahedron", mesh.cells["hexahedron"])]))

    def write(*changes):
        return changed_file(tmp_path / "box.toml", JOB, *changes)

    return write


def test_an_orthotropic_material_of_a_job_is_that_of_python(job_file, tmp_path):
    body = job_body(read_job(job_file()))
    wood = OrthotropicMaterial(
        "spruce", (11e9, 0.9e9, 0.5e9), (0.7e9, 0.6e9, 0.04e9), (0.4, 0.45, 0.5), 450.0,
        ((0.8, 0.6, 0), (-0.6, 0.8, 0), (0, 0, 1)),
    )  # fmt: skip
    expected = solid_body(read_mesh(tmp_path / "box.vtk"), wood, name="box", units=unit_system("m-kg-s"))
    assert_allclose(body.K.toarray(), expected.K.toarray(), rtol=0, atol=1e-12 * np.abs(expected.K.data).max())


WRONG = [
    ((("[0.4, 0.45, 0.5]", "0.3"),), "poisson: young has three numbers; an orthotropic material needs three here too"),
    ((("[11e9, 0.9e9, 0.5e9]", "11e9"),), "young: poisson has three numbers"),
    ((("shear = [0.7e9, 0.6e9, 0.04e9]\n", ""),), "shear: missing; expected three numbers above 0"),
    ((("[11e9, 0.9e9, 0.5e9]", "[11e9, -1, 0.5e9]"),), "young = .*expected a number above 0, Young's modulus"),
    ((("[0.7e9, 0.6e9, 0.04e9]", "0.7e9"),), "shear = .*expected three numbers above 0"),
    ((("[11e9, 0.9e9, 0.5e9]", "11e9"), ("[0.4, 0.45, 0.5]", "0.3")), "shear: belongs to an orthotropic material"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "words"), WRONG)
def test_a_material_that_is_neither_is_refused(job_file, changes, words):
    with pytest.raises(JobError, match=words):
        read_job(job_file(*changes))


def test_impossible_numbers_are_refused_in_words(job_file):
    with pytest.raises(MaterialError, match="some strains would have negative energy"):
        job_body(read_job(job_file(("0.5]\ndensity", "2.5]\ndensity"))))
    with pytest.raises(MaterialError, match="axes: expected three rows, orthonormal"):
        job_body(read_job(job_file(("[0.8, 0.6, 0]", "[0.8, 0.7, 0]"))))


def test_shells_refuse_an_orthotropic_material(job_file):
    job = read_job(job_file(("[reduction]", "[shells.skin]\nthickness = 0.01\n\n[reduction]")))
    with pytest.raises(
        MaterialError,
        match=r"materials\.spruce: it is not isotropic; shells of one thickness \(not of layers\) take isotropic",
    ):
        shell_properties(job.shells, job.materials)
