"""Decks of Nastran become bodies: a frame of bars beside the superelement that Nastran made of it."""

from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import block_diag, eigh

from cms.jobs.body_of_job import job_body, uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.nastran.matrices.superelement import read_superelement
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages
from tests.root import ROOT

DATA = ROOT / "tests" / "fe_models" / "files" / "data" / "nastran"
HEAD = "SOL 103\nCEND\nMETHOD=1\nBEGIN BULK\nBSET1,123456,3,11,19,27\ninclude 'outboard.blk'\nENDDATA\n"


def job_of(path: Path, units="m-kg-s", **options):
    text = job_text(parse_deck(path), DeckOptions(units, **{"densities": {}, **options}), path.name)
    path.with_suffix(".toml").write_text(text)
    return read_job(path.with_suffix(".toml"))


def test_the_frame_of_bars_has_the_frequencies_of_nastrans_superelement(tmp_path):
    """With its boundary held. Nastran's bars have no inertia of torsion, ours have: they lie below, by 1e-3 at most."""
    (tmp_path / "outboard.blk").write_bytes((DATA / "outboard.blk").read_bytes())
    deck = tmp_path / "frame.dat"
    deck.write_text(HEAD)
    job = job_of(deck, "mm-kg-s")
    assert {name: table.kind for name, table in job.interfaces.items()} == {"boundary_123456": "nodes"}
    body = job_body(job)
    i = body.i
    ours = np.sqrt(eigh(body.K[i][:, i].toarray(), body.M[i][:, i].toarray(), eigvals_only=True))[:10]
    theirs = read_superelement([DATA / f"outboard.{suffix}" for suffix in ("op4", "pch", "blk")])
    held = np.sqrt(np.sort(theirs.K.diagonal()[24:] / theirs.M.diagonal()[24:]))[:10]
    assert_allclose(ours, held, rtol=1e-3)
    assert (ours < held).all()
    b = np.concatenate([body.interfaces[0].dofs])
    order = np.lexsort((body.dofs[b, 1], body.dofs[b, 0]))
    b = b[order]
    K = body.K.toarray()
    condensed = K[np.ix_(b, b)] - K[np.ix_(b, i)] @ np.linalg.solve(K[np.ix_(i, i)], K[np.ix_(i, b)])
    assert_allclose(theirs.K.toarray()[:24, :24], condensed, rtol=0, atol=1e-7 * abs(condensed).max())


DECK = """SOL 103
CEND
SPC = 7
BEGIN BULK
INCLUDE 'nodes.bulk'
BEGIN BULK
CORD2R,5,,10.,0.,0.,10.,0.,1.
,11.,0.,0.
GRDSET,,5,,,,5
CHEXA,1,1,1,2,3,4,5,6
,7,8
PSOLID,1,9
MAT1,9,2.1+11,,.3,7850.
PARAM,COUPMASS,1
PARAM,WTMASS,2.
CONM2,50,9,,3.,.1,.2,.3
,1.,.1,2.,.2,.3,3.
RBE2,60,9,123456,5,6,7,8
SPC1,7,123,1,THRU,4
SPC1,8,123,5
FORCE,3,9,5,2.,0.,0.,1.
MOMENT,3,9,,4.,1.,0.,0.
GRAV,4,,9.81,0.,0.,-1.
CELAS2,70,5.+3,1,2,2,2
"""
NODES = "\n".join(
    f"GRID,{k + 1},,{x}.,{y}.,{z}."
    for k, (x, y, z) in enumerate(
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    )
)
NODES += "\nGRID,9,,.5,.5,2.,0\n"


def deck_of(folder, text=DECK):
    (folder / "nodes.bulk").write_text(f"BEGIN BULK\n{NODES}\nENDDATA\n")
    path = folder / "model.bdf"
    path.write_text(text)
    return path


