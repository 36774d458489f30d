"""A superelement of plain matrices becomes the body that the same modes give with the full model in hand."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import cms
import fe_models
from cms.errors import BodyError, ForeignBodyError
from cms.exchange.importers.inertia import FullMass, MeshMass, NodalMasses
from cms.exchange.importers.superelement import RecoveryRows, Superelement
from cms.exchange.importers.superelement_body import (
    ImportOptions,
    body_of_superelement,
    fe_body_of_superelement,
    known_moments,
)
from cms.reduction.basis.finishing import finish
from cms.reduction.basis.frames import frame_condition
from fe_models.body.loads import interface_load
from fe_models.foundation.units import unit_system
from floatframe.model.bodies.mode_choice import with_modes
from tests.bodies import STEEL, bar, box_mesh
from tests.superelements import FIRST, craig_bampton_matrices

SI = unit_system("m-kg-s")
N_MODES = 5


@pytest.fixture(scope="module")
def mesh():
    return box_mesh(4, 1, 1, 0.8, 0.06, 0.05, "hexahedron20")


@pytest.fixture(scope="module")
def full():
    part = bar(nx=4, length=0.8, width=0.06, height=0.05)
    part = part.with_load_cases(interface_load(part, "pull", "right", force=(3.0, -1.0, 2.0)))
    return cms.couple(part)


@pytest.fixture(scope="module")
def element(full):
    return craig_bampton_matrices(full, N_MODES)[0]


@pytest.fixture(scope="module")
def own(full):
    return cms.reduce(full, cms.craig_bampton(full, n_modes=N_MODES), geometric=False, stress=False)


def options(**more):
    return ImportOptions(units=SI, **more)


def names_of(full):
    return {i.name: [FIRST + int(full.dofs[i.dofs[0], 0])] for i in full.interfaces}


def mesh_mass(full, mesh):
    uncoupled = bar(nx=4, length=0.8, width=0.06, height=0.05)
    dofs = uncoupled.dofs + np.array([FIRST, 0])
    return FullMass(uncoupled.M, dofs, {FIRST + k: place for k, place in enumerate(uncoupled.nodes)})


def test_it_is_the_body_that_the_full_model_gives_but_for_the_inertia_that_matrices_do_not_say(full, element, own):
    body = body_of_superelement(element, options(interfaces=names_of(full)))
    assert body.moments.missing == ("3C", "4C", "5C")
    assert_allclose(np.diag(body.K), np.diag(own.K), rtol=1e-9)
    assert_allclose(body.free_frequencies, own.free_frequencies, rtol=1e-9)
    for name in ("m", "S", "R", "J0"):
        expected = getattr(own.moments, name)
        assert_allclose(getattr(body.moments, name), expected, rtol=0, atol=1e-9 * np.abs(own.moments.R).max() + 1e-9)
    assert_allclose(body.moments.M, np.eye(body.n_q), rtol=0, atol=1e-12)
    flip = np.sign(np.einsum("nak,nak->k", body.Phi[own.node_ids], own.Phi))
    assert_allclose(body.Phi[own.node_ids] * flip, own.Phi, rtol=0, atol=1e-6 * np.abs(own.Phi).max())
    for name in ("left", "right"):
        expected = own.interface(name)
        found = body.interface(name)
        assert_allclose(found.Psi * flip, expected.Psi, rtol=0, atol=1e-6 * np.abs(expected.Psi).max())
        assert_allclose(found.position, expected.position, rtol=0, atol=1e-12)
    load = body.load_case("pull")
    assert_allclose(load.h * flip, own.load_case("pull").h, rtol=0, atol=1e-6 * np.abs(load.h).max())
    assert_allclose(load.force, [3.0, -1.0, 2.0], rtol=0, atol=1e-9)
    records = {record.name: record.verdict for record in cms.check_body(body)}
    assert records.pop("inertia-terms") == "warn"
    assert "fail" not in records.values(), records


@pytest.mark.parametrize("kind", ["full mass", "mesh"])
def test_inertia_that_is_given_beside_completes_it_exactly(full, element, own, mesh, kind):
    numbered = replace(mesh, node_numbers=FIRST + np.arange(len(mesh.nodes)))
    beside = mesh_mass(full, mesh) if kind == "full mass" else MeshMass(numbered, STEEL.rho)
    body = body_of_superelement(element, options(interfaces=names_of(full), inertia=beside))
    assert body.moments.missing == ()
    assert body.moments.is_exact
    flip = np.sign(np.einsum("nak,nak->k", body.Phi[own.node_ids], own.Phi))
    signs = flip[:, None] * flip
    assert_allclose(body.moments.P * flip, own.moments.P, rtol=0, atol=1e-6 * np.abs(own.moments.P).max())
    assert_allclose(body.moments.S_kl * signs, own.moments.S_kl, rtol=0, atol=1e-6)
    assert_allclose(body.moments.C5 * signs[:, :, None, None], own.moments.C5, rtol=0, atol=1e-6)


@pytest.fixture(scope="module")
def lumped():
    """A body of point masses: consistent stiffness, diagonal mass, interfaces of nodes."""
    part = bar(nx=4, length=0.8, width=0.06, height=0.05)
    diagonal = part.M.diagonal()[::3]
    mass = diagonal * 7850.0 * 0.8 * 0.06 * 0.05 / diagonal.sum()
    ends = [replace(i, kind="nodes") for i in part.interfaces]
    return cms.couple(
        fe_models.files.body_from_matrices(
            sp.diags_array(np.repeat(mass, 3)), part.K, part.nodes, part.dofs, name="lumped", units=SI, interfaces=ends
        )
    )


def masses_of(lumped):
    return NodalMasses(FIRST + np.arange(len(lumped.nodes)), lumped.M.diagonal()[::3])


def test_nodal_masses_complete_it_exactly_where_they_are_the_mass(lumped):
    element, _ = craig_bampton_matrices(lumped, N_MODES)
    own = cms.reduce(lumped, cms.craig_bampton(lumped, n_modes=N_MODES))
    body = body_of_superelement(element, options(inertia=masses_of(lumped)))
    assert body.moments.missing == ()
    flip = np.sign(np.einsum("nak,nak->k", body.Phi[own.node_ids], own.Phi))
    for name in ("J0", "R"):
        expected = getattr(own.moments, name)
        assert_allclose(getattr(body.moments, name), expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    is_single = np.diff(np.r_[0, own.frequencies]) > 1e-4 * own.frequencies  # a twin has no shape of its own
    flip = flip[is_single]
    found, expected = body.moments.P[:, :, is_single] * flip, own.moments.P[:, :, is_single]
    assert_allclose(found, expected, rtol=0, atol=1e-5 * np.abs(expected).max())
    C5 = body.moments.C5[np.ix_(is_single, is_single)] * (flip[:, None] * flip)[:, :, None, None]
    assert_allclose(C5, own.moments.C5[np.ix_(is_single, is_single)], rtol=0, atol=1e-5)
    assert f"3C, 4C, 5C by {len(lumped.nodes)} nodal masses, which differ" in body.provenance["inertia"]


def test_nodal_masses_of_another_body_are_refused(lumped):
    element, _ = craig_bampton_matrices(lumped, 2)
    masses = masses_of(lumped)
    with pytest.raises(ForeignBodyError, match="do not belong to this body: mass differs by 100 %"):
        body_of_superelement(element, options(inertia=NodalMasses(masses.node_numbers, 2 * masses.masses)))
    with pytest.raises(ForeignBodyError, match=r"nodes \[7\] are not among"):
        body_of_superelement(element, options(inertia=NodalMasses(np.array([7]), np.array([1.0]))))
    with pytest.raises(ForeignBodyError, match="a mass above zero in each row"):
        body_of_superelement(element, options(inertia=NodalMasses(np.array([FIRST]), np.array([-1.0]))))
    few = replace(element, recovery=None)
    with pytest.raises(ForeignBodyError, match="have mass, but the files have no recovery rows"):
        body_of_superelement(few, options(inertia=masses))


def test_a_spinning_body_with_nodal_masses_conserves_energy_and_momenta(lumped):
    """The largest defect falls with the square of the step or faster, as the integrator promises."""
    from floatframe import GeneralizedAlpha, System, integrate
    from floatframe.model.bodies.flexible_body import FlexibleBody
    from tests.floatframe.orders import slope

    element, _ = craig_bampton_matrices(lumped, 2)
    body = body_of_superelement(element, options(inertia=masses_of(lumped)))
    body = with_modes(body, [0, 1, 2, 3])
    period = 1 / body.frequencies[0]
    q = 0.01 / np.abs(body.Phi[:, :, :4]).max() * np.array([1.0, -0.6, 0.4, 0.2])
    spin = (30.0, 200.0, -120.0)
    system = System([FlexibleBody("part", body, velocity=(1.0, 2.0, -1.0), omega_B=spin, q=q)])
    steps = period / np.array([40, 80, 160])
    motions = [integrate(system, GeneralizedAlpha(0.9, 1e-11), 4 * period, h, output_every=4) for h in steps]
    for of in (lambda m: m.energies.total[:, None], lambda m: m.angular_momentum, lambda m: m.linear_momentum):
        errors = [np.abs(of(m) - of(m)[0]).max() / np.abs(of(m)).max() for m in motions]
        assert errors[-1] < 1e-10 or (errors[-1] < 1e-5 and slope(steps, errors) > 1.85), errors


def test_modal_coordinates_of_any_kind_are_the_same_body(element, own):
    """x = T x' with modal coordinates that carry the boundary with them: stiffness couples the two."""
    rng = np.random.default_rng(4)
    n, q = len(element.dofs), np.flatnonzero(element.is_modal)
    T = np.eye(n)
    T[np.ix_(q, np.flatnonzero(~element.is_modal))] = 1e-2 * rng.normal(size=(len(q), n - len(q)))
    T[np.ix_(q, q)] += 0.3 * rng.normal(size=(len(q), len(q)))
    mixed = replace(
        element,
        K=T.T @ element.K @ T,
        M=T.T @ element.M @ T,
        recovery=RecoveryRows(element.recovery.dofs, element.recovery.matrix @ T),
        loads={name: T.T @ load for name, load in element.loads.items()},
    )
    body = body_of_superelement(mixed, options())
    assert_allclose(body.free_frequencies, own.free_frequencies, rtol=1e-7)
    assert_allclose(np.abs(body.load_case("pull").h), np.abs(own.load_case("pull").h), rtol=0, atol=1e-5)


