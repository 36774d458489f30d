"""Small meshes and bodies for the tests."""

import itertools
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from fe_models.body.fe_body import FEBody, Interface
from fe_models.body.material import Material
from fe_models.meshes.cell_shapes import CELL_SHAPES, shape_values
from fe_models.meshes.mesh import Mesh

STEEL = Material("steel", E=2.1e11, nu=0.3, rho=7850.0)
ALUMINIUM = Material("aluminium", E=7.0e10, nu=0.33, rho=2700.0)


def box_mesh(nx=2, ny=2, nz=2, lx=1.0, ly=1.0, lz=1.0, kind="hexahedron") -> Mesh:
    """A box 0..lx, 0..ly, 0..lz of nx * ny * nz bricks, each one hexahedron, two wedges, six tetrahedra or pyramids.

    Node sets: "left" (x = 0), "right" (x = lx), "bottom" (z = 0), "top" (z = lz); cell sets: "all", and "left half",
    "right half" by the bricks' position along x (the middle brick is in the right half).
    """
    corners = np.array(CELL_SHAPES["hexahedron"].corners)
    if kind.startswith("hexahedron"):
        parts = [corners]
    elif kind.startswith("wedge"):
        parts = [corners[[0, 1, 3, 4, 5, 7]], corners[[1, 2, 3, 5, 6, 7]]]
    elif kind.startswith("pyramid"):  # with their tips in the middle
        facets = CELL_SHAPES["hexahedron"].facets
        parts = [np.vstack([corners[list(facet[::-1])], [0.5, 0.5, 0.5]]) for facet in facets]
    else:
        parts = []
        for order in itertools.permutations(range(3)):  # six tetrahedra along the paths from corner 0 to corner 6
            steps = np.cumsum([np.eye(3, dtype=int)[axis] for axis in order], axis=0)
            tet = np.vstack([[0, 0, 0], steps])
            parts.append(tet if np.linalg.det(tet[1:]) > 0 else tet[[0, 2, 1, 3]])
    reference = CELL_SHAPES[kind].nodes
    low_order = {
        "tetra10": "tetra", "hexahedron20": "hexahedron", "hexahedron27": "hexahedron", "wedge15": "wedge",
        "pyramid13": "pyramid",
    }.get(kind, kind)  # fmt: skip
    to_nodes = shape_values(low_order, reference)[0]
    inside = np.rint(4 * np.array([to_nodes @ part for part in parts])).astype(int)  # on the quarter-step lattice
    bricks = np.array(list(itertools.product(range(nx), range(ny), range(nz))))
    lattice = (4 * bricks[:, None, None] + inside[None]).reshape(-1, 3)
    sizes = (4 * nx + 1, 4 * ny + 1, 4 * nz + 1)
    keys, cells = np.unique(np.ravel_multi_index(lattice.T, sizes), return_inverse=True)
    points, cells = np.stack(np.unravel_index(keys, sizes), axis=1), cells.reshape(-1, len(reference))
    nodes = points * np.array([lx / nx, ly / ny, lz / nz]) / 4
    is_left = np.repeat(2 * bricks[:, 0] + 1 < nx, len(parts))
    halves = {"left half": is_left, "right half": ~is_left, "all": np.ones(len(cells), bool)}
    x, z = points[:, 0], points[:, 2]
    sides = {"left": x == 0, "right": x == 4 * nx, "bottom": z == 0, "top": z == 4 * nz}
    return Mesh(
        nodes,
        {kind: cells},
        cell_sets={group: {kind: np.flatnonzero(is_in)} for group, is_in in halves.items()},
        node_sets={group: np.flatnonzero(is_in) for group, is_in in sides.items()},
        source=f"box {nx} x {ny} x {nz} {kind}",
    )


def bar(
    nx=8, ny=1, nz=1, length=1.0, width=0.05, height=0.04, kind="hexahedron20", material=STEEL, ranks=None
) -> FEBody:
    """A free bar along x with rigid interfaces "left" and "right", still to be coupled, at its end faces."""
    from fe_models.elements.solids.body import solid_body
    from fe_models.foundation.units import unit_system

    mesh = box_mesh(nx, ny, nz, length, width, height, kind)
    ends = [
        Interface(name, "rigid", mesh.node_sets[name], np.array([x, width / 2, height / 2]))
        for name, x in (("left", 0.0), ("right", length))
    ]
    return solid_body(mesh, material, name="bar", units=unit_system("m-kg-s"), interfaces=ends, ranks=ranks)


