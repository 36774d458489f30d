"""Reduced geometric stiffness of unit loads: invariance under rotation, columns that buckle, beams that spin."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose, assert_array_equal

import cms
from cms.errors import BodyError, ModeSetError
from cms.reduction.basis.frames import BuckensFrame, NodalFrame, TisserandFrame, frame_condition
from cms.reduction.basis.node_results import reference_motion
from cms.reduction.geometric_stiffness.geometric_reduction import reduced_geometric_stiffness
from cms.reduction.geometric_stiffness.unit_states import balanced, unit_loads, unit_states
from fe_models.body.elimination import planar
from fe_models.body.material import Material
from fe_models.body.rigid_motion import MassLoads, rigid_motion_of_dofs
from fe_models.elements.beams.attachments import PointMass
from fe_models.elements.beams.beam_property import BeamProperty
from fe_models.elements.beams.body import beam_body
from fe_models.elements.beams.sections import Rectangle
from fe_models.elements.interfaces import NodeIndices, line_interface
from fe_models.meshes.line_mesh import LineMesh, straight_line
from tests.bodies import STEEL, bar
from tests.cms.reduction.geometric_stiffness.examples import SECTION, SI, bar_of_beams, some_bodies


@pytest.mark.parametrize("frame", [TisserandFrame(), NodalFrame(), BuckensFrame()], ids=lambda f: type(f).__name__)
@pytest.mark.parametrize("name", ["rigid", "distributing", "nodes", "linked", "welded", "tied", "two"])
def test_a_rigid_rotation_turns_the_loads(name, frame):
    """phi·K_j (theta × c) is the work on phi of the loads turned by theta; half of it for moments."""
    body = some_bodies()[name]
    condition = frame_condition(body, frame)
    phi = np.random.default_rng(3).standard_normal((body.n_dof, 2))
    phi[body.dofs[:, 1] < 0] = 0.0  # no gap between a reference node and the mean of its members
    with cms.modes.Families(body) as families:
        phi = families.flexibility(phi)  # smooth shapes
        phi /= np.abs(phi).max()
        columns = np.hstack([rigid_motion_of_dofs(body.nodes, body.dofs), phi])
        found = reduced_geometric_stiffness(families, columns, condition)
    own = found.interfaces.reshape(-1, *found.spin.shape[1:])
    K = np.concatenate([found.translation, found.rotation, found.spin, own, found.spread.K])
    spread = unit_states(body, frame=condition).spread
    loads = balanced(body, unit_loads(body, condition.frame, body.interfaces, spread), condition)
    assert_allclose(K[:, :3], 0, rtol=0, atol=1e-9 * np.abs(K).max())  # translations
    T = np.eye(body.n_dof) if body.recovery is None else body.recovery.matrix
    for a in range(3):
        tilde = np.cross(np.eye(3)[a], np.eye(3)).T
        turned = MassLoads(tilde @ loads.mass.A, loads.mass.b @ tilde.T)
        expected = body.element_model.mass_forces(turned).T @ (T @ columns)
        expected += turned_on_dofs(body, loads, condition, tilde) @ columns
        scale = np.abs(K[:, 6:, 6:]).max(axis=(1, 2)) + np.abs(expected).max(axis=1)
        defect = (K[:, 3 + a] - expected)[~loads.is_zero] / scale[~loads.is_zero, None]
        assert_allclose(defect, 0, rtol=0, atol=1e-7)
    assert not K[loads.is_zero].any()


def turned_on_dofs(body, loads, condition, tilde):
    """Forces on dofs turned, moments by half, (k, n_dof): on nodes, and on the reference points of interfaces."""
    six = np.kron(np.diag([1.0, 0.5]), tilde)
    result = np.zeros(loads.on_dofs.T.shape)
    rest = np.array(loads.on_dofs)
    for number, interface in enumerate(body.interfaces):
        motion = reference_motion(body, interface).rows
        own = np.kron(np.eye(2), condition.frame.axes)
        rest[:, 12 + 6 * number : 18 + 6 * number] -= motion.T @ own
        result[12 + 6 * number : 18 + 6 * number] += (motion.T @ (six @ own)).T
    by_node = np.zeros((len(body.nodes), 6, loads.mass.k))
    real = body.dofs[:, 1] >= 0
    by_node[body.dofs[real, 0], body.dofs[real, 1]] = rest[real]
    turned = np.einsum("ab,nbj->naj", six, by_node)
    result[:, real] += turned[body.dofs[real, 0], body.dofs[real, 1]].T
    return result


def critical(K, K_geo):
    """Least factor P > 0 at which K - P K_geo is singular: of the opposite of a load that pulls."""
    return 1 / la.eigh(K_geo, K, eigvals_only=True)[-1]


def bar_without_lateral_strain():
    """Its rigid ends do not keep it from widening."""
    return bar(10, 1, 1, material=replace(STEEL, nu=0.0))


@pytest.mark.parametrize("make", [bar_without_lateral_strain, bar_of_beams], ids=["solid", "beams"])
def test_a_column_buckles_at_the_load_of_euler(make):
    body = cms.couple(make())
    EI = STEEL.E * 0.05 * 0.04**3 / 12
    with cms.modes.Families(body) as families:
        modes = cms.craig_bampton(families, n_modes=12)
        reduced = cms.reduce(families, modes, frame=NodalFrame(at="left"), geometric=True)
    push = critical(reduced.K, reduced.geometric.interfaces[1, 0])
    shear = 1 + np.pi**2 * EI / 4 / (STEEL.E / 2.6 * 0.05 * 0.04 * 5 / 6)  # Engesser: 1/P = 1/P_Euler + 1/(G A_s)
    assert_allclose(push, np.pi**2 * EI / 4 / shear, rtol=4e-3)


@pytest.mark.parametrize("angle", [0.0, 45.0])
def test_a_frame_bent_by_end_moments_tips_over_at_the_same_moment_either_way(angle):
    """Two legs at an angle, hinged about the normal of their plane: M = ± pi sqrt(EI GJ) / L, whatever the angle.

    Moments that do not turn by half with a node at the corner give a frame that is stiffer one way (Argyris 1979).
    """
    L, n, section = 240.0, 12, Rectangle(30.0, 0.6)
    leg = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
    s = np.linspace(0, L, n + 1)[:, None]
    nodes = np.vstack([s * leg, L * leg + s[1:] * leg * [1, -1, 1]])
    mesh = LineMesh(nodes, np.stack([np.arange(2 * n), np.arange(1, 2 * n + 1)], axis=1))
    ends = [line_interface(mesh, name, NodeIndices((node,))) for name, node in (("a", 0), ("b", 2 * n))]
    material = Material("metal", E=71240.0, nu=0.31, rho=2.7e-9)
    body = beam_body(mesh, BeamProperty(section, material), name="frame", units=SI, interfaces=ends)
    body = cms.couple(body)
    a, b = (np.asarray(interface.dofs) for interface in body.interfaces)
    free = np.setdiff1d(np.arange(body.n_dof), [*a[:5], *b[1:5]])
    found = reduced_geometric_stiffness(body, np.eye(body.n_dof)[:, free], frame_condition(body, NodalFrame("a")))
    K = body.K.toarray()[np.ix_(free, free)]
    values = la.eigh(found.interfaces[1, 5] - found.interfaces[0, 5], K, eigvals_only=True)
    properties = section.properties(material.nu)
    expected = np.pi * np.sqrt(material.E * properties.Iy * material.mu * properties.J) / L
    assert_allclose(1 / values[[0, -1]], [-expected, expected], rtol=5e-3)


def test_a_narrow_cantilever_tips_over_at_the_load_of_prandtl():
    """A narrow cantilever under a lateral tip force: P = 4.0126 sqrt(EI GJ) / L² (Timoshenko & Gere)."""
    L, height, width = 2.0, 0.06, 0.003
    section = Rectangle(width, height)
    body = cms.couple(bar_of_beams(24, L, section))
    properties = section.properties(STEEL.nu)
    EI, GJ = STEEL.E * min(properties.Iy, properties.Iz), STEEL.mu * properties.J
    stiff = int(np.argmax([properties.Iz, properties.Iy]))  # 0: strong for forces along y
    with cms.modes.Families(body) as families:
        modes = cms.craig_bampton(families, n_modes=30)
        reduced = cms.reduce(families, modes, frame=NodalFrame(at="left"), geometric=True)
    K_geo = reduced.geometric.interfaces[1, 1 + stiff]
    assert_allclose(critical(reduced.K, K_geo), 4.0126 * np.sqrt(EI * GJ) / L**2, rtol=5e-3)


@pytest.mark.parametrize("make", [bar_without_lateral_strain, bar_of_beams], ids=["solid", "beams"])
def test_a_bent_cantilever_becomes_shorter(make):
    """A tip load bends it by w; its tip comes nearer by ∫ ½ w'² = 3/5 w²/L, which is ½ qᵀ K q of the unit force x."""
    body = cms.couple(make())
    with cms.modes.Families(body) as families:
        modes = cms.craig_bampton(families, n_modes=8)
        reduced = cms.reduce(families, modes, frame=NodalFrame(at="left"), geometric=True)
    Psi = reduced.interface("right").Psi
    q = Psi[2] / np.diag(reduced.K)  # of a unit force along z
    shortening = q @ reduced.geometric.interfaces[1, 0] @ q / 2
    assert_allclose(shortening, 0.6 * (Psi[2] @ q) ** 2, rtol=5e-3)


