"""Bodies without interior dofs, all the modes there are, loose parts, wires, and interfaces with very many dofs."""

import dataclasses
import logging

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from cms.errors import BodyError, ModeSetError
from cms.modes.families import cost, families
from cms.modes.families.cost import interface_reduction_size, large_interfaces, reduction_cost
from tests.bodies import box_mesh, distorted
from tests.fe_models.small_shells import SI, STEEL

SETS = {
    "craig_bampton": cms.craig_bampton,
    "rubin": cms.rubin,
    "craig_chang": cms.modes.craig_chang,
    "herting": cms.modes.herting,
}


def beam(n):
    """A bar of n elements with an interface at both ends."""
    line = fm.beams.straight_line((0, 0, 0), (1, 0, 0), n)
    ends = [fm.beams.line_interface(line, name, fm.selections.NodeSet(name)) for name in ("start", "end")]
    return cms.couple(
        fm.beam_body(
            line, fm.beams.BeamProperty(fm.beams.Rectangle(0.03, 0.02), STEEL), name="b", units=SI, interfaces=ends
        )
    )


def free_frequencies(body):
    omega2 = la.eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True)[6:]
    return np.sqrt(omega2) / (2 * np.pi)


@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("n", [1, 2, 3])
def test_with_all_its_modes_a_reduced_beam_is_the_beam(n, name):
    """Of one element there is nothing inside; as many modes as interior dofs leave out nothing."""
    body = beam(n)
    reduced = cms.reduce(body, SETS[name](body, n_modes=len(body.i)))
    assert len(reduced.K) == body.n_dof - 6
    assert_allclose(np.sort(reduced.free_frequencies), free_frequencies(body), rtol=1e-8)


@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("units", ["m-kg-s", "mm-t-s"])
def test_two_masses_at_one_place_keep_their_frequencies_in_all_units(units, name):
    """The body has no size that could scale its rotations; its spring couples them with translations."""
    system, A = fm.unit_system(units), np.random.default_rng(1).normal(size=(6, 6))
    k = 1e4 * (A @ A.T + np.eye(6))
    M, K = np.diag([2, 2, 2, 0.01, 0.01, 0.01, 1, 1, 1, 0.02, 0.02, 0.02]), np.block([[k, -k], [-k, k]])
    expected = np.sqrt(la.eigh(K, M, eigvals_only=True)[6:]) / (2 * np.pi)
    size = np.tile(np.repeat([1.0, 1 / system.length], 3), 2)  # a rotation, as a displacement in the unit of length
    M, K = (each * np.outer(size, size) / system.mass for each in (M, K))
    nodes, dofs = np.tile(np.array([0.3, 0.2, -0.1]) / system.length, (2, 1)), list(np.ndindex(2, 6))
    at = fm.Interface("a", "nodes", np.array([0]), nodes[0])
    body = cms.couple(fm.files.body_from_matrices(M, K, nodes, dofs, name="two", units=system, interfaces=[at]))
    assert_allclose(cms.reduce(body, SETS[name](body, n_modes=6)).free_frequencies, expected, rtol=1e-8)


def test_more_modes_than_there_are_are_refused_with_the_number():
    body = beam(2)
    with pytest.raises(ModeSetError, match=r"has 6 interior dofs; choose 0 <= n_modes <= 6"):
        cms.craig_bampton(body, n_modes=7)
    with pytest.raises(ModeSetError, match=r"has 0 interior dofs; choose 0 <= n_modes <= 0"):
        cms.craig_bampton(beam(1), n_modes=1)


def test_a_cutoff_of_a_body_without_interior_dofs_finds_no_modes():
    body = beam(1)
    assert len(cms.reduce(body, cms.craig_bampton(body, cms.modes.ModeCount(cutoff=100.0))).K) == 6


