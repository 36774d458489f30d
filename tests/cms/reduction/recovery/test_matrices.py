"""Recovery matrices against the full model: statics, inertia relief, interface forces, rigid accelerations."""

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.testing import assert_allclose

import cms
from cms.errors import RecoveryError
from cms.modes.families.families import Families
from cms.reduction.basis.frames import frame_condition
from cms.reduction.recovery.load_columns import loads_of_body, loads_of_model, on_coordinates
from cms.reduction.recovery.matrices import recovery_of_model, residual_response
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import MassLoads, rigid_motion_of_dofs
from tests.bodies import STEEL
from tests.cms.reduction.recovery.examples import HEIGHT, LENGTH, NODES, POINT, ROWS, WIDTH, full, reduced

SOLVE = 1e-9  #: of two static solutions by different factorisations
ROUNDOFF = 1e-12


def supported(body: FEBody, F):
    """Return the static solution with the six dofs of "left" held, by a factorisation of its own."""
    free = np.setdiff1d(np.arange(body.n_dof), body.interface("left").dofs)
    u = np.zeros(F.shape)
    u[free] = spla.splu(body.K[free][:, free]).solve(F[free])
    return u


def stress_rows(body: FEBody, u):
    return body.element_model.nodal_stress(body.mesh_displacement(u))[list(NODES)].reshape(12, -1)


def amounts(table: cms.body.RecoveryTable, **values):
    """Return load amplitudes by name, blanks as underscores."""
    p = np.zeros(len(table.loads))
    for name, value in values.items():
        p[table.loads.index(name.replace("_", " "))] = value
    return p


def modal_forces(body: cms.ReducedBody, p):
    """Return the forces of loads on z; those at nodes are left to the model."""
    loads, forces = loads_of_body(body)
    return forces @ p[: len(loads.names)]


def statics(body: cms.ReducedBody, p):
    """Return z and its acceleration for steady loads: the rigid body accelerates, the rest stands."""
    Y, M_R = body.moments.coupling, body.moments.rigid_mass
    G = modal_forces(body, p)
    z, acceleration = np.zeros(6 + body.n_q), np.zeros(6 + body.n_q)
    acceleration[:6] = np.linalg.solve(M_R, G[:6])
    z[6:] = (G[6:] - Y.T @ acceleration[:6]) / np.diag(body.K)
    return z, acceleration


@pytest.mark.parametrize("modes", ["craig-bampton", "normal"])
@pytest.mark.parametrize("frame", ["tisserand", "turned", "nodal"])
def test_loads_in_balance_give_the_stress_of_the_full_static_solution(modes, frame):
    body = reduced(modes, frame)
    table = body.recovery["all"]
    A = body.frame.axes
    arm = np.array([-LENGTH, 0, 0])
    force, moment = np.array([700.0, -300.0, 500.0]), np.array([20.0, 9.0, -7.0])
    left, right = full().interface("left").dofs, full().interface("right").dofs
    F = np.zeros((full().n_dof, 1))
    F[right, 0] = np.concatenate([force, moment])
    F[left, 0] = np.concatenate([-force, -moment + np.cross(arm, force)])
    p = np.zeros(len(table.loads))
    for name, wrench in (("left", F[left, 0]), ("right", F[right, 0])):
        first = table.loads.index(f"{name} fx")
        p[first : first + 6] = np.concatenate([A.T @ wrench[:3], A.T @ wrench[3:]])
    z, acceleration = statics(body, p)
    assert_allclose(acceleration, 0.0, atol=1e-6)
    exact = stress_rows(full(), supported(full(), F))[:, 0]
    found = table.values(z, z_ddot=acceleration, p=p)[table.rows("stress")]
    assert_allclose(found, exact, rtol=0, atol=SOLVE * np.abs(exact).max())
    if modes == "normal":  # the modes alone are far from it
        alone = (table.dynamic[0] @ z)[table.rows("stress")]
        assert np.abs(alone - exact).max() > 1e-3 * np.abs(exact).max()