def test_many_loads_in_blocks_are_the_same(monkeypatch):
    body = cms.couple(bar(2, 1, 1))
    Phi = np.random.default_rng(0).standard_normal((body.n_dof, 2))
    condition = frame_condition(body, TisserandFrame())
    whole = reduced_geometric_stiffness(body, Phi, condition)
    monkeypatch.setattr("cms.reduction.geometric_stiffness.geometric_reduction.LOADS_AT_ONCE", 7)
    parts = reduced_geometric_stiffness(body, Phi, condition)
    assert_allclose(parts.spin, whole.spin, rtol=0, atol=1e-12 * np.abs(whole.spin).max())
    assert_allclose(parts.interfaces, whole.interfaces, rtol=0, atol=1e-12 * np.abs(whole.interfaces).max())


def spinning_cantilever_reference(speed, radius, n=12):
    """Flap frequencies of w: ∫ EI w''² + N w'² = omega² ∫ w², N = speed² ∫_x (radius + s), EI = rho A = L = 1.

    Ritz with x² P_k(2 x - 1), P_k of Legendre.
    """
    x, weight = np.polynomial.legendre.leggauss(40)
    x, weight = (x + 1) / 2, weight / 2
    square = np.polynomial.Polynomial([0, 0, 1])
    legendre = [np.polynomial.Legendre.basis(k, domain=[0, 1]) for k in range(n)]
    shapes = [square * P.convert(kind=np.polynomial.Polynomial) for P in legendre]
    w, dw, ddw = (np.array([s.deriv(d)(x) if d else s(x) for s in shapes]) for d in (0, 1, 2))
    N = speed**2 * (radius * (1 - x) + (1 - x**2) / 2)
    M, K = (w * weight) @ w.T, (ddw * weight) @ ddw.T + (dw * weight * N) @ dw.T
    return np.sqrt(la.eigh(K, M, eigvals_only=True))