def test_an_interface_of_very_many_dofs_announces_its_cost_before_the_work(monkeypatch, caplog):
    mesh = box_mesh(4, 4, 2)
    left = fm.body.nodes_interface(mesh, "left", fm.selections.NodeSet("left"))
    body = cms.couple(fm.solid_body(mesh, STEEL, name="block", units=SI, interfaces=[left]))
    assert large_interfaces(body) == []
    monkeypatch.setattr(cost, "MANY", 45)
    (words,) = large_interfaces(body)
    assert "interface 'left' of 15 nodes has 45 boundary dofs" in words
    assert "interface_modes = 20" in words
    assert "45 columns, about" in words
    assert "26 columns, about" in words
    order = []
    monkeypatch.setattr(families, "fix_interfaces", lambda *_, **__: order.append(len(caplog.records)) or 1 / 0)
    with caplog.at_level(logging.WARNING), pytest.raises(ZeroDivisionError):
        cms.craig_bampton(body, n_modes=2)
    assert order == [1]  # told before the factorisation


def test_the_cost_of_a_reduction_grows_as_its_arrays_do():
    mesh = box_mesh(4, 4, 2)
    sides = [
        fm.body.nodes_interface(mesh, "left", fm.selections.NodeSet("left")),
        fm.rigid_interface(mesh, "right", fm.selections.NodeSet("right")),
    ]
    body = cms.couple(fm.solid_body(mesh, STEEL, name="block", units=SI, interfaces=sides))
    assert (interface_reduction_size(body, 20), interface_reduction_size(body, 100)) == (32, 51)
    bare, whole = (reduction_cost(body, 51, stress=stress) for stress in (False, True))
    n_kept = len(np.unique(np.concatenate([body.surface.ravel(), *(each.nodes for each in body.interfaces)])))
    assert whole.file - bare.file == 8 * 6 * n_kept * 51
    assert 8 * 9 * 51**2 < bare.file < 8 * (27 * 51**2 + 3 * n_kept * 51)
    assert bare.memory > bare.file + 8 * 2 * body.n_dof * 51
    assert "51 columns" in bare.description
    few = reduction_cost(body, 9, n_constraint_modes=1000)
    assert few.memory == 8 * 2 * body.n_dof * 1000  # they are all made before few are left


def test_the_file_of_a_reduction_is_as_large_as_was_said(tmp_path):
    """Numbers that deflate leaves as they are: M, K and D, which are diagonal, are small here."""
    mesh = box_mesh(8, 6, 6)
    body = cms.couple(
        fm.solid_body(
            mesh,
            STEEL,
            name="b",
            units=SI,
            interfaces=[fm.body.nodes_interface(mesh, "l", fm.selections.NodeSet("left"))],
        )
    )
    modes = cms.craig_bampton(body, n_modes=3)
    cms.write(cms.reduce(body, modes, geometric=False), tmp_path / "b.h5")
    said = reduction_cost(body, modes.columns.shape[1]).file
    assert 0.8 < (tmp_path / "b.h5").stat().st_size / said < 1.1


def mean_motion(points, reference):
    """Least-squares rigid motion of points, [d, theta] (6, 3 n), by a pseudo-inverse."""
    turned = [np.cross(np.eye(3), p - reference).T for p in points]  # columns e_k x r
    return np.linalg.pinv(np.concatenate([np.hstack([np.eye(3), each]) for each in turned]))


