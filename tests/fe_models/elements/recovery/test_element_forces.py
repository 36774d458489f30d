"""Forces in shells and springs of simple states, and what elements are called."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

import fe_models as fm
from fe_models.elements.recovery.element_forces import element_groups
from fe_models.foundation.units import unit_system
from fe_models.meshes.numbering import NamedSet
from tests.bodies import STEEL, box_mesh

T, LENGTH = 0.01, 0.5


def plate() -> fm.FEBody:
    """A square of four flat quads in the x-y plane."""
    x, y = np.meshgrid(np.linspace(0, LENGTH, 3), np.linspace(0, LENGTH, 3), indexing="ij")
    nodes = np.stack([x.ravel(), y.ravel(), np.zeros(9)], axis=1)
    quads = np.array([[0, 3, 4, 1], [1, 4, 5, 2], [3, 6, 7, 4], [4, 7, 8, 5]])
    return fm.shell_body(
        fm.shells.ShellMesh(nodes, {"quad": quads}),
        fm.shells.ShellProperty(T, STEEL),
        name="plate",
        units=unit_system("m-kg-s"),
    )


def test_resultants_of_a_stretched_and_bent_plate():
    """N = E t/(1 - nu²) (1, nu) eps; M = D (1, nu) kappa of w = -kappa x²/2, whose rotation theta_y = -w,x."""
    body, eps, kappa = plate(), 1e-4, 2e-3
    assert body.element_model is not None
    u = np.zeros((body.n_dof, 2))
    x = body.nodes[:, 0]
    mesh = np.zeros((9, 6, 2))
    mesh[:, 0, 0] = eps * x[:9]
    mesh[:, 2, 1], mesh[:, 4, 1] = -kappa * x[:9] ** 2 / 2, kappa * x[:9]
    u[:54] = mesh.reshape(54, 2)
    group, _ = element_groups(body)
    assert (group.quantity, group.count, group.part) == ("shell resultant", 4, "quad")
    mesh_u = np.zeros((body.element_model.n_mesh_dof, 2))
    mesh_u[:54] = u[:54]
    forces = group.forces(mesh_u, np.array([2, 0]))
    E, nu = STEEL.E, STEEL.nu
    N = E * T / (1 - nu**2) * eps * np.array([1, nu, 0])
    M = E * T**3 / (12 * (1 - nu**2)) * kappa * np.array([1, nu, 0])
    for element in range(2):
        assert_allclose(forces[element, :3, 0], N, rtol=0, atol=1e-9 * N[0])
        assert_allclose(np.abs(forces[element, 3:6, 1]), M, rtol=0, atol=1e-9 * M[0])


def test_a_spring_shows_its_stiffness_times_its_elongation():
    nodes = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0.2, 0], [2, 0.2, 0]])
    mesh = fm.beams.LineMesh(nodes, np.array([[0, 1], [2, 3]]))
    triad = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])  # columns: its axes, x along y
    spring = fm.beams.Spring((1, 2), [1e4, 2e3, 0, 0, 0, 5.0], triad=triad)
    body = fm.beam_body(
        mesh,
        fm.beams.BeamProperty(fm.beams.Circle(0.01), STEEL),
        name="two",
        units=unit_system("m-kg-s"),
        springs=[spring],
    )
    beams, _, springs = element_groups(body)
    assert (beams.quantity, springs.quantity, springs.names) == ("beam force", "spring force", ("0",))
    u = np.zeros((body.element_model.n_mesh_dof, 1))
    u[6 * 2 + 1], u[6 * 2] = 1e-3, 4e-3  # node 2 away along y, and along x
    force = springs.forces(u, np.array([0]))[0, :, 0]
    assert_allclose(force, [10.0, 8.0, 0, 0, 0, 0], atol=1e-12)
    rigid = np.zeros((body.element_model.n_mesh_dof, 1))
    rigid[: 6 * 4] = np.array([[*np.cross([0.1, 0.2, 0.3], c), 0.1, 0.2, 0.3] for c in nodes]).reshape(-1, 1)
    assert_allclose(springs.forces(rigid, np.array([0])), 0.0, atol=1e-12)
    assert_allclose(beams.forces(rigid, np.array([0, 1])), 0.0, atol=1e-6)


def test_elements_are_called_as_the_user_does():
    nodes = np.stack([np.arange(4.0), np.zeros(4), np.zeros(4)], axis=1)
    mesh = fm.beams.LineMesh(
        nodes, np.array([[0, 1], [1, 2], [2, 3]]), line_numbers=np.array([40, 20, 30]),
        line_sets={"braces": np.array([2, 0])},
    )  # fmt: skip
    body = fm.beam_body(
        mesh, fm.beams.BeamProperty(fm.beams.Circle(0.01), STEEL), name="frame", units=unit_system("m-kg-s")
    )
    group, _ = element_groups(body)
    assert group.names == ("40", "20", "30")
    assert group.numbers.tolist() == [40, 20, 30]
    assert group.groups["braces"].tolist() == [0, 2]
    nameless = replace(body, numbering=type(body.numbering)(sets=(NamedSet("x", "nodes", np.array([0]), 1),)))
    assert element_groups(nameless)[0].names == ("0", "1", "2")


def test_beams_on_a_shell_know_which_nodes_of_the_body_are_theirs():
    """Behind the nodes and the skin of the shell: places that the groups name are those of their own models."""
    mesh = replace(
        fm.shells.flat_plate(1.0, 0.5, 2, 1), lines=np.array([[0, 1], [1, 2]]), line_sets={"rib": np.arange(2)}
    )
    bar = fm.beams.BeamProperty(fm.beams.Rectangle(0.02, 0.03), STEEL)
    body = fm.shell_body(
        mesh, fm.shells.ShellProperty(T, STEEL), name="p", units=unit_system("m-kg-s"), stiffeners={"rib": bar}
    )
    groups = element_groups(body)
    beams = next(group for group in groups if group.quantity == "beam force")
    own = beams.source.nodes
    assert beams.first_node >= len(mesh.nodes)
    assert_allclose(body.nodes[beams.first_node : beams.first_node + len(own)], own, rtol=0, atol=1e-15)
    assert next(group for group in groups if group.quantity == "shell resultant").first_node == 0


def bodies_of_all_elements(name: str):
    """A frame with a spring and a stiffened plate over a beam, and a brick; numbers of SI put into other units."""
    units = unit_system(name)

    def si(value, mass=0, length=0, time=0):
        return np.asarray(value) / units.to_si(mass=mass, length=length, time=time)

    steel = fm.Material("steel", E=float(si(2e11, 1, -1, -2)), nu=0.3, rho=float(si(7800.0, 1, -3)))
    lines = fm.beams.LineMesh(si([[0.0, 0, 0], [1, 0.2, 0], [1, 0.4, 0.1]], length=1), np.array([[0, 1]]))
    spring = fm.beams.Spring((1, 2), [*si([1e4, 2e3, 3e3], 1, 0, -2), *si([5.0, 6, 7], 1, 2, -2)])
    bar = fm.beams.BeamProperty(fm.beams.Rectangle(*si([0.02, 0.03], length=1).tolist()), steel)
    yield fm.beam_body(lines, bar, name="frame", units=units, springs=[spring])
    plate = fm.shells.flat_plate(float(si(1.0, length=1)), float(si(0.5, length=1)), 2, 1)
    plate = replace(plate, lines=np.array([[0, 1], [1, 2]]), line_sets={"rib": np.arange(2)})
    t = fm.shells.ShellProperty(float(si(T, length=1)), steel)
    yield fm.shell_body(plate, t, name="plate", units=units, stiffeners={"rib": bar})
    brick = box_mesh(2, 1, 1, *si([0.5, 0.2, 0.1], length=1).tolist(), kind="hexahedron")
    yield fm.solid_body(brick, steel, name="brick", units=units)


def test_every_component_of_every_element_has_its_dimensions():
    """The same displacement in two unit systems: values differ by the factor of their dimensions."""
    old, new = unit_system("m-kg-s"), unit_system("mm-g-ms")
    seen = set()
    for a, b in zip(bodies_of_all_elements(old.name), bodies_of_all_elements(new.name), strict=True):
        n = 3 * len(a.nodes) if a.name == "brick" else a.element_model.n_mesh_dof
        u = np.random.default_rng(5).normal(size=(n, 2))
        is_length = np.full(n, True) if a.name == "brick" else np.tile(np.arange(6) < 3, n // 6)
        v = np.where(is_length[:, None], u / new.length, u)
        for one, other in zip(element_groups(a), element_groups(b), strict=True):
            every = np.arange(one.count)
            assert len(one.dimensions) == len(one.components) == one.forces(u, every).shape[1], one.quantity
            factors = np.array([each.factor(old, new) for each in one.dimensions])
            found, expected = other.forces(v, every), one.forces(u, every) * factors[None, :, None]
            scale = np.abs(expected).max(axis=(0, 2), keepdims=True)
            assert_allclose(found / np.where(scale > 0, scale, 1), expected / np.where(scale > 0, scale, 1), atol=1e-9)
            seen.add(one.quantity)
    assert seen == {
        "beam force", "beam strain", "spring force", "shell resultant", "shell strain", "element stress",
        "element strain",
    }  # fmt: skip
