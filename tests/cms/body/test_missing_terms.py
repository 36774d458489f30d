"""Inertia terms that a foreign program did not say: what is known stays exact, what is not is refused by its name."""

from dataclasses import replace

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
from cms.assessment.quality.body_record import body_record
from cms.body.invariants import INERTIA_TERMS, moments_from_gram
from cms.errors import BodyError, ModalFileError
from cms.reduction.reduction import reduce
from tests.bodies import bar
from tests.cms.body.modal_file.examples import differences
from tests.synthetic import synthetic_reduced_body

SOME = (("3C", "4C", "5C"), ("3C",), ("5C",), ("4C", "5C"), ("3C", "5C"))


@pytest.fixture(scope="module")
def body():
    return synthetic_reduced_body()


@pytest.fixture(scope="module")
def real():
    coupled = cms.couple(bar(nx=4))
    return reduce(coupled, cms.craig_bampton(coupled, n_modes=2), frame=cms.NodalFrame("left"), geometric=False)


def lacking(body, missing):
    return replace(body, moments=replace(body.moments, missing=missing), geometric=None, quadratic=None)


@pytest.mark.parametrize("missing", SOME)
def test_what_a_reduced_mass_matrix_says_stays_and_the_rest_is_refused(body, missing):
    whole, moments = body.moments, lacking(body, missing).moments
    for name in ("m", "S", "R", "J0", "C1"):
        assert_array_equal(getattr(moments, name), getattr(whole, name))
    for name in ("C2", "M"):
        expected = getattr(whole, name)
        assert_allclose(getattr(moments, name), expected, rtol=0, atol=1e-14 * np.abs(expected).max())
    for term in INERTIA_TERMS:
        name = f"C{term[0]}"
        if term in missing:
            with pytest.raises(BodyError, match=rf"{term}.* missing: the program"):
                getattr(moments, name)
        elif term != "5C":
            expected = getattr(whole, name)
            assert_allclose(getattr(moments, name), expected, rtol=0, atol=1e-14 * np.abs(expected).max())


def test_numbers_of_what_is_missing_have_no_way_in(body):
    rng = np.random.default_rng(3)
    n = body.n_q
    P, S_kl = rng.normal(size=(3, 3, n)), rng.normal(size=(3, 3, n, n))
    even = (S_kl + S_kl.swapaxes(0, 1)) / 2
    even -= np.einsum("ab,cckl->abkl", np.eye(3), even) / 3
    moments = body.moments
    other = replace(moments, P=moments.P + P + P.swapaxes(0, 1), S_kl=moments.S_kl + even, missing=("3C", "5C"))
    own = replace(moments, missing=("3C", "5C"))
    assert_allclose(other.P, own.P, rtol=0, atol=1e-13 * np.abs(P).max())
    assert_allclose(other.S_kl, own.S_kl, rtol=0, atol=1e-13 * np.abs(S_kl).max())
    assert_allclose(own.left_out.C5 + own.left_out.C5.swapaxes(2, 3), 0, rtol=0, atol=1e-15)


def test_an_unknown_term_is_named(body):
    with pytest.raises(BodyError, match="unknown term '6C'"):
        replace(body.moments, missing=("6C",))


@pytest.mark.parametrize("missing", SOME)
def test_a_file_keeps_what_is_known_and_has_no_dataset_of_what_is_not(body, tmp_path, missing):
    part = lacking(body, missing)
    cms.write(part, tmp_path / "part.h5")
    assert differences(part, cms.read(tmp_path / "part.h5")) == []
    with h5py.File(tmp_path / "part.h5") as file:
        assert file.attrs["version"] == 4
        assert file["moments"].attrs["missing"].decode() == " ".join(part.moments.missing)
        assert ("P" in file["moments"]) is ("3C" not in missing)
        assert ("S_kl" in file["moments"]) is ("5C" not in part.moments.missing)
        assert [f"C{t[0]}" in file["invariants"] for t in INERTIA_TERMS] == [
            t not in part.moments.missing for t in INERTIA_TERMS
        ]
    in_mm = cms.body.convert_units(part, "mm-t-s")
    assert in_mm.moments.missing == part.moments.missing
    expected = cms.body.convert_units(lacking(body, ()), "mm-t-s").moments.C2
    assert_allclose(in_mm.moments.C2, expected, rtol=0, atol=1e-14 * np.abs(expected).max())


