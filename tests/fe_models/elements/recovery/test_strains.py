"""Strains of elements and nodes against the displacement fields that make them."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fe_models as fm
from fe_models.elements.recovery.element_forces import element_groups
from fe_models.elements.recovery.strain import nodal_strain
from fe_models.foundation.errors import BodyError
from fe_models.meshes.mesh import SOLID_TYPES
from tests.bodies import box_mesh
from tests.fe_models.small_frames import SI, STEEL, space_frame, straight
from tests.fe_models.small_shells import plate

NU = STEEL.nu


def group_of(body, quantity):
    return next(group for group in element_groups(body) if group.quantity == quantity)


def line_field(body, eps, kappa_y, kappa_z, twist):
    """Displacements of a beam along x: stretch, w = -kappa_y x²/2 with theta_y = kappa_y x, v = kappa_z x²/2, twist."""
    x = body.nodes[: body.element_model.n_nodes, 0]
    u = np.zeros((len(x), 6))
    u[:, 0], u[:, 3] = eps * x, twist * x
    u[:, 2], u[:, 4] = -kappa_y * x**2 / 2, kappa_y * x
    u[:, 1], u[:, 5] = kappa_z * x**2 / 2, kappa_z * x
    return body.mesh_displacement(u.reshape(-1, 1))


SECTIONS = (fm.beams.Circle(0.01), fm.beams.BoxSection(0.05, 0.08, 0.004, 0.006), fm.beams.Rectangle(0.02, 0.03))


@pytest.mark.parametrize("section", SECTIONS)
def test_strains_of_beams_are_stretch_curvatures_and_twist(section):
    body, given = straight(3, section), (1e-4, 2e-3, -3e-3, 5e-3)
    mesh = line_field(body, *given)
    found = group_of(body, "beam strain").forces(mesh, np.arange(3))
    eps, kappa_y, kappa_z, twist = given
    for end in range(2):
        assert_allclose(found[:, 6 * end : 6 * end + 6, 0], [[eps, 0, 0, twist, kappa_y, kappa_z]] * 3, atol=1e-13)
    n = body.element_model.n_nodes
    skin = np.arange(n, len(body.nodes))
    strain = nodal_strain(body, mesh, skin)[:, :, 0]
    y, z = body.nodes[skin, 1], body.nodes[skin, 2]
    axial = eps + kappa_y * z - kappa_z * y  # the fibre there
    assert_allclose(strain[:, 0], axial, atol=1e-13)
    assert_allclose(strain[:, 1], -NU * axial, atol=1e-13)
    if isinstance(section, fm.beams.Circle):  # tau = G twist r along the rim
        assert_allclose(np.hypot(strain[:, 4], strain[:, 5]), twist * 0.01, rtol=1e-9)


def test_a_shear_force_makes_the_shear_strain_of_the_section_off_its_shear_centre_too():
    body = space_frame()
    mesh = body.mesh_displacement(np.random.default_rng(3).standard_normal((body.n_dof, 2)))
    forces, strains = (group_of(body, f"beam {word}").forces(mesh, np.arange(6)) for word in ("force", "strain"))
    model = body.element_model
    for line in range(6):
        section = model.sections[model.of_line[line]]
        E, G = STEEL.E, STEEL.mu
        y_s, z_s = section.shear_center
        for end in range(2):
            N, Vy, Vz, Mx, My, Mz = forces[line, 6 * end : 6 * end + 6]
            torsion = Mx + z_s * Vy - y_s * Vz
            expected = [N / (E * section.A), Vy / (G * section.A_sy), Vz / (G * section.A_sz),
                        torsion / (G * section.J), My / (E * section.Iy), Mz / (E * section.Iz)]  # fmt: skip
            assert_allclose(strains[line, 6 * end : 6 * end + 6], expected, rtol=1e-12)


@pytest.mark.parametrize("kind", ["quad", "triangle"])
def test_strains_of_shells_are_stretch_and_curvature(kind):
    """u = eps x + a y, w = -(kx x² + ky y²)/2 - kxy x y / 2: strains at height z are eps + z kappa."""
    t, eps, shear, kx, ky, kxy = 0.02, 1e-4, 3e-5, 2e-3, -1e-3, 4e-3
    body = plate(kind, 3, 1.0, 0.8, t, material=STEEL)
    x, y = body.nodes[: body.element_model.n_nodes, :2].T
    u = np.zeros((len(x), 6))
    u[:, 0] = eps * x + shear * y
    u[:, 2] = -(kx * x**2 + ky * y**2 + kxy * x * y) / 2
    u[:, 3], u[:, 4] = -(ky * y + kxy * x / 2), kx * x + kxy * y / 2  # theta_x = w,y, theta_y = -w,x
    u[:, 5] = -shear / 2  # (v,x - u,y)/2
    mesh = body.mesh_displacement(u.reshape(-1, 1))
    group = group_of(body, "shell strain")
    resultant = group_of(body, "shell resultant")
    every = np.arange(group.count)
    found = group.forces(mesh, every)
    planes = group.source.planes
    turn = planes.R[:, :2, :2]  # local axes as columns; the plate lies in x-y
    for row, (field, second) in {0: (np.array([[eps, shear / 2], [shear / 2, 0]]), False),
                                 3: (np.array([[kx, kxy / 2], [kxy / 2, ky]]), True)}.items():  # fmt: skip
        local = turn.transpose(0, 2, 1) @ field @ turn
        expected = np.stack([local[:, 0, 0], local[:, 1, 1], 2 * local[:, 0, 1]], axis=1)
        assert_allclose(found[:, row : row + 3, 0], expected, rtol=0, atol=1e-9 * (1e-2 if second else 1e-3))
    law = group.source.laws[0]
    assert_allclose(np.einsum("ij,njk->nik", law.stiffness, found), resultant.forces(mesh, every), rtol=1e-9, atol=1e-6)
    skin = np.arange(len(x), len(body.nodes))
    strain = nodal_strain(body, mesh, skin)[:, :, 0]
    z = body.nodes[skin, 2]
    xx, yy, xy = eps + z * kx, z * ky, shear + z * kxy
    plane = np.stack([xx, yy, -NU / (1 - NU) * (xx + yy)], axis=1)
    assert_allclose(strain[:, :3], plane, rtol=0, atol=1e-10)
    assert_allclose(strain[:, 5], xy, rtol=0, atol=1e-10)


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_centres_of_solids_show_the_gradient_of_a_linear_field_and_its_stress(kind):
    mesh = box_mesh(2, 1, 1, kind=kind)
    body = fm.solid_body(mesh, STEEL, name="block", units=SI)
    A = np.random.default_rng(5).standard_normal((3, 3)) * 1e-3
    u = body.mesh_displacement((body.nodes @ A.T).reshape(-1, 1))
    e = (A + A.T) / 2
    expected = np.array([e[0, 0], e[1, 1], e[2, 2], 2 * e[1, 2], 2 * e[0, 2], 2 * e[0, 1]])
    strain, stress = (group_of(body, f"element {word}") for word in ("strain", "stress"))
    every = np.arange(strain.count)
    assert_allclose(strain.forces(u, every)[:, :, 0], [expected] * strain.count, rtol=0, atol=1e-13)
    nodal = body.element_model.nodal_stress(u)[0, :, 0]  # constant: the same everywhere
    found = stress.forces(u, every)[:, :, 0]
    assert_allclose(found, [nodal] * stress.count, rtol=0, atol=1e-9 * np.abs(nodal).max())


def test_in_a_quadratic_field_the_centre_has_the_gradient_at_its_place():
    mesh = box_mesh(3, 2, 1, kind="hexahedron20")
    body = fm.solid_body(replace(mesh, cell_numbers={"hexahedron20": np.arange(6) + 40}), STEEL, name="b", units=SI)
    u = np.zeros((len(body.nodes), 3))
    u[:, 0] = body.nodes[:, 0] ** 2 + 3 * body.nodes[:, 0] * body.nodes[:, 1]
    group = group_of(body, "element strain")
    found = group.forces(body.mesh_displacement(u.reshape(-1, 1)), np.arange(6))[:, :, 0]
    centres = mesh.nodes[mesh.cells["hexahedron20"][:, :8]].mean(axis=1)
    assert_allclose(found[:, 0], 2 * centres[:, 0] + 3 * centres[:, 1], rtol=1e-12)
    assert_allclose(found[:, 5], 3 * centres[:, 0], rtol=1e-12)
    assert group.names == tuple(map(str, range(40, 46)))


def test_the_strain_of_orthotropic_layups_at_nodes_is_refused():
    ply = fm.body.OrthotropicMaterial("ply", (1e11, 1e10, 1e10), (5e9, 5e9, 3e9), (0.3, 0.3, 0.3), 1.0)
    layup = fm.shells.LaminateProperty(
        (fm.shells.Layer(ply, 1e-3, 0.0), fm.shells.Layer(ply, 1e-3, 90.0)), direction=(1, 0, 0)
    )
    body = fm.shell_body(fm.shells.flat_plate(1.0, 1.0, 2, 2, kind="quad"), layup, name="layup", units=SI)
    mesh = body.mesh_displacement(np.ones((body.n_dof, 1)))
    with pytest.raises(BodyError, match='layup of OrthotropicMaterial is not known; ask for "shell strain"'):
        nodal_strain(body, mesh, np.array([len(body.nodes) - 1]))
    beam = straight(1)
    with pytest.raises(BodyError, match="node 0 is of no solid, shell or skin of a beam"):
        nodal_strain(beam, beam.mesh_displacement(np.ones((beam.n_dof, 1))), np.array([0]))


def hooke(material, stress):
    """Return the strain of an isotropic material, (n, 6, k)."""
    xx, yy, zz, yz, xz, xy = np.moveaxis(stress, 1, 0)
    E, nu = material.E, material.nu
    normal = [(xx - nu * (yy + zz)) / E, (yy - nu * (xx + zz)) / E, (zz - nu * (xx + yy)) / E]
    return np.stack([*normal, *(2 * (1 + nu) / E * shear for shear in (yz, xz, xy))], axis=1)


ALUMINIUM = fm.Material("aluminium", E=70e9, nu=0.33, rho=2700.0)


def strain_and_stress(body, nodes):
    """Return the strain and stress of any displacements of all nodes and skins of the mesh."""
    n_dof = body.recovery.matrix.shape[0]
    u = np.random.default_rng(8).normal(size=(n_dof, 2))
    return nodal_strain(body, u, nodes), body.element_model.nodal_stress(u)[nodes]


def test_nodal_strains_of_welded_solids_are_those_of_their_own_material_and_motion():
    blocks = []
    for name, material, at, n in (("a", STEEL, 0.0, 2), ("b", ALUMINIUM, 1.0, 3)):
        mesh = box_mesh(n, 1, 1, 1.0, 0.3, 0.2, "hexahedron")
        mesh = replace(mesh, nodes=np.add(mesh.nodes, (at, 0, 0)))
        ends = [
            fm.rigid_interface(mesh, f"{name}{x:g}", fm.selections.Plane((x, 0, 0), (1, 0, 0))) for x in (at, at + 1)
        ]
        blocks.append(fm.couple(fm.solid_body(mesh, material, name=name, units=SI, interfaces=ends)))
    body = fm.weld(blocks, [(("a", "a1"), ("b", "b1"))], name="both")
    first = np.concatenate([np.arange(len(block.element_model.mesh.nodes)) + at
                            for block, at in zip(blocks, (0, body.element_model.n_nodes[0]), strict=True)])  # fmt: skip
    of_steel = first < body.element_model.n_nodes[0]
    nodes = np.random.default_rng(1).permutation(first)
    strain, stress = strain_and_stress(body, nodes)
    expected = np.where(np.isin(nodes, first[of_steel])[:, None, None], hooke(STEEL, stress), hooke(ALUMINIUM, stress))
    assert_allclose(strain, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_nodal_strains_of_a_stiffened_plate_are_those_of_shell_and_beam():
    mesh = fm.shells.flat_plate(1.0, 0.5, 2, 1)
    mesh = replace(mesh, lines=np.array([[0, 1], [1, 2]]), line_sets={"rib": np.arange(2)})
    rib = fm.beams.BeamProperty(fm.beams.Rectangle(0.02, 0.03), ALUMINIUM)
    body = fm.shell_body(mesh, fm.shells.ShellProperty(0.01, STEEL), name="plate", units=SI, stiffeners={"rib": rib})
    model = body.element_model
    n_shell = model.shell.n_nodes + len(model.shell.skin.points)
    on_rib = n_shell + model.frame.n_nodes + np.arange(len(model.frame.skin.points))
    strain, stress = strain_and_stress(body, np.concatenate([on_rib, np.arange(n_shell)]))
    n = len(on_rib)
    expected = np.concatenate([hooke(ALUMINIUM, stress[:n]), hooke(STEEL, stress[n:])])
    for part in (slice(0, n), slice(n, None)):
        assert_allclose(strain[part], expected[part], rtol=0, atol=1e-12 * np.abs(expected[part]).max())


def test_nodal_strains_of_a_layup_are_those_of_the_material_of_its_face():
    """Steel below, twice as thick as aluminium above: at the two faces, and at the middle in steel."""
    layup = fm.shells.LaminateProperty(
        (fm.shells.Layer(STEEL, 2e-3, 0.0), fm.shells.Layer(ALUMINIUM, 1e-3, 0.0)), direction=(1, 0, 0)
    )
    body = fm.shell_body(fm.shells.flat_plate(1.0, 0.6, 2, 2, kind="quad"), layup, name="layup", units=SI)
    nodes = np.arange(len(body.nodes))
    strain, stress = strain_and_stress(body, nodes)
    above = body.nodes[:, 2] > 1e-9
    assert above.any()
    assert (body.nodes[:, 2] < -1e-9).any()
    expected = np.where(above[:, None, None], hooke(ALUMINIUM, stress), hooke(STEEL, stress))
    assert_allclose(strain, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
