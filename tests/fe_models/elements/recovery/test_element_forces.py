"""Forces in shells and springs of simple states, and what elements are called."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

import fe_models as fm
from fe_models.elements.recovery.element_forces import element_groups
from fe_models.foundation.units import unit_system
from fe_models.meshes.numbering import NamedSet
from tests.bodies import STEEL

T, LENGTH = 0.01, 0.5


def plate() -> fm.FEBody:
    """A square of four flat quads in the x-y plane."""
    x, y = np.meshgrid(np.linspace(0, LENGTH, 3), np.linspace(0, LENGTH, 3), indexing="ij")
    nodes = np.stack([x.ravel(), y.ravel(), np.zeros(9)], axis=1)
    quads = np.array([[0, 3, 4, 1], [1, 4, 5, 2], [3, 6, 7, 4], [4, 7, 8, 5]])
    return fm.shell_body(
        fm.ShellMesh(nodes, {"quad": quads}), fm.ShellProperty(T, STEEL), name="plate", units=unit_system("m-kg-s")
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
    mesh = fm.LineMesh(nodes, np.array([[0, 1], [2, 3]]))
    triad = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])  # columns: its axes, x along y
    spring = fm.Spring((1, 2), [1e4, 2e3, 0, 0, 0, 5.0], triad=triad)
    body = fm.beam_body(
        mesh, fm.BeamProperty(fm.Circle(0.01), STEEL), name="two", units=unit_system("m-kg-s"), springs=[spring]
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
    mesh = fm.LineMesh(
        nodes, np.array([[0, 1], [1, 2], [2, 3]]), line_numbers=np.array([40, 20, 30]),
        line_sets={"braces": np.array([2, 0])},
    )  # fmt: skip
    body = fm.beam_body(mesh, fm.BeamProperty(fm.Circle(0.01), STEEL), name="frame", units=unit_system("m-kg-s"))
    group, _ = element_groups(body)
    assert group.names == ("40", "20", "30")
    assert group.numbers.tolist() == [40, 20, 30]
    assert group.groups["braces"].tolist() == [0, 2]
    nameless = replace(body, numbering=type(body.numbering)(sets=(NamedSet("x", "nodes", np.array([0]), 1),)))
    assert element_groups(nameless)[0].names == ("0", "1", "2")


def test_beams_on_a_shell_know_which_nodes_of_the_body_are_theirs():
    """Behind the nodes and the skin of the shell: places that the groups name are those of their own models."""
    mesh = replace(fm.flat_plate(1.0, 0.5, 2, 1), lines=np.array([[0, 1], [1, 2]]), line_sets={"rib": np.arange(2)})
    bar = fm.BeamProperty(fm.Rectangle(0.02, 0.03), STEEL)
    body = fm.shell_body(
        mesh, fm.ShellProperty(T, STEEL), name="p", units=unit_system("m-kg-s"), stiffeners={"rib": bar}
    )
    groups = element_groups(body)
    beams = next(group for group in groups if group.quantity == "beam force")
    own = beams.source.nodes
    assert beams.first_node >= len(mesh.nodes)
    assert_allclose(body.nodes[beams.first_node : beams.first_node + len(own)], own, rtol=0, atol=1e-15)
    assert next(group for group in groups if group.quantity == "shell resultant").first_node == 0