@pytest.mark.parametrize("solver", ["superlu", None])
@pytest.mark.parametrize("n_parts", [2, 3])
def test_bricks_welded_at_distributing_interfaces_swing_as_the_constrained_pencil(n_parts, solver):
    """The oracle ties the mean motions of the faces in the null space of the constraint, without multipliers."""
    rng = np.random.default_rng(5)
    parts, faces, arms = [], [], []
    for k in range(n_parts):
        mesh = box_mesh(2, 1, 1, 0.5, 0.2, 0.1)
        mesh = dataclasses.replace(mesh, nodes=mesh.nodes + np.array([3.0 + 0.5 * k, -1.0, 2.0]))
        ends = []
        for name, side in (("a", "left"), ("b", "right")):
            members = mesh.node_sets[side]
            is_outer = (k, name) in ((0, "a"), (n_parts - 1, "b"))
            at = mesh.nodes[members].mean(axis=0) + 0.1 * rng.normal(size=3)
            ends.append(fm.Interface(name, "nodes" if is_outer else "distributing", members, at))
        uncoupled = fm.solid_body(mesh, STEEL, name=f"p{k}", units=SI)
        parts.append(uncoupled)
        faces.append([mesh.node_sets["left"], mesh.node_sets["right"]])
        arms.append(ends)
    coupled = [cms.couple(p.with_interfaces(*ends)) for p, ends in zip(parts, arms, strict=True)]
    joints = [((f"p{k}", "b"), (f"p{k + 1}", "a")) for k in range(n_parts - 1)]
    whole = fm.weld(coupled, joints, name="w")
    K, M = (la.block_diag(*[getattr(p, name).toarray() for p in parts]) for name in "KM")
    first = np.cumsum([0, *(p.n_dof for p in parts)])
    C = np.zeros((6 * len(joints), len(K)))
    for k in range(len(joints)):
        at = arms[k][1].reference  # the motion of either face seen from one point
        for part, side, sign in ((k, 1, 1.0), (k + 1, 0, -1.0)):
            rows = first[part] + (3 * faces[part][side][:, None] + np.arange(3)).ravel()
            C[6 * k : 6 * k + 6, rows] = sign * mean_motion(parts[part].nodes[faces[part][side]], at)
    Z = la.null_space(C)
    expected = np.sqrt(la.eigh(Z.T @ K @ Z, Z.T @ M @ Z, eigvals_only=True)[6:10]) / (2 * np.pi)
    reduced = cms.reduce(whole, cms.rubin(cms.modes.Families(whole, solver=solver), n_modes=4))
    assert_allclose(reduced.free_frequencies[:4], expected, rtol=1e-8)


@pytest.mark.parametrize("make", [cms.rubin, cms.modes.dual_craig_bampton, cms.modes.craig_chang])
@pytest.mark.parametrize("n_modes", [19, 27])
def test_modes_and_residuals_that_fill_the_space_leave_no_massless_shape(make, n_modes):
    """Two distributing interfaces: rounding of the residuals breaks their constraints, and came as four shapes more."""
    mesh = distorted(box_mesh(2, 1, 1, 0.5, 0.2, 0.1), 0.1, seed=1)
    mesh = dataclasses.replace(mesh, nodes=mesh.nodes + np.array([3.0, -1.0, 2.0]))
    ends = [fm.Interface(side, "distributing", mesh.node_sets[side], [3.2, -1, 2.1]) for side in ("left", "right")]
    body = fm.solid_body(mesh, STEEL, name="brick", units=SI)
    coupled = cms.couple(body.with_interfaces(*ends))
    reduced = cms.reduce(coupled, make(coupled, n_modes=n_modes), geometric=False)
    expected = np.sqrt(la.eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True)[6:]) / (2 * np.pi)
    assert reduced.n_q == body.n_dof - 6
    assert_allclose(reduced.M, np.eye(reduced.n_q), rtol=0, atol=1e-9)
    assert_allclose(reduced.free_frequencies, expected, rtol=1e-7)  # modes are found to 1e-5, squared


