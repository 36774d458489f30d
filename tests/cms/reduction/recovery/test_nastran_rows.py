"""Rows that Nastran wrote with an external superelement, beside ours of the same frame, and a second reader's."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

import cms
from cms.exchange.importers.element_rows import force_rows
from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.body.fe_body import Interface
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.nastran.matrices.superelement import read_superelement
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages
from tests.root import ROOT

DATA = ROOT / "tests" / "fe_models" / "files" / "data" / "nastran"
FILES = [DATA / f"outboard.{suffix}" for suffix in ("op4", "pch", "asm", "blk")]
HEAD = "SOL 103\nCEND\nMETHOD=1\nBEGIN BULK\nBSET1,123456,3,11,19,27\ninclude 'outboard.blk'\nENDDATA\n"
BOUNDARY = (3, 11, 19, 27)
#: Nastran's items of a CBAR by our section forces: plane 1 is x-y, plane 2 x-z, whose moment turns about -y
OF_A_BAR = {
    "end A M1": ("end A Mz", 1), "end A M2": ("end A My", -1),
    "end B M1": ("end B Mz", 1), "end B M2": ("end B My", -1),
    "V1": ("end A Vy", 1), "V2": ("end A Vz", 1), "N": ("end A N", 1), "T": ("end A Mx", 1),
}  # fmt: skip


@cache
def imported() -> cms.ReducedBody:
    return cms.exchange.import_body(FILES, units="mm-kg-s")


@pytest.fixture(scope="module")
def frame(tmp_path_factory) -> cms.FEBody:
    """The frame from its deck, with Nastran's boundary."""
    folder = tmp_path_factory.mktemp("frame")
    (folder / "outboard.blk").write_bytes((DATA / "outboard.blk").read_bytes())
    deck = folder / "frame.dat"
    deck.write_text(HEAD)
    deck.with_suffix(".toml").write_text(job_text(parse_deck(deck), DeckOptions("mm-kg-s", densities={}), deck.name))
    body = uncoupled_body(read_job(deck.with_suffix(".toml")), Stages())
    rows = {number: int(body.numbering.rows_of_node("test", number)[0]) for number in BOUNDARY}
    ends = [Interface(f"node {number}", "nodes", np.array([row]), body.nodes[row]) for number, row in rows.items()]
    return cms.couple(cms.FEBody(**{**body.__dict__, "interfaces": tuple(ends)}))


@pytest.fixture(scope="module")
def own(frame) -> cms.ReducedBody:
    """The same, reduced by us."""
    return reduced(frame)


@pytest.fixture(scope="module")
def rounded(frame) -> cms.ReducedBody:
    """The same, every entry of its stiffness off by up to one unit in the last place, as rounding leaves them."""
    signs = np.tril(np.random.default_rng(0).choice([-1.0, 1.0], frame.K.shape))
    signs += np.tril(signs, -1).T
    K = sp.csc_array(frame.K.toarray() * (1 + np.finfo(float).eps * signs))
    return reduced(replace(frame, K=K))


def reduced(body: cms.FEBody) -> cms.ReducedBody:
    request = cms.reduction.RecoveryRequest(
        "bars", (cms.reduction.Rows("beam force"), cms.reduction.Rows("displacement", at=(36, 43, 48)))
    )
    return cms.reduce(body, cms.craig_bampton(body, n_modes=8), recovery=request, geometric=False)


def boundary_rows(body: cms.ReducedBody, name: str):
    """Return label -> row over the 24 motions of the boundary in the order of Nastran's."""
    matrices = cms.reduction.craig_bampton_matrices(body)
    order = [matrices.boundary.index(f"node {n} {c}") for n in BOUNDARY for c in ("ux", "uy", "uz", "rx", "ry", "rz")]
    rows = matrices.recover(name)
    return {label: row[order] for label, row in zip(rows.table.labels, rows.displacement, strict=True)}


def test_forces_in_bars_are_those_of_nastran(own):
    """All 51 bars, 8 items, over 24 static motions; Nastran's files have 9 digits and its stiffness is of 1e12."""
    ours, theirs = boundary_rows(own, "bars"), boundary_rows(imported(), "element forces")
    table = imported().recovery["element forces"]
    bars = np.unique(table.numbers)
    assert len(bars) == 51
    assert len(table.labels) == 408
    for item, (component, sign) in OF_A_BAR.items():
        a = np.array([sign * ours[f"element {bar} beam force {component}"] for bar in bars])
        b = np.array([theirs[f"element {bar} element force {item}"] for bar in bars])
        assert_allclose(a, b, rtol=0, atol=1e-6 * np.abs(b).max(), err_msg=item)


def test_motions_of_nodes_are_those_of_nastran(own, rounded):
    """Up to nine digits, and what rounding brings.

    One unit in the last place of the stiffness, which reaches 1e12, moves node 48 by 1e-6; Nastran's solution has such
    a part of its own.
    """
    ours, others, theirs = (
        boundary_rows(own, "bars"), boundary_rows(rounded, "bars"), boundary_rows(imported(), "displacements")
    )  # fmt: skip
    for node in (36, 43, 48):
        for component in ("ux", "uy", "uz", "rx", "ry", "rz"):
            label = f"node {node} displacement {component}"
            rounding, scale = np.abs(others[label] - ours[label]).max(), np.abs(theirs[label]).max()
            assert_allclose(ours[label], theirs[label], rtol=0, atol=1e-7 * scale + 8 * rounding, err_msg=label)
            assert rounding < 2e-6 * scale, label


