from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import fe_models as fm
from cms.errors import ModeSetError
from cms.modes.centrifugal import centrifugal_loads
from cms.modes.families.families import Families
from cms.modes.mode_sets import craig_bampton, craig_bampton_ir, craig_chang, herting, rubin
from cms.modes.mode_sets.extra_columns import with_centrifugal, with_load_cases
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import Interface
from fe_models.body.load_cases import LoadCase
from fe_models.body.material import Material
from fe_models.elements.solids.body import solid_body
from fe_models.foundation.units import unit_system
from tests.bodies import bar, beam, box_mesh, with_interfaces
from tests.fe_models.small_frames import STEEL, straight

ROUNDOFF = 1e-12


def loaded_bar(kinds=("rigid", "rigid")):
    free = bar(nx=5, kind="hexahedron")
    push = np.zeros(free.n_dof)
    push[3 * 12 : 3 * 16 : 3] = [1.0, 2.0, -1.0, 0.5]
    push[3 * 12 + 1 : 3 * 16 : 3] = 3.0
    gravity = free.M @ np.tile([0.3, -9.0, 1.0], len(free.nodes))
    cases = (LoadCase("push", "force", push), LoadCase("weight", "gravity", gravity))
    free = replace(free, load_cases=cases)
    return replace(free, interfaces=[replace(x, kind=kind) for x, kind in zip(free.interfaces, kinds, strict=True)])


@pytest.fixture(scope="module")
def body():
    return couple(loaded_bar())


def rest(V, u):
    """Part of u that V cannot give, in columns of unit length."""
    V = V / np.linalg.norm(V, axis=0)
    return np.linalg.norm(u - V @ np.linalg.lstsq(V, u, rcond=1e-13)[0], axis=0) / np.linalg.norm(u, axis=0)


def responses(body, cases):
    """Static response with the boundary held, and that of the free body in balance with its acceleration."""
    F = np.array([case.f for case in cases]).T
    with Families(body) as families:
        free = families.flexibility(F)
    held = np.zeros_like(F)
    held[body.i] = np.linalg.solve(body.K.toarray()[np.ix_(body.i, body.i)], F[body.i])
    return held, free


@pytest.mark.parametrize(
    ("make", "n_new"), [(craig_bampton, 3), (craig_bampton_ir, 1), (rubin, 1)], ids=lambda x: getattr(x, "__name__", x)
)
def test_static_answers_to_load_cases_are_exact_with_as_few_columns_as_it_takes(body, make, n_new):
    """Craig-Bampton lacks inertia relief: two columns for the push, one for the weight, which is balanced when free."""
    modes = make(body, n_modes=2)
    more = with_load_cases(modes, body)
    assert more.columns.shape[1] == modes.columns.shape[1] + n_new
    held, free = responses(body, body.load_cases)
    assert_allclose(rest(more.columns, held), 0, rtol=0, atol=1e-8)
    assert_allclose(rest(more.columns, free[:, :1]), 0, rtol=0, atol=1e-8)
    assert rest(modes.columns, held)[0] > 1e-3


def test_the_set_keeps_its_columns_and_names_the_new_ones(body):
    modes = craig_bampton(body, n_modes=2)
    more = with_load_cases(modes, body)
    n = modes.columns.shape[1]
    assert_allclose(more.columns[:, :n], modes.columns, rtol=0, atol=0)
    assert more.labels[n:] == ("load case push held", "load case weight held", "load case push accelerating")
    assert more.options["extra load case columns in the span already"] == "load case weight accelerating"
    assert more.is_static[n:].all()
    assert "load case push" in reduce(body, more).sources


def test_no_column_is_redundant_in_the_finished_basis(body):
    for make in (craig_bampton, craig_bampton_ir, rubin):
        assert reduce(body, with_load_cases(make(body, n_modes=2), body)).provenance["mode set redundant"] == "none"