def test_a_file_of_a_whole_body_stays_one_that_older_programs_read(body, tmp_path):
    cms.write(body, tmp_path / "whole.h5")
    with h5py.File(tmp_path / "whole.h5") as file:
        assert file.attrs["version"] == 2


def test_a_false_word_about_what_is_missing_is_refused(body, tmp_path):
    from cms.body.modal_file.content import content_of
    from cms.body.modal_file.file import write_sealed

    content = content_of(lacking(body, ("3C",)), 4)
    attributes = {**content.attributes, "/moments": {"is_exact": 1, "missing": "3C 9C"}}
    write_sealed(replace(content, attributes=attributes), tmp_path / "a.h5")
    with pytest.raises(ModalFileError, match="unknown term '9C'"):
        cms.read(tmp_path / "a.h5")
    attributes = {**content.attributes, "/moments": {"is_exact": 1, "missing": ""}}
    write_sealed(replace(content, attributes=attributes), tmp_path / "a.h5")
    with pytest.raises(ModalFileError, match="/moments/P is missing"):
        cms.read(tmp_path / "a.h5")


@pytest.mark.parametrize("missing", [("3C",), ("5C",), ("3C", "4C", "5C")])
def test_another_frame_needs_nothing_that_is_missing(real, missing):
    whole = cms.reduction.convert_frame(real, cms.TisserandFrame())
    part = cms.reduction.convert_frame(lacking(real, missing), cms.TisserandFrame())
    assert part.moments.missing == (("3C", "4C", "5C") if "3C" in missing else missing)
    assert_allclose(part.free_frequencies, whole.free_frequencies, rtol=1e-12)
    for name in ("m", "S", "R", "C1", "C2", "M"):
        expected, size = getattr(whole.moments, name), np.abs(getattr(real.moments, name)).max()
        assert_allclose(getattr(part.moments, name), expected, rtol=0, atol=1e-10 * size)
    if "3C" not in missing:
        expected = whole.moments.C3
        assert_allclose(part.moments.C3, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_the_check_counts_and_says_what_a_motion_is_worth(real):
    records = {record.name: record for record in cms.check_body(lacking(real, ("3C", "4C", "5C")))}
    assert records["inertia-terms"].verdict == "warn"
    assert records["inertia-terms"].value == 3
    assert "3C, 4C, 5C missing; to be trusted: exact: mass, frequencies" in records["inertia-terms"].reason
    assert "cms import" not in records["inertia-terms"].reason
    others = {name: record.verdict for name, record in records.items() if name != "inertia-terms"}
    of_whole = {r.name: r.verdict for r in cms.check_body(replace(real, geometric=None)) if r.name != "inertia-terms"}
    assert others.pop("gram") == "info"  # it compares the terms with each other
    assert of_whole.pop("gram") == "pass"
    assert others == of_whole  # no other check needs what is missing
    assert next(r for r in cms.check_body(real) if r.name == "inertia-terms").verdict == "pass"


def test_the_record_of_a_body_lists_what_is_missing(real):
    assert body_record(lacking(real, ("5C",)))["missing_inertia_terms"] == ["5C"]
    assert body_record(real)["missing_inertia_terms"] == []


def test_the_gram_matrix_of_sums_over_points_gives_the_same_known_parts():
    rng = np.random.default_rng(8)
    mass, c, phi = rng.uniform(1, 2, 9), rng.normal(size=(9, 3)), rng.normal(size=(9, 3, 3))
    a = np.concatenate([np.ones((9, 1)), c, phi.reshape(9, -1)], axis=1)
    gram = a.T @ (mass[:, None] * a)
    part = moments_from_gram(gram, missing=INERTIA_TERMS)
    assert_allclose(part.C2, np.einsum("n,nak->ak", mass, np.cross(c[:, :, None], phi, axis=1)), rtol=0, atol=1e-13)
    assert_allclose(part.M, np.einsum("n,nak,nal->kl", mass, phi, phi), rtol=0, atol=1e-13)