def test_rows_over_the_boundary_are_those_of_the_file():
    """The way through a floating frame and back: what stands in MEF1, by the boundary and by each mode but for sign."""
    raw = read_superelement(FILES)
    assert raw.forces is not None
    matrices = cms.reduction.craig_bampton_matrices(imported())
    rows = matrices.recover("element forces")
    expected = raw.forces.matrix
    order = [matrices.boundary.index(f"node {n} {c}") for n in BOUNDARY for c in ("ux", "uy", "uz", "rx", "ry", "rz")]
    scale = np.abs(expected[:, :24]).max()
    assert_allclose(rows.displacement[:, order], expected[:, :24], rtol=0, atol=1e-6 * scale)
    held = np.sqrt(np.diag(raw.K.toarray())[24:] / np.diag(raw.M.toarray())[24:]) / (2 * np.pi)
    assert_allclose(np.sort(held), matrices.frequencies, rtol=1e-6)
    by_frequency = expected[:, 24:][:, np.argsort(held)]
    gaps = np.diff(np.sort(held), prepend=0, append=np.inf)
    for k in range(22):
        if min(gaps[k], gaps[k + 1]) < 0.01:  # two modes of one frequency: any pair of their plane
            continue
        a, b = rows.displacement[:, 24 + k], by_frequency[:, k]
        sign = np.sign(a @ b)
        assert_allclose(sign * a, b, rtol=0, atol=2e-4 * np.abs(b).max(), err_msg=str(k))


def test_forces_vanish_in_a_rigid_motion():
    """Over those of a bending of one unit; nine digits of entries of 1e12."""
    table = imported().recovery["element forces"]
    size = np.linalg.norm(np.ptp(imported().nodes, axis=0))
    motion = table.dynamic[0][:, :6] * np.array([1, 1, 1, 1 / size, 1 / size, 1 / size])
    static = boundary_rows(imported(), "element forces")
    assert np.abs(motion).max() < 1e-6 * max(np.abs(row).max() for row in static.values())


def test_elements_and_entries_are_those_another_reader_finds():
    """pyYeti reads MEF1 and the table TEF1 itself."""
    op4 = pytest.importorskip("pyyeti.nastran.op4")
    matrix = op4.load(str(DATA / "outboard.op4"))["mef1"][0]
    text = (DATA / "outboard.pch").read_text().split("TEF1    2")[1].split("ENDREC")[0]
    words = [word for line in text.splitlines()[1:] for word in line[8:].split() if word.isdigit()]
    entries = np.array(words, dtype=int).reshape(-1, 4)
    table = imported().recovery["element forces"]
    np.testing.assert_array_equal(table.numbers, np.repeat(entries[:, 1], entries[:, 2]))
    matrices = cms.reduction.craig_bampton_matrices(imported())
    rows = matrices.recover("element forces").displacement
    order = [
        matrices.boundary.index(f"node {n} {c}") for n in (3, 19, 27) for c in ("ux", "uy", "uz", "rx", "ry", "rz")
    ]
    columns = np.concatenate([np.arange(6), 12 + np.arange(12)])  # node 11 has axes of its own
    scale = np.abs(matrix[:, columns]).max()
    assert_allclose(rows[:, order], matrix[:, columns], rtol=0, atol=1e-6 * scale)


def test_forces_of_unknown_elements_are_left_out_and_told():
    elements = np.array([[34, 7, k + 1] for k in range(8)] + [[999, 3, 1], [999, 3, 2], [34, 9, 1]])
    rows, notes = force_rows(elements, np.ones((11, 4)))
    assert {name.number for name in rows.names} == {7}
    assert notes[0].startswith("element forces (MEF1): 2 rows of type 999 are left out")
    assert "1 rows of CBAR" in notes[1]


def test_rods_shear_panels_and_shells_have_their_items_and_scalar_springs_say_why_not():
    """The order is that of pyNastran (tests/external/test_pynastran.py); units are those of the words."""
    sizes = {10: 2, 3: 2, 24: 2, 4: 16, 33: 8, 74: 8, 38: 8, 69: 12, 102: 6, 11: 1, 21: 1}
    elements = np.array([[kind, kind, k + 1] for kind, n in sizes.items() for k in range(n)])
    rows, notes = force_rows(elements, np.ones((len(elements), 3)))
    names = {}
    for name in rows.names:
        names.setdefault(name.number, []).append((name.component, name.dimensions.length))
    assert names[10] == names[3] == names[24] == [("N", 1), ("T", 2)]
    assert names[33] == names[74]
    assert names[33][:4] == [("Nx", 0), ("Ny", 0), ("Nxy", 0), ("Mx", 1)]
    assert [length for _, length in names[4]] == [1] * 8 + [1, 0] * 4
    assert [length for _, length in names[69]] == [2, 2, 1, 1, 1, 2] * 2
    assert [length for _, length in names[38]] == [1] * 8
    assert [(11 in names, 21 in names), len(notes)] == [(False, False), 2]
    assert all("each is a force or a moment, and the file does not say which" in note for note in notes)


def test_rows_of_a_body_that_was_imported_go_through_its_file(tmp_path):
    cms.write(imported(), tmp_path / "outboard.h5")
    back = cms.read(tmp_path / "outboard.h5")
    assert set(back.recovery) == {"displacements", "element forces"}
    for name, table in imported().recovery.items():
        assert back.recovery[name].labels == table.labels
        assert back.recovery[name].loads == ()
        np.testing.assert_array_equal(back.recovery[name].dynamic, table.dynamic)
    assert Path(tmp_path / "outboard.h5").is_file()