@pytest.mark.parametrize(("speed", "radius"), [(2.0, 0.0), (6.0, 1.0), (12.0, 0.0)])
def test_a_spinning_cantilever_has_the_flap_frequencies_of_the_rotating_beam(speed, radius):
    """Speeds in units of sqrt(EI / rho A) / L²; Wright et al. (1982): 4.1373 at speed 2, 13.1702 at 12, radius 0."""
    L, section = 1.0, Rectangle(0.004, 0.004)
    body = cms.couple(bar_of_beams(30, L, section))
    EI, rho_A = STEEL.E * 0.004**4 / 12, STEEL.rho * 0.004**2
    unit = np.sqrt(EI / rho_A) / L**2
    with cms.modes.Families(body) as families:
        modes = cms.craig_bampton(families, n_modes=20)
        reduced = cms.reduce(families, modes, frame=NodalFrame(at="left"), geometric=True)
    Omega = speed * unit
    geometric = reduced.geometric
    K = reduced.K + Omega**2 * (geometric.spin[2] - radius * L * geometric.translation[0])
    K = K - Omega**2 * reduced.moments.C5[:, :, 2, 2]
    expected = spinning_cantilever_reference(speed, radius)[:2]
    flap, lag = expected, np.sqrt(expected**2 - speed**2)
    found = 1 / np.sqrt(la.eigh(reduced.M, K, eigvals_only=True)[-8:]) / unit
    for value in np.concatenate([flap, lag]):
        assert np.abs(found - value).min() < 1e-3 * value
    if radius == 0.0:
        assert_allclose(flap[0], {2.0: 4.1373, 12.0: 13.1702}[speed], rtol=1e-4)