def assembled_frequencies(first, second, shared):
    """Free frequencies of two superelements whose boundary dofs `shared` (rows of each) move together."""
    n = len(first.dofs)
    T = np.zeros((n + len(second.dofs), n + len(second.dofs) - len(shared[0])))
    T[:n, :n] = np.eye(n)
    own = np.setdiff1d(np.arange(len(second.dofs)), shared[1])
    T[n + own, n + np.arange(len(own))] = 1.0
    T[n + shared[1], shared[0]] = 1.0
    K = T.T @ la.block_diag(first.K, second.K) @ T
    M = T.T @ la.block_diag(first.M, second.M) @ T
    return np.sqrt(np.maximum(la.eigvalsh(K, M)[6:], 0)) / (2 * np.pi)


def test_joined_by_their_interfaces_they_have_the_frequencies_of_the_assembled_model_and_bound_those_of_the_whole(full):
    from floatframe import FixedJoint, Marker, System, linearize, system_modes
    from floatframe.model.bodies.flexible_body import FlexibleBody

    shift = np.array([0.8, 0.0, 0.0])
    first, _ = craig_bampton_matrices(full, 4, "first")
    second = replace(first, name="second", nodes=np.asarray(first.nodes) + shift)
    bodies = [body_of_superelement(part, options(interfaces=names_of(full))) for part in (first, second)]
    system = System(
        [FlexibleBody(body.name, body, leave_out_missing=True) for body in bodies],
        [FixedJoint("weld", Marker("first", "right"), Marker("second", "left"))],
    )
    found = system_modes(linearize(system)).frequencies
    found = np.sort(found[found > 1.0])
    rows = {name: np.flatnonzero(first.dofs[:, 0] == number[0]) for name, number in names_of(full).items()}
    expected = assembled_frequencies(first, second, (rows["right"], rows["left"]))
    assert_allclose(found[:12], expected[:12], rtol=1e-6)
    whole = cms.couple(bar(nx=8, length=1.6, width=0.06, height=0.05))
    exact = np.sqrt(np.sort(sp.linalg.eigsh(whole.K, 18, whole.M, sigma=-1e4)[0])[6:]) / (2 * np.pi)
    assert (found[:8] > exact[:8] * (1 - 1e-9)).all()
    assert_allclose(found[:4], exact[:4], rtol=0.02)


