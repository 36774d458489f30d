"""Bodies that are interpolated between samples, beside reductions at the same values."""

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
from cms.body.modal_file.contents import Dataset
from cms.body.modal_file.file import convert_units, read_sealed, write_sealed
from cms.errors import BodyError, JobError, ModalFileError
from cms.jobs.job import read_job
from cms.reduction import convert_frame, parametric_body, read_parametric_body, reduce_family, write_parametric_body
from cms.reduction.parametric.alignment import align, recombined
from cms.reduction.parametric.family_file import KIND
from cms.reduction.parametric.interpolation_errors import errors_between
from fe_models.meshes.numbering import Numbering
from tests.cms.command import assert_refused, run_cms
from tests.cms.reduction.parametric.bar import BAR, THICKNESSES, N, write_job

LENGTHS = (1.0, 1.2)
JOB = (
    """
[parameters]
length = 1.0
thickness = 0.01
[body]
nodes = "nodes.csv"
lines = "lines.csv"
scale = ["{length}", 1, 1]
units = "m-kg-s"
"""
    + BAR
    + """[reduction]
set = "craig-bampton-ir"
n_modes = 4
frame = "nodal"
at = "root"
stress = false
geometric_stiffness = false
error_estimates = false
[damping]
ratio = 0.01
"""
)


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    x = np.linspace(0, 1, N + 1)
    return write_job(tmp_path_factory.mktemp("cantilever"), np.stack([x, 0 * x, 0 * x], axis=1), JOB)


@pytest.fixture(scope="module")
def lengths(job):
    return reduce_family(job, {"length": LENGTHS})


@pytest.fixture(scope="module")
def thicknesses(job):
    return reduce_family(job, {"thickness": THICKNESSES})


def reduced(job, **parameters):
    return cms.reduce_job(read_job(job, parameters))


def test_a_cantilever_between_two_lengths_has_its_frequencies(job, lengths):
    """Euler-Bernoulli, which is 0.05 % too stiff in the third mode (shear, rotary inertia); and the same elements."""
    found = lengths.at(length=1.1)
    beta = np.array([1.8751041, 4.6940911, 7.8547574])
    exact = beta**2 / (2 * np.pi * 1.1**2) * np.sqrt(210e9 / 7850 * 0.01**2 / 12)
    bending = np.array([f for f, psi in zip(found.frequencies, found.interface("tip").Psi.T, strict=True)
                        if abs(psi[2]) > 0.1 * np.abs(psi[:3]).max()])[:3]  # fmt: skip
    assert_allclose(bending, exact, rtol=float(lengths.errors.frequency[:6].max()) + 5e-4)
    errors = errors_between(found, reduced(job, length=1.1))
    assert (errors.frequency <= lengths.errors.frequency + 1e-9).all()
    assert errors.frequency[:8].max() < 3e-4
    assert errors.free_frequency.max() < 2e-4
    assert errors.static < 1e-3
    assert max(errors.mass, errors.inertia) < 1e-12
    assert_allclose(found.interface("tip").position, [1.1, 0, 0], rtol=0, atol=1e-12)


def test_modes_that_cross_keep_their_identity(job, thicknesses):
    """Without alignment the modes of both planes change places among the samples, and errors are tens of per cent."""
    for thickness in (0.015, 0.02, 0.022):
        errors = errors_between(thicknesses.at(thickness=thickness), reduced(job, thickness=thickness))
        estimate = thicknesses.errors
        assert errors.frequency[:8].max() <= estimate.frequency[:8].max() < 5e-3
        assert errors.free_frequency.max() <= estimate.free_frequency.max()
        assert errors.static <= estimate.static < 0.1
        assert errors.mass < 1e-12
        assert errors.inertia < 1e-3


def test_alignment_undoes_signs_and_order_of_modes(thicknesses):
    body = convert_frame(thicknesses.samples[0], cms.TisserandFrame())
    rng = np.random.default_rng(0)
    Z = np.eye(body.n_q)[:, rng.permutation(body.n_q)] * rng.choice([-1.0, 1.0], body.n_q)
    found, expected = (align(sample, body, "one", "other") for sample in (recombined(body, Z), body))
    assert_allclose(found.omega2, body.K, rtol=0, atol=1e-10 * body.K.max())
    Psi = expected.body.interface("tip").Psi
    assert_allclose(found.body.interface("tip").Psi, Psi, rtol=0, atol=1e-9 * np.abs(Psi).max())
    assert_allclose(found.body.moments.S_kl, expected.body.moments.S_kl, rtol=0, atol=1e-9 * body.moments.m)


def test_a_family_returns_its_samples(thicknesses):
    for thickness, sample in zip(THICKNESSES, thicknesses.samples, strict=True):
        found = thicknesses.at(thickness=thickness)
        errors = errors_between(found, sample)
        assert max(errors.frequency.max(), errors.free_frequency.max(), errors.static, errors.inertia) < 1e-9
        assert_allclose(np.abs(found.moments.C1), np.abs(sample.moments.C1), rtol=0, atol=1e-6)


