from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.of_reduction.deformation import (
    NORMS,
    deformation_error,
    deformation_record,
    nodal_deformation_error,
)
from cms.assessment.quality.plots import plot_deformation_error
from cms.assessment.quality.reference.transient import (
    LoadHistory,
    Snapshots,
    interface_forces,
    modal_motion,
    support_acceleration,
    transient,
    transient_in,
)
from cms.modes.families.families import Families
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets import MODE_SETS, craig_bampton, guyan
from cms.reduction.basis.frames import NodalFrame, TisserandFrame
from cms.reduction.basis.free_basis import FreeBasis, free_basis
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from tests.bodies import bar, chain


@pytest.fixture(scope="module")
def body():
    return couple(bar(nx=6, kind="hexahedron"))


@pytest.fixture(scope="module")
def families(body):
    with Families(body) as made:
        yield made


@pytest.fixture(scope="module")
def pulse(body):
    """A half-sine force on the right interface, across the bar, then nothing."""
    t = np.linspace(0.0, 0.01, 801)
    force = np.zeros((6, len(t)))
    force[2] = 1000.0 * np.where(t < 0.001, np.sin(np.pi * t / 0.001), 0.0)
    return interface_forces(body, {"right": force}, t)


@pytest.fixture(scope="module")
def snapshots(families, pulse):
    return transient(families, pulse, cutoff=20000.0)


# Transient -----------------------------------------------------------------------------------------------------------


def oscillator(omega):
    return FreeBasis(np.ones((1, 1)), np.array([omega**2]), np.array([True]), np.zeros((1, 0)))


