from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.assessment.quality.body_check import check_body
from cms.assessment.quality.of_body.descriptions import step_size
from cms.assessment.quality.of_body.effective_mass import effective_mass, effective_mass_at
from cms.assessment.quality.of_body.interface_motions import missing_motions
from cms.assessment.quality.of_body.moments_of_mass import check_moments_of_shapes, masses_at_nodes
from cms.body.invariants import moments_from_gram
from cms.errors import BodyError
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets import craig_bampton
from cms.reduction.basis.damping import ModalDamping
from cms.reduction.basis.frames import NodalFrame, TisserandFrame
from cms.reduction.free_pencil import free_elastic_modes, free_pencil
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from tests.bodies import bar, beam
from tests.synthetic import synthetic_reduced_body

FRAMES = [
    TisserandFrame(), NodalFrame("left"), NodalFrame("right"), NodalFrame(),
    NodalFrame("left", axes=((0, 1, 0), (0, 0, 1), (1, 0, 0))),
]  # fmt: skip


@pytest.fixture(scope="module")
def body():
    return couple(bar(nx=6, kind="hexahedron"))


@pytest.fixture(scope="module")
def nodal(body):
    return reduce(body, craig_bampton(body, n_modes=6), frame=NodalFrame("left"), damping=ModalDamping(0.01))


@pytest.fixture(scope="module")
def tisserand(body):
    return reduce(body, craig_bampton(body, n_modes=6))


def unit_set(body) -> ModeSet:
    """Every dof a column: the full model as a mode set."""
    n = body.n_dof
    return ModeSet("unit", np.eye(n), [f"dof {k}" for k in range(n)], np.full(n, np.nan))


def verdicts(reduced):
    return {record.name: record.verdict for record in check_body(reduced)}


def with_moments(reduced, **changes):
    return replace(reduced, moments=replace(reduced.moments, **changes))


# Good bodies ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("frame", FRAMES, ids=str)
@pytest.mark.parametrize("n_modes", [0, 6])
def test_a_good_body_passes_in_every_frame(body, frame, n_modes):
    reduced = reduce(body, craig_bampton(body, n_modes=n_modes), frame=frame)
    found = verdicts(reduced)
    assert {name for name, verdict in found.items() if verdict == "fail"} == set()
    assert {name for name, verdict in found.items() if verdict == "warn"} == set()


def test_a_frame_on_nodes_of_an_interface_is_held_there():
    whole = bar(nx=4, kind="hexahedron")
    corners = replace(whole.interfaces[0], kind="nodes")
    body = couple(replace(whole, interfaces=(corners, whole.interfaces[1])))
    frame = NodalFrame("left", axes=((0, 1, 0), (0, 0, 1), (1, 0, 0)))
    reduced = reduce(body, craig_bampton(body, n_modes=3), frame=frame)
    records = {r.name: r for r in check_body(reduced)}
    assert records["frame-condition"].verdict == "pass"
    assert "6 held translations" in records["frame-condition"].reason
    moved = replace(reduced, Phi=reduced.Phi + 0.01 * np.abs(reduced.Phi).max())
    assert {r.name: r for r in check_body(moved)}["frame-condition"].verdict == "fail"


def test_a_beam_of_few_nodes_passes():
    body = couple(beam(n=4))
    assert "fail" not in verdicts(reduce(body, craig_bampton(body, n_modes=3))).values()


def test_free_frequencies_come_back_from_the_moments_in_every_frame(body, tisserand):
    omega2 = (2 * np.pi * tisserand.free_frequencies) ** 2
    for frame in FRAMES:
        reduced = reduce(body, craig_bampton(body, n_modes=6), frame=frame)
        own, X, is_massive = free_elastic_modes(reduced)
        assert is_massive.all()
        assert_allclose(own, omega2, rtol=1e-9)
        M = free_pencil(reduced).M
        assert_allclose(X.T @ M @ X, np.eye(len(own)), rtol=0, atol=1e-9)


# Corrupted bodies: the right record fails ----------------------------------------------------------------------------