def test_an_interpolated_body_is_an_ordinary_modal_file(thicknesses, tmp_path):
    cms.write(thicknesses.at(thickness=0.02), tmp_path / "bar.h5")
    checks = {each.name: each.verdict for each in cms.check_body(cms.read(tmp_path / "bar.h5"))}
    assert "fail" not in checks.values(), checks


def test_the_ratio_of_the_damping_is_that_of_the_job(thicknesses):
    found = thicknesses.at(thickness=0.015)
    assert_allclose(found.D, np.diag(0.02 * 2 * np.pi * found.frequencies), rtol=1e-9, atol=1e-9 * found.D.max())


@pytest.mark.parametrize("damping", ["ratio = 0.05", "alpha = 3.0\nbeta = 2e-4"])
def test_a_damped_body_in_general_position_responds_as_its_reduction(tmp_path, damping):
    """A bent bar far from the origin, in a nodal frame with other axes, up to its fourth free frequency.

    A frequency that is wrong by 1e-3 changes a response with 5 % damping by 1 %, and 5 % less damping by 5 %.
    """
    x = np.linspace(0, 1, N + 1)
    nodes = np.stack([5 + x, 0.2 * x - 3 + 0.1 * x**2, 2 - 0.3 * x], axis=1)
    frame = 'at = "root"\norigin = [5.2, -2.9, 2.1]\naxes = [[0, 0.6, 0.8], [0, -0.8, 0.6], [1, 0, 0]]'
    job = write_job(tmp_path, nodes, JOB.replace('at = "root"', frame).replace("ratio = 0.01", damping))
    family = reduce_family(job, {"thickness": THICKNESSES})
    found, expected = family.at(thickness=0.02), reduced(job, thickness=0.02)
    band = np.linspace(10, 1.1 * expected.free_frequencies[3], 200)
    H, H_expected = cms.frf(found, band).H, cms.frf(expected, band).H
    away = np.linalg.norm(H - H_expected, axis=(1, 2)) / np.linalg.norm(H_expected, axis=(1, 2))
    assert away.max() < 0.02
    assert_allclose(found.moments.S, expected.moments.S, rtol=1e-12)
    assert_allclose(found.moments.R, expected.moments.R, rtol=0, atol=1e-5 * np.trace(expected.moments.R))
    in_ms = parametric_body(family.values, [convert_units(each, "mm-kg-ms") for each in family.samples])
    own, other = convert_units(found, "mm-kg-ms"), in_ms.at(thickness=0.02)
    assert_allclose(other.K, own.K, rtol=0, atol=1e-10 * own.K.max())
    assert_allclose(np.diag(other.D), np.diag(own.D), rtol=1e-9)


def test_a_family_file_keeps_everything(lengths, tmp_path):
    write_parametric_body(lengths, tmp_path / "family.h5")
    back = read_parametric_body(tmp_path / "family.h5")
    assert dict(back.values) == dict(lengths.values)
    assert_array_equal(back.at(length=1.05).K, lengths.at(length=1.05).K)
    assert_array_equal(back.errors.frequency, lengths.errors.frequency)
    assert back.errors.method == lengths.errors.method == "a reduction at length = 1.1"
    with pytest.raises(ModalFileError, match="expected a modal-file, got a parametric-body"):
        cms.read(tmp_path / "family.h5")


@pytest.mark.parametrize(
    ("path", "values", "words"),
    [
        ("/parameters/names", ("length", "length"), "expected different texts, got ('length', 'length')"),
        ("/parameters/names", np.ones(1), "expected different texts"),
        ("/parameters/values_0", ("1", "2"), "expected a list of numbers, got text"),
        ("/parameters/values_0", np.ones((2, 2)), r"expected a list of numbers, got shape (2, 2)"),
        ("/errors/static", np.ones(2), r"expected one number, got shape (2,)"),
        ("/errors/frequency", np.ones(3), "16 modes, but errors of 3 frequencies"),
    ],
)
def test_a_family_file_with_impossible_content_is_refused(lengths, tmp_path, path, values, words):
    content = content_of_file(lengths, tmp_path / "family.h5")
    write_sealed(replace(content, datasets={**content.datasets, path: Dataset(values)}), tmp_path / "family.h5")
    with pytest.raises(ModalFileError, match=re.escape(words)):
        read_parametric_body(tmp_path / "family.h5")


def content_of_file(family, path):
    """Return the content of a family file without its digest."""
    write_parametric_body(family, path)
    content = read_sealed(path, KIND)
    return replace(content, attributes={**content.attributes, "/": {"name": content.attributes["/"]["name"]}})


def test_samples_of_a_later_version_are_refused(lengths, tmp_path):
    content = content_of_file(lengths, tmp_path / "family.h5")
    later = {**content.attributes, "/samples/1": {**content.attributes["/samples/1"], "modal_file_version": 99}}
    write_sealed(replace(content, attributes=later), tmp_path / "family.h5")
    with pytest.raises(ModalFileError, match=r"/samples/1 has version 99 of the modal file, .* update the program"):
        read_parametric_body(tmp_path / "family.h5")