def spoilt(element, **changes):
    return replace(element, **changes)


def test_what_does_not_fit_is_told(element):
    K = np.array(element.K)
    with pytest.raises(ForeignBodyError, match="one triangle is zero: only half of a symmetric matrix was written"):
        spoilt(element, K=np.triu(K))
    with pytest.raises(ForeignBodyError, match=r"K: expected \(\d+, \d+\), as many rows as dofs, got"):
        spoilt(element, K=K[:5, :5])
    bad = K.copy()
    bad[2, 2] = np.nan
    with pytest.raises(ForeignBodyError, match="expected finite numbers, got 1 that are not"):
        spoilt(element, K=bad)
    with pytest.raises(ForeignBodyError, match="have dofs but no position"):
        spoilt(element, node_numbers=element.node_numbers[5:], nodes=element.nodes[5:])
    twice = np.array(element.dofs)
    twice[1] = twice[0]
    with pytest.raises(ForeignBodyError, match="has two rows for one dof"):
        spoilt(element, dofs=twice)
    with pytest.raises(ForeignBodyError, match="recovery: expected finite rows over"):
        spoilt(element, recovery=RecoveryRows(element.recovery.dofs, element.recovery.matrix[:, :4]))
    with pytest.raises(ForeignBodyError, match=r"load 'a': expected \d+ finite forces"):
        spoilt(element, loads={"a": np.ones(3)})