def corrupted():
    def flip(array, k):
        changed = np.array(array)
        changed[..., k] *= -1
        return changed

    yield "free-frequencies", "sign of 1C of one mode", lambda r: with_moments(r, C1=flip(r.moments.C1, 1))
    yield "free-frequencies", "sign of P of one mode", lambda r: with_moments(r, P=flip(r.moments.P, 0))
    yield "free-frequencies", "sign of the first moment", lambda r: with_moments(r, S=-r.moments.S)
    yield "free-frequencies", "wrong mass", lambda r: with_moments(r, m=1.001 * r.moments.m)
    yield "free-frequencies", "wrong stiffness", lambda r: replace(r, K=1.01 * r.K)
    yield "free-frequencies", "a frequency too few", lambda r: replace(r, free_frequencies=r.free_frequencies[1:])
    yield "kinetic-energy", "mass of a tenth", lambda r: with_moments(r, m=0.1 * r.moments.m)
    yield "modal-mass", "moments of another scale", lambda r: with_moments(r, S_kl=1.01 * r.moments.S_kl)
    yield "modal-mass", "modal mass of two", lambda r: replace(r, M=2 * r.M)
    yield "inertia-tensor", "second moment too small", lambda r: with_moments(r, R=0.01 * r.moments.R)
    yield "inertia-tensor", "no mass", lambda r: with_moments(r, m=-r.moments.m)
    yield "definiteness", "negative stiffness", lambda r: replace(r, K=r.K * np.r_[-1.0, np.ones(r.n_q - 1)])
    yield "definiteness", "negative damping", lambda r: replace(r, D=-r.D)
    yield (
        "symmetry",
        "lopsided stiffness",
        lambda r: replace(r, K=r.K + np.triu(np.full(r.K.shape, 1e-3 * r.K.max()), 1)),
    )
    yield "energy-shares", "shares of another set", lambda r: replace(r, energy_shares=0.5 * r.energy_shares)
    yield "frame-condition", "frame of another interface", lambda r: replace(r, frame=replace(r.frame, at="right"))
    yield "frame-condition", "frame of another kind", lambda r: replace(r, frame=replace(r.frame, kind="tisserand"))
    yield (
        "rigid-interfaces",
        "turned interface motion",
        lambda r: replace(r, interfaces=(r.interfaces[0], replace(r.interfaces[1], Psi=-r.interfaces[1].Psi))),
    )


CORRUPTED = list(corrupted())


@pytest.mark.parametrize(("name", "what", "spoil"), CORRUPTED, ids=[f"{name}: {what}" for name, what, _ in CORRUPTED])
def test_the_right_record_of_a_corrupted_body_fails(nodal, name, what, spoil):
    assert verdicts(nodal)[name] == "pass"
    assert verdicts(spoil(nodal))[name] == "fail"


def test_a_mode_with_linear_or_angular_momentum_is_not_in_mean_axes(tisserand):
    """1C of one mode spoilt, then the antisymmetric part of P: 2C = (P_12 - P_21, ...) of one mode."""
    C1, P = np.array(tisserand.moments.C1), np.array(tisserand.moments.P)
    C1[2, 1] += 0.01 * np.sqrt(tisserand.moments.m)
    size = 0.01 * np.sqrt(np.trace(tisserand.moments.J0))
    P[0, 1, 3] += size / 2
    P[1, 0, 3] -= size / 2
    assert verdicts(tisserand)["frame-condition"] == "pass"
    for changes, linear, angular in (({"C1": C1}, 0.01, 0.0), ({"P": P}, 0.0, 0.01)):
        record = {r.name: r for r in check_body(with_moments(tisserand, **changes))}["frame-condition"]
        assert record.verdict == "fail"
        assert_allclose(record.data["linear"].max(), linear, rtol=0, atol=1e-9)
        assert_allclose(record.data["angular"].max(), angular, rtol=0, atol=1e-9)


def test_an_interface_that_lost_a_motion_is_named(body):
    whole = craig_bampton(body, n_modes=4)
    assert len(missing_motions(reduce(body, whole))) == 0
    # stretching needs ux of either end: rigid motion gives the sum of both only
    kept = [k for k, label in enumerate(whole.labels) if not label.endswith("ux")]
    cut = ModeSet("cut", whole.columns[:, kept], [whole.labels[k] for k in kept], whole.frequencies[kept])
    reduced = reduce(body, cut)
    missing = missing_motions(reduced)
    assert missing.shape == (1, 12)
    assert_allclose(np.abs(missing[0, [0, 6]]), np.sqrt(0.5), rtol=1e-6)
    record = next(r for r in check_body(reduced) if r.name == "interface-motions")
    assert (record.verdict, record.value) == ("warn", 1.0)
    assert "left ux" in record.reason


# Numbers -------------------------------------------------------------------------------------------------------------


def test_effective_mass_of_a_clamped_rod_is_eight_over_pi_squared():
    """Uniform rod, one end held: mode k carries 8 / ((2 k - 1)² pi²) of the mass, at (2 k - 1) c / 4 L."""
    body = couple(beam(n=24, length=1.0))
    reduced = reduce(body, unit_set(body))
    found = effective_mass(reduced, "left")
    axial = np.flatnonzero(found.share[:, 0] > 1e-6)[:3]
    odd = 2 * np.arange(1, 4) - 1
    assert_allclose(found.share[axial, 0], 8 / (odd * np.pi) ** 2, rtol=0.02)
    assert_allclose(found.share[axial[0], 0], 8 / np.pi**2, rtol=1e-3)
    speed = np.sqrt(2.1e11 / 7850.0)
    assert_allclose(found.frequencies[axial[0]], speed / 4, rtol=1e-3)
    assert_allclose(found.total[:3], 7850.0 * 1e-4, rtol=1e-9)
    # what the held node keeps: the Schur complement of the consistent mass of a long row, rho A h / (2 sqrt 3)
    assert_allclose(found.remainder[0], 1 / (2 * np.sqrt(3)) / 24, rtol=1e-9)


