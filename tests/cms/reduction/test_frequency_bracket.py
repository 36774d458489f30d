"""Largest errors of frequencies beside dense solutions of bodies whose modes nearly coincide, at every cutoff."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_array_equal

import cms
import fe_models as fm
from cms.assessment.quality.body_record import body_record
from cms.cli.info import print_free_frequencies
from cms.modes.families.families import Families
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets import MODE_SETS
from cms.reduction.error_estimates import cutoff_of
from cms.reduction.frequency_bracket import largest_errors
from cms.reduction.reduction import reduce
from tests.bodies import bar

ROUNDING = 1e-8  #: true error that is rounding of the dense solution
FOUR_DIGITS = 1 + 1e-3


@pytest.fixture(scope="module")
def close_modes():
    """True errors, estimates, largest errors and marks of sets that cut a dense spectrum at random numbers of modes.

    The bars are nearly square, so that their bending modes in two planes nearly coincide. Estimates are made with guard
    modes, and with random columns in their places.
    """
    rows = {"guards": [], "random": []}
    for seed in range(8):
        rng = np.random.default_rng(seed)
        width = 0.1 * (1 + 10 ** rng.uniform(-4, -2))
        body = fm.couple(bar(int(rng.integers(5, 8)), 2, 2, length=0.5, width=width, height=0.1, kind="hexahedron"))
        exact = np.sqrt(la.eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True)[6:]) / (2 * np.pi)
        with Families(body, announce=False) as families:
            for name in ("craig-bampton", "attachment"):
                for n_modes in rng.integers(20, body.n_dof // 3, 4):
                    modes = MODE_SETS[name](families, n_modes=int(n_modes))
                    for kind, each in (("guards", modes), ("random", replace(modes, guards=None))):
                        made = reduce(families, each, geometric=False)
                        found = made.errors
                        k = min(len(found.frequency), len(exact))
                        true = made.free_frequencies[:k] / exact[:k] - 1
                        rows[kind].append(
                            [true, *(e[:k] for e in (found.frequency, found.largest, found.is_uncertain))]
                        )
    return {kind: (*(found := np.hstack(each))[:3], found[3] > 0) for kind, each in rows.items()}


SETS_WITH_CUTOFF = (
    "craig-bampton", "craig-bampton-ir", "multilevel", "attachment", "herting", "rubin", "dual-craig-bampton", "normal",
)  # fmt: skip


@pytest.mark.parametrize("name", SETS_WITH_CUTOFF)
def test_shapes_beside_a_set_have_less_mass_than_its_cutoff_allows(name):
    """Shapes K-orthogonal to the set, without rigid-body motion, by a null space: their largest mass / stiffness."""
    body = fm.couple(bar(9, 3, 3, kind="hexahedron"))
    K, M = body.K.toarray(), body.M.toarray()
    with Families(body, announce=False) as families:
        modes = MODE_SETS[name](families, n_modes=21)
    M_rigid, K_V = M @ la.eigh(K, M)[1][:, :6], K @ np.asarray(modes.columns)
    beside = la.null_space(np.hstack([M_rigid / abs(M_rigid).max(), K_V / abs(K_V).max()]).T, rcond=1e-9)
    largest = la.eigh(beside.T @ M @ beside, beside.T @ K @ beside, eigvals_only=True)[-1]
    assert 0.5 < largest * cutoff_of(modes) ** 2 < 1.0


def test_an_estimate_far_too_small_is_marked_uncertain(close_modes):
    for true, estimate, _, is_uncertain in close_modes.values():
        is_far = (true > ROUNDING) & (estimate < 0.2 * true)
        assert is_far.any()
        assert is_uncertain[is_far].all()


def test_guard_modes_show_the_modes_that_a_set_lacks_near_its_cutoff(close_modes):
    n_far, n_uncertain = {}, {}
    for kind, (true, estimate, _, is_uncertain) in close_modes.items():
        n_far[kind], n_uncertain[kind] = ((true > ROUNDING) & (estimate < 0.5 * true)).sum(), is_uncertain.sum()
    assert 5 * n_far["guards"] <= n_far["random"]
    assert 4 * n_uncertain["guards"] <= n_uncertain["random"]


@pytest.mark.parametrize("kind", ["guards", "random"])
def test_no_true_error_is_above_the_largest_one(close_modes, kind):
    true, estimate, largest, _ = close_modes[kind]
    is_limited = np.isfinite(largest)
    assert (true <= largest * FOUR_DIGITS + ROUNDING)[is_limited].all()
    assert (estimate <= largest * FOUR_DIGITS)[is_limited].all()


def test_few_estimates_are_uncertain(close_modes):
    true, _, largest, is_uncertain = close_modes["random"]
    assert is_uncertain.mean() < 0.1
    assert (largest < 2 * true + ROUNDING).mean() > 0.5


def test_exact_modes_are_certain():
    with Families(fm.couple(bar())) as families:
        found = reduce(families, MODE_SETS["normal"](families, n_modes=8)).errors
    assert_array_equal(found.largest, np.zeros(8))
    assert not found.is_uncertain.any()


def test_a_mode_that_random_columns_find_beside_a_set_is_certain():
    """The set has exact modes 1, 2, 4 and 5: the third frequency is wrong by a known amount."""
    body = fm.couple(bar())
    omega2, Phi = la.eigh(body.K.toarray(), body.M.toarray())
    kept = np.array([6, 7, 9, 10])
    modes = ModeSet("some", Phi[:, kept], tuple("abcd"), np.sqrt(omega2[kept]) / (2 * np.pi))
    with Families(body) as families:
        families.fixed  # noqa: B018
        found = reduce(families, modes).errors
    true = np.sqrt(omega2[9] / omega2[8]) - 1
    assert true > 1e-3
    assert true <= found.largest[2] <= 1.5 * true
    assert_array_equal(found.is_uncertain[:3], [False, False, False])


def test_a_found_shape_above_the_cutoff_counts_as_a_mode():
    """A small mass matrix in full, with estimates that are a hundredth of the true errors."""
    rng = np.random.default_rng(3)
    mu_V, A = np.array([1.0, 0.6, 0.4, 0.2]), np.diag([0.5, 0.15, 0.1])
    B = 0.05 * rng.normal(size=(4, 3))
    exact = la.eigvalsh(np.block([[np.diag(mu_V), B], [B.T, A]]))[::-1]
    true = np.sqrt(exact[:3] / mu_V[:3]) - 1
    found = largest_errors(0.01 * true, 1 / mu_V[:3], (mu_V, B, A), 1 / np.sqrt(0.3))
    assert (true <= found).all()
    assert (found <= 5 * true).all()


def test_uncertain_estimates_are_marked_in_file_and_report(tmp_path, capsys):
    body = fm.couple(bar())
    made = cms.reduce(body, cms.craig_bampton(body, n_modes=6), errors=True)
    n = len(made.errors.frequency)
    largest = np.full(n, np.nan)
    largest[0] = made.errors.frequency[0]
    marked = replace(made, errors=replace(made.errors, largest=largest))
    cms.write(marked, tmp_path / "marked.h5")
    cms.write(replace(made, errors=replace(made.errors, largest=np.zeros(0))), tmp_path / "old.h5")
    assert_array_equal(cms.read(tmp_path / "marked.h5").errors.is_uncertain, [False] + [True] * (n - 1))
    assert not cms.read(tmp_path / "old.h5").errors.is_uncertain.any()
    assert info(tmp_path / "marked.h5", capsys).count("% ?") == n - 1
    old = info(tmp_path / "old.h5", capsys)
    assert "?" not in old
    assert "at most" not in old.split("reduction:")[0]


def info(path, capsys):
    """Return what `cms info` prints about the frequencies of a file."""
    print_free_frequencies(body_record(cms.read(path)))
    return capsys.readouterr().out
