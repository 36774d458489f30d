"""Jobs whose body is the matrices of another program with a deck beside them: Abaqus' block of C3D10."""

import gzip
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.linalg as la
from numpy.testing import assert_allclose

import cms
import fe_models
from cms.errors import JobError
from cms.jobs.body_of_job import job_body, uncoupled_body
from fe_models.assembly.tables.places import InterfaceSection, interfaces_of
from fe_models.errors import FeModelsError
from fe_models.foundation.stages import Stages

DATA = Path(__file__).parents[2] / "fe_models" / "files" / "matrices" / "data" / "abaqus"
JOB = """
[body]
matrices = {matrices}
geometry = "blockC3D10.inp"
units = "m-kg-s"
{more}
[interfaces.left]
kind = "rigid"
plane = {{point = [0, 0, 0], normal = [1, 0, 0]}}

[interfaces.corners]
kind = "nodes"
nodes = [1, 2, 3, 4]

[load_cases.push]
kind = "force"
force = [0, 0, 1]
nodes = "Set-1"

[reduction]
n_modes = 3
"""
BOTH = '["blockC3D10_STIF1.mtx", "blockC3D10_MASS1.mtx"]'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("block")
    for path in DATA.glob("*.mtx.gz"):
        (folder / path.stem).write_bytes(gzip.decompress(path.read_bytes()))
    (folder / "blockC3D10.inp").write_bytes((DATA / "blockC3D10.inp").read_bytes())
    return folder


def job_in(folder, matrices=BOTH, more=""):
    path = folder / "block.toml"
    path.write_text(JOB.format(matrices=matrices, more=more))
    return path


def test_a_job_of_matrices_reduces_as_that_of_the_mesh(folder):
    reduced = cms.reduce_job(job_in(folder))
    mesh = fe_models.read_mesh(folder / "blockC3D10.inp")
    steel = fe_models.Material("steel", E=2e11, nu=0.3, rho=2900.0)
    left = fe_models.rigid_interface(mesh, "left", fe_models.selections.Plane((0, 0, 0), (1, 0, 0)))
    corners = fe_models.body.nodes_interface(mesh, "corners", fe_models.selections.NodeNumbers((1, 2, 3, 4)))
    body = fe_models.solid_body(
        mesh, steel, name="block", units=fe_models.unit_system("m-kg-s"), interfaces=[left, corners]
    )
    coupled = fe_models.couple(body)
    ours = cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=3), geometric=False)
    assert reduced.moments.is_exact
    assert_allclose(np.diag(reduced.K), np.diag(ours.K), rtol=2e-8, atol=0)
    assert_allclose(reduced.moments.J0, ours.moments.J0, rtol=0, atol=1e-12 * np.abs(ours.moments.J0).max())
    # 5C of each mode, whatever its sign
    for mine, other in ((reduced.moments.S_kl, ours.moments.S_kl),):
        assert_allclose(np.einsum("abkk->kab", mine), np.einsum("abkk->kab", other), rtol=0, atol=1e-6)
    assert_allclose(reduced.load_cases[0].force, [0, 0, 1], rtol=0, atol=1e-12)


def test_the_user_is_told_what_was_read_before_it_is_judged(folder):
    reports = []
    job = cms.jobs.job.read_job(job_in(folder))
    job_body(job, on_report=reports.append)
    (report,) = reports
    assert report.title == "Matrices"
    rows = dict(report.rows())
    assert rows["files"] == "blockC3D10_STIF1.mtx, blockC3D10_MASS1.mtx"
    assert rows["rows"] == "771 of 257 nodes"
    assert rows["K"] == "50729 entries, stored: both"
    assert rows["note"].startswith("rows taken as 3 to a node")


def test_roles_may_be_named_and_one_matrix_is_not_enough(folder):
    named = job_body(cms.jobs.job.read_job(job_in(folder, '{K = "blockC3D10_STIF1.mtx", M = "blockC3D10_MASS1.mtx"}')))
    assert named.n_dof > 0
    with pytest.raises(FeModelsError, match="the mass M is missing"):
        job_body(cms.jobs.job.read_job(job_in(folder, '"blockC3D10_STIF1.mtx"')))


@pytest.mark.parametrize(
    ("matrices", "more", "words"),
    [
        ('["blockC3D10_STIF1.mtx", "blockC3D10_MAS1.mtx"]', "", "did you mean 'blockC3D10_MASS1.mtx'"),
        ('{stiffness = "blockC3D10_STIF1.mtx"}', "", "unknown role 'stiffness'"),
        ("3", "", "expected the path of a file"),
        (BOTH, 'mesh = "blockC3D10.inp"', "expected either mesh or matrices, got both"),
        (BOTH, "names = 3", "a table {K = name, M = name, D = name}"),
    ],
)
def test_what_a_job_says_wrongly_is_told(folder, matrices, more, words):
    with pytest.raises(JobError) as caught:
        cms.jobs.job.read_job(job_in(folder, matrices, more))
    assert words in str(caught.value)


