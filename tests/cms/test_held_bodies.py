"""Bodies that are held to the ground and say so: reduced, checked, compared, written, refused by a floating frame."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from numpy.testing import assert_allclose

import cms
import floatframe as ff
from cms.assessment.compare.compare import compare_sets
from cms.assessment.quality.body_check import check_body
from cms.assessment.quality.of_body.effective_mass import effective_mass
from cms.assessment.quality.reduction_check import check_reduction
from cms.assessment.quality.reference.port_model import frf
from cms.body.modal_file.file import read_sealed
from cms.errors import BodyError
from cms.reduction.basis.frames import HeldFrame, TisserandFrame
from fe_models.files.matrices.given import body_from_matrices
from fe_models.foundation.units import unit_system
from fe_models.meshes.numbering import Numbering
from floatframe.errors import ModelError
from tests.bodies import STEEL, bar
from tests.cms.command import run_cms

SI = unit_system("m-kg-s")


@pytest.fixture(scope="module")
def held():
    """A cantilever: the rows of the left face are taken out."""
    free = bar(nx=8)
    keep = np.flatnonzero(free.nodes[free.dofs[:, 0], 0] > 0)
    return cms.couple(
        body_from_matrices(
            free.M[keep][:, keep], free.K[keep][:, keep], free.nodes, free.dofs[keep], name="cantilever", units=SI,
            interfaces=[free.interfaces[1]], held=True,
        )
    )  # fmt: skip


@pytest.fixture(scope="module")
def frequencies(held):
    return np.sqrt(la.eigvalsh(held.K.toarray(), held.M.toarray())) / (2 * np.pi)


@pytest.fixture(scope="module")
def reduced(held):
    return cms.reduce(held, cms.rubin(held, n_modes=6))


SETS = ("craig-bampton", "craig-bampton-ir", "rubin", "herting", "normal", "attachment", "krylov")


@pytest.mark.parametrize("name", SETS)
def test_sets_of_a_held_body_have_its_frequencies_from_above(name, held, frequencies):
    found = cms.reduce(held, cms.MODE_SETS[name](held, n_modes=6)).free_frequencies
    assert (found[:6] > frequencies[:6] * (1 - 1e-9)).all()
    assert_allclose(found[:2], frequencies[:2], rtol=1e-4 if "craig" in name else 1e-6)


def test_the_first_frequency_is_that_of_a_cantilever(frequencies):
    """1.8751² / (2 pi L²) sqrt(E I / (rho A)), to the shear and the held face that beam theory lacks."""
    r = 0.04 / np.sqrt(12)
    expected = 1.875104**2 / (2 * np.pi) * r * np.sqrt(STEEL.E / STEEL.rho)
    assert_allclose(frequencies[0], expected, rtol=0.02)


def test_a_held_body_passes_the_checks_and_is_not_asked_to_be_free(held, reduced):
    modes = cms.rubin(held, n_modes=6)
    records = {record.name: record for record in check_reduction(held, modes, reduced)}
    assert [name for name, record in records.items() if record.verdict == "fail"] == []
    assert records["grounding"].verdict == "info"
    assert "held to the ground, as declared" in records["grounding"].reason
    assert records["same-body"].verdict == records["free-frequencies"].verdict == "pass"


def test_its_response_at_rest_is_the_flexibility_of_the_held_body(held, reduced):
    b = held.b
    exact = np.linalg.inv(held.K.toarray())[np.ix_(b, b)]
    H = frf(reduced, np.array([1e-3])).H[0].real
    assert_allclose(H, exact, rtol=0, atol=1e-6 * np.abs(exact).max())


def test_effective_masses_of_ground_motion_sum_to_the_moving_mass(held):
    whole = cms.ModeSet("unit", np.eye(held.n_dof), tuple(map(str, range(held.n_dof))), np.full(held.n_dof, np.nan))
    reduced = cms.reduce(held, whole)
    shares = effective_mass(reduced, "right").share.sum(axis=0)
    assert_allclose(shares[:3], 1.0, rtol=1e-9)


def test_the_file_of_a_held_body_says_so_in_a_newer_version(reduced, tmp_path):
    cms.write(reduced, tmp_path / "held.h5")
    content = read_version(tmp_path / "held.h5")
    assert content == 3
    again = cms.read(tmp_path / "held.h5")
    assert again.is_held
    assert again.frame.kind == "held"
    free = cms.reduce(body := cms.couple(bar(nx=3, kind="hexahedron")), cms.modes.guyan(body), geometric=False)
    free = replace(free, numbering=Numbering(), kept=None)  # the mesh has sets, which older readers do not know
    cms.write(free, tmp_path / "free.h5")
    assert read_version(tmp_path / "free.h5") == 2  # what older readers know


def read_version(path):
    from cms.body.modal_file.file import KIND

    return read_sealed(path, KIND).version


def test_a_floating_frame_refuses_it(reduced):
    with pytest.raises(ModelError, match=r"'cantilever' is held to the ground, but a floating frame needs"):
        ff.FlexibleBody("part", reduced)


def test_frames_of_free_and_held_bodies_are_not_exchanged(held, reduced):
    with pytest.raises(BodyError, match=r"its frame is the ground: omit the frame"):
        cms.reduce(held, cms.modes.guyan(held), frame=TisserandFrame())
    body = cms.couple(bar(nx=3, kind="hexahedron"))
    with pytest.raises(BodyError, match=r"is free; a HeldFrame is for a body that is held"):
        cms.reduce(body, cms.modes.guyan(body), frame=HeldFrame())
    with pytest.raises(BodyError, match=r"reduce it again with or without its supports"):
        cms.reduction.convert_frame(reduced, TisserandFrame())


def test_sets_of_a_held_body_are_compared(held):
    found = compare_sets(held, ["guyan", "craig-bampton", "rubin"], [0, 8], n_reference=3)
    assert found.set("rubin").verdict == "pass"
    assert found.set("guyan").verdict != "pass"


def test_a_job_says_that_its_matrices_are_held(tmp_path):
    free = bar(nx=4, kind="hexahedron")
    K = free.K.tolil()
    for k in np.flatnonzero(free.nodes[free.dofs[:, 0], 0] == 0):
        K[k, k] += 1e8
    arrays = {"M": free.M.toarray(), "K": sp.csc_array(K).toarray(), "nodes": free.nodes, "dofs": free.dofs}
    right = free.interfaces[1]
    arrays |= {"interface/right/nodes": right.nodes, "interface/right/reference": right.reference}
    np.savez(tmp_path / "bar.npz", **arrays)
    job = '[body]\nmatrices = "bar.npz"\nunits = "m-kg-s"\n{}[reduction]\nset = "rubin"\nn_modes = 4\n{}'
    (tmp_path / "bar.toml").write_text(job.format("", ""))
    run = run_cms("reduce", tmp_path / "bar.toml", code=2)
    assert "say so: held = true in the [body] of a job" in run.stderr
    (tmp_path / "bar.toml").write_text(job.format("held = true\n", 'frame = "tisserand"\n'))
    run = run_cms("reduce", tmp_path / "bar.toml")
    assert "its frame is the ground: remove frame" in run.stderr
    (tmp_path / "bar.toml").write_text(job.format("held = true\n", ""))
    run = run_cms("reduce", tmp_path / "bar.toml", code=0)
    assert "no floating frame can take it" in run.stdout
    told = run_cms("info", tmp_path / "bar.h5").output
    assert "Frequencies as held" in told
    assert "Free-free" not in told
    run = run_cms("check", tmp_path / "bar.h5", "--job", tmp_path / "bar.toml", code=0)
    assert [record.name for record in check_body(cms.read(tmp_path / "bar.h5")) if record.verdict == "fail"] == []
