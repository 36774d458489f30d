"""Moments from the invariants of files, and from masses beside a reduced matrix, of clouds of point masses."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.body.invariants import INERTIA_TERMS, Moments
from cms.body.reduced_body import BodyFrame
from cms.errors import ForeignBodyError
from cms.exchange.importers.inertia import completed, moments_in_frame
from cms.exchange.importers.integrals import moments_of_invariants

N_Q = 4


def cloud(seed):
    """Return masses, places and shapes of points in no symmetric position, (40,), (40, 3), (40, 3, n_q)."""
    rng = np.random.default_rng(seed)
    return rng.uniform(0.1, 2.0, 40), rng.normal(size=(40, 3)) * [3, 1, 0.5] + [5, -2, 1], rng.normal(size=(40, 3, N_Q))


def moments_of(m, c, phi):
    """Return the moments by their definitions."""
    return Moments(
        m=float(m.sum()), S=m @ c, R=np.einsum("i,ia,ib->ab", m, c, c), C1=np.einsum("i,iak->ak", m, phi),
        P=np.einsum("i,ia,ibk->abk", m, c, phi), S_kl=np.einsum("i,iak,ibl->abkl", m, phi, phi),
    )  # fmt: skip


def invariants(m, c, phi):
    """Return J0, 1C, 2C, M, 3C, 4C, 5C by sums over points, with tilde(a) b = a × b."""
    c_tilde, phi_tilde = tilde(c), tilde(np.moveaxis(phi, 2, 1))  # (i, 3, 3), (i, k, 3, 3)
    return {
        "J0": -np.einsum("i,iab,ibc->ac", m, c_tilde, c_tilde),
        "C1": np.einsum("i,iak->ak", m, phi),
        "C2": np.einsum("i,iab,ibk->ak", m, c_tilde, phi),
        "M": np.einsum("i,iak,ial->kl", m, phi, phi),
        "C3": -np.einsum("i,iab,ikbc->kac", m, c_tilde, phi_tilde),
        "C4": np.einsum("i,ilab,ibk->kla", m, phi_tilde, phi),
        "C5": -np.einsum("i,ikab,ilbc->klac", m, phi_tilde, phi_tilde),
    }


def tilde(a):
    x, y, z = np.moveaxis(np.asarray(a), -1, 0)
    o = np.zeros_like(x)
    return np.moveaxis(np.array([[o, -z, y], [z, o, -x], [-y, x, o]]), (0, 1), (-2, -1))


def agree(found, expected, names=("m", "S", "R", "C1", "P", "S_kl")):
    for name in names:
        size = np.abs(getattr(expected, name)).max()
        assert_allclose(getattr(found, name), getattr(expected, name), rtol=0, atol=1e-12 * size, err_msg=name)


@pytest.mark.parametrize("seed", range(3))
def test_all_invariants_of_a_file_give_the_moments_of_its_masses(seed):
    m, c, phi = cloud(seed)
    found, notes = moments_of_invariants("file", float(m.sum()), m @ c, **invariants(m, c, phi))
    agree(found, moments_of(m, c, phi))
    assert (notes, found.missing, found.is_exact) == ((), (), True)


@pytest.mark.parametrize("left_out", [("C3",), ("C5",), ("C4", "C5"), ("C3", "C4", "C5")])
def test_what_a_file_lacks_is_missing_and_the_rest_is_right(left_out):
    m, c, phi = cloud(5)
    given = {name: value for name, value in invariants(m, c, phi).items() if name not in left_out}
    found, _ = moments_of_invariants("file", float(m.sum()), m @ c, **given)
    own = invariants(m, c, phi)
    assert found.missing == tuple(name for name in INERTIA_TERMS if "C" + name[0] in left_out)
    for name in given:
        assert_allclose(getattr(found, name), own[name], rtol=0, atol=1e-12 * np.abs(own[name]).max(), err_msg=name)


def with_trace(own):
    """Return 5C of another modal mass."""
    return own["C5"] + own["M"][:, :, None, None] * np.eye(3)


@pytest.mark.parametrize(
    ("name", "part", "share", "what"),
    [
        ("C3", lambda own: own["C3"].swapaxes(1, 2), 1.0, "2C and the antisymmetric part of 3C"),
        ("C2", lambda own: -own["C2"], 1.0, "2C and the antisymmetric part of 3C"),
        ("C5", with_trace, 1.0, "the modal mass and the trace of 5C"),
        ("C4", lambda own: -own["C4"], 1.0, "4C and the antisymmetric part of 5C"),
        ("C5", lambda own: own["C5"].swapaxes(0, 1), 1.0, "4C and the antisymmetric part of 5C"),
        ("C4", lambda own: -own["C4"], 1e-3, "4C and the antisymmetric part of 5C"),
        ("C2", lambda own: own["C2"][::-1], 1e-4, "2C and the antisymmetric part of 3C"),
        ("C5", with_trace, 1e-3, "the modal mass and the trace of 5C"),
    ],
)
def test_two_statements_of_one_integral_are_compared_and_the_first_is_taken(name, part, share, what):
    m, c, phi = cloud(7)
    own = invariants(m, c, phi)
    given = own | {name: (1 - share) * own[name] + share * part(own)}
    if share == 1.0:
        with pytest.raises(ForeignBodyError, match=f"file: {what} differ by"):
            moments_of_invariants("file", float(m.sum()), m @ c, **given)
        return
    found, notes = moments_of_invariants("file", float(m.sum()), m @ c, **given)
    assert [note.split(" differ by")[0] for note in notes] == [what]
    assert not found.is_exact
    assert_allclose(found.C2, given["C2"], rtol=0, atol=1e-12 * np.abs(own["C2"]).max())
    assert_allclose(found.M, own["M"], rtol=0, atol=1e-12 * np.abs(own["M"]).max())


def test_5c_without_4c_is_refused():
    m, c, phi = cloud(1)
    given = {name: value for name, value in invariants(m, c, phi).items() if name != "C4"}
    with pytest.raises(ForeignBodyError, match="the file has 5C but not 4C, which is a part of it"):
        moments_of_invariants("file", float(m.sum()), m @ c, **given)


def test_masses_beside_complete_what_a_reduced_matrix_does_not_say():
    m, c, phi = cloud(2)
    whole, own = moments_of(m, c, phi), invariants(m, c, phi)
    known, _ = moments_of_invariants(
        "file", float(m.sum()), m @ c, **{name: own[name] for name in ("J0", "C1", "C2", "M")}
    )
    found, words = completed(known, whole, "masses")
    agree(found, whole)
    assert found.is_exact
    assert words.startswith("mass ")
    with pytest.raises(ForeignBodyError, match="they do not belong to this body: mass differs by"):
        completed(known, replace(whole, m=1.5 * whole.m), "masses")


def test_moments_in_a_frame_are_those_of_places_and_shapes_in_its_axes():
    m, c, phi = cloud(3)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    frame = BodyFrame("nodal", np.array([0.7, -3.0, 2.0]), turn)
    a = np.concatenate([np.ones((40, 1)), c, phi.reshape(40, -1)], axis=1)
    found = moments_in_frame(a.T @ (m[:, None] * a), frame)
    agree(found, moments_of(m, (c - frame.origin) @ turn, np.einsum("ba,ibk->iak", turn, phi)))