@pytest.mark.parametrize(
    ("spring", "n_inner"), [(None, 6), ([1e9, 1e9, 1e9, 0, 0, 0], 3), ([1e9, 1e9, 1e9, 1e5, 1e5, 0], 1)]
)
@pytest.mark.parametrize("name", ["craig_bampton", "rubin", "craig_chang"])
@pytest.mark.parametrize("geometric", [None, False])
def test_the_inner_motions_of_two_beams_are_counted(name, spring, n_inner, geometric):
    """A joint of two beams leaves the motions that it does not hold, whatever the direction of the beams."""
    along = np.array([1.0, 2.0, 3.0]) / np.sqrt(14)
    triad = np.linalg.qr(np.column_stack([along, np.eye(3)[:, :2]]))[0][:, [1, 2, 0]]  # z along the beams
    triad[:, 2] *= np.linalg.det(triad)
    nodes = np.concatenate([np.linspace(0, 1, 6), np.linspace(1, 2, 6)])[:, None] * along + np.array([5.0, -3.0, 2.0])
    lines = np.array([(i, i + 1) for i in range(5)] + [(6 + i, 7 + i) for i in range(5)])
    mesh = fm.beams.LineMesh(nodes, lines, node_sets={"a": np.array([0]), "b": np.array([11])})
    turn = [] if spring is None else [fm.beams.Spring((5, 6), np.array(spring), triad=triad)]
    body = cms.couple(
        fm.beam_body(
            mesh, fm.beams.BeamProperty(fm.beams.Rectangle(0.03, 0.05), STEEL), name="b", units=SI, springs=turn,
            interfaces=[fm.beams.line_interface(mesh, end, fm.selections.NodeSet(end)) for end in "ab"],
        )
    )  # fmt: skip
    what = "6 motions" if n_inner == 6 else f"{n_inner} motion{'s' if n_inner > 1 else ''}"
    with pytest.raises(BodyError, match=f"{what} besides the rigid ones costs? no energy.*largest at node"):
        cms.reduce(body, SETS[name](body, n_modes=4), geometric=geometric)


def test_a_wire_whose_torsion_is_lost_in_the_mass_matrix_is_refused_with_the_number():
    """EA L²/EI = 2e13 across the axes of the mesh: M has the torsion of two long elements beside their bending."""
    line = fm.beams.straight_line((0, 0, 0), (1 / 3, 2 / 3, 2 / 3), 2)
    ends = [fm.beams.line_interface(line, name, fm.selections.NodeSet(name)) for name in ("start", "end")]
    thin = fm.beams.BeamProperty(fm.beams.Circle(4.5e-7), STEEL)
    body = cms.couple(fm.beam_body(line, thin, name="wire", units=SI, interfaces=ends))
    with pytest.raises(BodyError, match=r"the mass of a shape has a relative rounding error of \d\.\de-0[3-6].*rotate"):
        cms.reduce(body, cms.craig_bampton(body, n_modes=4), geometric=False)


@pytest.mark.parametrize("along", [(1.0, 0.0, 0.0), (1.0, 2.0, 3.0)])
@pytest.mark.parametrize("name", SETS)
def test_a_wire_swings_like_a_free_beam(name, along):
    """EA L²/EI = 1e13 along an axis of the mesh, and 3e11 across it, where entries of K hold bending and tension."""
    ratio = 1e13 if along[1] == 0 else 3e11
    width = np.sqrt(12 / ratio)
    mesh = fm.beams.straight_line((0, 0, 0), tuple(np.array(along) / np.linalg.norm(along)), 12)
    ends = [fm.beams.line_interface(mesh, end, fm.selections.NodeSet(end)) for end in ("start", "end")]
    section = fm.beams.BeamProperty(fm.beams.Rectangle(width, width), STEEL)
    body = cms.couple(fm.beam_body(mesh, section, name="wire", units=SI, interfaces=ends))
    reduced = cms.reduce(body, SETS[name](body, n_modes=10))
    bending = width * np.sqrt(STEEL.E / 12 / STEEL.rho) / (2 * np.pi)  # of radius of gyration width / sqrt(12)
    expected = bending * np.array([4.730041, 4.730041, 7.853205, 7.853205]) ** 2
    assert_allclose(reduced.free_frequencies[:4], expected, rtol=2e-3)