def test_the_gates_of_bare_matrices_stand_before_it(element):
    held = np.array(element.K)
    held[0, 0] *= 1.5
    with pytest.raises(BodyError, match="not the matrices of a free body"):
        body_of_superelement(spoilt(element, K=held), options())
    M = np.array(element.M)
    M[-1, -1] = -1.0
    with pytest.raises(BodyError, match="M is indefinite"):
        body_of_superelement(spoilt(element, M=M), options())
    matrix = np.array(element.recovery.matrix)
    matrix[[0, 1]] = matrix[[1, 0]]
    with pytest.raises(ForeignBodyError, match="misses a rigid motion of the boundary"):
        body_of_superelement(spoilt(element, recovery=RecoveryRows(element.recovery.dofs, matrix)), options())
    in_mm = replace(options(), units=unit_system("mm-t-s"))
    with pytest.raises(BodyError, match="mm"):
        body_of_superelement(element, in_mm)


def test_rotations_that_solid_elements_do_not_have_are_no_rows_of_the_recovery(element, own):
    """As Nastran writes them: six rows a node, the rotations zero."""
    numbers = np.unique(element.recovery.dofs[:, 0])
    turns = np.stack([np.repeat(numbers, 3), np.tile([3, 4, 5], len(numbers))], axis=1)
    dofs = np.concatenate([element.recovery.dofs, turns])
    matrix = np.concatenate([element.recovery.matrix, np.zeros((len(turns), len(element.dofs)))])
    body = body_of_superelement(spoilt(element, recovery=RecoveryRows(dofs, matrix)), options())
    assert_allclose(body.free_frequencies, own.free_frequencies, rtol=1e-9)
    matrix[-1, 0] = 1.0
    with pytest.raises(ForeignBodyError, match="misses a rigid motion of the boundary"):
        body_of_superelement(spoilt(element, recovery=RecoveryRows(dofs, matrix)), options())