def test_adding_the_load_cases_twice_adds_nothing(body):
    once = with_load_cases(craig_bampton(body, n_modes=2), body)
    assert with_load_cases(once, body).columns.shape == once.columns.shape


def test_proportional_loads_add_one_column():
    """A straight beam takes the same centrifugal load about both axes across it, and none about its own."""
    body = couple(beam(6))
    more = with_centrifugal(craig_bampton(body, n_modes=0), body)
    assert more.columns.shape[1] == 12 + 2 * 3  # yy or zz, xz, xy
    assert reduce(body, more).provenance["mode set redundant"] == "none"


def test_load_cases_can_be_named(body):
    modes = with_load_cases(craig_bampton_ir(body, n_modes=0), body, names=["push"])
    assert modes.labels[-1] == "load case push held"
    with pytest.raises(ModeSetError, match="no load case 'pusch'; did you mean 'push'"):
        with_load_cases(modes, body, names=["pusch"])


def test_a_body_without_load_cases_is_refused():
    body = couple(bar(nx=2, kind="hexahedron"))
    with pytest.raises(ModeSetError, match="has no load cases"):
        with_load_cases(craig_bampton(body, n_modes=0), body)


def test_the_set_of_another_body_is_refused(body):
    other = couple(bar(nx=2, kind="hexahedron"))
    with pytest.raises(ModeSetError, match="make the set from this body"):
        with_load_cases(craig_bampton(other, n_modes=0), body)


@pytest.mark.parametrize("kind", ["hexahedron", "tetra10"])
def test_centrifugal_loads_do_the_work_of_the_exact_integrals(kind):
    """f_ab · u = ∫ (c_a u_b + c_b u_a) / -2 + (a = b) c · u, each from the moments ∫ c_a u_b."""
    body = bar(nx=2, kind=kind)
    u = np.random.default_rng(0).normal(size=(body.n_dof, 2))
    P = body.element_model.mass_gram(u)[1:4, 4:].reshape(3, 3, 2)  # ∫ c_a u_b, of every column
    for case, (a, b) in zip(centrifugal_loads(body), [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)], strict=True):
        exact = (a == b) * np.trace(P) - (P[a, b] + P[b, a]) / 2
        assert_allclose(case.f @ u, exact, rtol=0, atol=ROUNDOFF * np.abs(P).max() * 10)


def test_centrifugal_loads_sum_to_the_force_of_any_rotation():
    body = bar(nx=2, kind="hexahedron")
    w = np.array([0.4, -1.3, 0.8])
    products = [w[0] ** 2, w[1] ** 2, w[2] ** 2, 2 * w[1] * w[2], 2 * w[0] * w[2], 2 * w[0] * w[1]]
    total = sum(p * case.f for p, case in zip(products, centrifugal_loads(body), strict=True))
    field = -np.cross(w, np.cross(w, body.nodes))
    assert_allclose(total, body.M @ field.ravel(), rtol=0, atol=ROUNDOFF * np.abs(total).max() * 10)


def test_a_flat_beam_takes_the_torque_that_turns_it_into_the_plane_of_rotation():
    """f_yz = -rho (c_y e_z + c_z e_y) / 2 has the torque -rho (∫ y² - ∫ z²) / 2 about the axis of the beam."""
    body = straight(n=5, section=fm.beams.Rectangle(0.02, 0.05), length=1.3)
    loads = {case.name: case.f.reshape(-1, 6) for case in centrifugal_loads(body)}
    width, height = np.ptp(body.nodes[6:, 1]), np.ptp(body.nodes[6:, 2])  # of the skin
    second = STEEL.rho * width * height / 12 * np.array([width**2, height**2])
    assert_allclose(loads["centrifugal yz"][:, 3].sum(), -1.3 * (second[0] - second[1]) / 2, rtol=1e-9)
    # and the loads are those of the exact moments for any displacement
    u = np.random.default_rng(2).normal(size=(body.n_dof, 2))
    P = body.element_model.mass_gram(body.mesh_displacement(u))[1:4, 4:].reshape(3, 3, 2)
    found = loads["centrifugal xz"].ravel() @ u
    assert_allclose(found, -(P[0, 2] + P[2, 0]) / 2, rtol=0, atol=ROUNDOFF * np.abs(P).max() * 10)


