import inspect
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from numpy.testing import assert_allclose

from cms.errors import BodyError, ModeSetError
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.modes.families.families import Families
from cms.modes.families.interface_loads import InterfaceLoad, boundary_load, condensed_load, point_load
from cms.modes.mode_sets import (
    attachment,
    benfield_hruda,
    craig_bampton,
    craig_bampton_ir,
    craig_chang,
    dual_craig_bampton,
    guyan,
    herting,
    macneal,
    normal_modes,
    rubin,
    unrestrained_attachment,
)
from cms.reduction.basis.finishing import finish
from cms.reduction.basis.frames import NodalFrame, TisserandFrame, frame_condition
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import FEBody, Interface
from tests.bodies import bar, beam, with_interfaces
from tests.cms.modes.families.examples import BODIES, constrained_spectrum, three_interface_solid

LOADS = {"left": {"mass": 1.0, "inertia": 0.01}, "right": {"stiffness": (1e6, 5e5, 2e6), "rotational_stiffness": 1e3}}
CLASSICAL = {
    "craig-bampton": craig_bampton,
    "craig-bampton-ir": craig_bampton_ir,
    "herting": herting,
    "benfield-hruda": benfield_hruda,
    "rubin": rubin,
    "macneal": macneal,
    "craig-chang": craig_chang,
    "dual-craig-bampton": dual_craig_bampton,
    "attachment": attachment,
    "unrestrained-attachment": unrestrained_attachment,
    "normal": normal_modes,
}
STATICALLY_COMPLETE = (craig_bampton_ir, herting, rubin, craig_chang, unrestrained_attachment)


def options_of(make, body):
    if make is not benfield_hruda:
        return {}
    names = [interface.name for interface in body.interfaces]
    return {"loads": [point_load(names[0], mass=1.0, inertia=0.01), point_load(names[-1], stiffness=1e6)]}


@pytest.fixture(scope="module")
def body():
    return couple(bar(nx=6, kind="hexahedron"))


@pytest.fixture(scope="module")
def families(body):
    with Families(body) as families:
        yield families


@pytest.fixture(scope="module")
def full(body):
    return np.sqrt(constrained_spectrum(body, np.zeros(0, int))[6:]) / (2 * np.pi)


@pytest.mark.parametrize("make", CLASSICAL.values(), ids=CLASSICAL)
def test_frequencies_bound_the_full_ones_and_fall_as_modes_are_added(body, families, full, make):
    before = np.full(5, np.inf)
    for n_modes in (2, 5, 12):
        modes = make(families, n_modes=n_modes, **options_of(make, body))
        free = reduce(body, modes).free_frequencies[:5]
        n = len(free)
        assert (free >= full[:n] * (1 - 1e-9)).all()
        assert (free <= before[:n] * (1 + 1e-9)).all()
        before[:n] = free
    assert_allclose(before[:4], full[:4], rtol=1e-2)


@pytest.mark.parametrize("make", [rubin, craig_chang, herting, unrestrained_attachment, normal_modes])
def test_sets_of_free_modes_keep_them_exactly(body, families, full, make):
    free = reduce(body, make(families, n_modes=4)).free_frequencies
    assert_allclose(free[:4], full[:4], rtol=1e-8)


def static_errors(families, modes):
    """Errors of static responses in the span, of their largest, and the condition of the reduced stiffness.

    Interface loads: a unit force on each boundary dof of the free body, in balance with the acceleration it causes;
    displacement of all boundary dofs, rigid-body motion apart. Inertia loads: rigid-body accelerations of the body with
    all interfaces held; their work.
    """
    body, b = families.body, families.body.b
    free = finish(body, modes, frame_condition(body, TisserandFrame()))
    exact = families.Psi_U[b]
    compliance = (free.Phi[b] / np.diag(free.K)) @ free.Phi[b].T
    interface_error = np.abs(compliance - exact).max() / np.abs(exact).max()
    held = finish(body, modes, frame_condition(body, NodalFrame()))
    Z = la.null_space(held.Phi[b] / np.abs(held.Phi[b]).max())
    load = (held.Phi @ Z).T @ (body.M @ families.Psi_R)
    work = load.T @ np.linalg.solve(Z.T @ held.K @ Z, load)
    exact = families.Psi_R.T @ (body.M @ families.Psi_H)
    size = np.sqrt(np.diag(exact))
    inertia_error = np.abs((work - exact) / np.outer(size, size)).max()
    return interface_error, inertia_error, np.linalg.cond(free.K)