def test_keys_of_matrices_belong_to_matrices(tmp_path, folder):
    path = folder / "mesh.toml"
    path.write_text(
        '[body]\nmesh = "blockC3D10.inp"\nunits = "m-kg-s"\nremove_supports = true\n'
        "[materials.steel]\nyoung = 2e11\npoisson = 0.3\ndensity = 2900.0\n[reduction]\nn_modes = 3\n"
    )
    with pytest.raises(JobError, match="remove_supports: belongs to matrices"):
        cms.jobs.job.read_job(path)
    with pytest.raises(FeModelsError, match="node numbers 900: 1 of 2 are not in the mesh"):
        fe_models.selections.NodeNumbers((1, 900)).members(fe_models.files.read_geometry(folder / "blockC3D10.inp"))


FRAME = """
[body]
matrices = "frame.mat"
units = "m-kg-s"

[interfaces.foot]
kind = "rigid"
nodes = [30]

[interfaces.tip]
kind = "nodes"
box = {lo = [0.9, -0.1, 1.9], hi = [1.1, 0.1, 2.1]}

[reduction]
n_modes = 4
"""


def test_matrices_that_bring_their_nodes_need_no_geometry(tmp_path):
    """A bent frame of our beams, its nodes renumbered: elements with rotations, interfaces by number and by box."""
    points = np.array([[0, 0, 0], [0, 0, 0.7], [0, 0, 1.3], [0, 0, 2], [0.5, 0, 2], [1, 0, 2]], dtype=float)
    lines = fe_models.beams.LineMesh(points, np.array([[k, k + 1] for k in range(5)]))
    steel = fe_models.Material("steel", E=2.1e11, nu=0.3, rho=7850.0)
    frame = fe_models.beam_body(
        lines,
        fe_models.beams.BeamProperty(fe_models.beams.Circle(0.02), steel),
        name="frame",
        units=fe_models.unit_system("m-kg-s"),
    )
    numbers = np.array([30, 10, 60, 20, 50, 40])
    dofs = np.column_stack([numbers[frame.dofs[:, 0]], frame.dofs[:, 1] + 1])
    nodes = np.column_stack([numbers, points])
    scipy.io.savemat(tmp_path / "frame.mat", {"K": frame.K, "M": frame.M, "dofs": dofs, "nodes": nodes})
    job = tmp_path / "frame.toml"
    job.write_text(FRAME)
    reduced = cms.reduce_job(job)
    foot = fe_models.beams.line_interface(lines, "foot", fe_models.beams.NodeIndices((0,)))
    tip = fe_models.beams.line_interface(lines, "tip", fe_models.beams.NodeIndices((5,)), kind="nodes")
    coupled = fe_models.couple(frame.with_interfaces(foot, tip))
    ours = cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=4), geometric=False)
    assert_allclose(np.diag(reduced.K), np.diag(ours.K), rtol=1e-9, atol=0)
    assert not reduced.moments.is_exact  # rotations have mass: labelled approximate
    assert_allclose(reduced.interfaces[0].position, ours.interfaces[0].position, rtol=0, atol=1e-9)


def test_distributing_interfaces_and_faces_on_a_geometry_of_shells():
    """A deck of shells is a cloud of nodes with face groups: their area weighs a distributing interface."""
    geometry = fe_models.meshes.NodeCloud(
        np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [4, 0, 0], [4, 1, 0]], dtype=float),
        face_sets={"web": {"quad": np.array([[0, 1, 2, 3], [1, 4, 5, 2]])}, "left": {"quad": np.array([[0, 1, 2, 3]])}},
        node_numbers=np.arange(1, 7),
    )
    table = {"kind": "distributing", "faces": "web"}
    interfaces = {"web": InterfaceSection.model_validate(table)}
    (web,) = interfaces_of(interfaces, geometry)
    assert_allclose(web.weights, np.array([1, 2, 2, 1, 1, 1]) / 8, rtol=1e-12, atol=0)
    assert fe_models.selections.FaceGroup("left").members(geometry).tolist() == [0, 1, 2, 3]
    with pytest.raises(FeModelsError, match="no face group 'right'"):
        fe_models.selections.FaceGroup("right").members(geometry)


def test_a_full_file_of_ansys_with_its_deck_has_the_printed_frequency(tmp_path):
    """SOLID186, one end held: rows without the held dofs, nodes from the .cdb; Ansys printed 1283.2004 Hz."""
    for name in ("HexBeam_clamped.full", "HexBeam.cdb"):
        (source,) = Path(__file__).parents[2].rglob(name)
        (tmp_path / name).write_bytes(source.read_bytes())
    job = tmp_path / "beam.toml"
    job.write_text(
        '[body]\nmatrices = "HexBeam_clamped.full"\ngeometry = "HexBeam.cdb"\nunits = "in-slinch-s"\nheld = true\n'
        '[interfaces.tip]\nkind = "rigid"\nplane = {point = [0, 0, 5], normal = [0, 0, 1]}\n[reduction]\nn_modes = 2\n'
    )
    body = uncoupled_body(cms.jobs.job.read_job(job), Stages())
    flexible = la.eigh(body.M.toarray(), body.K.toarray(), eigvals_only=True)[-1]  # M has no full rank
    assert_allclose(1 / np.sqrt(flexible) / (2 * np.pi), 1283.2004, rtol=0, atol=1e-4)
    assert body.is_held
    assert len(body.interfaces[0].nodes) == 21
    job.write_text(job.read_text().replace("held = true\n", ""))
    with pytest.raises(FeModelsError, match="declare the body as held"):
        uncoupled_body(cms.jobs.job.read_job(job), Stages())