def test_a_spinning_rod_stretches_as_it_should():
    """E u'' = -rho x about the middle: u(L / 2) = rho (L / 2)³ / (3 E) for unit rotation, without lateral strain."""
    length, material = 1.0, Material("cork", E=2.0e11, nu=0.0, rho=7000.0)
    mesh = box_mesh(4, 1, 1, length, 0.05, 0.04, "hexahedron20")
    free = solid_body(mesh, material, name="rod", units=unit_system("m-kg-s"))
    ends = [Interface(n, "nodes", mesh.node_sets[n], np.array([x, 0, 0])) for n, x in (("left", 0.0), ("right", 1.0))]
    body = couple(with_interfaces(free, *ends))
    modes = with_centrifugal(craig_bampton(body, n_modes=0), body)
    exact = material.rho * (length / 2) ** 3 / (3 * material.E)
    (zz,) = (case.f for case in centrifugal_loads(body) if case.name == "centrifugal zz")
    with Families(body) as families:
        u = families.flexibility(zz[:, None])[:, 0].reshape(-1, 3)
    at_end = u[mesh.node_sets["right"], 0]
    assert_allclose(at_end, exact, rtol=1e-6)
    assert_allclose(rest(modes.columns, u.reshape(-1, 1)), 0, rtol=0, atol=1e-7)


def test_centrifugal_responses_are_exact_in_the_set_of_a_body_with_rigid_interfaces():
    free = bar(nx=5, kind="hexahedron")
    body = couple(replace(free, load_cases=centrifugal_loads(free)))
    modes = rubin(body, n_modes=2)
    more = with_centrifugal(modes, body)
    held, accelerating = responses(body, body.load_cases)
    assert_allclose(rest(more.columns, held), 0, rtol=0, atol=1e-8)
    assert_allclose(rest(more.columns, accelerating), 0, rtol=0, atol=1e-8)
    assert rest(modes.columns, held).max() > 1e-3


def test_centrifugal_loads_of_eliminated_dofs_must_come_before_coupling(body):
    with pytest.raises(ModeSetError, match="before coupling"):
        with_centrifugal(craig_bampton(body, n_modes=0), body)


@pytest.mark.parametrize("make", [craig_bampton_ir, rubin, herting, craig_chang], ids=lambda make: make.__name__)
def test_a_rest_that_is_rigid_motion_of_a_slender_frame_is_no_column(make):
    """Its energy is rounding, of either sign, and it was scaled to unit energy: columns of 1e6 beside others of 1."""
    points = Rotation.random(random_state=2).apply([(0, 0, 0), (0.5, 0.1, 0), (1, 0, 0.1), (1.4, 0.3, 0.2)])
    mesh = fm.beams.LineMesh(points, [(0, 1), (1, 2), (2, 3)])
    joints = [
        fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("left", 0), ("right", 3))
    ]
    section = fm.beams.BeamProperty(fm.beams.Rectangle(0.003, 0.003), STEEL)
    free = fm.beam_body(mesh, section, name="wire", units=unit_system("m-kg-s"), interfaces=joints)
    push = np.zeros(free.n_dof)
    push[6:9] = [1.0, 2.0, 3.0]
    weight = 9.81 * (free.M @ (free.dofs[:, 1] == 2).astype(float))
    body = couple(free.with_load_cases(LoadCase("weight", "gravity", weight), LoadCase("push", "force", push)))
    modes = make(body, n_modes=3 if make is craig_chang else 2)
    more = with_load_cases(modes, body)
    new = more.columns[:, modes.columns.shape[1] :]
    assert any("push" in label for label in more.labels)
    assert_allclose(new.T @ (body.K @ new), np.eye(new.shape[1]), rtol=0, atol=1e-2)