def test_a_deck_of_nastran_is_read_whole(tmp_path):
    deck = parse_deck(deck_of(tmp_path, DECK.replace("CELAS2,70,5.+3,1,2,2,2\n", "")))
    deck.ledger.require_whole()
    assert_allclose(deck.mesh.nodes[0], [10, 0, 0], atol=1e-14)
    assert deck.materials["9"].density == 2 * 7850.0
    assert (deck.solids[0].group, deck.solids[0].mass) == ("pid_1", "consistent")
    mass = deck.masses[0]
    assert (mass.nodes, mass.mass, mass.offset) == ("node_9", 6.0, (0.1, 0.2, 0.3))
    assert_allclose(mass.inertia, 2 * np.array([[1, -0.1, -0.2], [-0.1, 2, -0.3], [-0.2, -0.3, 3]]), rtol=1e-14)
    link = deck.rigid[0]
    assert (link.node, list(deck.mesh.node_numbers[deck.mesh.node_sets[link.followers]])) == ("node_9", [5, 6, 7, 8])
    support = deck.supports[0]
    assert list(deck.mesh.node_numbers[deck.mesh.node_sets[support.nodes]]) == [1, 2, 3, 4]
    assert deck.loads[0].forces == {"node_9": (0.0, 0.0, 2.0, 4.0, 0.0, 0.0)}
    assert_allclose(deck.loads[1].acceleration, [0, 0, -9.81], rtol=1e-14)
    assert ("SPC1", "1", "of a set that the case control does not select") in deck.ledger.rows()


def test_the_job_of_a_deck_of_nastran_has_its_mass_and_its_loads(tmp_path):
    path = deck_of(tmp_path, DECK.replace("CELAS2,70,5.+3,1,2,2,2", "CELAS2,70,5.+3,5,1,6,2"))
    body = job_body(job_of(path, leave_out=("CELAS2",)))
    up = np.where(body.dofs[:, 1] == 2, 1.0, 0.0)
    assert_allclose(up @ body.M @ up, 2 * 7850.0 + 6.0, rtol=1e-12)
    assert_allclose(body.load_cases[0].f @ up, 2.0, rtol=1e-12)
    assert body.provenance["deck sha256"] == sha256(path.read_bytes()).hexdigest()
    text = path.with_suffix(".toml").read_text()
    assert "#   1 CELAS2: LEFT OUT ON REQUEST: between different components, grid points of different axes, or" in text


def test_a_spring_between_held_components_is_left_out_with_a_note(tmp_path):
    path = deck_of(tmp_path)
    job_of(path)
    assert "#   1 CELAS2: between components that are held: without effect in" in path.with_suffix(".toml").read_text()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("PSOLID,1,9", "PCOMPG,1,,,,,,,", "1 CHEXA: property 1 is PCOMPG"),
        ("RBE2,60,9,123456,5,6,7,8", "RBE1,60,9,123456", "1 RBE1: this card is not known here"),
        ("PSOLID,1,9", "PSOLID,2,9", "1 CHEXA: property 1 is not known here"),
        ("CONM2", "CONM1", "1 CONM1: no mass matrix of a rigid piece"),
        ("CELAS2,70,5.+3,1,2,2,2", "CBUSH,70,71,1,2\n,.3,5\nPBUSH,71,K,1.,1.,1.", "1 CBUSH: OCID = 5: this field"),
        ("CELAS2,70,5.+3,1,2,2,2", "CBUSH,70,71,1,2\nPBUSH,71,K,1.,1.,2.", "1 CBUSH: with length, other values"),
        ("CELAS2,70,5.+3,1,2,2,2", "CBUSH,70,71,1,2,1.,0.,0.\nPBUSH,71,K,1.,1.,2.", "1 CBUSH: whose orientation"),
        ("CELAS2,70,5.+3,1,2,2,2", "CBAR,70,71,1,2,2.,0.,0.\nPBARL,71,9,,ROD\n,.1",
         "1 CBAR: its orientation vector is along the bar"),
        ("RBE2,60,9,123456,5,6,7,8", "RBE3,60,,9,123456,1.,123,5,6\n,7,8,UM,9,123456", "1 RBE3: with UM"),
    ],
)  # fmt: skip
def test_cards_with_mass_or_stiffness_are_refused_by_name(tmp_path, old, new, words):
    assert old in DECK
    deck = parse_deck(deck_of(tmp_path, DECK.replace(old, new)))
    with pytest.raises(ValueError, match=words):
        deck.ledger.require_whole()