def test_values_outside_and_other_names_are_refused(lengths):
    with pytest.raises(BodyError, match=r"length = 1\.3: outside of the sampled range from 1 to 1\.2"):
        lengths.at(length=1.3)
    with pytest.raises(BodyError, match="no parameter 'lenght'; did you mean 'length'"):
        lengths.at(lenght=1.1)
    with pytest.raises(BodyError, match=r"length: missing; expected a value from 1 to 1\.2"):
        lengths.at()
    with pytest.raises(BodyError, match=r"length = nan: outside of the sampled range"):
        lengths.at(length=np.nan)
    for value in ("1.1", True, None):
        with pytest.raises(BodyError, match=rf"length = {value!r}: expected a number from 1 to 1\.2"):
            lengths.at(length=value)


def test_samples_that_differ_are_refused_by_name(job, lengths):
    first, last = lengths.samples
    fewer = reduced(job, length=1.2, **{"reduction.n_modes": 3})
    with pytest.raises(BodyError, match=r"number of modes: expected 16 at length = 1\.2, as at length = 1, got 15"):
        parametric_body(lengths.values, [first, fewer])
    other = replace(last, provenance={**last.provenance, "mode set redundant": "constraint tip rx"})
    with pytest.raises(
        BodyError, match=r"columns dropped from the mode set: expected none at .* got constraint tip rx"
    ):
        parametric_body(lengths.values, [first, other])
    renamed = replace(last, interfaces=(last.interfaces[0], replace(last.interfaces[1], name="end")))
    with pytest.raises(BodyError, match=r"interfaces: expected root, tip at .*, got root, end"):
        parametric_body(lengths.values, [first, renamed])
    with pytest.raises(BodyError, match=r"samples length = 1 and length = 1\.2 differ in body\.surface"):
        parametric_body(lengths.values, [first, replace(last, surface=last.surface[:, ::-1])]).at(length=1.1)


def test_samples_of_other_meshes_are_refused(lengths):
    first, last = lengths.samples
    n = len(last.nodes) - 1
    other = replace(
        last, nodes=last.nodes[:n], node_ids=last.node_ids[:n], Phi=last.Phi[:n], surface=np.zeros((0, 3), np.int64),
        numbering=Numbering(), kept=None, interfaces=tuple(replace(each, members=[]) for each in last.interfaces),
    )  # fmt: skip
    with pytest.raises(BodyError, match=r"number of kept nodes: expected \d+ at .* scale one mesh instead"):
        parametric_body(lengths.values, [first, other])


def test_two_parameters_are_interpolated_together(job):
    """Their errors are those in the middle of both, and stay within a factor elsewhere."""
    over = {"length": (1.0, 1.1), "thickness": (0.011, 0.013)}
    family = reduce_family(job, over)
    assert family.names[1] == "length = 1, thickness = 0.013"
    assert family.errors.method == "a reduction at length = 1.05, thickness = 0.012"
    errors = errors_between(family.at(length=1.04, thickness=0.0125), reduced(job, length=1.04, thickness=0.0125))
    assert errors.frequency[:6].max() < family.errors.frequency[:6].max() < 1e-3
    assert errors.mass < 1e-12


def test_factors_of_the_mesh_are_above_zero(job):
    with pytest.raises(JobError, match=r"body\.scale = .*: expected three factors above 0"):
        read_job(job, {"length": 0})


def test_values_that_do_not_ascend_are_refused(job):
    with pytest.raises(JobError, match=r"length: expected two to 7 ascending values, got 1\.2, 1"):
        reduce_family(job, {"length": [1.2, 1.0]})
    with pytest.raises(JobError, match=r"length: expected two to 7 ascending values, got nan, 1"):
        reduce_family(job, {"length": [np.nan, 1.0]})
    with pytest.raises(JobError, match=r"expected one to 3 parameters, got 0"):
        reduce_family(job, {})


@pytest.mark.parametrize(
    ("over", "words"),
    [
        ("lenght=1,1.2", "there is no parameter 'lenght'; did you mean 'length'"),
        ("length=1,nan", "expected NAME=FROM:TO:N or NAME=A,B,C"),
        ("length=1:1.2", "expected NAME=FROM:TO:N or NAME=A,B,C"),
        ("length=1", "expected two to 7 ascending values, got 1\n"),
        ("length=1:1.2:99", "expected two to 7 ascending values, got 1, 1.00204, "),
        ("reduction.n_modes=-2,4", "reduction.n_modes = -2: expected a whole number"),
    ],
)
def test_values_that_are_none_are_refused_by_the_command(job, over, words):
    result = run_cms("family", job, "--over", over)
    assert_refused(result, words)
    assert len(result.stderr) < 400


def test_the_command_interpolates_no_text_and_no_damaged_file(lengths, tmp_path):
    path = tmp_path / "family.h5"
    write_parametric_body(lengths, path)
    assert_refused(run_cms("interpolate", path, "--set", "length=long"), "length = 'long': expected a number from 1")
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    assert_refused(run_cms("interpolate", path, "--set", "length=1.1"), "family.h5: this parametric-body was altered")
