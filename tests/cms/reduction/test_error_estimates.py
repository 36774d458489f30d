"""Estimated errors of frequencies, shapes and static responses against dense solutions of the whole model."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from cms.errors import BodyError
from cms.modes.families.families import Families
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets import MODE_SETS
from cms.reduction.basis.free_basis import free_basis
from cms.reduction.error_estimates import frequency_errors
from cms.reduction.reduction import reduce
from fe_models.body.fe_body import Interface
from fe_models.files.matrices.given import body_from_matrices
from tests.bodies import bar, beam, box_mesh, distorted

EXACT = 1e-7  #: relative error of a frequency that is rounding
FOUR_DIGITS = 1 + 5e-4  #: largest factor of an error by its rounding to four digits
EXACT_SETS = ("rubin", "normal")  #: sets that contain the free modes below their cutoff
#: sets without vibration modes, whose estimates do not end at a cutoff
WITHOUT_CUTOFF = ("guyan", "krylov", "balanced-truncation", "h2-optimal")
SETS = {
    "craig-bampton": {"n_modes": 9}, "craig-bampton-ir": {"n_modes": 6}, "rubin": {"n_modes": 7}, "guyan": {},
    "krylov": {"n_blocks": 2}, "attachment": {"n_modes": 9}, "normal": {"n_modes": 8},
    "balanced-truncation": {"n_modes": 9}, "h2-optimal": {"n_modes": 5},
}  # fmt: skip


@pytest.fixture(scope="module")
def body():
    """A bent bar in general position, in mm and ms, with two rigid interfaces."""
    mesh = distorted(box_mesh(6, 2, 1, 300.0, 60.0, 25.0), 0.1, seed=2)
    turn = la.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    mesh = replace(mesh, nodes=mesh.nodes @ (turn * la.det(turn)).T + [40.0, -900.0, 300.0])
    ports = [
        Interface(name, "rigid", nodes := mesh.node_sets[name], mesh.nodes[nodes].mean(axis=0) + np.array([3, 1, -2]))
        for name in ("left", "right")
    ]
    units = fm.unit_system("mm-kg-ms")
    steel = fm.Material("steel", 210.0, 0.3, 7.85e-6)  # GPa = kg / (mm ms²)
    return fm.couple(fm.solid_body(mesh, steel, name="bar", units=units, interfaces=ports))


@pytest.fixture(scope="module")
def exact(body):
    """Elastic eigenvalues and M-orthonormal modes of the whole model, by LAPACK."""
    omega2, Phi = la.eigh(body.K.toarray(), body.M.toarray())
    return omega2[6:], Phi[:, 6:]


@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("frame", [cms.TisserandFrame(), cms.NodalFrame("left")], ids=str)
def test_an_estimate_is_below_the_true_error_and_near_it(body, exact, name, frame):
    with Families(body) as families:
        modes = MODE_SETS[name](families, **SETS[name])
        made = reduce(families, modes, frame=frame)
    errors, f = made.errors, np.sqrt(exact[0]) / (2 * np.pi)
    judged = made.free_frequencies[: len(errors.frequency)]
    true = judged / f[: len(judged)] - 1
    is_judged = true > EXACT
    assert (errors.frequency <= true * FOUR_DIGITS + EXACT).all()
    assert (errors.frequency >= 0.3 * true)[is_judged].all()
    assert np.quantile((errors.frequency / true)[is_judged], 0.1) >= 0.5 if is_judged.any() else name in EXACT_SETS
    nearest = np.abs(judged[:, None] ** 2 / f**2 - 1).min(axis=1)
    assert (nearest <= errors.bound * FOUR_DIGITS + EXACT).all()
    vibrating = modes.frequencies[~modes.is_static]
    assert judged[-1] <= (1 + EXACT) * vibrating.max(initial=0) or name in WITHOUT_CUTOFF


def test_modes_that_a_set_contains_have_no_error(body):
    with Families(body) as families:
        errors = reduce(families, MODE_SETS["normal"](families, n_modes=8)).errors
    assert len(errors.frequency) == 8
    assert errors.frequency.max() < 1e-10
    assert errors.bound.max() < 1e-4


def test_a_mode_that_a_set_lacks_is_seen_though_no_residual_has_it(body, exact):
    """Exact modes 1, 2, 4, 5: all residuals are zero, and the third frequency of the set is that of mode 4."""
    kept = [0, 1, 3, 4]
    modes = ModeSet("some", exact[1][:, kept], tuple("abcd"), np.sqrt(exact[0][kept]) / (2 * np.pi))
    with Families(body) as families:
        families.fixed  # noqa: B018
        errors = reduce(families, modes).errors
    f = np.sqrt(exact[0])
    assert_allclose(errors.frequency[:3], [0, 0, f[3] / f[2] - 1], rtol=0.3, atol=1e-9)
    assert errors.bound.max() < 1e-4


def noisy_modes(exact):
    """Forty exact modes, each with a share of its own of a higher one, so that forty corrections are independent."""
    Phi = exact[1][:, :40] + 0.03 * exact[1][:, 50:90] * np.random.default_rng(4).uniform(0.5, 1, 40)
    return ModeSet("noisy", Phi, tuple(map(str, range(40))), np.sqrt(exact[0][:40]) / (2 * np.pi))


@pytest.mark.parametrize("name", ["craig-bampton", "craig-bampton-ir", "rubin", "noisy"])
def test_sampled_corrections_give_the_estimates_of_all_corrections(monkeypatch, body, exact, name):
    """Those of constraint modes and eigenmodes span 12 columns; if they span more, tests show it."""
    with Families(body) as families:
        modes = noisy_modes(exact) if name == "noisy" else MODE_SETS[name](families, n_modes=40)
        families.fixed  # noqa: B018
        n_solved, flexibility = [], families.flexibility
        monkeypatch.setattr(families, "flexibility", lambda F: n_solved.append(F.shape[1]) or flexibility(F))
        found = reduce(families, modes).errors
        own, spin, smoothing = 12 + 2, 6, [6, 6] if name == "noisy" else []  # without guard modes: random columns
        assert n_solved[: len(smoothing) + 1] == [*smoothing, own + spin]
        assert len(n_solved) == len(smoothing) + 1 + (name == "noisy")
        monkeypatch.setattr(cms.reduction.error_estimates, "TESTS", 1000)
        every = reduce(families, modes).errors
    assert name == "rubin" or every.frequency.max() > 1e-5
    assert_allclose(found.frequency, every.frequency, rtol=2e-3, atol=1e-9)
    assert_allclose(found.bound, every.bound, rtol=2e-3, atol=2e-7)
    assert_allclose(found.response, every.response, rtol=2e-3, atol=1e-6)


def test_no_mode_has_no_error(body):
    with Families(body) as families:
        basis = free_basis(body, MODE_SETS["guyan"](families), families)
        errors = frequency_errors(families, basis, 0)
    assert [len(each) for each in (errors.frequency, errors.bound, errors.shape)] == [0, 0, 0]


def test_the_error_of_a_shape_is_that_of_its_strain_energy(body, exact):
    with Families(body) as families:
        modes = MODE_SETS["craig-bampton"](families, n_modes=9)
        made = reduce(families, modes)
        basis = cms.reduction.basis.free_basis.free_basis(body, modes, families)
    K, n = body.K, len(made.errors.frequency)
    true = []
    for k in range(n):
        phi = basis.Phi[:, k] / np.sqrt(basis.omega2[k])
        true.append(np.sqrt(max(0.0, 1 - (phi @ (K @ exact[1][:, k])) ** 2 / exact[0][k])))
    assert_allclose(made.errors.shape, true, rtol=0.1, atol=1e-4)


@pytest.mark.parametrize("name", ["craig-bampton", "craig-bampton-ir", "krylov", "h2-optimal", "normal"])
def test_errors_of_responses_are_near_those_of_a_dense_solution(body, exact, name):
    """Forces and moments on both interfaces, with 1 % damping, at the 33 frequencies around each mode."""
    with Families(body) as families:
        made = reduce(families, MODE_SETS[name](families, **SETS[name]), frame=cms.NodalFrame("left"))
    true = errors_of_responses(made, body, exact)
    assert max(true) > 1e-3
    ratio = made.errors.response / true
    assert ((ratio > 0.5) & (ratio < 1.5))[true < 0.5].all()


def errors_of_responses(made, body, exact):
    """Root mean square errors of the receptance at the 33 frequencies around each judged mode, by dense solutions."""
    f, n = made.free_frequencies, len(made.errors.frequency)
    ends = [0.05 * f[0], *(f[1:n] + f[: n - 1]) / 2, f[n - 1]]
    damping = 0.02 * (body.M @ exact[1] * np.sqrt(exact[0])) @ (body.M @ exact[1]).T
    scale = np.where(body.dofs[body.b, 1] < 3, 1.0, body.length)
    true = []
    for low, high in pairwise(ends):
        own = cms.frf(made, np.linspace(low, high, 33) / body.units.time, damping=0.01)
        errors = []
        for omega, H in zip(2 * np.pi * np.linspace(low, high, 33), own.H, strict=True):
            A = body.K.toarray() + 1j * omega * damping - omega**2 * body.M.toarray()
            whole = la.inv(A)[np.ix_(body.b, body.b)] * np.outer(scale, scale)
            errors.append(la.norm(H * np.outer(scale, scale) - whole) / la.norm(whole))
        true.append(np.sqrt(np.mean(np.square(errors))))
    return np.array(true)


@pytest.mark.parametrize(
    ("name", "interface", "inertia"),
    [("craig-bampton", True, False), ("craig-bampton-ir", True, True), ("normal", False, False)],
)
def test_static_responses_are_exact_by_construction_or_have_an_error(body, name, interface, inertia):
    with Families(body) as families:
        errors = reduce(families, MODE_SETS[name](families, n_modes=6)).errors
    assert len(errors.interface_loads) == len(errors.interface) == 6
    assert (errors.interface.max() == 0) == interface
    assert (errors.inertia.max() == 0) == inertia
    assert errors.inertia.shape == (6,)


def test_exact_responses_of_a_slender_bar_are_not_lost_in_rounding():
    """Under loads near the reactions it turns a thousand times more than it bends."""
    with Families(fm.couple(bar(nx=40, length=10.0, width=0.02, height=0.02))) as families:
        errors = reduce(families, MODE_SETS["craig-bampton"](families, n_modes=6)).errors
    assert errors.interface.max() == 0


def test_very_many_unit_loads_are_judged_by_random_sums(monkeypatch, body):
    with Families(body) as families:
        modes = {name: MODE_SETS[name](families, n_modes=6) for name in ("craig-bampton", "normal")}
        plain = reduce(families, modes["normal"]).errors.interface
        monkeypatch.setattr(cms.reduction.error_estimates, "MOST_LOADS", 5)
        found = {name: reduce(families, each).errors for name, each in modes.items()}
    assert len(found["normal"].interface_loads) == len(found["normal"].interface) == 12
    assert found["craig-bampton"].interface.max() == 0
    assert plain.min() < found["normal"].interface.max() < 1
    assert "random signs" in found["normal"].interface_loads[0]


def test_static_errors_are_those_of_a_dense_solution(body):
    with Families(body) as families:
        modes = MODE_SETS["normal"](families, n_modes=6)
        errors = reduce(families, modes).errors
        held, e = families.r, families.h[families.free.e]
        Phi = modes.columns
    K = body.K.toarray()
    left = np.setdiff1d(np.arange(body.n_dof), held)
    for k, dof in enumerate(e):
        f = np.zeros(body.n_dof)
        f[dof] = 1.0
        u = np.zeros(body.n_dof)
        u[left] = la.solve(K[np.ix_(left, left)], f[left], assume_a="pos")
        d = u - Phi @ np.linalg.lstsq(Phi.T @ K @ Phi, Phi.T @ K @ u, rcond=1e-9)[0]
        assert_allclose(errors.interface[k], np.sqrt((d @ K @ d) / (u @ K @ u)), rtol=6e-4)


def test_a_held_body_is_judged_as_it_is_held():
    """A cantilever: the rows of the left face are taken out."""
    free = bar(nx=8)
    keep = np.flatnonzero(free.nodes[free.dofs[:, 0], 0] > 0)
    M, K = free.M[keep][:, keep], free.K[keep][:, keep]
    right = [free.interfaces[1]]
    held = fm.couple(
        body_from_matrices(M, K, free.nodes, free.dofs[keep], name="c", units=free.units, interfaces=right, held=True)
    )
    with Families(held) as families:
        made = reduce(families, MODE_SETS["craig-bampton"](families, n_modes=6))
    errors, n = made.errors, len(made.errors.frequency)
    exact = la.eigh(held.K.toarray(), held.M.toarray())
    true = made.free_frequencies[:n] / (np.sqrt(exact[0][:n]) / (2 * np.pi)) - 1
    assert true.max() > 1e-3
    assert_allclose(errors.frequency, true, rtol=0.5, atol=EXACT)
    assert_allclose(errors.response, errors_of_responses(made, held, exact), rtol=0.01)


def test_modes_that_coincide_are_judged_together():
    """One of two equal bending modes of a round beam, so small that the estimate finds its exact modes.

    Rounding chooses the exact shapes of such a pair, and the error of the shape must not depend on it.
    """
    round_beam = fm.couple(beam(2, Iy=2e-9, Iz=2e-9))
    with Families(round_beam) as families:
        found = families.free_modes(3)
        assert abs(found.frequencies[0] / found.frequencies[1] - 1) < 1e-9
        ratio = found.frequencies[2] / found.frequencies[0]
        for angle in np.linspace(0, np.pi, 7):
            column = np.cos(angle) * found.Phi[:, 0] + np.sin(angle) * found.Phi[:, 1] + 1e-2 / ratio * found.Phi[:, 2]
            errors = reduce(families, ModeSet("one", column[:, None], ("a",), np.array([1e6]))).errors
            assert_allclose(errors.shape, 1e-2, rtol=1e-2)


def test_errors_of_more_modes_than_there_are_free_frequencies_are_refused(body):
    made = cms.reduce(body, cms.craig_bampton(body, n_modes=2), errors=True)
    with pytest.raises(BodyError, match="0 free frequencies, but errors of"):
        replace(made, free_frequencies=made.free_frequencies[:0])


def test_a_body_alone_is_judged_on_request(body):
    modes = cms.craig_bampton(body, n_modes=6)
    assert cms.reduce(body, modes).errors is None
    asked = cms.reduce(body, modes, errors=True).errors
    with Families(body) as families:
        own = reduce(families, MODE_SETS["craig-bampton"](families, n_modes=6)).errors
    assert_allclose(asked.frequency, own.frequency, rtol=1e-3)


def test_errors_survive_a_file_and_other_units(body, tmp_path):
    modes = cms.craig_bampton(body, n_modes=6)
    made = cms.reduce(body, modes, errors=True)
    cms.write(made, tmp_path / "bar.h5")
    back = cms.read(tmp_path / "bar.h5").errors
    for name in ("frequency", "bound", "shape", "response", "interface", "inertia"):
        assert_allclose(getattr(back, name), getattr(made.errors, name), rtol=0, atol=0)
    assert (back.method, back.date, back.interface_loads) == (
        made.errors.method, made.errors.date, made.errors.interface_loads
    )  # fmt: skip
    si = cms.read(tmp_path / "bar.h5", units="m-kg-s").errors
    assert_allclose(si.frequency, made.errors.frequency, rtol=0)
