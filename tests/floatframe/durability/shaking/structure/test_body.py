"""A body on bases against its own finite element matrices with the driven dofs put on the right side, and pyYeti."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from cms.errors import BodyError
from fe_models.body.fe_body import Interface
from fe_models.elements.beams.attachments import PointMass
from fe_models.meshes.line_mesh import LineMesh
from floatframe.durability.shaking.structure.body import bases_of_body, held_by_bases, require_held, shaken_body
from floatframe.durability.shaking.structure.damping import Damping
from floatframe.durability.shaking.structure.model import response
from floatframe.durability.shaking.structure.places import Observed
from floatframe.errors import ModelError
from tests.bodies import bar, beam, with_interfaces

FREQUENCIES = np.array([1.0, 30.0, 77.0, 140.0, 400.0])
ZETA = 0.03
UNITS = cms.unit_system("m-kg-s")
P = np.array([0.2, -0.1, 0.3])  #: a point of a base beside its interface


@pytest.fixture(scope="module")
def part():
    ends = [
        Interface(name, "nodes", np.array([k]), np.array([k / 3, 0, 0]))
        for k, name in enumerate("left first second right".split())
    ]
    return cms.couple(with_interfaces(beam(n=3), *ends))


@pytest.fixture(scope="module", params=[None, cms.NodalFrame("left")], ids=["mean axes", "nodal frame"])
def reduced(part, request):
    modes = cms.modes.guyan(part)  # all there are: the span is that of the matrices
    return cms.reduce(part, modes, frame=request.param)


def driven_response(part, held, T, wanted, zeta):
    """Acceleration of dofs and forces on held dofs, from the finite element matrices, for s_ddot = exp(i omega t)."""
    M, K = part.M.toarray(), part.K.toarray()
    inner = np.setdiff1d(np.arange(len(M)), held)
    omega2, Phi = la.eigh(K[np.ix_(inner, inner)], M[np.ix_(inner, inner)])
    omega = np.sqrt(omega2)
    full = np.zeros((len(M), T.shape[1]))
    full[held] = T
    full[inner] = -np.linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, held)] @ T)
    load = -Phi.T @ (M @ full)[inner]
    acceleration, forces = [], []
    for w in 2 * np.pi * FREQUENCIES:
        eta = load / (omega2 - w**2 + 2j * zeta * omega * w)[:, None]
        x_ddot = full.astype(complex)
        x_ddot[inner] += -(w**2) * Phi @ eta
        acceleration.append(x_ddot[wanted])
        forces.append(full.T @ (M @ x_ddot + K @ full / -(w**2)))
    return np.array(acceleration), np.array(forces)


def dofs_of(part, node):
    return np.flatnonzero(part.dofs[:, 0] == node)


@pytest.mark.parametrize("seed", range(4))
def test_motions_on_bases_split_a_random_structure(seed):
    """Statically: x = T s + K_N^-1 f with G x = R s; dynamically the modes and the shapes without mass span G x = 0."""
    rng = np.random.default_rng(seed)
    n, n_g, n_s, n_0 = 11, 4, 3, int(rng.integers(0, 4))
    S = 10 ** rng.uniform(-2, 2, size=n)
    A, B, G, R = (rng.normal(size=size) for size in ((n, n), (n, n - n_g - n_0), (n_g, n), (n_g, n_s)))
    K, M = ((X @ X.T) / S / S[:, None] for X in (A, B))
    held = held_by_bases("a", M, K, G / S, R, S)
    V, V_0 = held.V / S[:, None], held.V_0 / S[:, None]
    K, M, T = K * S * S[:, None], M * S * S[:, None], held.T / S[:, None]
    assert (V.shape, V_0.shape) == ((n, n - n_g - n_0), (n, n_0))
    assert_allclose(G @ np.hstack([T, V, V_0]), np.hstack([R, np.zeros((n_g, n - n_g))]), rtol=0, atol=1e-9)
    energy = la.block_diag(T.T @ K @ T, np.diag(held.omega**2), np.eye(n_0))
    both = np.hstack([T, V, V_0])
    assert_allclose(both.T @ K @ both, energy, rtol=0, atol=1e-8 * np.abs(energy).max())
    assert_allclose(V.T @ M @ V, np.eye(n - n_g - n_0), rtol=0, atol=1e-9)
    assert_allclose(M @ V_0, 0, rtol=0, atol=1e-8)
    assert np.all(np.diff(held.omega) >= 0)


def test_a_force_on_massless_shapes_gives_the_response_of_the_full_matrices():
    """Point masses on beams without density: the rotations of the nodes follow forces statically."""
    nodes = np.array([[0.2, 0.1, -0.3], [0.4, 0.2, -0.2], [0.5, 0.5, 0.0], [0.6, 0.4, 0.3], [0.9, 0.5, 0.4]])
    mesh = LineMesh(nodes, np.array([[0, 1], [1, 2], [2, 3], [3, 4]]))
    ends = [Interface(name, "nodes", np.array([k]), mesh.nodes[k]) for name, k in (("foot", 0), ("top", 4))]
    masses = [PointMass(k, 0.3 + 0.1 * k) for k in range(5)]
    property_ = fm.beams.BeamProperty(fm.beams.Rectangle(0.02, 0.03), fm.Material("light", 7e10, 0.3, 0.0))
    part = cms.couple(fm.beam_body(mesh, property_, name="mast", units=UNITS, interfaces=ends, point_masses=masses))
    body = cms.reduce(part, cms.craig_bampton(part, 9), damping=None)
    seen = [Observed("top", interface="top", quantities=("displacement", "acceleration"))]
    names = ["top:y", "top:rx", "top:rz"]
    model = shaken_body(body, bases_of_body(body, "foot"), Damping(ratio=0.0), seen, names)
    K, M = part.K.toarray()[6:, 6:], part.M.toarray()[6:, 6:]
    forces = np.eye(24)[:, [19, 21, 23]]
    at = model.output_index("top displacement x")
    for f in (3.0, 20.0):
        w = 2 * np.pi * f
        x = np.linalg.solve(K - w**2 * M, forces)
        H = response(model, np.array([f]))[0][:, 6:]
        assert_allclose(H[at : at + 6], x[18:], rtol=0, atol=1e-7 * np.abs(x[18:]).max())
        held = part.K.toarray()[:6, 6:] @ x
        assert_allclose(H[:6], held, rtol=0, atol=1e-7 * np.abs(held).max())


def test_one_driven_interface_gives_the_response_of_the_full_matrices(part, reduced):
    bases = bases_of_body(reduced, "left")
    model = shaken_body(reduced, bases, Damping(ratio=ZETA), [Observed("tip", interface="right")])
    H = response(model, FREQUENCIES)
    names = [output.name for output in model.outputs]
    expected, forces = driven_response(part, dofs_of(part, 0), np.eye(6), dofs_of(part, 3), ZETA)
    scale = np.abs(expected).max()
    assert_allclose(H[:, names.index("tip acceleration x") :][:, :6], expected, rtol=0, atol=1e-9 * scale)
    assert_allclose(H[:, :6], forces, rtol=0, atol=1e-9 * np.abs(forces).max())


def test_two_bases_moved_against_each_other_give_the_response_of_the_full_matrices(part, reduced):
    bases = bases_of_body(reduced, {"a": ("left",), "b": ("right",)})
    model = shaken_body(reduced, bases, Damping(ratio=ZETA), [Observed("middle", interface="first")])
    H = response(model, FREQUENCIES)
    names = [output.name for output in model.outputs]
    held = np.concatenate([dofs_of(part, 0), dofs_of(part, 3)])
    expected, forces = driven_response(part, held, np.eye(12), dofs_of(part, 1), ZETA)
    first = names.index("middle acceleration x")
    assert_allclose(H[:, first : first + 6], expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    assert_allclose(H[:, :12], forces, rtol=0, atol=1e-9 * np.abs(forces[0]).max())
    net = names.index("net force x")
    assert_allclose(H[:, net : net + 3], forces[:, :3] + forces[:, 6:9], rtol=0, atol=1e-9 * np.abs(forces[0]).max())
    moments = forces[:, 3:6] + forces[:, 9:12] + np.cross([1.0, 0, 0], forces[:, 6:9], axisb=1, axisc=1)
    assert_allclose(H[:, net + 3 : net + 6], moments, rtol=0, atol=1e-9 * np.abs(forces[0]).max())


def test_another_point_of_the_base_turns_and_is_loaded_as_a_rigid_body(reduced):
    tip = [Observed("tip", interface="right")]
    at_zero, at_p = (
        response(
            shaken_body(reduced, bases_of_body(reduced, "left", {"left": point}), Damping(ratio=ZETA), tip), FREQUENCIES
        )
        for point in (np.zeros(3), P)
    )
    S = np.eye(6)  # motion of the point at zero with that at P: d + theta × (0 - P)
    S[:3, 3:] = np.array([np.cross(theta, -P) for theta in np.eye(3)]).T
    assert_allclose(at_p[:, -6:], at_zero[:, -6:] @ S, rtol=0, atol=1e-9 * np.abs(at_zero[:, -6:]).max())
    assert_allclose(at_p[:, :6], S.T @ at_zero[:, :6] @ S, rtol=0, atol=1e-9 * np.abs(at_zero[:, :6]).max())


def test_one_base_may_hold_two_interfaces(part, reduced):
    base = bases_of_body(reduced, {"table": ("left", "right")})
    model = shaken_body(reduced, base, Damping(ratio=ZETA), [Observed("middle", interface="second")])
    held = np.concatenate([dofs_of(part, 0), dofs_of(part, 3)])
    arm = np.array([[0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
    T = np.vstack([np.eye(6), np.block([[np.eye(3), arm], [np.zeros((3, 3)), np.eye(3)]])])
    expected, forces = driven_response(part, held, T, dofs_of(part, 2), ZETA)
    H = response(model, FREQUENCIES)
    assert_allclose(H[:, -6:], expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    assert_allclose(H[:, :6], forces, rtol=0, atol=1e-9 * np.abs(forces).max())


def test_effective_masses_and_the_mass_on_the_base_sum_to_the_mass(part, reduced):
    model = shaken_body(reduced, bases_of_body(reduced, "left"), Damping(ratio=ZETA))
    participation = -model.B[2]
    held = dofs_of(part, 0)
    on_base = part.M.toarray()[np.ix_(held, held)]
    inner = np.setdiff1d(np.arange(24), held)
    M = part.M.toarray()
    coupled = M[np.ix_(held, inner)] @ np.linalg.solve(M[np.ix_(inner, inner)], M[np.ix_(inner, held)])
    assert_allclose(participation.T @ participation, model.mass - on_base + coupled, atol=1e-9 * model.mass.max())
    assert_allclose(model.mass[0, 0], 7850.0 * 1e-4, rtol=1e-9)


def test_the_lowest_relative_displacement_is_the_static_one_under_the_base_acceleration(reduced):
    outputs = [Observed("tip", interface="right", quantities=("displacement",))]
    model = shaken_body(reduced, bases_of_body(reduced, "left"), Damping(ratio=ZETA), outputs)
    H = response(model, np.array([1e-3]))[0]
    k = model.output_index("tip displacement z")
    rho_A, E_I, L = 7850.0 * 1e-4, 2.1e11 * 1e-9, 1.0
    # a uniform load -rho A a over a cantilever; consistent nodal loads give its tip exactly
    assert_allclose(H[k, 2].real, -rho_A * L**4 / (8 * E_I), rtol=1e-6)


def test_random_loads_of_pyyeti_on_the_same_matrices(reduced):
    from pyyeti.ode import SolveUnc

    model = shaken_body(
        reduced, bases_of_body(reduced, "left"), Damping(ratio=ZETA), [Observed("tip", interface="right")]
    )
    solver = SolveUnc(np.ones(len(model.omega)), 2 * ZETA * model.omega, model.omega**2)
    load = np.tile(model.B[2][:, [1]], (1, len(FREQUENCIES)))
    eta = solver.fsolve(load.astype(complex), FREQUENCIES, rf_disp_only=False).a
    expected = model.E[2] @ eta + model.D[2][:, [1]]
    assert_allclose(response(model, FREQUENCIES)[:, :, 1].T, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_an_amplification_is_that_of_a_mass_at_its_frequency():
    """|a / a_base| of one mode at its frequency is the root of 1 + Q²; Q = 1/(2 ratio)."""
    f, Q = 50.0, 8.0
    ratio = Damping(Q=Q).ratios(np.array([f]))
    assert_allclose(np.abs((1 + 2j * ratio) / (2j * ratio)), np.hypot(1, Q), rtol=1e-12)


def test_own_damping_of_the_body_couples_its_modes_and_changes_the_response():
    part = cms.couple(beam(n=3))
    body = cms.reduce(part, cms.craig_bampton(part, n_modes=12), damping=cms.reduction.ModalDamping(0.02))
    model = shaken_body(body, bases_of_body(body, "left"), Damping(own=True), [Observed("tip", interface="right")])
    assert not model.is_modal
    M, C, K = np.eye(len(model.omega)), model.C, np.diag(model.omega**2)
    w = 2 * np.pi * 77.0
    eta = np.linalg.solve(K - w**2 * M + 1j * w * C, model.B[2].astype(complex))
    assert_allclose(response(model, np.array([77.0]))[0], -(w**2) * model.E[2] @ eta + model.D[2], rtol=1e-9, atol=1e-9)
    # the same from the whole pencil of the free body with its base held by rows of its own, no elimination
    from cms.reduction.free_pencil import whole_pencil, whole_port_rows

    pencil, G = whole_pencil(body), whole_port_rows(body, "left")
    n = len(pencil.M)
    S = np.block([[pencil.K - w**2 * pencil.M + 1j * w * pencil.D, -G.T], [G, np.zeros((6, 6))]])
    x = np.linalg.solve(S, np.vstack([np.zeros((n, 6)), np.eye(6) / -(w**2)]))
    tip = -(w**2) * whole_port_rows(body, "right") @ x[:n]
    assert_allclose(response(model, np.array([77.0]))[0, -6:], tip, rtol=0, atol=1e-8 * np.abs(tip).max())


def test_own_damping_acts_through_two_bases_that_move_against_each_other(part):
    """Oracle: the whole pencil of the free body, both bases held by rows of their own, no elimination."""
    from cms.reduction.free_pencil import whole_pencil, whole_port_rows

    body = cms.reduce(part, cms.modes.guyan(part), damping=cms.reduction.ModalDamping(0.2))
    bases = bases_of_body(body, {"a": ("left",), "b": ("right",)}, {"a": P})
    middle = Observed("middle", interface="first", quantities=("acceleration", "displacement"))
    model = shaken_body(body, bases, Damping(own=True), [middle])
    pencil, w = whole_pencil(body), 2 * np.pi * 77.0
    n, s = len(pencil.M), np.eye(12) / -(w**2)
    G = np.vstack([whole_port_rows(body, name) for name in ("left", "right")])
    T = np.eye(12)
    T[:6, :6] = carried(-P)
    S = np.block([[pencil.K - w**2 * pencil.M + 1j * w * pencil.D, -G.T], [G, np.zeros((12, 12))]])
    x = np.linalg.solve(S, np.vstack([np.zeros((n, 12)), T @ s]))
    H = response(model, np.array([77.0]))[0]
    forces, place = T.T @ x[n:], whole_port_rows(body, "first") @ x[:n]
    assert_allclose(H[:12], forces, rtol=0, atol=1e-8 * np.abs(forces).max())
    first = model.output_index("middle acceleration x")
    assert_allclose(H[first : first + 6], -(w**2) * place, rtol=0, atol=1e-8 * w**2 * np.abs(place).max())
    # displacements are counted from where base a alone would carry the place
    rigid = np.hstack([carried(np.array([1 / 3, 0, 0]) - P), np.zeros((6, 6))]) @ s
    first = model.output_index("middle displacement x")
    assert_allclose(H[first : first + 6], place - rigid, rtol=0, atol=1e-8 * np.abs(place).max())


def carried(arm):
    """Motion of a point of a rigid body at `arm` from another by that of the other: d + theta × arm."""
    found = np.eye(6)
    found[:3, 3:] = np.array([np.cross(theta, arm) for theta in np.eye(3)]).T
    return found


@pytest.fixture(scope="module")
def solid():
    part = cms.couple(bar(nx=3))
    return cms.reduce(part, cms.craig_bampton(part, n_modes=3))


def test_stress_and_places_of_a_solid(solid):
    solid = replace(solid, numbering=replace(solid.numbering, nodes=1000 + np.arange(len(solid.nodes))))
    number = 1005
    place = solid.frame.origin + solid.frame.axes @ solid.nodes[5]
    wanted = [Observed("a", node=number, quantities=("stress",)), Observed("b", position=place, quantities=("stress",))]
    model = shaken_body(solid, bases_of_body(solid, "left"), Damping(Q=10), wanted)
    H = response(model, FREQUENCIES)
    a, b = model.output_index("a stress xx"), model.output_index("b stress xx")
    assert_allclose(H[:, a : a + 6], H[:, b : b + 6], rtol=0, atol=0)
    assert np.abs(H[:, a]).max() > 0


def test_rows_of_a_recovery_table_are_the_outputs_of_the_same_places(part):
    rows = (
        cms.reduction.Rows("acceleration", at=("right",)),
        cms.reduction.Rows("displacement", at=("right",)),
        cms.reduction.Rows("net force", about=(0.0, 0.0, 0.0)),
    )
    request = cms.reduction.RecoveryRequest("table", rows=rows)  # of all modes there are: no static rest beside them
    body = cms.reduce(part, cms.modes.guyan(part), recovery=[request])
    seen = [
        Observed("tip", interface="right", quantities=("acceleration", "displacement")),
        Observed("t", recovery="table"),
    ]
    model = shaken_body(body, bases_of_body(body, "left", {"left": P}), Damping(ratio=ZETA), seen, ("right:z",))
    H, names = response(model, FREQUENCIES), [output.name for output in model.outputs]
    labels = body.recovery["table"].labels
    first, table = names.index("tip acceleration x"), names.index(labels[0])
    for k in range(2):  # six accelerations, six displacements
        own, other = H[:, table + 6 * k : table + 6 * k + 6], H[:, first + 6 * k : first + 6 * k + 6]
        assert_allclose(own, other, rtol=0, atol=1e-9 * np.abs(other).max())
    # the net force on the body about the origin: what the base and the further force exert
    net = H[:, table + 12 : table + 18]
    exerted = np.array(H[:, :6])
    exerted[:, 3:] += np.cross(P, exerted[:, :3], axisb=1, axisc=1)
    arm = np.array([1.0, 0.0, 0.0])
    exerted[:, :, 6] += np.concatenate([[0, 0, 1.0], np.cross(arm, [0, 0, 1.0])])
    assert_allclose(np.abs(net), np.abs(exerted), rtol=0, atol=1e-7 * np.abs(exerted).max())


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        ({"recovery": "tabel"}, "no recovery table"),
        ({"node": 10**6}, "1000000"),
        ({"position": (0.5, 0.5, 0.5)}, "Keep the node there"),
        ({"interface": "rigth"}, "right"),
        ({"point": "p"}, "no stress point"),
        ({}, "expected one of interface, node, element"),
        ({"interface": "right", "quantities": ("stress",)}, "not at interface"),
        ({"node": 0, "quantities": ("strain",)}, "unknown quantity"),
    ],
)
def test_places_that_do_not_exist_are_refused(solid, wanted, words):
    with pytest.raises((ModelError, BodyError), match=words):
        shaken_body(solid, bases_of_body(solid, "left"), Damping(ratio=0.01), [Observed("o", **wanted)])


@pytest.mark.parametrize(
    ("bases", "words"),
    [
        (None, "name the one that the base holds"),
        ("lft", "left"),
        ({"a": ("left",), "b": ("left",)}, "held by two bases"),
        ({"a": ()}, "expected at least one interface"),
    ],
)
def test_bases_that_do_not_exist_are_refused(solid, bases, words):
    with pytest.raises((ModelError, BodyError), match=words):
        bases_of_body(solid, bases)


def test_a_body_whose_modes_cannot_follow_two_bases_is_refused():
    part = cms.couple(bar(nx=3))
    body = cms.reduce(part, cms.modes.normal_modes(part, n_modes=4))
    with pytest.raises(ModelError, match="cannot follow relative motions of the bases"):
        shaken_body(body, bases_of_body(body, {"a": ("left",), "b": ("right",)}), Damping(ratio=0.01))


def test_damping_by_table_band_and_mode():
    damping = Damping(ratio=0.01, table=[(10, 0.01), (1000, 0.03)], bands=[(50, 150, 0.05)], modes={3: 0.2})
    assert_allclose(
        damping.ratios(np.array([5.0, 100.0, 100.0, 316.22776601683796, 5000.0])), [0.01, 0.05, 0.2, 0.025, 0.03]
    )


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, "got nothing"),
        ({"ratio": 0.1, "Q": 5}, "either ratio or Q"),
        ({"ratio": -0.1}, "from 0 to below 1"),
        ({"ratio": 0.02, "modes": {2: 0.3}}, "ratio 0.3: this is 30 % of critical damping.* heavy = true"),
        ({"table": [(10, 0.1), (5, 0.1)]}, "row 2"),
        ({"bands": [(10, 5, 0.1)]}, "from < to"),
        ({"own": True, "ratio": 0.1}, "either own"),
    ],
)
def test_damping_that_makes_no_sense_is_refused(given, words):
    with pytest.raises(ModelError, match=words):
        Damping(**given)


def test_heavy_damping_can_be_meant():
    assert Damping(ratio=0.02, bands=[(20, 90, 0.3)], heavy=True).ratios(np.array([50.0])) == 0.3
    assert Damping(Q=1.25).ratios(np.array([50.0])) == 0.4


def test_a_mode_in_no_band_is_refused():
    with pytest.raises(ModelError, match="mode 2 at 200 Hz is in none of the bands"):
        Damping(bands=[(0, 100, 0.01)]).ratios(np.array([50.0, 200.0]))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("n_free", [0, 1, 2])
def test_motions_without_energy_are_counted_whatever_their_rounding(seed, n_free):
    """Springs of very different stiffness between motions, fewer springs than motions."""
    rng = np.random.default_rng(seed)
    B = rng.normal(size=(7, 7 - n_free)) * 10 ** rng.uniform(-2, 2, size=7 - n_free)
    if not n_free:
        require_held("part", B @ B.T)
        return
    with pytest.raises(ModelError, match=rf"do not hold it: {n_free} motions? without energy remain"):
        require_held("part", B @ B.T)