def chain(n=6, stiffness=1000.0, mass=2.0) -> FEBody:
    """n equal masses in a row along x, n - 1 equal springs, one dof (x) each; ends are interfaces of kind "nodes".

    Free frequencies: omega_k = 2 sqrt(stiffness / mass) sin(k pi / (2 n)), k = 0 .. n - 1.
    """
    springs = sp.diags_array([-np.ones(n - 1), np.r_[1, 2 * np.ones(n - 2), 1], -np.ones(n - 1)], offsets=[-1, 0, 1])
    nodes = np.stack([np.arange(n, dtype=float), np.zeros(n), np.zeros(n)], axis=1)
    dofs = np.stack([np.arange(n), np.zeros(n, int)], axis=1)
    ends = [Interface(name, "nodes", np.array([node]), nodes[node]) for name, node in (("left", 0), ("right", n - 1))]
    return FEBody(
        "chain", sp.csc_array(mass * sp.eye_array(n)), sp.csc_array(stiffness * springs), nodes, dofs, tuple(ends)
    )


def two_node_beam_matrices(E=2.1e11, G=8.1e10, A=1e-4, Iy=1e-9, Iz=2e-9, J=3e-9, rho=7850.0, L=0.1):
    """K and M, (12, 12), of an Euler-Bernoulli beam along x: cubic bending, linear axial motion and torsion.

    Dofs (ux, uy, uz, rx, ry, rz) of both nodes; no rotary inertia of bending; torsional inertia rho (Iy + Iz).
    """
    K, M = np.zeros((12, 12)), np.zeros((12, 12))
    rod_K, rod_M = np.array([[1, -1], [-1, 1]]) / L, np.array([[2, 1], [1, 2]]) * L / 6
    for dofs, stiff, heavy in (([0, 6], E * A, rho * A), ([3, 9], G * J, rho * (Iy + Iz))):
        K[np.ix_(dofs, dofs)] += stiff * rod_K
        M[np.ix_(dofs, dofs)] += heavy * rod_M
    bend_K = (
        np.array(
            [
                [12, 6 * L, -12, 6 * L],
                [6 * L, 4 * L**2, -6 * L, 2 * L**2],
                [-12, -6 * L, 12, -6 * L],
                [6 * L, 2 * L**2, -6 * L, 4 * L**2],
            ]
        )
        / L**3
    )
    bend_M = (
        np.array(
            [
                [156, 22 * L, 54, -13 * L],
                [22 * L, 4 * L**2, 13 * L, -3 * L**2],
                [54, 13 * L, 156, -22 * L],
                [-13 * L, -3 * L**2, -22 * L, 4 * L**2],
            ]
        )
        * L
        / 420
    )
    for dofs, I_b, sign in (([1, 5, 7, 11], Iz, 1), ([2, 4, 8, 10], Iy, -1)):  # in the x-z plane uz' = -ry
        signs = np.array([1, sign, 1, sign])
        K[np.ix_(dofs, dofs)] += E * I_b * bend_K * np.outer(signs, signs)
        M[np.ix_(dofs, dofs)] += rho * A * bend_M * np.outer(signs, signs)
    return K, M


def beam(n=8, length=1.0, **section) -> FEBody:
    """A free beam along x of n elements of `two_node_beam_matrices`, six dofs a node; ends of kind "nodes"."""
    K_e, M_e = two_node_beam_matrices(L=length / n, **section)
    K, M = np.zeros((6 * n + 6, 6 * n + 6)), np.zeros((6 * n + 6, 6 * n + 6))
    for e in range(n):
        at = slice(6 * e, 6 * e + 12)
        K[at, at] += K_e
        M[at, at] += M_e
    nodes = np.stack([np.linspace(0, length, n + 1), np.zeros(n + 1), np.zeros(n + 1)], axis=1)
    dofs = np.stack([np.repeat(np.arange(n + 1), 6), np.tile(np.arange(6), n + 1)], axis=1)
    ends = [Interface(name, "nodes", np.array([node]), nodes[node]) for name, node in (("left", 0), ("right", n))]
    return FEBody("beam", sp.csc_array(M), sp.csc_array(K), nodes, dofs, tuple(ends))


def with_interfaces(body: FEBody, *interfaces: Interface) -> FEBody:
    """The body with these interfaces instead of its own."""
    return replace(body, interfaces=interfaces)


def distorted(mesh: Mesh, amount=0.1, seed=0) -> Mesh:
    """The mesh with every node moved at random by up to `amount` of the shortest distance of two nodes."""
    shortest = min(
        np.linalg.norm(mesh.nodes[cells[:, a]] - mesh.nodes[cells[:, b]], axis=1).min()
        for cells in mesh.cells.values()
        for a, b in itertools.combinations(range(cells.shape[1]), 2)
    )
    shift = np.random.default_rng(seed).uniform(-1, 1, mesh.nodes.shape) * amount * shortest / np.sqrt(3)
    return Mesh(mesh.nodes + shift, mesh.cells, mesh.cell_sets, mesh.faces, mesh.face_sets, mesh.node_sets, mesh.source)