@pytest.mark.parametrize("damping", [0.0, 0.07])
def test_an_oscillator_under_a_ramp_follows_the_closed_form(damping):
    """q'' + 2 zeta w q' + w² q = c t from rest: c/w² (t - 2 zeta/w + e^(-zeta w t) (...)), exact at any step."""
    w, c = 30.0, 5.0
    t = np.linspace(0, 1, 12)
    wd, z = w * np.sqrt(1 - damping**2), damping
    decay = np.exp(-z * w * t)
    wanted = c / w**2 * (t - 2 * z / w + decay * (2 * z / w * np.cos(wd * t) + (2 * z**2 - 1) / wd * np.sin(wd * t)))
    found = modal_motion(oscillator(w), (c * t)[None], float(t[1]), damping)[0]
    assert_allclose(found, wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


def test_a_preloaded_oscillator_stays_where_it_is():
    found = modal_motion(oscillator(30.0), np.full((1, 50), 7.0), 0.01, 0.0, is_preloaded=True)
    assert_allclose(found, 7.0 / 900.0, rtol=1e-12)


def test_the_deformation_of_a_row_of_masses_agrees_with_a_dense_solution():
    """Piecewise linear force on one end: every mode of the dense pencil by the variation of constants, finely."""
    row = couple(chain(n=6, stiffness=1000.0, mass=2.0))
    t = np.linspace(0, 2.0, 201)
    p = np.interp(t, [0, 0.3, 0.5, 2.0], [0, 4.0, -1.0, 0])
    load = LoadHistory(np.eye(6)[:, :1], t, p[None])
    with Families(row) as families:
        found = transient(families, load, cutoff=1e3, damping=0.02).u
    lam, Phi = la.eigh(row.K.toarray(), row.M.toarray())
    fine = np.linspace(0, 2.0, 20001)
    force = np.interp(fine, t, p)
    wanted = np.zeros((6, len(t)))
    for k in range(1, 6):
        w = np.sqrt(lam[k])
        wd = w * np.sqrt(1 - 0.02**2)
        kernel = np.exp(-0.02 * w * fine) * np.sin(wd * fine) / wd
        q = np.convolve(kernel, force * Phi[0, k])[: len(fine)] * (fine[1] - fine[0])
        wanted += np.outer(Phi[:, k], q[::100])
    assert_allclose(found, wanted, rtol=0, atol=2e-4 * np.abs(wanted).max())


def test_a_slow_load_deforms_statically(body, families):
    t = np.linspace(0, 10.0, 41)
    force = np.outer([0.0, 1.0, 3.0, 0, 0.2, 0], t / 10.0)
    load = interface_forces(body, {"right": force}, t)
    found = transient(families, load, cutoff=3000.0, damping=0.05)
    static = families.flexibility(load.F) @ load.p[:, -1]
    assert_allclose(found.u[:, -1], static, rtol=0, atol=1e-4 * np.abs(static).max())
    held = transient(families, load, cutoff=3000.0, held=["left"], damping=0.05).u[:, -1]
    dofs = body.interface("left").dofs
    assert_allclose(held[dofs], 0, rtol=0, atol=1e-12 * np.abs(held).max())
    free = np.setdiff1d(np.arange(body.n_dof), dofs)
    wanted = np.zeros(body.n_dof)
    wanted[free] = np.linalg.solve(body.K.toarray()[np.ix_(free, free)], (load.F @ load.p[:, -1])[free])
    assert_allclose(held, wanted, rtol=0, atol=1e-4 * np.abs(wanted).max())


def test_all_interfaces_can_be_held_under_an_acceleration(body, families):
    t = np.linspace(0, 10.0, 21)
    load = support_acceleration(body, np.outer([0, 0, 9.81, 0, 0, 0], t / 10), t)
    found = transient(families, load, cutoff=5000.0, held=["left", "right"], damping=0.05).u[:, -1]
    wanted = (
        -9.81
        * families.Psi_H
        @ np.linalg.lstsq(families.Psi_R, rigid_motion_of_dofs(body.nodes, body.dofs)[:, 2], rcond=None)[0]
    )
    assert_allclose(found, wanted, rtol=0, atol=1e-4 * np.abs(wanted).max())


def test_a_motion_in_the_full_space_is_that_of_the_full_model_and_guyan_is_another(body, families, pulse, snapshots):
    every = ModeSet("unit", np.eye(body.n_dof), [f"dof {k}" for k in range(body.n_dof)], np.full(body.n_dof, np.nan))
    full = transient_in(free_basis(body, every, families), pulse).u
    size = np.abs(full).max()
    assert np.abs(snapshots.u - full).max() < 1e-4 * size
    basis = free_basis(body, guyan(body), families)
    condensed = transient_in(basis, pulse)
    assert np.abs(condensed.u - full).max() > 1e-2 * size
    assert deformation_error(body, basis, condensed).largest("K") < 1e-7


def test_more_modes_change_the_reference_little(families, pulse, snapshots):
    other = transient(families, pulse, cutoff=9000.0).u
    assert np.abs(other - snapshots.u).max() < 2e-4 * np.abs(other).max()


# Deformation error ---------------------------------------------------------------------------------------------------


def test_what_lies_in_the_span_has_no_error_and_what_is_orthogonal_has_all(body, families):
    modes = families.free_modes(n_modes=6)
    N = families.free.N
    basis = FreeBasis(modes.Phi[:, :4], modes.omega2[:4], np.ones(4, bool), N)
    t = np.arange(3.0)
    inside = deformation_error(body, basis, Snapshots(modes.Phi[:, [0, 2]], np.array([[1, 2, 3], [0.5, -1, 0]]), t))
    for norm in NORMS:
        assert inside.error[norm].max() < 1e-7
    beyond = deformation_error(body, basis, Snapshots(modes.Phi[:, [4, 5]], np.array([[1, 2, 3], [0.5, -1, 0]]), t))
    for norm in ("M", "K"):
        assert_allclose(beyond.error[norm], beyond.size[norm], rtol=1e-7)
        assert_allclose(beyond.largest(norm), 1.0, rtol=1e-7)


def test_two_modes_mixed_leave_the_share_of_the_missing_one(body, families):
    """u = phi_1 cos t + phi_5 sin t: |rest|² is sin² t in M and lambda_5 sin² t in K."""
    modes = families.free_modes(n_modes=5)
    basis = FreeBasis(modes.Phi[:, :4], modes.omega2[:4], np.ones(4, bool), families.free.N)
    t = np.linspace(0, np.pi / 2, 7)
    found = deformation_error(body, basis, Snapshots(modes.Phi[:, [0, 4]], np.array([np.cos(t), np.sin(t)]), t))
    assert_allclose(found.error["M"], np.sin(t), rtol=0, atol=1e-7)
    lam = modes.omega2[[0, 4]]
    largest = np.sqrt((lam[0] * np.cos(t) ** 2 + lam[1] * np.sin(t) ** 2).max())
    assert_allclose(found.error["K"], np.sqrt(lam[1]) * np.sin(t) / largest, rtol=0, atol=1e-7)


def test_the_error_does_not_depend_on_the_frame_of_the_snapshots(body, families, snapshots):
    basis = free_basis(body, craig_bampton(body, n_modes=3), families)
    plain = deformation_error(body, basis, snapshots)
    rng = np.random.default_rng(4)
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs)
    size = np.abs(snapshots.amplitudes).max()
    moved = Snapshots(
        np.hstack([snapshots.columns, Psi_R]),
        np.vstack([snapshots.amplitudes, size * rng.normal(size=(6, len(snapshots.t)))]),
        snapshots.t,
    )
    found = deformation_error(body, basis, moved)
    for norm in NORMS:
        assert_allclose(found.error[norm], plain.error[norm], rtol=0, atol=1e-6)
        assert_allclose(found.size[norm], plain.size[norm], rtol=0, atol=1e-6)