@pytest.mark.parametrize("kind", ["tetra10", "hexahedron20"])
def test_a_spinning_cantilever_of_solids_has_the_flap_frequency_of_the_rotating_beam(kind):
    """Speed 6: 7.3604 in flap (Wright et al., 1982), lag² = flap² - speed²; the solid is a little softer at rest."""
    material, h = replace(STEEL, nu=0.0), 0.02
    body = cms.couple(bar(20, 1, 1, width=h, height=h, kind=kind, material=material))
    unit = np.sqrt(STEEL.E * h**2 / 12 / STEEL.rho)
    with cms.modes.Families(body) as families:
        modes = cms.craig_bampton(families, n_modes=10)
        reduced = cms.reduce(families, modes, frame=NodalFrame(at="left"), geometric=True)
    Omega = 6.0 * unit
    found = []
    for K_geo in (0.0, Omega**2 * (reduced.geometric.spin[2] - reduced.moments.C5[:, :, 2, 2])):
        found.append(1 / np.sqrt(la.eigh(reduced.M, reduced.K + K_geo, eigvals_only=True)[-1:]) / unit)
    at_rest, lag = np.concatenate(found)
    assert_allclose(at_rest, 3.5160, rtol=3e-3)
    assert_allclose(lag**2 - at_rest**2, 7.3604**2 - 6.0**2 - 3.5160**2, rtol=5e-3)


def test_solids_and_beams_agree():
    """A slender bar of solids and of beams: K_spin and K of end loads over the first bending modes."""
    values = []
    for body in (bar(16, 1, 1, width=0.02, height=0.02), bar_of_beams(16, section=Rectangle(0.02, 0.02))):
        body = cms.couple(body)
        with cms.modes.Families(body) as families:
            modes = cms.modes.normal_modes(families, n_modes=4)
            reduced = cms.reduce(families, modes, geometric=True)
        g = reduced.geometric
        values.append([np.linalg.eigvalsh(K) for K in (*g.spin[:3], g.interfaces[1, 0] - g.interfaces[0, 0])])
    for solid, beams in zip(*values, strict=True):
        assert_allclose(solid, beams, rtol=0, atol=0.01 * np.abs(np.array(beams)).max())


def test_mean_axes_need_no_matrices_of_accelerations():
    body = cms.couple(bar(3, 1, 1))
    reduced = cms.reduce(body, cms.craig_bampton(body, n_modes=2), geometric=True)
    assert not reduced.geometric.translation.any()
    assert not reduced.geometric.rotation.any()
    assert reduced.geometric.spin.any()


def test_the_support_does_not_matter_to_loads_in_balance():
    """Two opposite forces on the ends: the same stress in every frame, so the same matrix over the same shapes."""
    body = cms.couple(bar(3, 1, 1))
    Phi = np.random.default_rng(0).standard_normal((body.n_dof, 3))
    matrices = []
    with cms.modes.Families(body) as families:
        for frame in (TisserandFrame(), NodalFrame("left"), NodalFrame("right"), BuckensFrame()):
            g = reduced_geometric_stiffness(families, Phi, frame_condition(body, frame))
            matrices.append(g.interfaces[1, 0] - g.interfaces[0, 0])
    for K in matrices[1:]:
        assert_allclose(K, matrices[0], rtol=0, atol=1e-8 * np.abs(matrices[0]).max())