def test_a_mean_motion_of_no_grids_is_refused(tmp_path):
    with pytest.raises(ValueError, match="expected weights, components and grids, got none"):
        parse_deck(deck_of(tmp_path, DECK.replace("RBE2,60,9,123456,5,6,7,8", "RBE3,60,,9,123456")))


@pytest.mark.parametrize(
    ("bush", "axes"),
    [
        ("CBUSH,70,71,5,10", "its axes are those of the displacements of GA"),
        ("CBUSH,70,71,5,10,,,,0", ""),
        ("CBUSH,70,71,1,2,0.,0.,1.", ""),
        ("CBUSH,70,71,1,2,,,,0", ""),
    ],
)
def test_a_bush_says_whose_axes_it_takes_unasked(tmp_path, bush, axes):
    lines = f"GRID,10,,0.,0.,1.\n{bush}\nPBUSH,71,K,1.,2.,3."
    deck = parse_deck(deck_of(tmp_path, DECK.replace("CELAS2,70,5.+3,1,2,2,2", lines)))
    deck.ledger.require_whole()
    assert len(deck.springs) == 1
    told = [why for name, _, why in deck.ledger.rows() if name == "CBUSH"]
    assert len(told) == bool(axes)
    assert all(axes in why for why in told)


@pytest.mark.parametrize("orientation", ["12", "2.,-1.,.5"], ids=["grid", "vector"])
def test_axes_of_a_bush_lie_along_it_and_towards_its_orientation(tmp_path, orientation):
    """From (1, 2, 3) to (3, 5, 9), off the origin: x is (2, 3, 6)/7, z is normal to x and the orientation."""
    grids = "GRID,10,,1.,2.,3.\nGRID,11,,3.,5.,9.\nGRID,12,,3.,1.,3.5\n"
    lines = f"{grids}CBUSH,70,71,10,11,{orientation}\nPBUSH,71,K,1.,2.,3.,4.,5.,6."
    deck = parse_deck(deck_of(tmp_path, DECK.replace("CELAS2,70,5.+3,1,2,2,2", lines)))
    x = np.array([2, 3, 6]) / 7
    z = np.cross(x, [2, -1, 0.5])
    z /= np.linalg.norm(z)
    (spring,) = deck.springs
    assert spring.stiffness == (1, 2, 3, 4, 5, 6)
    assert_allclose(spring.triad, [x, np.cross(z, x), z], rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("law", "is_round"),
    [
        ("K,1.,2.,2.,3.,4.,4.", True), ("K,1.,2.,2.,4.,4.,3.", False), ("K,1.,2.,2.,3.,4.,3.", False),
        ("K,1.,2.,2.\n,,B,1.,2.,2.,3.,4.,4.", True), ("K,1.,2.,2.\n,,B,1.,2.,3.", False), ("K,2.,2.,1.", False),
    ],
)  # fmt: skip
def test_a_bush_with_length_needs_axes_unless_it_is_round(tmp_path, law, is_round):
    """Round: the same along its y and z, and about them; whatever acts along and about its line."""
    bush = f"GRID,10,,7.,.5,1.\nCBUSH,70,71,5,10\nPBUSH,71,{law}"
    deck = parse_deck(deck_of(tmp_path, DECK.replace("CELAS2,70,5.+3,1,2,2,2", bush)))
    told = [why for name, _, why in deck.ledger.rows() if name == "CBUSH" and "with length, other values" in why]
    assert bool(told) != is_round, deck.ledger.rows()


def test_a_missing_include_and_a_ring_of_them_are_refused(tmp_path):
    path = deck_of(tmp_path)
    (tmp_path / "nodes.bulk").write_text("INCLUDE 'nodes.bulk'\n")
    with pytest.raises(ValueError, match=r"INCLUDE nodes\.bulk: .*nodes\.bulk includes itself"):
        parse_deck(path)
    (tmp_path / "nodes.bulk").unlink()
    with pytest.raises(ValueError, match=r"INCLUDE nodes.bulk: .* cannot be read: No such file"):
        parse_deck(path)