def test_the_error_of_plain_displacements_is_that_of_their_factors(body, families, snapshots):
    basis = free_basis(body, guyan(body), families)
    few = Snapshots(snapshots.columns, snapshots.amplitudes[:, ::50], snapshots.t[::50])
    factored = deformation_error(body, basis, few)
    plain = deformation_error(body, basis, Snapshots.of_displacements(few.u, few.t))
    for norm in NORMS:
        assert_allclose(plain.error[norm], factored.error[norm], rtol=0, atol=1e-9)


def test_the_error_is_the_distance_of_a_dense_least_squares(body, families, snapshots):
    basis = free_basis(body, craig_bampton(body, n_modes=1), families)
    few = Snapshots(snapshots.columns, snapshots.amplitudes[:, 100::200], snapshots.t[100::200])
    found = deformation_error(body, basis, few)
    for norm, W, rigid in (
        ("M", body.M.toarray(), rigid_motion_of_dofs(body.nodes, body.dofs)),
        ("K", body.K.toarray(), np.zeros((body.n_dof, 0))),
    ):
        values, vectors = la.eigh(W)
        root = np.sqrt(np.maximum(values, 0))[:, None] * vectors.T
        lengths = []
        for X in (np.hstack([rigid, basis.Phi]), rigid):
            rest = root @ few.u - root @ X @ np.linalg.lstsq(root @ X, root @ few.u, rcond=None)[0]
            lengths.append(np.linalg.norm(rest, axis=0))
        assert_allclose(found.error[norm], lengths[0] / lengths[1].max(), rtol=1e-4, atol=1e-6)


def test_richer_sets_have_smaller_errors_in_the_energy_norm(body, families, snapshots):
    largest = [
        deformation_error(body, free_basis(body, craig_bampton(body, n_modes=n), families), snapshots).largest("K")
        for n in (0, 3, 10)
    ]
    assert largest[0] > largest[1] > largest[2]
    relief = MODE_SETS["craig-bampton-ir"](families, n_modes=3)
    assert deformation_error(body, free_basis(body, relief, families), snapshots).largest("K") < largest[1]


@pytest.mark.parametrize("frame", [TisserandFrame(), NodalFrame("left")], ids=str)
def test_a_file_alone_gives_the_nodal_error_of_the_full_model(body, families, snapshots, frame):
    """All nodes of this bar are on its surface, so the file keeps them all."""
    modes = craig_bampton(body, n_modes=2)
    few = Snapshots(snapshots.columns, snapshots.amplitudes[:, ::100], snapshots.t[::100])
    reduced = reduce(body, modes, frame=frame)
    assert len(reduced.nodes) == len(body.nodes)
    u = body.translations(few.u)[reduced.node_ids]
    found = nodal_deformation_error(reduced, u, few.t)
    wanted = deformation_error(body, free_basis(body, modes, families), few)
    assert_allclose(found.error["nodal"], wanted.error["nodal"], rtol=0, atol=1e-8)


def test_the_record_tells_the_largest_error_and_keeps_the_history(body, families, snapshots):
    found = deformation_error(body, free_basis(body, guyan(body), families), snapshots)
    record = deformation_record(found)
    assert record.value == found.largest("K")
    assert_allclose(record.data["error"]["M"], found.error["M"], rtol=0)
    ax = plot_deformation_error({"guyan": found}, "M")
    assert_allclose(ax.get_lines()[1].get_ydata()[1:], found.error["M"][1:], rtol=0)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda b, f: LoadHistory(np.ones((3, 1)), np.array([0.0, 1.0, 3.0]), np.ones((1, 3))), "evenly spaced"),
        (
            lambda b, f: LoadHistory(np.ones((3, 2)), np.array([0.0, 1.0]), np.ones((1, 2))),
            r"p: expected shape \(2, 2\)",
        ),
        (
            lambda b, f: Snapshots(np.ones((3, 2)), np.ones((1, 2)), np.arange(2.0)),
            r"amplitudes: expected shape \(2, n_t\)",
        ),
        (
            lambda b, f: transient(f, LoadHistory(np.ones((3, 1)), np.arange(2.0), np.ones((1, 2))), cutoff=1.0),
            "over 3 dofs",
        ),
        (
            lambda b, f: transient(f, support_acceleration(b, np.ones((6, 2)), np.arange(2.0)), cutoff=1.0),
            "the load does not deform",
        ),
        (
            lambda b, f: deformation_error(
                b,
                free_basis(b, guyan(b), f),
                Snapshots(rigid_motion_of_dofs(b.nodes, b.dofs), np.ones((6, 2)), np.arange(2.0)),
            ),
            "does not deform the body",
        ),
    ],
)
def test_bad_motions_are_refused_in_one_message(body, families, call, words):
    with pytest.raises(QualityError, match=words):
        call(body, families)


def test_loads_at_the_same_times_add(body, pulse):
    both = pulse + support_acceleration(body, np.zeros((6, len(pulse.t))), pulse.t)
    assert both.F.shape[1] == 12
    with pytest.raises(QualityError, match="different times"):
        pulse + replace(pulse, t=2 * pulse.t)
