"""Stiffeners on shells against strips of shell in their place; the rotations of sections that are their own."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from cms.assessment.quality.body_check import check_body
from fe_models.elements.shells.section_rotations import own_axes
from tests.fe_models.small_shells import SI, STEEL, of_nodes, solved

A, B, T = 1.0, 0.6, 0.004  #: of the plate
HEIGHT, WIDTH = 0.06, 0.006  #: of the rib
KINDS = ("quad", "triangle", "mixed")


def ribbed_plate(kind, n, ribs=(("x", 0.3),)):
    """A plate of 2 n x 1.2 n cells, and the nodes of its ribs in order; "mixed" splits half of the quads at random."""
    mesh = fm.shells.flat_plate(A, B, 2 * n, 2 * round(0.6 * n), kind="triangle" if kind == "triangle" else "quad")
    if kind == "mixed":
        quads = mesh.cells["quad"]
        split = np.random.default_rng(1).random(len(quads)) < 0.5
        halves = np.concatenate([quads[split][:, [0, 1, 2]], quads[split][:, [0, 2, 3]]])
        mesh = replace(mesh, cells={"quad": quads[~split], "triangle": halves}, cell_sets={})
    lines = []
    for axis, place in ribs:
        along = 0 if axis == "x" else 1
        on = np.flatnonzero(np.abs(mesh.nodes[:, 1 - along] - place) < 1e-9)
        lines.append(on[np.argsort(mesh.nodes[on, along])])
    return mesh, lines


def with_beams(mesh, lines, bar):
    """The plate with beams on these lines."""
    ends = np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in lines])
    mesh = replace(mesh, lines=ends, line_sets={"rib": np.arange(len(ends))})
    return fm.shell_body(mesh, fm.shells.ShellProperty(T, STEEL), name="plate", units=SI, stiffeners={"rib": bar})


def with_strips(mesh, lines, across, t, n_across=6):
    """The plate with strips of quads on these lines, from them to the points `across` beyond, (3,)."""
    nodes, cells, number = list(mesh.nodes), [], {}

    def at(node, k):
        if k and (node, k) not in number:
            number[node, k] = len(nodes)
            nodes.append(mesh.nodes[node] + np.asarray(across) * k / n_across)
        return number[node, k] if k else node

    for line in lines:
        for i, j in pairwise(line.tolist()):
            cells += [[at(i, k), at(j, k), at(j, k + 1), at(i, k + 1)] for k in range(n_across)]
    quads = np.concatenate([mesh.cells.get("quad", np.zeros((0, 4), int)), cells])
    n_plate = len(quads) - len(cells)
    sets = {
        "plate": {kind: np.arange(len(rows)) for kind, rows in mesh.cells.items()},
        "rib": {"quad": np.arange(n_plate, len(quads))},
    }
    whole = fm.shells.ShellMesh(np.array(nodes), {**mesh.cells, "quad": quads}, cell_sets=sets)
    properties = {"plate": fm.shells.ShellProperty(T, STEEL), "rib": fm.shells.ShellProperty(t, STEEL)}
    return fm.shell_body(whole, properties, name="plate", units=SI)


def free_frequencies(body, k=8):
    """The lowest elastic frequencies [Hz]."""
    import scipy.sparse.linalg as spla

    shift = -((2 * np.pi * 2.0) ** 2)
    v0 = np.random.default_rng(0).normal(size=body.n_dof)
    omega2 = spla.eigsh(body.K, 6 + k, body.M, sigma=shift, return_eigenvectors=False, v0=v0)
    return np.sqrt(np.sort(omega2)[6:]) / (2 * np.pi)


def rib(**options):
    """A rectangle on end, its foot on the line."""
    return fm.beams.BeamProperty(fm.beams.Rectangle(WIDTH, HEIGHT), STEEL, offset=(0.0, HEIGHT / 2), **options)


#: both kinds of cells are in a mixed plate
@pytest.mark.parametrize(
    "kind", ["mixed", *(pytest.param(kind, marks=pytest.mark.long) for kind in ("quad", "triangle"))]
)
def test_an_eccentric_rib_converges_to_the_strip_of_shells_in_its_place(kind):
    """The first mode is torsion: sections that turned with the nodes would make it 10 to 41 % too stiff at n = 20."""
    across = (0.0, 0.0, HEIGHT)
    strip = free_frequencies(with_strips(*ribbed_plate("quad", 20), across, WIDTH))
    for n, limit in ((10, 0.006), (20, 0.005)):
        assert_allclose(free_frequencies(with_beams(*ribbed_plate(kind, n), rib())), strip, rtol=limit)


def test_crossing_ribs_converge_to_strips_that_cross():
    """Where ribs cross, they share one rotation about the normal, as their strips share an upright line."""
    ribs = (("x", 0.15), ("x", 0.45), ("y", 0.3), ("y", 0.7))
    mesh, lines = ribbed_plate("triangle", 20, ribs)
    strip = free_frequencies(with_strips(mesh, lines, (0.0, 0.0, HEIGHT), WIDTH))
    assert_allclose(free_frequencies(with_beams(mesh, lines, rib())), strip, rtol=0.016)


@pytest.mark.parametrize("kind", ["quad", "triangle"])
def test_a_bar_beside_the_edge_converges_to_a_wider_plate(kind):
    """A lever in the plane of the wall: sections turn by themselves about it too; else 7 % too stiff with quads."""
    width, t = 0.06, 0.008
    edge = (("x", 0.0),)
    wider = free_frequencies(with_strips(*ribbed_plate("quad", 20, edge), (0.0, -width, 0.0), t))
    bar = fm.beams.BeamProperty(fm.beams.Rectangle(width, t), STEEL, offset=(-width / 2, 0.0))
    assert_allclose(free_frequencies(with_beams(*ribbed_plate(kind, 20, edge), bar)), wider, rtol=0.005)


@pytest.mark.parametrize("kind", KINDS)
def test_a_rib_in_the_plane_of_a_wall_leaves_its_shear_free(kind):
    """Constant shear with a rib on the line v = x gamma: its axis turns with v,x, the wall by half of gamma."""
    mesh, lines = ribbed_plate(kind, 5)
    body = with_beams(mesh, lines, fm.beams.BeamProperty(fm.beams.Rectangle(WIDTH, 0.02), STEEL))
    x = mesh.nodes[:, 0]
    u = np.zeros((len(x), 6))
    u[:, 1], u[:, 5] = 1e-3 * x, 0.5e-3
    rim = np.unique(np.concatenate(list(mesh.node_sets.values())))
    fixed = of_nodes(rim, *range(6))
    found = solved(body, np.zeros(body.n_dof), fixed, u.ravel()[fixed])
    assert_allclose(found[: 6 * len(x)], u.ravel(), rtol=0, atol=1e-9 * 1e-3)
    assert_allclose(found[6 * len(x) :], 1e-3, rtol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_six_rigid_motions_and_no_others_without_energy(kind):
    body = with_beams(*ribbed_plate(kind, 3, (("x", 0.3), ("y", 0.5))), rib())
    lam = np.linalg.eigvalsh(body.K.toarray())
    assert lam[5] < 1e-10 * lam[-1]
    assert lam[6] > 1e-8 * lam[-1]


@pytest.mark.parametrize("pattern", ["half", "random"])
def test_plates_of_quads_and_triangles_pass_the_patch_test_of_constant_twist(pattern):
    """Inner nodes are in equilibrium; with different rotations on shared sides they would not be."""
    mesh, _ = ribbed_plate("mixed", 5)
    if pattern == "half":
        quads = fm.shells.flat_plate(A, B, 10, 6).cells["quad"]
        split = quads.mean(axis=1) < len(mesh.nodes) / 2
        halves = np.concatenate([quads[split][:, [0, 1, 2]], quads[split][:, [0, 2, 3]]])
        mesh = replace(mesh, cells={"quad": quads[~split], "triangle": halves})
    body = fm.shell_body(mesh, fm.shells.ShellProperty(T, STEEL), name="plate", units=SI)
    x, y, zero = mesh.nodes.T
    u = np.stack([zero, zero, x * y, x, -y, zero], axis=1)
    f = (body.K @ u.ravel()).reshape(-1, 6)
    inner = np.setdiff1d(np.arange(len(x)), np.concatenate(list(mesh.node_sets.values())))
    assert_allclose(f[inner], 0, rtol=0, atol=1e-9 * np.abs(f).max())


def test_a_section_turns_by_itself_across_its_lines_where_nothing_else_holds_it():
    x, y, z = np.eye(3)
    nan = np.full(3, np.nan)
    lines = np.array([(0, 1), (1, 2), (3, 1), (1, 4)])  # 0-1-2 along x, 3-1-4 along y, crossing in 1
    directions = np.stack([x, x, y, y])
    upright, aside = np.tile(z, (4, 2, 1)), np.tile(0.1 * y, (4, 2, 1))
    normals, free = np.tile(z, (5, 1)), np.zeros(5, bool)
    for axes in own_axes(lines, directions, upright, normals, free):  # one, the normal, also where ribs cross
        assert_allclose(np.abs(axes), z[:, None], rtol=0, atol=1e-12)
    assert [axes.shape[1] for axes in own_axes(lines, directions, upright, normals, ~free)] == [0] * 5
    two = own_axes(lines[:2], directions[:2], aside[:2], normals[:3], free[:3])
    assert [axes.shape[1] for axes in two] == [1, 2, 1]  # the lever counts where the line goes on
    assert_allclose(two[1] @ two[1].T, np.diag([0.0, 1.0, 1.0]), rtol=0, atol=1e-12)
    folded = own_axes(lines[:2], directions[:2], 0 * aside[:2], np.stack([z, nan, z]), free[:3])
    assert [axes.shape[1] for axes in folded] == [1, 0, 1]  # walls hold a section in their fold


def test_sections_turn_with_the_node_at_interfaces_masses_and_where_a_line_leaves_the_wall():
    mesh, lines = ribbed_plate("quad", 3)
    bar, line = rib(), lines[0]
    ends = np.stack([line[:-1], line[1:]], axis=1)
    mesh = replace(mesh, lines=ends, line_sets={"rib": np.arange(len(ends))})
    made = {"name": "plate", "units": SI, "stiffeners": {"rib": bar}}
    n = 6 * len(mesh.nodes)
    assert fm.shell_body(mesh, fm.shells.ShellProperty(T, STEEL), **made).n_dof == n + 7
    root = fm.shells.shell_interface(mesh, "root", fm.selections.NodeSet("u0"))
    mass = fm.beams.PointMass(int(line[3]), 1.0)
    held = fm.shell_body(mesh, fm.shells.ShellProperty(T, STEEL), interfaces=[root], point_masses=[mass], **made)
    assert held.n_dof == n + 5
    beyond = replace(
        mesh,
        nodes=np.vstack([mesh.nodes, mesh.nodes[line[-1]] + [0.1, 0, 0]]),
        lines=np.vstack([ends, [[line[-1], len(mesh.nodes)]]]),
        line_sets={"rib": np.arange(len(ends) + 1)},
    )
    assert fm.shell_body(beyond, fm.shells.ShellProperty(T, STEEL), **made).n_dof == n + 6 + 6


def held_at_its_edge(body, nodes):
    """The body with a rigid interface, coupled and reduced with geometric stiffness."""
    root = fm.Interface("root", "rigid", nodes, np.array([0.0, B / 2, 0.0]))
    coupled = cms.couple(replace(body, interfaces=(root,)))
    return cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=8), frame=cms.NodalFrame("root"), geometric=True)


@pytest.mark.parametrize("kind", ["quad", "triangle"])
def test_a_spinning_ribbed_plate_stiffens_as_with_a_strip_in_place_of_the_rib(kind):
    """The frequencies at rest, the stiffness of spins about all axes, and a file that passes its checks."""
    strip = with_strips(*ribbed_plate("quad", 8), (0.0, 0.0, HEIGHT), WIDTH)
    at_root = np.flatnonzero(strip.nodes[: strip.element_model.n_nodes, 0] < 1e-9)
    exact = held_at_its_edge(strip, at_root)
    mesh, (line,) = ribbed_plate(kind, 8)
    ends = np.stack([line[:-1], line[1:]], axis=1)
    mesh = replace(mesh, lines=ends, line_sets={"rib": np.arange(len(ends))})
    root = fm.shells.shell_interface(mesh, "root", fm.selections.NodeSet("u0"), reference=(0.0, B / 2, 0.0))
    made = {"name": "plate", "units": SI, "stiffeners": {"rib": rib()}, "interfaces": [root]}
    body = fm.shell_body(mesh, fm.shells.ShellProperty(T, STEEL), **made)
    coupled = cms.couple(body)
    found = cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=8), frame=cms.NodalFrame("root"), geometric=True)
    lowest = [np.argsort(np.diag(reduced.K))[:4] for reduced in (found, exact)]
    assert_allclose(found.frequencies[lowest[0]], exact.frequencies[lowest[1]], rtol=0.01)
    spins = [reduced.geometric.spin[:3, rows, rows] for reduced, rows in zip((found, exact), lowest, strict=True)]
    assert_allclose(spins[0], spins[1], rtol=0.02)
    assert not [record.name for record in check_body(found) if record.verdict == "fail"]