def test_rods_are_axial_springs_with_half_of_their_mass_at_each_end(tmp_path):
    """A tripod of rods: the frequency of its tip, K = Σ EA/L x xᵀ and a third of all mass at it."""
    feet = [(1.0, 0.0, 0.0), (-0.5, 0.8, 0.0), (-0.4, -0.9, 0.0)]
    cards = ["BEGIN BULK", "GRID,9,,0.,0.,1.5,,456", "MAT1,1,2.+11,,.3,7800.", "PROD,1,1,1.-4"]
    for k, (x, y, z) in enumerate(feet, start=1):
        cards += [f"GRID,{k},,{x},{y},{z},,456", f"CROD,{k},1,{k},9"]
    cards += ["SPC1,1,123,1,2,3"]
    path = tmp_path / "tripod.nas"
    path.write_text("\n".join(cards) + "\n")
    job = job_of(path)
    body = uncoupled_body(job, Stages())
    tip = np.flatnonzero((body.nodes == [0, 0, 1.5]).all(axis=1))
    at = [k for k, (node, c) in enumerate(body.dofs) if node in tip and c < 3]
    arms = [np.array(foot) - [0, 0, 1.5] for foot in feet]
    K = sum(2e11 * 1e-4 / np.linalg.norm(a) ** 3 * np.outer(a, a) for a in arms)
    assert_allclose(body.K[at][:, at].toarray(), K, rtol=0, atol=1e-12 * K.max())
    mass = sum(7800 * 1e-4 * np.linalg.norm(a) for a in arms) / 2
    assert_allclose(body.M[at][:, at].toarray(), mass * np.eye(3), rtol=0, atol=1e-12 * mass)


def test_rbe3_with_weights_of_components_is_the_weighted_motion_of_its_grids(tmp_path):
    """Grids of shells; one is in two sets, the reference grid follows in part; weights by an own least squares."""
    cards = [
        "BEGIN BULK", "MAT1,1,2.+11,,.3,7800.", "PSHELL,1,1,.01,1,,1", "CQUAD4,1,1,1,2,3,4", "GRID,9,,.4,.7,.5",
        "CONM2,5,9,,11.", "RBE3,7,,9,12356,1.5,123,1,2", ",3,2.,126,2,4,.5,456,1", ",THRU,3",
    ]  # fmt: skip
    points = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.2, 0.0), (0.0, 1.2, 0.0)])
    cards += [f"GRID,{k},,{x},{y},{z}" for k, (x, y, z) in enumerate(points, start=1)]
    path = tmp_path / "plate.bdf"
    path.write_text("\n".join(cards) + "\n")
    deck = parse_deck(path)
    deck.ledger.require_whole()
    coupling = deck.couplings[0]
    assert coupling.components == (0, 1, 2, 4, 5)
    weights = np.zeros((4, 6))
    for group, given in coupling.members:
        rows = deck.mesh.node_numbers[deck.mesh.node_sets[group]] - 1
        weights[rows] = np.array([given] * 3 + [0.0] * 3) if isinstance(given, float) else given
    expected = [1.5, 1.5, 1.5, 0.5, 0.5, 0.5] * np.ones((4, 1))
    expected[1, [0, 1, 5]], expected[3] = [3.5, 3.5, 2.5], [2, 2, 0, 0, 0, 2]
    assert_allclose(weights, expected, rtol=0, atol=0)
    body = uncoupled_body(job_of(path), Stages())
    reference = np.array([0.4, 0.7, 0.5])
    arms = points - reference
    length = np.linalg.norm(arms, axis=1).mean()
    G = np.zeros((4, 6, 6))
    for k, (x, y, z) in enumerate(arms):
        G[k, :3] = np.hstack([np.eye(3), [[0, z, -y], [-z, 0, x], [y, -x, 0]]])
        G[k, 3:, 3:] = np.eye(3)
    root = np.sqrt(expected * [1, 1, 1, length**2, length**2, length**2])
    solution = np.linalg.lstsq((root[:, :, None] * G).reshape(24, 6), np.diag(root.ravel()), rcond=None)[0]
    node = int(np.flatnonzero((body.nodes == reference).all(axis=1))[0])
    u = np.random.default_rng(2).normal(size=(body.n_dof, 2))
    at_grids = np.zeros((4, 6, 2))
    for (n, c), row in zip(body.recovery.dofs, body.mesh_displacement(u), strict=True):
        found = np.flatnonzero((body.nodes[n] == points).all(axis=1))
        if len(found) and c >= 0:
            at_grids[found[0], c] = row
    moved = body.translations(u)[node]
    assert_allclose(moved, (solution @ at_grids.reshape(24, 2))[:3], rtol=0, atol=1e-12 * np.abs(u).max())