@pytest.mark.parametrize("make", STATICALLY_COMPLETE)
@pytest.mark.parametrize("name", ["beam", "three interfaces", "random pencil"])
def test_statically_complete_sets_are_exact_under_interface_and_inertia_loads(make, name):
    with Families(BODIES[name]()) as families:
        *errors, condition = static_errors(families, make(families, n_modes=3))
        assert max(errors) < max(1e-9, 1e3 * np.finfo(float).eps * condition)
        lacking = static_errors(families, craig_bampton(families, n_modes=3))
        assert min(lacking[:2]) > 1e-5


def span_angle(body, left, right):
    """Sine of the largest angle between two spans in W = K + omega_1² M."""
    K, M = body.K.toarray(), body.M.toarray()
    W = K + constrained_spectrum(body, np.zeros(0, int))[6] * M
    spans = []
    for modes in (left, right):
        X = modes.columns / np.sqrt(np.einsum("nk,nk->k", modes.columns, W @ modes.columns))
        values, vectors = la.eigh(X.T @ W @ X)
        kept = values > 1e-12 * values[-1]
        spans.append(X @ (vectors[:, kept] / np.sqrt(values[kept])))
    A, B = spans
    assert A.shape == B.shape
    rest = A - B @ (B.T @ W @ A)
    return np.sqrt(np.maximum(la.eigvalsh(rest.T @ W @ rest)[-1], 0))


@pytest.mark.parametrize("other", [craig_chang, unrestrained_attachment, macneal, dual_craig_bampton])
@pytest.mark.parametrize("n_modes", [0, 4])
def test_rubin_spans_craig_chang_and_the_other_free_interface_sets(body, families, other, n_modes):
    left, right = (make(families, n_modes=n_modes) for make in (rubin, other))
    assert span_angle(body, left, right) < 1e-6
    herting_too = herting(families, n_modes=n_modes)
    assert herting_too.columns.shape == left.columns.shape
    assert span_angle(body, left, herting_too) < 1e-6  # [Psi_C Psi_H] = [Psi_R Psi_U]
    if n_modes:
        assert span_angle(body, left, craig_bampton_ir(families, n_modes=n_modes)) > 1e-2


def test_craig_chang_has_the_boundary_displacements_as_coordinates(body, families):
    modes = craig_chang(families, n_modes=4)
    on_boundary = modes.columns[body.b]
    assert_allclose(on_boundary[:, :12], np.eye(12), rtol=0, atol=1e-7)
    scale = np.abs(modes.columns[:, 12:]).max(axis=0)
    assert_allclose(on_boundary[:, 12:] / scale, 0, rtol=0, atol=1e-6)


