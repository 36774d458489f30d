"""The door of foreign bodies: files are told by their content, units are asked for, every damage is one message."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

import cms
from cms.errors import BodyError, ForeignBodyError, UnitsError
from cms.exchange.export import export_body
from cms.exchange.importers.inertia import FullMass
from fe_models.errors import MatrixError
from floatframe import GeneralizedAlpha, System, integrate
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.results.recovery import interface_positions
from tests.bodies import bar
from tests.cms.command import run_cms
from tests.root import ROOT
from tests.superelements import FIRST, craig_bampton_matrices

OUTBOARD = ROOT / "tests" / "fe_models" / "files" / "data" / "nastran"
NAMES = ("outboard.op4", "outboard.pch", "outboard.asm", "outboard.blk")


@pytest.fixture
def outboard(tmp_path):
    for name in NAMES:
        shutil.copy(OUTBOARD / name, tmp_path / name)
    return tmp_path / "outboard.op4"


def raw_matrices(path):
    """K and M as pyYeti reads them, in the displacement systems of the grid points."""
    from pyyeti.nastran import op4

    found = op4.read(str(path))
    return found["kxx"], found["mxx"]


def test_a_superelement_of_nastran_has_the_frequencies_of_its_matrices_as_another_program_reads_them(outboard):
    body = cms.exchange.import_body(outboard, units="mm-kg-s")
    K, M = raw_matrices(outboard)
    # torsion of the bars has no mass: omega² from the pencil (M, K + s M), whose right side is definite
    s = 100.0
    values = la.eigvalsh((M + M.T) / 2, (K + K.T) / 2 + s * M)[::-1]
    omega2 = 1 / values[:14] - s
    assert_allclose(omega2[:6], 0, rtol=0, atol=1e-3)
    assert_allclose(body.free_frequencies[:8], np.sqrt(omega2[6:]) / (2 * np.pi), rtol=1e-7)
    assert [i.name for i in body.interfaces] == ["node 3", "node 11", "node 19", "node 27"]
    assert_allclose(body.moments.m, 1.5903838, rtol=1e-6)
    assert len(body.nodes) == 4  # the axes of the others are in the bulk data of the model
    assert body.moments.missing == ("3C", "4C", "5C")
    place = body.frame.origin + body.frame.axes @ body.interface("node 11").position
    assert_allclose(place, [600, 300, 300], rtol=0, atol=1e-6)


def test_its_recovery_moves_every_node_as_the_modes_of_a_beam_do(outboard):
    """Interface nodes are among the recovered ones: both routes say one motion."""
    body = cms.exchange.import_body([outboard.with_name(name) for name in NAMES], units="mm-kg-s")
    assert len(body.nodes) == 26
    for interface in body.interfaces:
        row = int(np.flatnonzero(body.node_ids == int(interface.name.split()[1]))[0])
        assert_allclose(body.Phi[row], interface.Psi[:3], rtol=0, atol=1e-7 * np.abs(body.Phi).max())


def test_units_are_asked_for(outboard):
    result = run_cms("import", outboard)
    assert result.exit_code != 0
    assert "--units: missing; none of these formats says its units" in result.output.replace("\n", " ")
    with pytest.raises(UnitsError, match="unknown unit system"):
        cms.exchange.import_body(outboard, units="mm")


def test_the_command_writes_a_file_that_says_what_is_missing(outboard, tmp_path):
    path = tmp_path / "body.h5"
    words = ["import", str(outboard), "--units", "mm-kg-s", "--interface", "hub=11", "--interface", "tips=3", "-o"]
    result = run_cms(*words, path, code=0)
    assert "inertia missing" in result.output
    assert "exact, as far as they are known" in result.output
    body = cms.read(path)
    assert [i.name for i in body.interfaces] == ["hub", "tips"]
    record = json.loads(run_cms("check", path, "--json").output)
    terms = next(r for r in (record["records"] if isinstance(record, dict) else record) if r["name"] == "inertia-terms")
    assert terms["verdict"] == "warn"


def write_coordinates(path: Path, matrix):
    """Write a matrix as Abaqus does in COORDINATE format: row, column, value, from 1."""
    rows, columns = np.nonzero(matrix)
    lines = [f"{i + 1} {j + 1} {matrix[i, j]:.17e}" for i, j in zip(rows, columns, strict=True)]
    path.write_text("\n".join(lines) + "\n")


def test_a_body_of_ours_that_went_out_as_plain_matrices_moves_as_before(tmp_path):
    """Full mass beside: nothing is missing, and the motion of a spinning body is the same to rounding."""
    part = bar(nx=4, length=0.8, width=0.06, height=0.05)
    full = cms.couple(part)
    own = cms.reduce(full, cms.craig_bampton(full, n_modes=3), geometric=False, stress=False)
    element, _ = craig_bampton_matrices(full, 3)
    for role in ("K", "M"):
        write_coordinates(tmp_path / f"{role}.mtx", np.asarray(getattr(element, role)))
    boundary = [FIRST + int(full.dofs[i.dofs[0], 0]) for i in full.interfaces]
    places = dict(zip(map(int, element.node_numbers), element.nodes, strict=True))
    beside = FullMass(part.M, part.dofs + np.array([FIRST, 0]), places)
    from cms.exchange.importers.superelement_body import ImportOptions, body_of_superelement
    from fe_models.foundation.units import unit_system

    plain = cms.exchange.import_body(
        {"K": tmp_path / "K.mtx", "M": tmp_path / "M.mtx"}, units="m-kg-s", nodes=places, boundary=boundary
    )
    assert plain.moments.missing == ("3C", "4C", "5C")
    assert_allclose(plain.free_frequencies, own.free_frequencies, rtol=1e-9)
    names = {i.name: [number] for i, number in zip(full.interfaces, boundary, strict=True)}
    again = body_of_superelement(element, ImportOptions(unit_system("m-kg-s"), names, beside))
    ends = []
    for body in (own, again):
        q = np.zeros(body.n_q)
        q[[0, 1, 4]] = np.array([1, 1, 1]) * 1e-3 * np.sign(body.interface("right").Psi[:3].sum(axis=0))[[0, 1, 4]]
        q[np.argsort(-np.abs(q))[3:]] = 0.0
        system = System([FlexibleBody("part", body, omega_B=(50.0, 300.0, -200.0), q=q, stiffening=False)])
        motion = integrate(system, GeneralizedAlpha(0.9, 1e-12), 4e-3, 1e-5, output_every=50)
        ends.append(interface_positions(motion, "part", body, "right"))
    assert np.ptp(ends[0], axis=0).max() > 0.3
    assert_allclose(ends[1], ends[0], rtol=0, atol=1e-9)


def test_what_cannot_be_read_is_one_message(outboard, tmp_path):
    def refused(files, words, error=ForeignBodyError, **more):
        with pytest.raises(error, match=words):
            cms.exchange.import_body(files, **{"units": "mm-kg-s", **more})

    refused(tmp_path / "outbord.op4", "there is no such file; did you mean")
    refused(tmp_path, "expected a file, got a folder")
    refused([], "expected at least one file")
    (tmp_path / "empty.op4").write_bytes(b"")
    refused(tmp_path / "empty.op4", "the file is empty")
    refused(outboard, "format 'nastrn': unknown", form="nastrn")
    refused(outboard, "list their dofs themselves", boundary=[3])
    content = outboard.read_bytes()
    outboard.write_bytes(content[: len(content) // 2])
    refused(outboard, "outboard", MatrixError)
    outboard.write_bytes(content)
    refused(outboard, "no boundary node", interfaces={"hub": [12]})


def test_matrices_without_rows_or_places_ask_for_them(tmp_path):
    part = cms.couple(bar(nx=2))
    element, _ = craig_bampton_matrices(part, 2)
    for role in ("K", "M"):
        write_coordinates(tmp_path / f"{role}.mtx", np.asarray(getattr(element, role)))
    files = {"K": tmp_path / "K.mtx", "M": tmp_path / "M.mtx"}
    with pytest.raises(ForeignBodyError, match="do not say which dof each row is"):
        cms.exchange.import_body(files, units="m-kg-s")
    with pytest.raises(ForeignBodyError, match="have dofs but no position"):
        cms.exchange.import_body(files, units="m-kg-s", boundary=[1, 2])
    with pytest.raises(ForeignBodyError, match="3 nodes have 18 dofs, the matrices have 14 rows"):
        cms.exchange.import_body(files, units="m-kg-s", boundary=[1, 2, 3])
    with pytest.raises(ForeignBodyError, match="M is missing"):
        cms.exchange.import_body({"K": files["K"]}, units="m-kg-s", boundary=[1, 2])


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--mesh", "a.msh"], "--mesh and --density belong together"),
        (["--interface", "hub"], "expected NAME=3,11,19"),
        (["--interface", "hub=a"], "expected node numbers with commas between"),
        (["--nodal-masses", "none.csv"], "--nodal-masses: none.csv: cannot be read: No such file"),
        (["--frame", "mean"], "unknown frame"),
        (["--damping", "0.3"], "--heavy of a command"),
    ],
)
def test_options_that_are_wrong_are_told(outboard, words, told):
    result = run_cms("import", outboard, "--units", "mm-kg-s", *words)
    assert result.exit_code != 0
    assert told in " ".join(result.output.split())


def test_a_damping_ratio_above_a_fifth_is_taken_if_it_is_confirmed(outboard, tmp_path):
    words = ["import", str(outboard), "--units", "mm-kg-s", "-o", str(tmp_path / "body.h5")]
    run_cms(*words, "--damping", "0.3", "--heavy", code=0)
    body, bare = cms.read(tmp_path / "body.h5"), cms.exchange.import_body(outboard, units="mm-kg-s")
    omega = np.sqrt(np.diag(body.K) * np.diag(body.M))
    assert_allclose(np.diag(body.D - bare.D), 2 * 0.3 * omega, rtol=1e-9, atol=0)


def test_a_table_of_nodal_masses_completes_a_superelement(outboard, tmp_path):
    body = cms.exchange.import_body(outboard, units="mm-kg-s")
    share = body.moments.m / len(body.nodes)
    table = tmp_path / "masses.csv"
    table.write_text("node,mass\n" + "".join(f"{number},{share:.12g}\n" for number in body.node_ids))
    output = tmp_path / "whole.h5"
    words = ["import", str(outboard), "--units", "mm-kg-s", "--nodal-masses", str(table), "-o", str(output)]
    result = run_cms(*words)
    assert result.exit_code != 0  # equal masses are not those of this frame: its parts are of other sizes
    assert "do not belong to this body" in " ".join(result.output.split())
    table.write_text("node,mass\n3,1.0\nx\n")
    result = run_cms(*words)
    assert "masses.csv, line 3: expected two numbers, node and mass" in " ".join(result.output.split())


def test_a_superelement_of_ansys_has_its_mass_and_the_frequencies_of_its_matrices():
    """A cube of 30 mm with a density in kg/m³: its numbers are those of metres, and another system is refused."""
    from fe_models.files.read_matrices import read_matrices

    path = ROOT / "tests" / "fe_models" / "files" / "data" / "ansys" / "cp56.sub"
    body = cms.exchange.import_body(path, units="m-kg-s")
    assert_allclose(body.moments.m, 30.0**3 * 7850.0, rtol=1e-9)
    assert_allclose(
        body.moments.J0, body.moments.m * 30.0**2 / 6 * np.eye(3), rtol=0, atol=2e-3 * body.moments.J0[0, 0]
    )
    assert [(i.name, i.kind, len(i.members)) for i in body.interfaces] == [("boundary", "nodes", 80)]
    raw = read_matrices(path)
    omega2 = la.eigh(raw.K.toarray(), raw.M.toarray(), eigvals_only=True)
    assert_allclose(body.free_frequencies[:20], np.sqrt(omega2[6:26]) / (2 * np.pi), rtol=1e-6)
    with pytest.raises(BodyError, match="the mass is"):
        cms.exchange.import_body(path, units="mm-t-s")


def test_a_substructure_of_abaqus_finds_its_places_in_a_deck(tmp_path):
    """Element matrices as *SUBSTRUCTURE MATRIX OUTPUT writes them, nodes from the deck beside."""
    part = cms.couple(bar(nx=4))
    element, _ = craig_bampton_matrices(part, 0)
    numbers = list(dict.fromkeys(element.dofs[:, 0].tolist()))
    lines = [
        "** ELEMENT NODES",
        f"** {', '.join(map(str, numbers))}",
        "*USER ELEMENT, NODES=2, LINEAR",
        "1, 2, 3, 4, 5, 6",
    ]
    for kind, matrix in (("STIFFNESS", element.K), ("MASS", element.M)):
        lines.append(f"*MATRIX, TYPE={kind}")
        values = [f"{matrix[i, j]:.16e}" for j in range(len(matrix)) for i in range(j + 1)]
        lines += [", ".join(values[k : k + 4]) + "," for k in range(0, len(values), 4)]
    (tmp_path / "part.mtx").write_text("\n".join(lines) + "\n")
    places = {int(n): element.nodes[element.places(np.array([n]))[0]] for n in numbers}
    deck = ["*NODE", *(f"{n}, {', '.join(f'{x:.12g}' for x in place)}" for n, place in places.items())]
    (tmp_path / "part.inp").write_text("\n".join(deck) + "\n")
    own = cms.reduce(part, cms.modes.guyan(part), geometric=False)
    body = cms.exchange.import_body(
        tmp_path / "part.mtx", units="m-kg-s", nodes=places, interfaces={"a": numbers[:1], "b": numbers[1:]}
    )
    assert_allclose(body.free_frequencies, own.free_frequencies, rtol=1e-8)
    from_deck = cms.exchange.import_body(tmp_path / "part.mtx", units="m-kg-s", nodes=tmp_path / "part.inp")
    assert_allclose(from_deck.free_frequencies, own.free_frequencies, rtol=1e-8)
    with pytest.raises(ForeignBodyError, match="have dofs but no position"):
        cms.exchange.import_body(tmp_path / "part.mtx", units="m-kg-s")


def test_a_superelement_that_we_wrote_for_nastran_comes_back(tmp_path):
    part = cms.couple(bar(nx=4, length=0.8, width=0.06, height=0.05))
    own = cms.reduce(part, cms.craig_bampton(part, n_modes=3), geometric=False, stress=False)
    export_body(own, tmp_path / "part.op4", to="nastran-op4", units=own.units)
    body = cms.exchange.import_body(tmp_path / "part.op4", units=own.units)
    assert_allclose(body.free_frequencies, own.free_frequencies, rtol=1e-8)
    assert_allclose(body.moments.J0, own.moments.J0, rtol=0, atol=1e-8 * np.abs(own.moments.J0).max())
    assert body.moments.missing == ("3C", "4C", "5C")
