"""An external superelement of Nastran: rows, axes and recovery, against the frame of its own deck made of our beams."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose, assert_array_equal

from fe_models import UNIT_SYSTEMS, beam_body
from fe_models.beams import BeamProperty, GeneralSection
from fe_models.body.material import Material
from fe_models.errors import MatrixError, MeshError
from fe_models.files.nastran.bulk_data.cards import read_cards
from fe_models.files.nastran.bulk_data.coordinate_systems import read_grid_points
from fe_models.files.nastran.matrices.op4 import read_op4
from fe_models.files.nastran.matrices.superelement import SCALAR, read_superelement
from fe_models.files.nastran.matrices.write_op4 import write_op4
from fe_models.meshes.line_mesh import LineMesh

DATA = Path(__file__).parent / "data" / "nastran"
TRIAD = [DATA / f"outboard.{suffix}" for suffix in ("op4", "pch", "blk")]
BOUNDARY = (3, 11, 19, 27)
LAST_OF_TUG1 = "        ENDREC" + " " * 66 + "\nDTI     TEF1    0"


@pytest.fixture(scope="module")
def outboard():
    return read_superelement(TRIAD)


def frame_of_beams(*, inertia=1.0):
    """The frame of outboard.blk of our own beams: body, grid points, element numbers.

    With second moments of area near zero, `inertia`, its mass is that of the bars of Nastran, which have none in
    torsion; its stiffness then says nothing.
    """
    cards = list(read_cards("outboard.blk", (DATA / "outboard.blk").read_text()))
    points = read_grid_points(cards)
    ids = sorted(points.positions)
    materials = {card.integer(1): card for card in cards if card.name == "MAT1"}
    bars = [card for card in cards if card.name == "CBAR"]
    pids = np.array([card.integer(2) for card in bars])
    properties = {}
    for card in cards:
        if card.name == "PBAR" and (pids == card.integer(1)).any():
            material = materials[card.integer(2)]
            E, G = material.real(2), material.real(3)
            Iz, Iy = inertia * card.real(4), inertia * card.real(5)
            section = GeneralSection(A=card.real(3), Iz=Iz, Iy=Iy, J=card.real(6))
            steel = Material("m", E, E / (2 * G) - 1, material.real(5))
            properties[card.text(1)] = BeamProperty(section, steel, shear=False, rotary_inertia=False)
    mesh = LineMesh(
        np.array([points.positions[number] for number in ids]),
        np.array([[ids.index(card.integer(k)) for k in (3, 4)] for card in bars]),
        {pid: np.flatnonzero(pids == int(pid)) for pid in properties},
    )
    return (
        beam_body(mesh, properties, name="outboard", units=next(iter(UNIT_SYSTEMS.values()))),
        ids,
        [c.integer(1) for c in bars],
    )


@pytest.fixture(scope="module")
def frame():
    return frame_of_beams()


def rigid(rows, positions):
    """Six rigid motions at these rows, basic axes, (n, 6); none at scalar points."""
    G = np.zeros((len(rows), 6))
    for k, (number, component) in enumerate(rows.tolist()):
        if component >= 3:
            G[k, component] = 1
        elif component != SCALAR:
            G[k, component] = 1
            G[k, 3:] = np.cross(np.eye(3), positions[number])[:, component]
    return G


def test_rows_are_the_grid_points_and_scalar_points_of_extrn(outboard):
    assert tuple(outboard.grid_ids) == BOUNDARY
    assert outboard.scalar_ids == list(range(1995001, 1995023))
    assert_array_equal(outboard.dofs[6:12], [(11, k) for k in range(6)])
    assert outboard.loads.shape == (46, 0)  # its px1 is the zero that stands for none
    assert outboard.D is None
    assert len(outboard.files) == 3


def test_a_rigid_motion_in_basic_axes_takes_no_force(outboard):
    """Grid point 11 has a turned displacement system: rows that were left in it would answer by 3e-2 of K."""
    G = rigid(outboard.dofs, outboard.positions)
    assert_allclose(outboard.K @ G, 0, rtol=0, atol=1e-11 * abs(outboard.K).max())
    local = outboard.K.copy()
    Q = np.eye(46)
    Q[6:9, 6:9] = Q[9:12, 9:12] = [[0, 1, 0], [0, 0, 1], [1, 0, 0]]
    assert abs(Q @ (local @ (Q.T @ G))).max() > 1e-2 * abs(outboard.K).max()


def test_the_boundary_stiffness_is_that_of_the_frame_of_beams(outboard, frame):
    body, ids, _ = frame
    K = body.K.toarray()
    b = np.concatenate([6 * ids.index(number) + np.arange(6) for number in BOUNDARY])
    i = np.setdiff1d(np.arange(len(K)), b)
    condensed = K[np.ix_(b, b)] - K[np.ix_(b, i)] @ la.solve(K[np.ix_(i, i)], K[np.ix_(i, b)])
    assert_allclose(outboard.K.toarray()[:24, :24], condensed, rtol=0, atol=1e-8 * abs(condensed).max())


def test_frequencies_are_those_of_the_frame_of_beams(outboard, frame):
    """Free, and with the interfaces held: Nastran kept 16 modes to 50 Hz."""
    body, ids, _ = frame
    K, M = body.K.toarray(), frame_of_beams(inertia=1e-12)[0].M.toarray()
    M += np.diag(np.tile([0, 0, 0, 1, 1, 1], len(ids))) * 1e-9 * abs(M).max()  # so that it is definite
    b = np.concatenate([6 * ids.index(number) + np.arange(6) for number in BOUNDARY])
    i = np.setdiff1d(np.arange(len(K)), b)
    free = la.eigvalsh(outboard.K.toarray(), outboard.M.toarray())
    assert_allclose(np.sqrt(free[6:16]), np.sqrt(la.eigvalsh(K, M)[6:16]), rtol=1e-6)
    held = np.sort(outboard.K.diagonal()[24:] / outboard.M.diagonal()[24:])
    assert_allclose(np.sqrt(held[:16]), np.sqrt(la.eigvalsh(K[np.ix_(i, i)], M[np.ix_(i, i)])[:16]), rtol=1e-6)


def test_mass_and_moments_are_those_of_the_frame(outboard, frame):
    body, ids, _ = frame
    G = rigid(outboard.dofs, outboard.positions)
    whole = rigid(np.array([(number, k) for number in ids for k in range(6)]), outboard.positions)
    gram = whole.T @ (body.M @ whole)
    assert_allclose((G.T @ (outboard.M @ G))[:3], gram[:3], rtol=0, atol=1e-5 * abs(gram[:3]).max())


def test_recovery_moves_every_grid_point_of_the_frame(outboard, frame):
    """Rigid motions, and the static shapes of the boundary, which the frame of beams has too; MUG1 is in singles."""
    body, ids, _ = frame
    recovery = outboard.displacement
    assert recovery.unplaced.size == 0
    assert_array_equal(recovery.rows, [(number, k) for number in ids for k in range(6)])
    G = rigid(outboard.dofs, outboard.positions)
    assert_allclose(recovery.matrix @ G, rigid(recovery.rows, outboard.positions), rtol=0, atol=1e-6 * abs(G).max())
    K = body.K.toarray()
    b = np.concatenate([6 * ids.index(number) + np.arange(6) for number in BOUNDARY])
    i = np.setdiff1d(np.arange(len(K)), b)
    static = np.zeros((len(K), 24))
    static[b] = np.eye(24)
    static[i] = -la.solve(K[np.ix_(i, i)], K[np.ix_(i, b)])
    scale = abs(static).max()
    assert_allclose(recovery.matrix[:, :24], static, rtol=0, atol=1e-6 * scale)


def test_forces_are_the_section_forces_of_the_beams(outboard, frame):
    """Axial force and torque (items 7 and 8 of a CBAR) of the recovered displacements."""
    body, _, numbers = frame
    u = np.zeros((body.element_model.n_mesh_dof, 46))
    u[: 6 * body.element_model.n_nodes] = outboard.displacement.matrix
    N_and_T = body.element_model.section_forces(u)[:, 0][:, [0, 3]]
    forces = outboard.forces
    for k, item in enumerate((7, 8)):
        is_item = forces.elements[:, 2] == item
        assert_array_equal(forces.elements[is_item, 1], numbers)
        ours = N_and_T[:, k]
        assert_allclose(forces.matrix[is_item], ours, rtol=0, atol=2e-5 * abs(ours).max())


def test_one_file_finds_its_companions_and_says_which_points_have_no_place(tmp_path):
    for suffix in ("op4", "pch", "asm"):
        shutil.copy(DATA / f"outboard.{suffix}", tmp_path)
    element = read_superelement(tmp_path / "outboard.op4")
    assert len(element.files) == 3
    assert "outboard.asm, outboard.op4, outboard.pch" in element.notes[0]
    assert len(element.displacement.unplaced) == 22
    assert "22 grid points" in element.notes[1]


def matrices_of(path):
    return {matrix.name: matrix.matrix for matrix in read_op4(path)}


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda m: m.pop("KXX"), "expected a matrix KXX or KAA, got MXX"),
        (lambda m: m.update(KAA=m["KXX"]), "got KXX, KAA; write each once"),
        (lambda m: m.update(MXX=m["MXX"][:40, :40]), "stiffness has 46 rows, mass 40"),
        (
            lambda m: m.update(KXX=m["KXX"][:40, :40], MXX=m["MXX"][:40, :40]),
            "EXTRN names 46 rows, the matrices have 40",
        ),
        (lambda m: m.update(KXX=m["KXX"][:40]), "square"),
        (lambda m: m.update(MUG1=m["MUG1"][:150]), "TUG1 has 156 rows, its matrix 150"),
        (lambda m: m.update(MEF1=m["MEF1"][:, :40]), "expected 408 rows and 46 columns"),
        (lambda m: m.update(PX=np.ones((3, 1))), "expected 46 rows"),
    ],
)
def test_matrices_that_do_not_fit_their_rows_are_refused(tmp_path, change, word):
    matrices = matrices_of(DATA / "outboard.op4")
    change(matrices)
    write_op4(tmp_path / "outboard.op4", matrices)
    shutil.copy(DATA / "outboard.pch", tmp_path)
    with pytest.raises(MatrixError, match=word):
        read_superelement(tmp_path / "outboard.op4")


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ("\nEXTRN ", "\nEXTRA ", "expected an EXTRN card"),
        ("EXTRN          3  123456", "EXTRN          3  123478", "components 1 to 6"),
        ("      19  123456", "      11  123456", "names point 11 twice"),
        ("      11  123456", "      11     123", "EXTRN names 43 rows, the matrices have 46"),
        ("DTI     TUG1    2", "DTI     TUGX    2", "expected one table TUG1"),
        ("1       9       6       19 ", "1       9       6       25 ", "begin at 25, expected 19"),
        (LAST_OF_TUG1, "DTI     TEF1    0", "expected ENDREC"),
        ("0.300000000E+03              10  ", "0.300000000E+03              12  ", "coordinate system 12"),
        ("1       1       6       1  ", "3       1       6       1  ", "type 1"),
    ],
)  # fmt: skip
def test_rows_that_are_not_told_are_refused(tmp_path, old, new, word):
    shutil.copy(DATA / "outboard.op4", tmp_path)
    text = (DATA / "outboard.pch").read_text()
    assert old in text
    (tmp_path / "outboard.pch").write_text(text.replace(old, new, 1))
    with pytest.raises((MatrixError, MeshError), match=word) as caught:
        read_superelement(tmp_path / "outboard.op4")
    assert "\n" not in str(caught.value)


def test_rows_for_some_translations_in_turned_axes_are_refused(tmp_path):
    matrices = matrices_of(DATA / "outboard.op4")
    keep = np.setdiff1d(np.arange(46), [7, 8])
    short = {name: matrices[name][np.ix_(keep, keep)] for name in ("KXX", "MXX")}
    write_op4(tmp_path / "outboard.op4", short)
    text = (DATA / "outboard.pch").read_text()
    (tmp_path / "outboard.pch").write_text(text.replace("      11  123456", "      11    1456", 1))
    with pytest.raises(MatrixError, match="grid point 11 has rows for some components only"):
        read_superelement(tmp_path / "outboard.op4")


def test_loads_and_damping_are_turned_too(tmp_path):
    """In the rows of the files grid point 11 has axes turned by a third of a circle."""
    matrices = matrices_of(DATA / "outboard.op4")
    matrices["BXX"] = 0.01 * matrices["KXX"]
    load = np.zeros((46, 2))
    load[6:9, 0] = [1.0, 2.0, 3.0]
    matrices["PX"] = load
    write_op4(tmp_path / "outboard.op4", matrices)
    shutil.copy(DATA / "outboard.pch", tmp_path)
    element = read_superelement(tmp_path / "outboard.pch")
    assert_allclose(element.D.toarray(), 0.01 * element.K.toarray(), rtol=1e-12, atol=1e-9)
    # CORD2R 10: z along basic x, x along basic y: local (1, 2, 3) is basic (3, 1, 2)
    assert_allclose(element.loads[6:9, 0], [3.0, 1.0, 2.0], atol=1e-14)


def test_missing_files_are_named(tmp_path):
    with pytest.raises(MatrixError, match=r"none\.op4"):
        read_superelement(tmp_path / "none.op4")
    with pytest.raises(MatrixError, match=r"expected an \.op4 file"):
        read_superelement(DATA / "outboard.blk")