def test_inertia_relief_is_not_lost_on_top_of_20_fixed_modes(body, families):
    """Columns of 22 dimensions in nearly the same span: none is redundant, gravity is exact in a clamped body."""
    modes = craig_bampton_ir(families, n_modes=20)
    reduced = reduce(body, modes, frame=NodalFrame("left"))
    assert reduced.n_q == 12 + 6 + 20 - 6
    assert reduced.provenance["mode set redundant"] == "none"
    held = np.setdiff1d(np.arange(body.n_dof), body.interface("left").dofs)
    load = body.M @ np.where(body.dofs[:, 1] == 1, 1.0, 0.0)
    u = np.zeros(body.n_dof)
    u[held] = la.solve(body.K.toarray()[np.ix_(held, held)], load[held], assume_a="pos")
    expected = u[body.interface("right").dofs]
    right = reduced.interface("right")
    q = np.linalg.solve(reduced.K, reduced.moments.C1[1])
    assert_allclose(right.Psi @ q, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    without = reduce(body, craig_bampton(families, n_modes=20), frame=NodalFrame("left"))
    strain_energy = reduced.moments.C1[1] @ q
    lacking = without.moments.C1[1] @ np.linalg.solve(without.K, without.moments.C1[1])
    assert_allclose(strain_energy, load @ u, rtol=1e-9)
    assert 3e-9 < 1 - lacking / strain_energy < 1e-2


def test_more_columns_than_the_body_has_dofs_are_dropped_by_label_and_change_nothing():
    body = couple(beam(3))
    with Families(body) as families:
        modes = craig_bampton_ir(families, n_modes=11)
    V = modes.columns
    assert V.shape[1] == 12 + 6 + 11 > body.n_dof
    K, M = body.K.toarray(), body.M.toarray()
    W = K + constrained_spectrum(body, np.zeros(0, int))[6] * M
    U, lengths, _ = la.svd(la.cholesky(W) @ (V / np.sqrt(np.einsum("nk,nk->k", V, W @ V))))
    rank = int((lengths > 1e-10).sum())
    reduced = reduce(body, modes)
    dropped = reduced.provenance["mode set redundant"].split("; ")
    assert len(dropped) == 29 - rank > 0
    assert set(dropped) <= set(modes.labels)
    basis = la.solve(la.cholesky(W), U[:, :rank])
    omega2 = la.eigh(basis.T @ K @ basis, basis.T @ M @ basis, eigvals_only=True)[6:]
    assert_allclose((2 * np.pi * reduced.free_frequencies) ** 2, omega2, rtol=1e-7)


def test_a_single_mass_lowers_the_rank_of_inertia_relief():
    """All mass in one interior node without rotary inertia: accelerations load it in three directions, not six."""
    body = couple(beam(4))
    M = np.zeros(body.n_dof)
    M[(body.dofs[:, 0] == 2) & (body.dofs[:, 1] < 3)] = 2.0
    M[(body.dofs[:, 0] != 2) & (body.dofs[:, 1] < 3)] = 0.0
    body = replace(body, M=sp.diags_array(M + 0.0))
    with Families(body) as families:
        modes = craig_bampton_ir(families, n_modes=0)
    half = la.cholesky(body.K + np.eye(body.n_dof) * 1e-3 * body.K.diagonal().mean())
    size = np.linalg.norm(half @ modes.columns, axis=0)
    lengths = la.svdvals(half @ (modes.columns[:, 12:] / np.where(size[12:] > 0, size[12:], 1.0)))
    assert (lengths > 1e-8 * lengths[0]).sum() == 3


@pytest.mark.parametrize("frame", [TisserandFrame(), NodalFrame("left")], ids=str)
def test_every_set_passes_the_finishing_step_of_a_solid_with_three_interfaces(frame):
    body = three_interface_solid()
    full = np.sqrt(constrained_spectrum(body, np.zeros(0, int))[6:9]) / (2 * np.pi)
    with Families(body) as families:
        for make in CLASSICAL.values():
            modes = make(families, n_modes=6, **options_of(make, body))
            assert len(modes.labels) == len(set(modes.labels))
            reduced = reduce(body, modes, frame=frame)
            assert_allclose(reduced.free_frequencies[:3], full, rtol=5e-2)


def test_modes_of_the_attachment_set_hold_the_determinate_dofs_alone(body, families):
    modes = attachment(families, n_modes=3)
    expected = constrained_spectrum(body, families.r)[:3]
    assert_allclose((2 * np.pi * modes.frequencies[-3:]) ** 2, expected, rtol=1e-8)
    assert_allclose(modes.columns[families.r, 6:], 0, rtol=0, atol=0)
    assert modes.options["held"].count(",") == 5


def test_loaded_modes_are_near_those_of_the_loaded_body(body, families):
    """With the loads on it the reduced body has their exact frequencies, where as many fixed modes miss them."""
    loads = [point_load(name, **load) for name, load in LOADS.items()]
    K_load, M_load = boundary_load(body, loads)
    expected = constrained_spectrum(body, np.zeros(0, int), K_load, M_load)
    loaded = benfield_hruda(families, n_modes=6, loads=loads)
    # soft springs: the dense road knows omega² = 159 to 1e-5 only, beside 1e11 at its upper end
    assert_allclose((2 * np.pi * loaded.frequencies[12:]) ** 2, expected[:6], rtol=1e-6)
    errors = {}
    for make in (benfield_hruda, craig_bampton):
        options = {"loads": loads} if make is benfield_hruda else {}
        V = make(families, n_modes=6, **options).columns
        K = V.T @ body.K.toarray() @ V + V[body.b].T @ K_load @ V[body.b]
        M = V.T @ body.M.toarray() @ V + V[body.b].T @ M_load @ V[body.b]
        errors[make] = np.abs(la.eigh(K, M, eigvals_only=True)[:6] / expected[:6] - 1).max()
    roundoff = 10 * np.finfo(float).eps * expected[-1] / expected[0]  # of the dense road, as above
    assert errors[benfield_hruda] < roundoff
    assert errors[craig_bampton] > 1e-5


def test_a_load_in_a_turned_triad_is_the_same_load():
    """Springs along the interface's axes equal the matrix turned into mesh axes."""
    body = bar(nx=4, kind="hexahedron")
    left, right = body.interfaces
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # columns y, z, x
    turned = couple(with_interfaces(body, left, replace(right, triad=turn)))
    K, _ = boundary_load(turned, [point_load("right", stiffness=(3.0, 5.0, 7.0), rotational_stiffness=(1.0, 2.0, 4.0))])
    assert_allclose(np.diag(K), [0] * 6 + [7, 3, 5, 4, 1, 2], rtol=0, atol=1e-14)


def test_a_mass_on_the_nodes_of_an_interface_moves_with_their_mean():
    """Rigid-body motion of the body: kinetic energy of the point mass by its 6 x 6 matrix, about the reference."""
    body = bar(nx=3, kind="hexahedron")
    left, right = body.interfaces
    coupled = couple(with_interfaces(body, left, replace(right, kind="nodes")))
    _, M = boundary_load(coupled, [point_load("right", mass=3.0, inertia=(1.0, 2.0, 4.0))])
    from fe_models.body.rigid_motion import rigid_motion_of_dofs

    R = rigid_motion_of_dofs(coupled.nodes, coupled.dofs, np.asarray(right.reference))[coupled.b]
    assert_allclose(R.T @ M @ R, np.diag([3.0, 3, 3, 1, 2, 4]), rtol=0, atol=1e-12)


def test_a_condensed_neighbour_loads_as_its_guyan_matrices_do(body):
    """The neighbour of one interface is a rigid mass there; of two, its condensed stiffness holds no rigid motion."""
    neighbour = couple(bar(nx=5, kind="hexahedron"))
    one = condensed_load(neighbour, {"right": "left"})
    assert_allclose(one.K, 0, rtol=0, atol=1e-6 * np.abs(neighbour.K).max())
    mass = 7850 * 0.05 * 0.04
    assert_allclose(np.diag(one.M)[:3], mass, rtol=1e-9)
    assert_allclose(np.diag(one.M)[4:5], mass * (1 / 3 + 0.04**2 / 12), rtol=1e-9)
    two = condensed_load(neighbour, {"left": "left", "right": "right"})
    Psi_C = guyan(neighbour).columns
    assert_allclose(two.K, Psi_C.T @ (neighbour.K @ Psi_C), rtol=0, atol=1e-9 * np.abs(two.K).max())
    assert_allclose(two.M, Psi_C.T @ (neighbour.M @ Psi_C), rtol=0, atol=1e-9 * np.abs(two.M).max())
    assert benfield_hruda(body, n_modes=2, loads=[two]).options["loaded interfaces"] == "left, right"


@pytest.mark.parametrize(("change", "message"), [
    (lambda: point_load("left", mass=-1.0), "expected no negative mass, inertia or stiffness, got -1"),
    (lambda: point_load("left", stiffness=np.nan), "expected finite numbers"),
    (lambda: InterfaceLoad(("left",), np.eye(5), np.eye(6)), r"expected shape \(6, 6\), got \(5, 5\)"),
    (lambda: InterfaceLoad(("left",), np.triu(np.ones((6, 6))), np.eye(6)), "expected a symmetric matrix"),
    (lambda: InterfaceLoad(("left",), np.ones((6, 6)) - 0.5 * np.eye(6), np.eye(6)), "positive semidefinite"),
    (lambda: InterfaceLoad(("a", "a"), np.eye(12), np.eye(12)), "names of interfaces, each once"),
])  # fmt: skip
def test_a_load_that_is_no_mass_or_stiffness_is_refused(change, message):
    with pytest.raises(BodyError, match=message):
        change()


def test_loads_at_an_unknown_interface_and_loaded_modes_without_loads_are_refused(body):
    with pytest.raises(BodyError, match="no interface 'lefft'; did you mean 'left'"):
        benfield_hruda(body, n_modes=2, loads=[point_load("lefft", mass=1.0)])
    with pytest.raises(ModeSetError, match=r"expected loads.*\(left, right\), got none"):
        benfield_hruda(body, n_modes=2)
    with pytest.raises(ModeSetError, match="need the mass or stiffness of the neighbours on at least one"):
        benfield_hruda(body, n_modes=2, loads=[point_load("left")])
    plain = bar(nx=3, kind="hexahedron")
    nodes = couple(with_interfaces(plain, replace(plain.interfaces[0], kind="nodes")))
    with pytest.raises(BodyError, match="has no reference node with six dofs"):
        condensed_load(nodes, {"left": "left"})


def test_mixed_interface_modes_leave_a_bearing_free_and_describe_it_better(families):
    """A pin that turns freely about y: its pinned frequencies from the reduced body, 3 mixed against 3 fixed modes."""
    body = families.body
    turning = body.interface("right").dofs[[4]]
    held = np.setdiff1d(body.b, turning)
    expected = constrained_spectrum(body, held)[:3]
    mixed = craig_bampton(families, n_modes=3, free={"right": ["ry"]})
    assert_allclose((2 * np.pi * mixed.frequencies[12:]) ** 2, expected, rtol=1e-8)
    assert_allclose(mixed.columns[np.ix_(body.b, range(12, 15))], 0, rtol=0, atol=1e-9)
    assert mixed.options["free"] == "right ry"
    assert mixed.labels[12] == "mixed-interface 1"
    errors = []
    for modes in (mixed, craig_bampton(families, n_modes=3)):
        V = modes.columns[:, np.r_[10, 12:15]]  # the constraint mode of the turning dof beside the vibration modes
        omega2 = la.eigh(V.T @ body.K.toarray() @ V, V.T @ body.M.toarray() @ V, eigvals_only=True)
        errors.append(np.abs(omega2[:3] / expected - 1).max())
    assert errors[0] < 1e-8
    assert errors[1] > 1e-3


def test_free_components_follow_the_axes_of_the_interface():
    """About the turned axis z' = x the mixed modes are those with rx of the mesh free."""
    body = bar(nx=4, kind="hexahedron")
    left, right = body.interfaces
    cyclic = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # columns y, z, x
    turned = couple(with_interfaces(body, left, replace(right, triad=cyclic)))
    plain = couple(body)
    assert_allclose(
        craig_bampton(turned, n_modes=4, free={"right": ["rz"]}).frequencies,
        craig_bampton(plain, n_modes=4, free={"right": ["rx"]}).frequencies,
        rtol=1e-9,
    )
    skew = la.expm(np.cross(np.eye(3), [0.3, 0.2, -0.1]))
    skewed = couple(with_interfaces(body, left, replace(right, triad=skew)))
    everything = ["ux", "uy", "uz", "rx", "ry", "rz"]
    assert_allclose(
        craig_bampton_ir(skewed, n_modes=3, free={"right": everything}).frequencies,
        craig_bampton_ir(plain, n_modes=3, free={"right": everything}).frequencies,
        rtol=1e-8,
    )


@pytest.mark.parametrize(("free", "message"), [
    ({"lefft": ["rx"]}, "no interface 'lefft'; did you mean 'left'"),
    ({"left": ["rq"]}, "unknown component 'rq'"),
    ({"left": ["rx", "rx"]}, "one is listed twice"),
])  # fmt: skip
def test_free_components_that_do_not_exist_are_refused(body, families, free, message):
    with pytest.raises(BodyError, match=message):
        craig_bampton(families, n_modes=2, free=free)


def test_a_component_the_nodes_do_not_have_is_refused():
    body = bar(nx=3, kind="hexahedron")
    left, right = body.interfaces
    coupled = couple(with_interfaces(body, left, replace(right, kind="nodes")))
    with pytest.raises(BodyError, match="it has no dof rx along its axes"):
        craig_bampton(coupled, n_modes=2, free={"right": ["rx"]})
    assert craig_bampton(coupled, n_modes=2, free={"right": ["ux"]}).columns.shape[1] == 6 + 12 + 2


def test_a_ball_joint_marker_alone_makes_a_body(body):
    """One node with three translations: sets of constraint and of attachment modes agree on the free body."""
    plain = bar(nx=5, kind="hexahedron")
    node = int(np.argmin(np.linalg.norm(plain.nodes, axis=1)))
    ball = Interface("ball", "nodes", np.array([node]), plain.nodes[node])
    coupled = couple(with_interfaces(plain, ball))
    full = np.sqrt(constrained_spectrum(coupled, np.zeros(0, int))[6:9]) / (2 * np.pi)
    with Families(coupled) as families:
        for make in (craig_bampton, craig_bampton_ir, rubin, craig_chang, herting, attachment):
            modes = make(families, n_modes=8)
            reduced = reduce(coupled, modes)
            assert_allclose(reduced.free_frequencies[:3], full, rtol=5e-2)
        assert guyan(families).labels[3].startswith("constraint node ")


def test_normal_modes_need_no_interface_and_the_others_say_so(full):
    body = with_interfaces(bar(nx=6, kind="hexahedron"))
    reduced = reduce(body, normal_modes(body, n_modes=5))
    exact = np.sqrt(constrained_spectrum(body, np.zeros(0, int))[6:11]) / (2 * np.pi)
    assert_allclose(reduced.free_frequencies, exact, rtol=1e-8)
    assert (exact < full[:5]).all()  # rigid end faces stiffen
    for make in (craig_bampton, craig_bampton_ir, rubin, craig_chang, herting, attachment, unrestrained_attachment):
        with pytest.raises(ModeSetError, match="has no interface; give it at least one, or take free modes"):
            make(body, n_modes=2)
    with pytest.raises(ModeSetError, match="only rigid-body motion"):
        reduce(body, normal_modes(body, n_modes=0))


@pytest.mark.parametrize("make", CLASSICAL.values(), ids=CLASSICAL)
def test_impossible_numbers_of_modes_are_refused_by_every_set(body, families, make):
    name = inspect.unwrap(make).__name__.replace("macneal", "rubin").replace("dual_craig_bampton", "rubin")
    options = options_of(make, body)
    for n_modes, message in [
        (10**6, "interior dofs"),
        (ModeCount(cutoff=1e-3), r"lies below the first .* mode of body 'bar', at \d"),
    ]:
        with pytest.raises(ModeSetError, match=f"{name}: .*{message}"):
            make(families, n_modes=n_modes, **options)
    with pytest.raises(ModeSetError, match="n_modes = -1: expected 0 or more"):
        make(families, n_modes=-1, **options)
    with pytest.raises(ModeSetError, match=r"n_modes = 2\.5: expected a whole number"):
        make(families, n_modes=2.5, **options)


@pytest.mark.parametrize("make", [rubin, craig_bampton_ir, benfield_hruda, attachment])
def test_cutoff_takes_every_mode_below_it(body, families, make):
    options = options_of(make, body)
    by_count = make(families, n_modes=8, **options)
    frequencies = by_count.frequencies[~by_count.is_static]
    cutoff = float(frequencies[4] * 1.0001)
    by_cutoff = make(body, n_modes=ModeCount(cutoff=cutoff, verify=True), **options)
    assert_allclose(by_cutoff.frequencies[~by_cutoff.is_static], frequencies[frequencies <= cutoff], rtol=1e-8)
    assert by_cutoff.options["verified"].startswith("yes: ")


def test_an_uncoupled_body_is_sent_to_couple():
    body = bar(nx=2, kind="hexahedron")
    for make in CLASSICAL.values():
        with pytest.raises(BodyError, match=r"call cms\.couple"):
            make(body, n_modes=1, **options_of(make, body))


def test_the_set_says_what_ran(body, families):
    modes = rubin(families, n_modes=3)
    assert modes.options["n_modes"] == "3"
    assert "condensed stiffness" in modes.options["eigensolver"]
    assert (
        modes.groups
        == ("rigid-body",) * 6 + ("free",) * 3 + ("residual attachment left",) * 6 + ("residual attachment right",) * 6
    )
    assert isinstance(body, FEBody)