@pytest.mark.parametrize("modes", ["craig-bampton", "normal"])
@pytest.mark.parametrize("frame", ["tisserand", "turned", "nodal"])
def test_a_body_that_accelerates_steadily_has_the_stress_of_inertia_relief(modes, frame):
    body = reduced(modes, frame)
    table = body.recovery["all"]
    A = body.frame.axes
    force = np.array([30.0, 400.0, -250.0])
    F = np.zeros((full().n_dof, 1))
    F[full().interface("right").dofs[:3], 0] = force
    Psi = rigid_motion_of_dofs(full().nodes, full().dofs)
    rigid = np.linalg.solve(Psi.T @ (full().M @ Psi), Psi.T @ F)
    balanced = F - full().M @ (Psi @ rigid)
    p = np.zeros(len(table.loads))
    first = table.loads.index("right fx")
    p[first : first + 3] = A.T @ force
    z, acceleration = statics(body, p)
    exact = stress_rows(full(), supported(full(), balanced))[:, 0]
    found = table.values(z, z_ddot=acceleration, p=p)[table.rows("stress")]
    assert_allclose(found, exact, rtol=0, atol=SOLVE * np.abs(exact).max())


def test_the_residual_response_is_static_in_mean_axes_without_the_modes():
    """K x + M Psi a = F with (M Psi)ᵀ x = 0, by one factorisation of both; then without the modal response."""
    body = full()
    F = np.random.default_rng(7).normal(size=(body.n_dof, 2))
    with Families(body) as families:
        modes = families.free_modes(8)
        condition = frame_condition(body, cms.TisserandFrame())
        found = residual_response(families, condition, modes.Phi, np.diag(modes.omega2), F)
    M_Psi = body.M @ rigid_motion_of_dofs(body.nodes, body.dofs)
    scale = np.abs(body.K).max() / np.abs(M_Psi).max()
    both = sp.block_array([[body.K, sp.csc_array(scale * M_Psi)], [sp.csc_array(scale * M_Psi.T), None]], format="csc")
    exact = spla.splu(both).solve(np.vstack([F, np.zeros((6, 2))]))[: body.n_dof]
    exact = exact - modes.Phi @ ((modes.Phi.T @ F) / modes.omega2[:, None])
    assert_allclose(found, exact, rtol=0, atol=SOLVE * np.abs(exact).max())


def test_tables_over_combinations_of_modes_are_those_over_modes_combined():
    body, request = reduced("normal"), cms.reduction.RecoveryRequest("all", ROWS, loads_at=(20,))
    Z = np.random.default_rng(8).normal(size=(body.n_q, 3))
    condition = frame_condition(full(), cms.TisserandFrame())
    with Families(full()) as families:
        Phi = families.free_modes(body.n_q).Phi
        whole, combined = (
            recovery_of_model(families, Phi, condition, body, request, over=over)["all"] for over in (None, Z)
        )
    assert_allclose(combined.static, whole.static, rtol=0, atol=SOLVE * np.abs(whole.static).max())
    for k, rows in enumerate(whole.dynamic):
        expected = np.hstack([rows[:, :6], rows[:, 6:] @ Z])
        assert_allclose(combined.dynamic[k], expected, rtol=0, atol=SOLVE * np.abs(expected).max())


@pytest.mark.parametrize("frame", ["turned", "nodal"])
def test_a_steady_spin_has_the_stress_of_its_centrifugal_load(frame):
    body = reduced("normal", frame)
    table = body.recovery["all"]
    A, origin = body.frame.axes, body.frame.origin
    omega = np.array([20.0, -35.0, 50.0])  # mesh axes
    c = full().nodes - origin
    field = -np.cross(omega, np.cross(omega, c))  # of the inertia force per mass
    tensor = np.outer(omega, omega) - omega @ omega * np.eye(3)
    assert_allclose(field, -(c @ tensor.T), atol=1e-9)
    F = full().recovery.matrix.T @ full().element_model.mass_forces(MassLoads(-tensor[None], (tensor @ origin)[None]))
    Psi = rigid_motion_of_dofs(full().nodes, full().dofs)
    rigid = np.linalg.solve(Psi.T @ (full().M @ Psi), Psi.T @ F)
    exact = stress_rows(full(), supported(full(), F - full().M @ (Psi @ rigid)))[:, 0]
    p = np.zeros(len(table.loads))
    first = table.loads.index("spin xx")
    p[first : first + 6] = cms.body.spin_products(A.T @ omega)
    z, acceleration = statics(body, p)
    found = table.values(z, z_ddot=acceleration, p=p)[table.rows("stress")]
    assert_allclose(found, exact, rtol=0, atol=SOLVE * np.abs(exact).max())