def test_slightly_negative_mass_is_mended_when_asked(element, own):
    M = np.array(element.M)
    values, vectors = la.eigh(M)
    M += np.outer(vectors[:, 0], vectors[:, 0]) * (-values[0] - 1e-7 * values[-1])
    with pytest.raises(BodyError, match="repair_mass"):
        body_of_superelement(spoilt(element, M=M), options())
    body = body_of_superelement(spoilt(element, M=M), options(repair_mass=True))
    assert "mass mended" in body.provenance
    assert_allclose(body.free_frequencies[:3], own.free_frequencies[:3], rtol=1e-3)


def test_interfaces_are_boundary_nodes_each_in_one(full, element):
    body = body_of_superelement(element, options())
    assert [i.name for i in body.interfaces] == [f"node {n[0]}" for n in names_of(full).values()]
    for wanted, words in (
        ({"a": [FIRST]}, "is no boundary node"),
        ({"a": []}, "expected node numbers, got none"),
        ({"a": names_of(full)["left"], "b": names_of(full)["left"]}, "is in another interface or twice"),
    ):
        with pytest.raises(ForeignBodyError, match=words):
            body_of_superelement(element, options(interfaces=wanted))


def test_a_boundary_of_translations_is_one_interface_of_its_nodes():
    part = bar(nx=3)
    part = replace(part, interfaces=tuple(replace(i, kind="nodes") for i in part.interfaces))
    coupled = cms.couple(part)
    element, _ = craig_bampton_matrices(coupled, 3)
    body = body_of_superelement(element, options())
    assert [(i.name, i.kind, len(i.members)) for i in body.interfaces] == [("boundary", "nodes", 16)]
    own = cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=3), geometric=False)
    assert_allclose(body.free_frequencies, own.free_frequencies, rtol=1e-8)


def test_more_rows_than_a_reduced_body_has_are_refused_before_they_take_memory():
    n = 20_001
    with pytest.raises(ForeignBodyError, match="expected a reduced body of at most 20000 rows"):
        Superelement("a", np.eye(2), np.eye(2), np.zeros((n, 2), int), np.arange(2), np.zeros((2, 3)))


def test_moments_of_a_mass_matrix_are_the_integrals_of_its_elements():
    """m, S, R, 1C and 2C of a bent bar off its origin in a turned frame, beside those that its elements integrate."""
    body = cms.couple(bar(nx=3, kind="hexahedron"))
    turn = Rotation.from_rotvec([0.4, -0.7, 0.9]).as_matrix()
    frame, modes = cms.NodalFrame("left", axes=tuple(map(tuple, turn.T))), cms.craig_bampton(body, n_modes=3)
    reduced = cms.reduce(body, modes, frame=frame)
    shapes = finish(body, modes, frame_condition(body, frame)).Phi
    found, expected = known_moments(body, shapes, reduced.M, reduced.frame), reduced.moments
    assert np.abs(expected.S).min() > 1e-3 * np.abs(expected.S).max()
    for name in ("m", "S", "R", "C1", "C2"):
        own = np.asarray(getattr(expected, name))
        assert_allclose(getattr(found, name), own, rtol=0, atol=1e-9 * np.abs(own).max(), err_msg=name)


def test_damping_is_carried_to_the_coordinates_in_which_static_parts_are_taken_out(element):
    """D = 0.3 M + 1e-5 K of the matrices is 0.3 M + 1e-5 K of the body."""
    damped = replace(element, D=0.3 * element.M + 1e-5 * element.K)
    body = fe_body_of_superelement(damped, options())
    assert body.D is not None
    expected = (0.3 * body.M + 1e-5 * body.K).toarray()
    assert_allclose(body.D.toarray(), expected, rtol=0, atol=1e-10 * np.abs(expected).max())