def test_turned_axes_turn_the_matrices():
    """The matrices of a frame with other axes are those of the same loads, named along the new axes."""
    body = cms.couple(bar(3, 1, 1))
    Phi = np.random.default_rng(0).standard_normal((body.n_dof, 2))
    axes = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))  # new x along y
    with cms.modes.Families(body) as families:
        old, new = (
            reduced_geometric_stiffness(families, Phi, frame_condition(body, frame))
            for frame in (NodalFrame("left"), NodalFrame("left", axes=axes))
        )
    scale = np.abs(old.spin).max()
    assert_allclose(new.translation, old.translation[[1, 2, 0]], rtol=0, atol=1e-9 * np.abs(old.translation).max())
    assert_allclose(new.spin, old.spin[[1, 2, 0, 4, 5, 3]], rtol=0, atol=1e-9 * scale)


def test_a_planar_frame_stiffens_in_its_plane():
    body = planar(cms.couple(bar_of_beams(8)), normal=2)
    reduced = cms.reduce(body, cms.craig_bampton(body, n_modes=4), frame=NodalFrame(at="left"), geometric=True)
    space = cms.couple(bar_of_beams(8))
    whole = cms.reduce(space, cms.craig_bampton(space, n_modes=20), frame=NodalFrame(at="left"), geometric=True)
    lag = critical(reduced.K, reduced.geometric.interfaces[1, 0])
    both = 1 / la.eigh(whole.geometric.interfaces[1, 0], whole.K, eigvals_only=True)[-4:]
    assert np.abs(both / lag - 1).min() < 2e-3


def test_a_body_with_hardly_any_inertia_about_its_axis_is_stiffened_too():
    """Point masses in a row on massless beams; with none at all no frame can turn with the body."""
    massless = replace(STEEL, rho=1e-30)
    mesh = straight_line((0, 0, 0), (1, 0, 0), 4)
    ends = [line_interface(mesh, name, NodeIndices((node,))) for name, node in (("left", 0), ("right", 4))]
    masses = [PointMass(node, 1.0, (1e-9, 0.1, 0.1)) for node in range(5)]
    body = cms.couple(
        beam_body(mesh, BeamProperty(SECTION, massless), name="row", units=SI, interfaces=ends, point_masses=masses)
    )
    reduced = cms.reduce(body, cms.modes.guyan(body), frame=NodalFrame("left"), geometric=True)
    EI = STEEL.E * 0.05 * 0.04**3 / 12
    assert critical(reduced.K, reduced.geometric.interfaces[1, 0]) > 0.99 * np.pi**2 * EI / 4


def test_states_made_before_serve_when_the_factorisation_is_gone():
    body = cms.couple(bar(3, 1, 1))
    frame = NodalFrame("left")
    with cms.modes.Families(body) as families:
        modes = cms.craig_bampton(families, n_modes=2)
        expected = cms.reduce(families, modes, frame=frame, geometric=True).geometric
        states = cms.reduction.unit_states(families, frame=frame)
    found = cms.reduce(body, modes, geometric=states).geometric
    for name in ("translation", "rotation", "spin", "interfaces"):
        assert_array_equal(getattr(found, name), getattr(expected, name))
    with pytest.raises(ModeSetError, match=r"belong to body 'bar' in a nodal frame; .* no other frame"):
        cms.reduce(body, modes, frame=cms.TisserandFrame(), geometric=states)
    with pytest.raises(ModeSetError, match="expected states of this body object 'bar'"):
        cms.reduce(cms.couple(bar(3, 1, 1)), modes, geometric=states)


def test_bare_matrices_are_refused():
    from fe_models.files.matrices.given import body_from_matrices

    solid = bar(2, 1, 1)
    body = body_from_matrices(
        solid.M, solid.K, solid.nodes, solid.dofs, name="foreign", units=SI, interfaces=solid.interfaces
    )
    body = cms.couple(body)
    with pytest.raises(BodyError, match="'foreign': geometric stiffness needs the elements"):
        cms.reduce(body, cms.modes.guyan(body), geometric=True)
    assert cms.reduce(body, cms.modes.guyan(body)).geometric is None