def motion_of(body: cms.ReducedBody, modes, seed=3):
    """Return random z, z', z'' and the motions of the full model that they are, (n_dof,) each."""
    condition = frame_condition(full(), cms.NodalFrame("left"))
    Phi = cms.reduction.basis.finishing.finish(full(), modes, condition).Phi
    Psi = rigid_motion_of_dofs(full().nodes, full().dofs, body.frame.origin)
    rng = np.random.default_rng(seed)
    z = rng.standard_normal((3, 6 + body.n_q)) * np.concatenate([np.ones(6), np.full(body.n_q, 1e-3)])
    z[:2, :6] = 0.0  # rigid motions of order one against strains: their rounding is that of the stiffness
    return z, z @ np.hstack([Psi, Phi]).T


def test_interface_forces_are_what_holds_the_full_motion_on_the_constraint_modes():
    """B has the span of the set, so the force at an interface dof is the work on its constraint mode, Psi_Cᵀ f."""
    body = reduced("craig-bampton", "nodal")
    table = body.recovery["all"]
    modes = cms.craig_bampton(full(), n_modes=4)
    z, u = motion_of(body, modes)
    with cms.modes.Families(full()) as families:
        Psi_C = families.Psi_C
    expected = Psi_C.T @ (full().M @ u[2] + full().K @ u[0])
    found = table.values(z[0], z_ddot=z[2])[table.rows("interface force")]
    assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_net_forces_are_the_rates_of_momentum_and_the_sum_of_the_interfaces():
    body = reduced("craig-bampton", "nodal")
    table = body.recovery["all"]
    z, u = motion_of(body, cms.craig_bampton(full(), n_modes=4))
    about = rigid_motion_of_dofs(full().nodes, full().dofs, np.array(POINT))
    expected = about.T @ (full().M @ u[2])
    y = table.values(z[0], z[1], z[2])
    rows = table.rows("net force")
    assert_allclose(y[rows[:6]], expected, rtol=0, atol=1e-11 * np.abs(expected).max())
    forces = table.rows("interface force")
    by_hand = np.zeros(6)
    for k, name in enumerate(("left", "right")):
        f, m = y[forces[6 * k : 6 * k + 3]], y[forces[6 * k + 3 : 6 * k + 6]]
        arm = full().interface(name).reference - np.array(POINT)
        by_hand += np.concatenate([f, m + np.cross(arm, f)])
    assert_allclose(y[rows[6:]], by_hand, rtol=0, atol=1e-10 * np.abs(by_hand).max())
    assert_allclose(y[rows[6:]], expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_net_forces_of_interfaces_under_other_loads_are_the_sum_of_the_interfaces():
    """Gravity, for one: what the interfaces carry besides the motion, about the point of the rows."""
    table = reduced("craig-bampton", "nodal").recovery["all"]
    forces, rows = table.rows("interface force"), table.rows("net force")[6:]
    by_hand = np.zeros((6, len(table.loads)))
    for k, name in enumerate(("left", "right")):
        f, m = table.static[forces[6 * k : 6 * k + 3]], table.static[forces[6 * k + 3 : 6 * k + 6]]
        arm = full().interface(name).reference - np.array(POINT)
        by_hand += np.concatenate([f, m + np.cross(arm, f, axis=0)])
    assert np.abs(by_hand).max() > 1e-3
    assert_allclose(table.static[rows], by_hand, rtol=0, atol=1e-12 * np.abs(by_hand).max())


def test_net_forces_of_a_rigid_acceleration_are_mass_times_acceleration():
    """Bar of steel: m and J about its centre by hand; about a point by the parallel axes."""
    body = reduced("craig-bampton", "turned")
    table = body.recovery["all"]
    A = body.frame.axes
    a, alpha = np.array([1.0, -2.0, 3.0]), np.array([5.0, 7.0, -4.0])  # of the centre, mesh axes
    m = STEEL.rho * LENGTH * WIDTH * HEIGHT
    J = m / 12 * np.diag([WIDTH**2 + HEIGHT**2, LENGTH**2 + HEIGHT**2, LENGTH**2 + WIDTH**2])
    center = np.array([LENGTH / 2, WIDTH / 2, HEIGHT / 2])
    z = np.zeros(6 + body.n_q)
    z[:3] = A.T @ (a + np.cross(alpha, body.frame.origin - center))
    z[3:6] = A.T @ alpha
    y = table.values(np.zeros_like(z), z_ddot=z)
    expected = np.concatenate([m * a, J @ alpha + np.cross(center - np.array(POINT), m * a)])
    assert_allclose(y[table.rows("net force")[:6]], expected, rtol=0, atol=1e-11 * np.abs(expected).max())
    for k, node in enumerate(NODES):
        c = full().nodes[node] - center
        rows = table.rows(f"node index {node} acceleration")
        assert_allclose(y[rows], a + np.cross(alpha, c), rtol=1e-12, atol=1e-12)
        assert len(rows) == 3, k


def test_a_spinning_body_has_the_acceleration_towards_its_axis():
    body = reduced("normal", "turned")
    table = body.recovery["all"]
    A, omega = body.frame.axes, np.array([3.0, -1.0, 2.0])
    p = np.zeros(len(table.loads))
    first = table.loads.index("spin xx")
    p[first : first + 6] = cms.body.spin_products(A.T @ omega)
    y = table.values(np.zeros(6 + body.n_q), p=p)
    c = full().nodes[NODES[0]] - body.frame.origin
    expected = np.cross(omega, np.cross(omega, c))
    assert_allclose(y[table.rows(f"node index {NODES[0]} acceleration")], expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("frame", ["tisserand", "turned", "nodal"])
def test_loads_of_the_body_are_those_of_the_model(frame):
    """From the moments, and from mass matrix and element integrals."""
    body = reduced("craig-bampton", frame)
    own, forces = loads_of_body(body)
    loads, F = loads_of_model(full(), body.frame)
    assert own.names == loads.names
    modes = cms.craig_bampton(full(), n_modes=4)
    chosen = {"nodal": cms.NodalFrame("left")}.get(
        frame, cms.TisserandFrame(origin=tuple(body.frame.origin), axes=tuple(map(tuple, body.frame.axes.T)))
    )
    Phi = cms.reduction.basis.finishing.finish(full(), modes, frame_condition(full(), chosen)).Phi
    Psi = rigid_motion_of_dofs(full().nodes, full().dofs, body.frame.origin) @ np.kron(np.eye(2), body.frame.axes)
    expected = np.hstack([Psi, Phi]).T @ F
    scale = np.abs(expected).max(axis=0) + 1e-300
    assert_allclose(forces / scale, expected / scale, rtol=0, atol=1e-9)


def test_strain_is_the_compliance_times_stress():
    table = reduced("craig-bampton").recovery["all"]
    node = NODES[0]
    stress, strain = (table.dynamic[0][table.rows(f"node index {node} {what}")] for what in ("stress", "strain"))
    E, nu = STEEL.E, STEEL.nu
    for k in range(3):
        others = stress.sum(axis=0) - stress[k] - stress[3:].sum(axis=0)
        expected = (stress[k] - nu * others) / E
        assert_allclose(strain[k], expected, rtol=0, atol=ROUNDOFF * np.abs(strain).max())
    assert_allclose(strain[3:], stress[3:] * 2 * (1 + nu) / E, rtol=0, atol=ROUNDOFF * np.abs(strain).max())


def test_rows_of_the_body_alone_are_those_of_the_model_without_their_static_part():
    body = reduced("craig-bampton", "turned")
    rows = tuple(row for row in ROWS if row.quantity != "strain")
    alone = cms.reduction.recovery_matrices(body, cms.reduction.RecoveryRequest("all", rows))["all"]
    table = body.recovery["all"]
    same = [table.labels.index(label) for label in alone.labels]
    expected = table.of_rows(same)
    motion = [k for k, name in enumerate(alone.quantities) if name in ("velocity", "acceleration", "net force")]
    for order in range(3):
        rows_of = range(alone.n_rows) if order == 0 else motion
        a, b = alone.dynamic[order][list(rows_of)], expected.dynamic[order][list(rows_of)]
        scale = np.abs(expected.dynamic[order]).max(axis=1)[list(rows_of)][:, None] + 1e-300
        assert_allclose(a / scale, b / scale, rtol=0, atol=1e-8)
    with pytest.raises(RecoveryError, match="cannot provide it"):
        cms.reduction.recovery_matrices(
            body, cms.reduction.RecoveryRequest("x", (cms.reduction.Rows("strain", at=NODES),))
        )


@pytest.mark.parametrize("target", ["nodal", "turned"])
def test_another_frame_gives_the_same_rows_of_the_same_motion(target):
    """The state is given in the new frame, with the accelerations that its equations of motion say."""
    frames = {
        "nodal": cms.NodalFrame("right"),
        "turned": cms.TisserandFrame(axes=((0, 0.6, 0.8), (0, -0.8, 0.6), (1, 0, 0)), origin=(0.3, 0.2, -0.3)),
    }
    old = reduced("normal", "nodal" if target == "turned" else "tisserand")
    new, change = cms.reduction.frame_conversion.converted(old, frames[target])
    rng = np.random.default_rng(5)
    table = new.recovery["all"]
    loads, G = loads_of_body(new)
    p = rng.standard_normal(len(table.loads))
    p[len(loads.names) :] = 0.0  # forces at nodes: of the model
    M, _, K = on_coordinates(new)
    z = np.concatenate([np.zeros(6), rng.standard_normal(new.n_q) * 1e-3])
    z_ddot = np.linalg.solve(M, G @ p[: len(loads.names)] - K @ z)
    # the same state in the old frame, by hand
    omega_products = p[table.loads.index("spin xx") :][:6]
    z_old, z_ddot_old = np.zeros_like(z), np.zeros_like(z)
    R, C, Z, P = change.R, change.C, change.Z, change.p
    for of_old, of_new in ((z_old, z), (z_ddot_old, z_ddot)):
        of_old[6:] = Z @ of_new[6:]
        off = C @ Z @ of_new[6:]
        of_old[3:6] = R @ of_new[3:6] - off[3:]
        of_old[:3] = R @ of_new[:3] - np.cross(R @ of_new[3:6], P) - off[:3]
    tensor = np.diag(omega_products[:3])
    for value, (a, b) in zip(omega_products[3:], ((0, 1), (1, 2), (2, 0)), strict=True):
        tensor[a, b] = tensor[b, a] = value / 2  # omega omegaᵀ
    tensor = R @ tensor @ R.T
    z_ddot_old[:3] += -(tensor - np.trace(tensor) * np.eye(3)) @ P
    old_table = old.recovery["all"]
    p_old = np.array(p)
    for name in ("gravity x", "left fx", "left mx", "right fx", "right mx"):
        k = table.loads.index(name)
        p_old[k : k + 3] = R @ p[k : k + 3]
    k = table.loads.index("spin xx")
    p_old[k : k + 6] = [*np.diag(tensor), 2 * tensor[0, 1], 2 * tensor[1, 2], 2 * tensor[2, 0]]
    found = table.values(z, np.zeros_like(z), z_ddot, p)
    expected = old_table.values(z_old, np.zeros_like(z), z_ddot_old, p_old)
    for quantity in ("displacement", "stress", "strain", "acceleration", "net force"):
        rows = table.rows(quantity)
        assert_allclose(found[rows], expected[rows], rtol=0, atol=1e-8 * np.abs(expected[rows]).max())


def test_rows_go_through_the_modal_file_and_units(tmp_path):
    body = reduced("craig-bampton", "turned")
    cms.write(body, tmp_path / "bar.h5")
    back = cms.read(tmp_path / "bar.h5")
    table, other = body.recovery["all"], back.recovery["all"]
    assert (table.labels, table.units, table.loads) == (other.labels, other.units, other.loads)
    for name in ("dynamic", "static", "numbers", "dimensions"):
        np.testing.assert_array_equal(getattr(table, name), getattr(other, name))
    in_mm = cms.read(tmp_path / "bar.h5", units="mm-t-s").recovery["all"]
    assert in_mm.units[table.rows("stress")[0]] == "MPa"
    in_ms, first = cms.read(tmp_path / "bar.h5", units="mm-kg-ms").recovery["all"], table.rows("acceleration")[0]
    assert_allclose(in_ms.dynamic[2][first, :3], table.dynamic[2][first, :3], rtol=1e-12)
    # the same steady state, said in both units: loads in N and mm/s², q by sqrt(t) mm
    p, z, z_ddot = (np.random.default_rng(k).standard_normal(n) for k, n in enumerate((len(table.loads), 24, 24)))
    z, z_ddot = z[: 6 + body.n_q], z_ddot[: 6 + body.n_q]
    to_mm = np.concatenate([np.full(3, 1e3), np.ones(3), np.full(body.n_q, 1e3 / np.sqrt(1e3))])
    by = {"m s^-2": 1e3, "N": 1.0, "N m": 1e3, "s^-2": 1.0}
    p_mm = p * np.array([by[unit] for unit in table.load_units])
    found, expected = in_mm.values(z * to_mm, z_ddot=z_ddot * to_mm, p=p_mm), table.values(z, z_ddot=z_ddot, p=p)
    rows = table.rows("stress")
    assert_allclose(found[rows], expected[rows] * 1e-6, rtol=1e-10)
    rows = table.rows("net force")[3:6]
    assert_allclose(found[rows], expected[rows] * 1e3, rtol=1e-10, atol=1e-9 * np.abs(expected[rows]).max() * 1e3)


def test_the_static_part_brings_the_stress_of_a_shaken_body_to_that_of_the_full_model():
    """Both ends driven: what is left of the error is (f over the first mode left out)² of that without it, or less."""
    body = reduced("craig-bampton", "tisserand")
    matrices = cms.reduction.craig_bampton_matrices(body)
    table = body.recovery["all"]
    kept = [k for k, name in enumerate(table.loads) if not name.startswith("node ")]
    table = cms.body.RecoveryTable(
        **{
            **table.__dict__,
            "loads": tuple(table.loads[k] for k in kept),
            "static": table.static[:, kept],
            "load_dimensions": table.load_dimensions[kept],
        }
    )
    rows, n_b = matrices.recover(table), matrices.n_b
    drive = matrices.rigid @ np.array([0.3, 0.2, 1.0, 0, 0, 0])
    b, i = full().b, full().i
    with cms.modes.Families(full()) as families:
        left_out = families.fixed_modes(12).omega2[4] ** 0.5
    for share in (0.05, 0.2):
        omega2 = (share * left_out) ** 2
        u = np.zeros((full().n_dof, 1))
        u[b, 0] = drive
        Z = full().K - omega2 * full().M
        u[i] = -spla.spsolve(Z[i][:, i].tocsc(), Z[i][:, b] @ u[b]).reshape(-1, 1)
        exact = stress_rows(full(), u)[:, 0]
        y = np.zeros(len(matrices.M))
        y[:n_b] = drive
        inner = matrices.K[n_b:, n_b:] - omega2 * matrices.M[n_b:, n_b:]
        y[n_b:] = np.linalg.solve(inner, omega2 * matrices.M[n_b:, :n_b] @ drive)
        z = matrices.T @ y
        stress = table.rows("stress")
        found = rows.values(y, 0 * y, -omega2 * y)[stress]
        alone = (table.dynamic[0] @ z)[stress]
        error, without = np.abs(found - exact).max(), np.abs(alone - exact).max()
        assert error < share**2 * without