def test_weights_and_components_of_an_rbe3_are_along_the_axes_of_their_points(tmp_path):
    """Grids with CD of two systems; every requested component is that of an own least squares along these axes."""
    cards = [
        "BEGIN BULK", "MAT1,1,2.+11,,.3,7800.", "PSHELL,1,1,.01,1,,1", "CQUAD4,1,1,1,2,3,4", "GRID,9,,.4,.7,.5,8",
        "CORD2R,7,,0.,0.,0.,0.,3.,4.", ",1.,0.,0.", "CORD2R,8,,0.,0.,0.,2.,2.,1.", ",1.,-1.,0.",
        "CONM2,5,9,,11.", "RBE3,7,,9,1356,1.5,13,1,2", ",3,2.,126,2,4,.5,456,1", ",THRU,3",
    ]  # fmt: skip
    points = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.2, 0.0), (0.0, 1.2, 0.0)])
    cards += [f"GRID,{k + 1},,{x},{y},{z},{(7, 8, '', 7)[k]}" for k, (x, y, z) in enumerate(points)]
    path = tmp_path / "plate.bdf"
    path.write_text("\n".join(cards) + "\n")
    deck = parse_deck(path)
    deck.ledger.require_whole()
    seven = np.array([[1, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])
    eight = np.array([[1, -1, 0], [1, 1, -4], [2, 2, 1]]) / np.sqrt([[2], [18], [9]])
    turns = [seven, eight, np.eye(3), seven]
    weights = np.array([[1.5, 0, 1.5, 0.5, 0.5, 0.5], [3.5, 2, 1.5, 0.5, 0.5, 2.5],
                        [1.5, 0, 1.5, 0.5, 0.5, 0.5], [2, 2, 0, 0, 0, 2]])  # fmt: skip
    body = uncoupled_body(job_of(path), Stages())
    reference = np.array([0.4, 0.7, 0.5])
    arms = points - reference
    length = np.linalg.norm(arms, axis=1).mean()
    G = np.zeros((4, 6, 6))
    for k, (x, y, z) in enumerate(arms):
        G[k, :3] = turns[k] @ np.hstack([np.eye(3), [[0, z, -y], [-z, 0, x], [y, -x, 0]]])
        G[k, 3:, 3:] = turns[k]
    root = np.sqrt(weights * [1, 1, 1, length**2, length**2, length**2])
    along = block_diag(*(np.kron(np.eye(2), turn) for turn in turns))
    solution = np.linalg.lstsq((root[:, :, None] * G).reshape(24, 6), root.ravel()[:, None] * along, rcond=None)[0]
    u = np.random.default_rng(2).normal(size=(body.n_dof, 2))
    at = np.zeros((5, 6, 2))
    places = np.vstack([points, reference])
    for (n, c), row in zip(body.recovery.dofs, body.mesh_displacement(u), strict=True):
        found = np.flatnonzero((np.abs(body.nodes[n] - places) < 1e-12).all(axis=1))
        if len(found) and c >= 0:
            at[found[0], c] = row
    own, fitted = np.kron(np.eye(2), eight) @ at[4], np.kron(np.eye(2), eight) @ solution @ at[:4].reshape(24, 2)
    asked = [0, 2, 4, 5]
    assert_allclose(own[asked], fitted[asked], rtol=0, atol=1e-12 * np.abs(u).max())
    assert (np.abs(own - fitted)[[1, 3]] > 1e-3).all()  # these are free


@pytest.mark.parametrize("words", ["1,123,5", "1.,123,5,x", "1.", "-1.,123,5"])
def test_an_rbe3_without_weight_and_components_is_refused(tmp_path, words):
    deck = DECK.replace("RBE2,60,9,123456,5,6,7,8", f"RBE3,60,,9,123456,{words}")
    with pytest.raises(ValueError, match="RBE3 60: expected a weight and components"):
        parse_deck(deck_of(tmp_path, deck))


@pytest.mark.parametrize("weight", ["[1.0, 2.0]", "true", '"1"', "[1, 1, 1, 0, 0, nan]"])
def test_a_weight_of_a_coupling_is_a_number_or_six(tmp_path, weight):
    path = deck_of(tmp_path, DECK.replace("RBE2,60,9,123456,5,6,7,8", "RBE3,60,,9,123456,1.,123,5,6\n,7,8"))
    text = job_text(parse_deck(path), DeckOptions("m-kg-s", {}), path.name)
    job = path.with_suffix(".toml")
    job.write_text(text.replace("rbe3_60_nodes_1 = 1.0", f"rbe3_60_nodes_1 = {weight}"))
    with pytest.raises(ValueError, match="expected a number, or a list of six"):
        read_job(job)


_SOLIDS = {
    "CHEXA": "CHEXA,1,1,1,2,3,4,5,6\n,7,8",
    "CPENTA": "CPENTA,1,1,1,2,4,5,6,8",
    "CTETRA": "CTETRA,1,1,1,2,4,5",
}


@pytest.mark.parametrize(
    ("card", "pair", "area"),
    [
        ("CHEXA", "5,7", (0, 0, 1)),
        ("CHEXA", "8,1", (-1, 0, 0)),
        ("CPENTA", "4,", (0, 0, -0.5)),
        ("CPENTA", "6,", (0, 0, 0.5)),
        ("CPENTA", "2,8", (1, 1, 0)),
        ("CTETRA", "1,5", (0, 0, -0.5)),
        ("CTETRA", "4,1", (0.5, 0.5, 0.5)),
    ],
)
def test_pressure_on_a_face_of_a_solid_pushes_with_its_area(tmp_path, card, pair, area):
    """Positive pressure acts against the outward area vector, which the unit cube gives by hand."""
    deck = "BEGIN BULK\nINCLUDE 'nodes.bulk'\nPSOLID,1,9\nMAT1,9,2.+11,,.3,7850.\n"
    deck += f"{_SOLIDS[card]}\nPLOAD4,5,1,10.,10.,,,{pair}\nPLOAD4,6,1,3.,,,,{pair}\nPLOAD2,7,4.,1\n"
    path = deck_of(tmp_path, deck)
    body = job_body(job_of(path))
    assert [case.name for case in body.load_cases] == ["pressure_5", "pressure_6"]
    for case, pressure in zip(body.load_cases, (10.0, 3.0), strict=True):
        total = [case.f[body.dofs[:, 1] == c].sum() for c in range(3)]
        assert_allclose(total, -pressure * np.array(area), rtol=0, atol=1e-13 * pressure)
    assert "#   1 PLOAD2: pressure on shells" in path.with_suffix(".toml").read_text()


@pytest.mark.parametrize(
    ("load", "words"),
    [
        ("PLOAD4,5,1,10.,9.,,,5,7", "varies over the face"),
        ("PLOAD4,5,1,10.,,,,5,7\n,,0.,0.,1.", "along a direction"),
        ("PLOAD4,5,2,10.", "on shells or on elements that are not there"),
    ],
)
def test_pressure_that_no_load_case_has_is_counted(tmp_path, load, words):
    deck = parse_deck(deck_of(tmp_path, DECK + load + "\n"))
    assert [name for name in (load.name for load in deck.loads) if "pressure" in name] == []
    assert any(name == "PLOAD4" and words in why for name, _, why in deck.ledger.rows())


def test_a_face_that_the_element_has_not_is_refused(tmp_path):
    with pytest.raises(ValueError, match="element 1 has no face of the grid points 5 and 6"):
        parse_deck(deck_of(tmp_path, DECK + "PLOAD4,5,1,10.,,,,5,6\n"))
