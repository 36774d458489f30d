"""The body of a shell: properties, skin, stress, interfaces, loads, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from tests.bodies import box_mesh
from tests.fe_models.small_shells import KINDS, SI, STEEL, distorted, frequencies, of_nodes, plate, solved


def folded(kind="quad", n=2):
    """An L of two square flanges in the groups "floor" and "wall"."""
    mesh = fm.shells.mapped_shell(
        lambda u, v: np.stack([np.minimum(2 * u, 1.0), v, np.maximum(2 * u - 1.0, 0.0)], axis=1), 2 * n, n, kind=kind
    )
    half = len(mesh.cells[kind]) // 2
    rows = np.arange(2 * half)
    return replace(mesh, cell_sets={"floor": {kind: rows[:half]}, "wall": {kind: rows[half:]}})


def volume(nodes, triangles):
    """Volume inside of a closed surface, its triangles outward."""
    a, b, c = nodes[triangles].transpose(1, 0, 2)
    return np.einsum("na,na->", a, np.cross(b, c)) / 6


def is_closed(triangles):
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    _, count = np.unique(edges, axis=0, return_counts=True)
    _, both = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    return (count == 1).all() and (both == 2).all()


@pytest.mark.parametrize("kind", KINDS)
def test_the_skin_of_a_plate_is_closed_and_holds_its_volume(kind):
    body = plate(kind, 3, t=0.5)
    assert is_closed(body.surface)
    assert_allclose(volume(body.nodes, body.surface), 50.0, rtol=1e-12)
    assert_allclose(np.sum(body.node_volumes), 50.0, rtol=1e-12)


def test_folds_and_steps_of_thickness_stay_sharp_and_curved_walls_are_smooth():
    t = {"floor": fm.shells.ShellProperty(0.1, STEEL), "wall": fm.shells.ShellProperty(0.2, STEEL)}
    fold = fm.shell_body(folded(), t, name="L", units=SI)
    assert is_closed(fold.surface)
    assert_allclose(volume(fold.nodes, fold.surface), 0.3, rtol=1e-12)
    assert len(fold.nodes) == 15 + 2 * (15 + 3)  # the three nodes of the fold have two patches
    quarter = fm.shells.mapped_shell(
        lambda u, v: np.stack([np.cos(np.pi / 2 * u), np.sin(np.pi / 2 * u), v], axis=1), 6, 2
    )
    wall = fm.shell_body(quarter, fm.shells.ShellProperty(0.1, STEEL), name="wall", units=SI)
    assert len(wall.nodes) == 21 + 2 * 21
    assert is_closed(wall.surface)


def test_mass_and_centre_of_groups_with_offset_and_added_mass():
    mesh = folded()
    properties = {
        "floor": fm.shells.ShellProperty(0.1, STEEL, offset=0.05),
        "wall": fm.shells.ShellProperty(0.2, fm.Material("other", E=7e10, nu=0.3, rho=2700.0), added_mass=50.0),
    }
    body = fm.shell_body(mesh, properties, name="L", units=SI)
    gram = body.element_model.mass_gram(np.zeros((len(body.recovery.dofs), 0)))
    floor, wall = 8000 * 0.1, 2700 * 0.2 + 50.0
    assert_allclose(gram[0, 0], floor + wall, rtol=1e-12)
    center = (floor * np.array([0.5, 0.5, 0.05]) + wall * np.array([1.0, 0.5, 0.5])) / (floor + wall)
    assert_allclose(gram[0, 1:4] / gram[0, 0], center, rtol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_stress_of_a_cantilever_at_its_faces_and_shear_in_its_middle(kind):
    length, b, t, F = 1.0, 0.2, 0.02, 50.0
    mesh = fm.shells.flat_plate(length, b, 20, 4, kind=kind)
    body = fm.shell_body(mesh, fm.shells.ShellProperty(t, replace(STEEL, nu=0.0)), name="strip", units=SI)
    f = np.zeros(body.n_dof)
    end = mesh.node_sets["u1"]
    share = np.ones(5)
    share[[0, -1]] = 0.5
    f[of_nodes(end, 2)] = F * share / share.sum()
    u = solved(body, f, of_nodes(mesh.node_sets["u0"], *range(6)))
    stress = body.element_model.nodal_stress(body.mesh_displacement(u[:, None]))[:, :, 0]
    inside = np.flatnonzero((body.nodes[:, 0] > 0.2) & (body.nodes[:, 0] < 0.8))
    z, x = body.nodes[inside, 2], body.nodes[inside, 0]
    bending = -F * (length - x) * z / (b * t**3 / 12)
    scale = 6 * F * length / (b * t**2)
    assert_allclose(stress[inside, 0], bending, rtol=0, atol=0.002 * scale)
    middle = inside[z == 0]
    width = np.where(np.abs(body.nodes[middle, 1] - b / 2) > 0.4 * b, 0.5, 1.0)  # that a node stands for
    assert_allclose(width @ stress[middle, 4] / width.sum(), 1.5 * F / (b * t), rtol=0.025)
    assert_allclose(stress[inside[z != 0], 3:5], 0, rtol=0, atol=1e-9 * scale)


def test_stress_turns_with_the_body():
    rng = np.random.default_rng(0)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    mesh = distorted(fm.shells.flat_plate(1.0, 1.0, 2, 2), warp=0.03)
    turned = replace(mesh, nodes=mesh.nodes @ turn.T)
    u = rng.normal(size=(len(mesh.nodes), 2, 3))
    tensors = []
    for m, field in ((mesh, u), (turned, u @ turn.T)):
        body = fm.shell_body(m, fm.shells.ShellProperty(0.05, STEEL), name="p", units=SI)
        s = body.element_model.nodal_stress(body.mesh_displacement(field.reshape(-1, 1)))[:, :, 0]
        tensors.append(s[:, [[0, 5, 4], [5, 1, 3], [4, 3, 2]]])
    assert_allclose(tensors[1], turn @ tensors[0] @ turn.T, rtol=0, atol=1e-10 * np.abs(tensors[0]).max())


def test_interfaces_of_a_shell():
    mesh = fm.shells.flat_plate(2.0, 1.0, 4, 2)
    rigid = fm.shells.shell_interface(mesh, "root", fm.selections.NodeSet("u0"))
    assert_allclose(rigid.reference, [0, 0.5, 0])
    spread = fm.shells.shell_interface(mesh, "all", fm.selections.FaceGroup("shell"), kind="distributing")
    assert_allclose(spread.weights[[0, 1, 4]], np.array([1, 2, 4]) / 32)  # corner, side, inside
    edge = fm.shells.shell_interface(mesh, "edge", fm.selections.NodeSet("v0"), kind="distributing")
    assert_allclose(edge.weights, np.array([1, 2, 2, 2, 1]) / 8)
    with pytest.raises(fm.errors.InterfaceError, match=r"no group of cells 'shel'.*did you mean 'shell'"):
        fm.shells.shell_interface(mesh, "x", fm.selections.FaceGroup("shel"))
    with pytest.raises(fm.errors.InterfaceError, match=r"no node set 'shell' \('shell' is a cell group\)"):
        fm.shells.shell_interface(mesh, "x", fm.selections.NodeSet("shell"))


@pytest.mark.parametrize("kind", KINDS)
def test_pressure_pushes_against_the_normal_with_its_exact_resultant(kind):
    mesh = fm.shells.flat_plate(2.0, 1.0, 3, 2, kind=kind)
    body = fm.shell_body(mesh, fm.shells.ShellProperty(0.1, STEEL), name="plate", units=SI)
    case = fm.loads.pressure_load(body, mesh, "p", fm.selections.FaceGroup("shell"), 3.0)
    assert_allclose(case.f.reshape(-1, 6).sum(axis=0), [0, 0, -6, 0, 0, 0], rtol=0, atol=1e-12)
    assert_allclose(mesh.nodes[:, 0] @ case.f[2::6], -6.0, rtol=1e-12)


def test_masses_springs_and_links_on_a_shell():
    mesh = fm.shells.flat_plate(1.0, 1.0, 2, 2)
    corner = [int(np.intersect1d(mesh.node_sets[u], mesh.node_sets[v])[0]) for u, v in (("u0", "v0"), ("u1", "v1"))]
    body = fm.shell_body(
        mesh,
        fm.shells.ShellProperty(0.01, STEEL),
        name="plate",
        units=SI,
        point_masses=[fm.beams.PointMass(corner[1], 5.0, 0.2)],
        springs=[fm.beams.Spring((corner[0], corner[1]), np.full(6, 1e4), damping=np.full(6, 3.0))],
        links=[fm.beams.RigidLink(4, (3,))],
    )
    assert body.n_dof == 6 * 8
    gram = body.element_model.mass_gram(np.zeros((len(body.recovery.dofs), 0)))
    assert_allclose(gram[0, 0], 80.0 + 5.0, rtol=1e-12)
    assert body.D is not None
    reduced = cms.reduce(cms.couple(body), cms.modes.normal_modes(cms.couple(body), n_modes=4))
    assert_allclose(reduced.moments.m, 85.0, rtol=1e-12)


def test_what_cannot_be_a_shell_is_refused_in_words():
    mesh = fm.shells.flat_plate(1.0, 1.0, 2, 2)
    ok = fm.shells.ShellProperty(0.01, STEEL)
    make = {"name": "p", "units": SI}
    with pytest.raises(fm.errors.ShellError, match="thickness: expected a length above zero, got 0"):
        fm.shells.ShellProperty(0.0, STEEL)
    with pytest.raises(fm.errors.ShellError, match=r"no group of cells 'shel'.*did you mean 'shell'"):
        fm.shell_body(mesh, {"shel": ok}, **make)
    two = replace(mesh, cell_sets={"a": {"quad": np.array([0, 1])}, "b": {"quad": np.array([1, 2])}})
    with pytest.raises(fm.errors.ShellError, match="cells without a thickness: 2 quad; they are in the groups b"):
        fm.shell_body(two, {"a": ok}, **make)
    with pytest.raises(fm.errors.ShellError, match="1 quad cells of group 'b' have two thicknesses"):
        fm.shell_body(two, {"a": ok, "b": fm.shells.ShellProperty(0.02, STEEL)}, **make)
    bow_tie = replace(mesh, cells={"quad": mesh.cells["quad"][:, [0, 1, 3, 2]]})
    with pytest.raises(fm.errors.ShellError, match="4 quad cells have no area, first quad 0; merge their nodes"):
        fm.shell_body(bow_tie, ok, **make)
    pushed = np.array(mesh.nodes)
    pushed[4] = [0.9, 0.9, 0.0]
    with pytest.raises(fm.errors.ShellError, match=r"1 quad cells are folded \(an inner angle.*first quad 3"):
        fm.shell_body(replace(mesh, nodes=pushed), ok, **make)
    warped = replace(mesh, nodes=mesh.nodes + np.array([0, 0, 0.2]) * ((np.arange(9) % 2)[:, None]))
    with pytest.raises(fm.errors.ShellError, match=r"4 quad cells are warped beyond 20 degrees, by up to .*split them"):
        fm.shell_body(warped, ok, **make)
    fm.shell_body(warped, ok, **make, warp_limit=90.0)
    loose = replace(mesh, nodes=np.vstack([mesh.nodes, [[5.0, 5.0, 5.0]]]))
    with pytest.raises(fm.errors.ShellError, match="1 nodes belong to no cell, first node 9"):
        fm.shell_body(loose, ok, **make)
    with pytest.raises(fm.errors.ShellError, match=r"expected triangles or quads, got none"):
        fm.shell_body(replace(mesh, cells={}, cell_sets={}), ok, **make)
    with pytest.raises(fm.errors.ShellError, match=r"quad: expected 0..8, got"):
        replace(mesh, cells={"quad": np.array([[0, 1, 2, 99]])})


def test_the_report_finds_warp_flipped_normals_parts_and_coincident_nodes():
    mesh = fm.shells.flat_plate(1.0, 1.0, 2, 2)
    fine = fm.shells.report_shell(mesh, [STEEL], units=SI)
    assert (fine.area, fine.n_parts, fine.n_free_edges) == (1.0, 1, 8)
    assert fine.findings == ()
    cells = np.array(mesh.cells["quad"])
    cells[0] = cells[0, ::-1]
    flipped = fm.shells.report_shell(replace(mesh, cells={"quad": cells}), [STEEL], units=SI)
    assert [f.kind for f in flipped.findings] == ["normals"]
    assert "at 2 edges" in flipped.findings[0].text
    double = fm.shells.ShellMesh(
        np.tile(mesh.nodes, (2, 1)), {"quad": np.concatenate([mesh.cells["quad"], mesh.cells["quad"] + 9])}
    )
    report = fm.shells.report_shell(double, [STEEL], units=SI)
    assert [f.kind for f in report.findings] == ["parts", "coincident"]
    with pytest.raises(fm.errors.MeshError, match="2 parts that no cell"):
        report.raise_for_errors()
    report.raise_for_errors(accept=["parts"])
    for height, is_error in ((0.04, False), (0.2, True)):
        warped = replace(mesh, nodes=mesh.nodes + np.array([0, 0, height]) * ((np.arange(9) % 2)[:, None]))
        found = fm.shells.report_shell(warped, [STEEL], units=SI).findings
        assert [(f.kind, f.is_error) for f in found] == [("warped", is_error)]


def test_named_points_show_top_middle_and_bottom_of_a_cell():
    mesh = fm.shells.flat_plate(1.0, 0.5, 2, 1)
    t, material = 0.02, replace(STEEL, nu=0.0)
    body = fm.shell_body(mesh, fm.shells.ShellProperty(t, material, offset=0.1), name="plate", units=SI)
    points = fm.shells.shell_points(body, {"quad": [1]}).stress_points
    assert points.names == ("quad 1 top", "quad 1 middle", "quad 1 bottom")
    assert_allclose(points.positions, [[0.75, 0.25, 0.1 + z] for z in (0.01, 0, -0.01)], rtol=0, atol=1e-15)
    x = mesh.nodes[:, 0]
    stretch, curvature = 1e-4, 2e-3
    u = np.zeros((len(x), 6))
    u[:, 0], u[:, 2], u[:, 4] = stretch * x, curvature * x**2 / 2, -curvature * x
    stress = points.stress(body.mesh_displacement(u.reshape(-1, 1)))[:, 0, 0]
    expected = [material.E * (stretch - (0.1 + z) * curvature) for z in (t / 2, 0, -t / 2)]
    assert_allclose(stress, expected, rtol=1e-10)
    with pytest.raises(fm.errors.ShellError, match=r"quad: expected some of 2 cells, 0..1, got \[5\]"):
        fm.shells.shell_points(body, {"quad": [5]})
    reduced_from = cms.couple(fm.shells.shell_points(body, {"quad": [0, 1]}))
    reduced = cms.reduce(reduced_from, cms.modes.normal_modes(reduced_from, n_modes=2))
    assert reduced.point_stress.modes.shape == (6, 6, 2)


def test_normals_are_turned_to_one_side():
    rng = np.random.default_rng(0)
    for kind in KINDS:
        mesh = folded(kind, 3)
        cells = np.array(mesh.cells[kind])
        some = rng.choice(len(cells), len(cells) // 3, replace=False)
        some = some[some > 0]
        cells[some] = cells[some][:, ::-1]
        mixed = replace(mesh, cells={kind: cells})
        assert [f.kind for f in fm.shells.report_shell(mixed, [STEEL], units=SI).findings] == ["normals"]
        oriented = fm.shells.orient_normals(mixed)
        assert fm.shells.report_shell(oriented, [STEEL], units=SI).findings == ()
        assert oriented.notes == (f"the nodes of {len(some)} cells were reversed",)
        body = fm.shell_body(oriented, fm.shells.ShellProperty(0.02, STEEL), name="L", units=SI)
        assert is_closed(body.surface)
    assert fm.shells.orient_normals(mesh) is mesh


def test_a_shell_is_welded_to_a_solid_with_the_mass_of_both_and_no_loose_motion():
    block_mesh = box_mesh(2, 2, 2, 0.2, 0.4, 0.2, "hexahedron20")
    x = block_mesh.nodes[:, 0].max()
    block_mesh = replace(block_mesh, node_sets={"face": np.flatnonzero(block_mesh.nodes[:, 0] > x - 1e-9)})
    face = fm.rigid_interface(block_mesh, "face", fm.selections.NodeSet("face"))
    block = cms.couple(fm.solid_body(block_mesh, STEEL, name="block", units=SI, interfaces=[face]))
    mesh = fm.shells.flat_plate(1.0, 0.4, 8, 4)
    mesh = replace(mesh, nodes=mesh.nodes + np.array([0.2, 0.0, 0.1]))
    root = fm.shells.shell_interface(mesh, "root", fm.selections.NodeSet("u0"))
    flap = cms.couple(
        fm.shell_body(mesh, fm.shells.ShellProperty(0.01, STEEL), name="flap", units=SI, interfaces=[root])
    )
    whole = fm.weld([block, flap], [(("block", "face"), ("flap", "root"))], name="whole")
    reduced = cms.reduce(whole, cms.modes.normal_modes(whole, n_modes=4), geometric=True)
    assert_allclose(reduced.moments.m, STEEL.rho * (0.2 * 0.4 * 0.2 + 0.4 * 0.01), rtol=1e-12)
    assert reduced.provenance["mode set rigid-body motions removed"] == "6"
    assert reduced.geometric is not None
    m, width, thick = STEEL.rho * 0.2 * 0.4 * 0.2, 0.4, 0.01
    inertia = m / 12 * np.array([0.4**2 + 0.2**2, 0.2**2 + 0.2**2, 0.2**2 + 0.4**2])
    beam = fm.beam_body(
        fm.beams.straight_line((0, 0, 0), (1, 0, 0), 20),
        fm.beams.BeamProperty(fm.beams.Rectangle(width, thick), STEEL),
        name="beam",
        units=SI,
        point_masses=[fm.beams.PointMass(0, m, inertia, offset=(-0.1, 0.0, 0.0))],
    )
    as_beam = frequencies(beam, np.zeros(0, np.int64), 7)[6]
    assert as_beam < reduced.free_frequencies[0] < 1.06 * as_beam  # a plate is stiffer by what nu holds back
