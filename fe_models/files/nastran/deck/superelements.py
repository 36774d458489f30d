"""Superelements in one deck: main bulk data and the section of each BEGIN SUPER become one body.

(1) each section is read with its own numbers, properties and systems
(2) a superelement is placed as in its section, or where SELOC requires; SEBULK REPEAT and MIRROR are images of another
    superelement
(3) points of different superelements at one position become one point (SEBULK AUTO), and so do pairs of SECONCT
(4) the joined deck has the names of the main bulk data; names in superelement k become `super_k_NAME`
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from fe_models.errors import MeshError
from fe_models.files.decks.deck import Deck, Load
from fe_models.files.decks.deck_images import Motion, moved_deck, renamed_deck
from fe_models.files.nastran.bulk_data.cards import Card
from fe_models.files.nastran.deck.model import NastranModel
from fe_models.foundation.arrays import Array
from fe_models.meshes.cells.raw_mesh import RawBlock, RawMesh

__all__ = ["MAIN_CARDS", "Superelement", "connect_superelements", "join_superelements", "place_superelements"]

#: distance within which points are one point if TOL of SEBULK is blank: our reading of MSC's default, which is printed
#: as 10E-5; OptiStruct's guide has 1e-5
TOLERANCE = 1e-4
SAME_SHAPE = 1e-4  #: difference of distances of SELOC points divided by the largest one, up to which they agree
KINDS = ("PRIMARY", "REPEAT", "MIRROR")
MAIN_CARDS = ("SEBULK", "SELOC", "SEMPLN", "SECONCT", "SEEXCLD")  #: cards that are allowed only in the main bulk data
#: fields of a deck that are concatenated from its parts
JOINED = ("solids", "shells", "lines", "masses", "springs", "rigid", "couplings", "equations", "supports", "rods")

Key = tuple[int, int]  #: number of the superelement, and of the grid point


@dataclass(frozen=True, eq=False)
class Superelement:
    """Superelement: the section that describes it, and its position."""

    number: int
    source: int  #: number of the section that describes it: its own, or another one if it is an image
    motion: Motion
    tolerance: float | None  #: value TOL of its SEBULK
    is_automatic: bool  #: whether its boundary is searched for (METHOD = AUTO)

    def positions(self, models: Mapping[int, NastranModel]) -> dict[int, Array]:
        """Return the position of each grid point in basic axes."""
        return {n: self.motion.point(x) for n, x in models[self.source].points.positions.items()}


def place_superelements(models: Mapping[int, NastranModel]) -> list[Superelement]:
    """Step (2): return the superelements of a deck, the main bulk data (0) first.

    Parameters
    ----------
    models
        Cards and grid points of each section, by its number; 0 is the main bulk data.
    """
    main = models[0]
    options = {card.integer(1): card for card in main.of("SEBULK")}
    for number, model in models.items():
        for name in MAIN_CARDS:
            if number and name in model.cards:
                main.ledger.refuse(name, f"stands in superelement {number}; expected in the main bulk data")
    found = [Superelement(0, 0, Motion(), None, True)]
    for number in sorted({*models, *options} - {0}):
        card = options.get(number)
        kind = "PRIMARY" if card is None else card.text(2).upper() or "PRIMARY"
        method = "AUTO" if card is None else card.text(4).upper() or "AUTO"
        source = number if card is None or kind == "PRIMARY" else card.integer(3, 0)
        if kind not in KINDS or method not in ("AUTO", "MANUAL") or source not in models:
            why = f"superelement {number}: TYPE = {kind}, METHOD = {method} of section {source or 'none'}"
            main.ledger.refuse("SEBULK", f"{why}; expected {', '.join(KINDS)} of a section of this deck")
            continue
        motion = _mirror(main, number) if kind == "MIRROR" else Motion()
        if kind == "REPEAT" and not any(each.integer(1) == number for each in main.of("SELOC")):
            main.ledger.refuse("SEBULK", f"superelement {number} repeats {source} and needs a place (SELOC)")
        for seloc in main.of("SELOC"):
            if seloc.integer(1) == number:
                motion = _located(seloc, main, models[source], motion)
        tolerance = card.real(5) if card is not None and card.text(5) else None
        found.append(Superelement(number, source, motion, tolerance, method == "AUTO"))
        if source != number and number in models and models[number].points.positions:
            main.ledger.refuse(
                "SEBULK", f"superelement {number} is an image of {source} and has grid points of its own"
            )
    return found


def _mirror(main: NastranModel, number: int) -> Motion:
    """Return the reflection of SEMPLN at the plane of three points."""
    for card in main.of("SEMPLN"):
        if card.integer(1) == number and card.text(2).upper() == "PLANE":
            a, b, c = (_main_point(main, card, k) for k in (3, 4, 5))
            normal = np.cross(b - a, c - a)
            size = np.linalg.norm(b - a) * np.linalg.norm(c - a)
            if not np.linalg.norm(normal) > SAME_SHAPE * size:
                raise MeshError(f"{card.where} {number}: its three points lie on one line")
            n = normal / np.linalg.norm(normal)
            return Motion(np.eye(3) - 2 * np.outer(n, n), 2 * (a @ n) * n)
    main.ledger.refuse("SEBULK", f"superelement {number} is a MIRROR and needs SEMPLN with PLANE and three points")
    return Motion()


def _main_point(main: NastranModel, card: Card, field: int) -> Array:
    """Return the position of a POINT or GRID of the main bulk data."""
    number = card.integer(field)
    for point in main.of("POINT"):
        if point.integer(1) == number:
            cp, x = point.integer(2, 0), np.array([point.real(k, 0.0) for k in (3, 4, 5)])
            if cp not in main.points.systems:
                raise MeshError(f"{point.where} {number}: names coordinate system {cp}, which is not defined")
            return main.points.systems[cp].place(x)
    return main.point(card, number)


def _located(card: Card, main: NastranModel, source: NastranModel, before: Motion) -> Motion:
    """Return the motion that maps three points of a superelement to three of the main bulk data (SELOC)."""
    here = np.array([before.point(source.point(card, card.integer(k))) for k in (2, 3, 4)])
    there = np.array([_main_point(main, card, k) for k in (5, 6, 7)])
    sides = [np.linalg.norm(each - np.roll(each, 1, axis=0), axis=1) for each in (here, there)]
    if np.abs(sides[0] - sides[1]).max() > SAME_SHAPE * sides[0].max():
        raise MeshError(
            f"{card.where} {card.text(1)}: expected three points of the superelement and three of the main bulk data "
            f"at the same distances, got {sides[0].tolist()} and {sides[1].tolist()}"
        )
    axes = []
    for a, b, c in (here, there):
        z = np.cross(b - a, c - a)
        if not np.linalg.norm(z) > SAME_SHAPE * np.linalg.norm(b - a) * np.linalg.norm(c - a):
            raise MeshError(f"{card.where} {card.text(1)}: its three points lie on one line")
        x, z = (b - a) / np.linalg.norm(b - a), z / np.linalg.norm(z)
        axes.append(np.stack([x, np.cross(z, x), z], axis=1))
    R = axes[1] @ axes[0].T
    return Motion(R @ before.Q, there[0] - R @ here[0] + R @ before.t)


def connect_superelements(models: Mapping[int, NastranModel], placed: list[Superelement]) -> dict[Key, Key]:
    """Step (3): return the representative point of each group of connected grid points.

    Components fixed at such a point become fixed at its representative.
    """
    ledger = models[0].ledger
    root: dict[Key, Key] = {}

    def find(key: Key) -> Key:
        while key in root:
            key = root[key]
        return key

    for a, b in (*_pairs_at_one_place(models, placed), *_named_pairs(models, placed)):
        first, second = sorted((find(a), find(b)))
        if first != second:
            root[second] = first
    connected = {key: find(key) for key in root}
    members: dict[Key, list[Key]] = {}
    for key, stands in connected.items():
        members.setdefault(stands, [stands]).append(key)
    source = {each.number: each for each in placed}
    for stands, keys in members.items():
        twice = [n for n in {n for n, _ in keys} if sum(number == n for number, _ in keys) > 1]
        if twice:
            points = sorted(point for number, point in keys if number == twice[0])
            why = f"grid points {points} of superelement {twice[0]} lie where another one has a point; name the one "
            ledger.refuse("SEBULK", f"{why}that is connected (METHOD = MANUAL, SECONCT)")
        for number, point in keys:
            models[source[number].source].shared.add(point)
        _share_supports(models, source, stands, keys)
    ledger.note("BEGIN SUPER", f"superelements joined to one body: {len(connected)} grid points are those of others")
    return connected


def _share_supports(
    models: Mapping[int, NastranModel], source: Mapping[int, Superelement], stands: Key, keys: list[Key]
) -> None:
    """Transfer supports at a connected point to its representative."""
    main = models[source[stands[0]].source]
    for number, point in keys:
        if (number, point) == stands:
            continue
        model = models[source[number].source]
        held = model.held.pop(point, set()) if source[number].source == number else set()
        if not held:
            continue
        axes = [source[n].motion.Q @ models[source[n].source].axes(p) for n, p in (stands, (number, point))]
        if np.abs(axes[0] - axes[1]).max() > SAME_SHAPE:
            why = (
                f"of point {point} of superelement {number}, whose axes (CD) are not those of the point it is one with"
            )
            main.ledger.refuse("SPC", why)
        main.held.setdefault(stands[1], set()).update(held)


def _pairs_at_one_place(models: Mapping[int, NastranModel], placed: list[Superelement]) -> list[tuple[Key, Key]]:
    """Return pairs of points of different superelements with the same position."""
    main = models[0]
    left_out: set[tuple[int, int, int | str]] = set()  # superelement, point, the other superelement or ALL
    for card in main.of("SEEXCLD"):
        other = card.text(2).upper()
        for word in card.fields[2:]:
            if word and not word.isdigit():
                main.ledger.refuse("SEEXCLD", f"{word}: expected single grid points")
            elif word:
                left_out.add((card.integer(1), int(word), other if other == "ALL" else int(other)))
    automatic = [each for each in placed if each.is_automatic]
    keys = [(each.number, point) for each in automatic for point in each.positions(models)]
    places = np.array([x for each in automatic for x in each.positions(models).values()]).reshape(-1, 3)
    tolerance = {each.number: each.tolerance for each in placed}
    widest = max([TOLERANCE, *(t for t in tolerance.values() if t is not None)])
    pairs = []
    for i, j in sorted(cKDTree(places).query_pairs(widest)):
        a, b = keys[i], keys[j]
        if a[0] == b[0] or any((p[0], p[1], other) in left_out for p, q in ((a, b), (b, a)) for other in ("ALL", q[0])):
            continue
        apart = float(np.linalg.norm(places[i] - places[j]))
        given = [t for t in (tolerance[a[0]], tolerance[b[0]]) if t is not None]
        if apart <= (max(given) if given else TOLERANCE):
            pairs.append((a, b))
    return pairs


def _named_pairs(models: Mapping[int, NastranModel], placed: list[Superelement]) -> list[tuple[Key, Key]]:
    """Return the pairs of SECONCT, whose points must have the same position."""
    main, known = models[0], {each.number: each for each in placed}
    pairs = []
    for card in main.of("SECONCT"):
        numbers = card.integer(1), card.integer(2)
        words = [word for word in card.fields[8:] if word]
        if not set(numbers) <= set(known) or len(words) % 2 or not all(word.isdigit() for word in words):
            main.ledger.refuse("SECONCT", "expected two superelements of this deck, and pairs of single grid points")
            continue
        places = [known[number].positions(models) for number in numbers]
        for a, b in zip(map(int, words[::2]), map(int, words[1::2]), strict=True):
            if a not in places[0] or b not in places[1]:
                raise MeshError(f"{card.where}: names grid points {a} and {b}, of which one is not defined")
            apart = float(np.linalg.norm(places[0][a] - places[1][b]))
            if apart > card.real(3, TOLERANCE):
                why = f"points {a} and {b} are {apart:.3g} apart: forces on both would not balance"
                main.ledger.refuse("SECONCT", why)
            pairs.append(((numbers[0], a), (numbers[1], b)))
    return pairs


def join_superelements(
    models: Mapping[int, NastranModel], decks: Mapping[int, Deck], placed: list[Superelement], connected: dict[Key, Key]
) -> Deck:
    """Step (4): return the deck of all superelements."""
    ledger = models[0].ledger
    parts: list[Deck] = []
    for each in placed:
        if each.source in decks:
            what = f"superelement {each.number}"
            moved = moved_deck(decks[each.source], each.motion, ledger, what)
            parts.append(renamed_deck(moved, f"super_{each.number}_") if each.number else moved)
    numbered = [each for each in placed if each.source in decks]
    every: dict[str, Any] = {kind: tuple(item for part in parts for item in getattr(part, kind)) for kind in JOINED}
    materials = {name: material for part in parts for name, material in part.materials.items()}
    mesh = _joined_mesh(parts, numbered, connected)
    return replace(parts[0], mesh=mesh, materials=materials, loads=_joined_loads(parts, models[0]), **every)


def _joined_mesh(parts: list[Deck], placed: list[Superelement], connected: dict[Key, Key]) -> RawMesh:
    """Return nodes, cells and groups of all superelements; connected points become one node.

    If numbers repeat, k times a power of ten is added to those of the k-th superelement.
    """
    place: dict[Key, int] = {}
    positions: list[Array] = []
    numbers: list[int] = []
    index: list[int] = []  # superelement of each node, by its place in the list
    rows: list[np.ndarray] = []
    for k, (part, each) in enumerate(zip(parts, placed, strict=True)):
        own = np.asarray(part.mesh.node_numbers).tolist()
        for number, x in zip(own, part.mesh.nodes, strict=True):
            key = connected.get((each.number, number), (each.number, number))
            if key not in place:
                place[key] = len(positions)
                positions.append(x)
                numbers.append(number)
                index.append(k)
            place[each.number, number] = place[key]
        rows.append(np.array([place[each.number, number] for number in own], dtype=np.int64))
    cells = [int(n) for part in parts for b in part.mesh.blocks if b.numbers is not None for n in b.numbers]
    repeats = len(set(numbers)) < len(numbers) or len(set(cells)) < len(cells)
    step = 10 ** len(str(max([*numbers, *cells]))) if repeats else 0
    blocks: list[RawBlock] = []
    sets: dict[str, np.ndarray] = {}
    for k, (part, own_rows) in enumerate(zip(parts, rows, strict=True)):
        for b in part.mesh.blocks:
            own_numbers = None if b.numbers is None else np.asarray(b.numbers) + k * step
            blocks.append(RawBlock(b.kind, own_rows[b.nodes], b.groups, own_numbers))
        sets |= {name: own_rows[members] for name, members in part.mesh.node_sets.items()}
    whole = np.array(numbers, dtype=np.int64) + step * np.array(index, dtype=np.int64)
    names = tuple(f"super_{each.number}" if each.number else "main" for each in placed) if step else ()
    mesh = RawMesh(np.array(positions), tuple(blocks), sets, whole, included=parts[0].mesh.included)
    return replace(mesh, instances=names, instance_step=step)


def _joined_loads(parts: list[Deck], main: NastranModel) -> tuple[Load, ...]:
    """Return the loads of all parts: forces of the same set form one load; gravity only if all parts have the same."""
    made: dict[str, Load] = {}
    for part in parts:
        for load in part.loads:
            if load.forces is not None and load.name in made:
                made[load.name] = replace(load, forces={**(made[load.name].forces or {}), **load.forces})
            elif load.acceleration is not None:
                if all(load in other.loads for other in parts if other.solids or other.shells or other.lines):
                    made[load.name] = load
                else:
                    main.ledger.note("GRAV", "not on all superelements alike: no load case has it")
            else:
                made[load.name] = load
    return tuple(made.values())