def test_sums_of_effective_mass_end_at_what_the_modes_carry(nodal):
    found = effective_mass_at(nodal, "left")
    assert_allclose(found.cumulative[-1] + found.remainder, np.where(found.total > 0, 1.0, 0.0), rtol=0, atol=1e-12)
    assert_allclose(np.diff(found.cumulative, axis=0), found.share[1:], rtol=0, atol=1e-12)
    with pytest.raises(BodyError, match="no interface 'lift'"):
        effective_mass_at(nodal, "lift")


@pytest.mark.parametrize("at", ["left", "right"])
def test_effective_mass_does_not_depend_on_the_frame(body, nodal, tisserand, at):
    first, second = effective_mass(nodal, at), effective_mass(tisserand, at)
    assert_allclose(first.frequencies, second.frequencies, rtol=1e-8)
    assert_allclose(first.remainder, second.remainder, rtol=0, atol=1e-8)


def test_effective_mass_of_the_held_frame_is_its_own_modal_momentum(nodal):
    """In a nodal frame at the driven interface the participation of a mode is 1C and 2C themselves."""
    found = effective_mass(nodal, "left")
    assert_allclose(found.mass[:, :3], nodal.moments.C1.T**2, rtol=0, atol=1e-10 * nodal.moments.m)


def test_step_size_follows_the_highest_frequency(nodal):
    record = next(r for r in check_body(nodal) if r.name == "step-size")
    highest = nodal.frequencies.max()
    assert_allclose(record.data["step_highest_s"], step_size(highest), rtol=1e-12)
    assert_allclose(record.data["step_explicit_s"] * 2 * np.pi * highest, 2.0, rtol=1e-12)


def test_damping_is_told_in_ratios(nodal, tisserand):
    found = {r.name: r for r in check_body(nodal)}["damping"]
    assert_allclose(found.data["ratio"], 0.01, rtol=1e-9)
    assert {r.name: r for r in check_body(tisserand)}["damping"].value == 1.0


def skinned_bar(s):
    """Return a bar of even mass that keeps the nodes of its skin, with a mode u_x ~ z³ - s z; its moments are exact."""
    x, z = np.linspace(-0.2, 0.2, 5), np.linspace(-1.0, 1.0, 5)
    grid = np.stack(np.meshgrid(x, x, z, indexing="ij"), axis=-1).reshape(-1, 3)
    nodes = grid[(np.abs(grid[:, :2]).max(axis=1) > 0.19) | (np.abs(grid[:, 2]) > 0.99)]
    points, weights = np.polynomial.legendre.leggauss(4)  # exact
    p = np.stack(np.meshgrid(0.2 * points, 0.2 * points, points, indexing="ij"), axis=-1).reshape(-1, 3)
    w = np.einsum("i,j,k->ijk", weights, weights, weights).ravel() / 8

    def shape(at):
        u = np.zeros((len(at), 3, 1))
        u[:, 0, 0] = (at[:, 2] ** 3 - s * at[:, 2]) / np.sqrt(1 / 7 - 2 * s / 5 + s**2 / 3)
        return u

    a = np.concatenate([np.ones((len(p), 1)), p, shape(p)[:, :, 0]], axis=1)
    made = synthetic_reduced_body(n_q=1, n_nodes=len(nodes))
    return replace(
        made, nodes=nodes, Phi=shape(nodes), interfaces=(), moments=moments_from_gram(a.T @ (w[:, None] * a))
    )


def test_masses_at_the_nodes_do_not_reverse_the_moments_of_a_sound_body():
    """Of equal masses ∫ z u_x is large and positive: a sound body failed (seed 93119). Of the bar it is negative."""
    body = skinned_bar(0.8)
    size = np.linalg.norm(np.ptp(body.nodes, axis=0))
    of_equal = body.nodes[:, 2] @ body.Phi[:, 0, 0] / len(body.nodes)
    assert body.moments.P[2, 0, 0] < -0.1 * size
    assert of_equal > 0.1 * size
    weights = masses_at_nodes(body)
    assert weights is not None
    assert weights.min() >= 0
    assert_allclose([weights.sum(), *(weights @ body.nodes)], [1, 0, 0, 0], atol=1e-12)
    assert weights * body.nodes[:, 2] @ body.Phi[:, 0, 0] < 0
    assert check_moments_of_shapes(body).verdict in ("pass", "info")


def test_reversed_moments_are_found_by_the_shapes_at_the_nodes():
    body = skinned_bar(0.0)
    assert check_moments_of_shapes(body).verdict == "pass"
    reversed_one = replace(body, moments=replace(body.moments, P=-np.asarray(body.moments.P)))
    assert check_moments_of_shapes(reversed_one).verdict == "fail"


@pytest.mark.parametrize("share", [0.1, -0.1, 10.0])
def test_moments_of_mass_that_lies_elsewhere_are_not_judged_by_the_shapes(share):
    """A point mass on a light frame: a sound body had an eighth of the moments of masses at its nodes (seed 190492)."""
    body = skinned_bar(0.0)
    other = replace(body, moments=replace(body.moments, P=share * np.asarray(body.moments.P)))
    found = check_moments_of_shapes(other)
    assert found.verdict == "info"
    assert "times the moments of the file" in found.reason
