"""Tapered beams of Nastran, divided into pieces whose section is the mean of the taper."""

from dataclasses import dataclass

import numpy as np

from fe_models.files.nastran.bulk_data.cards import Card, real_of
from fe_models.files.nastran.deck.bar_shapes import DIMENSIONS
from fe_models.files.nastran.deck.bars import OFFSETS, line_of_ends, orientation_of
from fe_models.files.nastran.deck.model import PROPERTIES, NastranModel
from fe_models.foundation.arrays import Array

__all__ = ["N_PIECES", "cut_tapers"]

N_PIECES = 12  #: number of pieces of a tapered beam
YES = ("YES", "YESA", "NO")
FIRST = 3  #: field number of the area of a PBEAM
ALIKE = 1e-12  #: relative difference of a section property up to which stations are equal
SIZES = 6  #: number of section properties: A, I1, I2, I12, J, NSM
TORSION = 4  #: index of J among these properties


@dataclass(frozen=True)
class Taper:
    """Section properties that vary linearly between stations along a beam."""

    places: Array  #: x/L of the stations, (n,), ascending from 0 to 1
    sizes: Array  #: section properties, (n, n_sizes): A, I1, I2, I12, J, NSM of a PBEAM; dimensions and NSM of a PBEAML

    @property
    def is_none(self) -> bool:
        """Whether all stations are equal."""
        return bool((np.ptp(self.sizes, axis=0) <= ALIKE * np.abs(self.sizes).max(axis=0)).all())

    def at(self, x: float) -> Array:
        """Return the section properties at x/L."""
        return np.array([np.interp(x, self.places, column) for column in self.sizes.T])


def cut_tapers(model: NastranModel) -> None:
    """Divide each tapered beam into pieces with separate properties, between new nodes.

    The first piece keeps the number of the beam. Released ends and offsets remain at the ends. The new nodes are on the
    line between both ends including offsets.
    """
    tapers: dict[int, tuple[Card, Taper]] = {}
    for name, taper_of in (("PBEAM", _pbeam_taper), ("PBEAML", _pbeaml_taper)):
        for k, card in enumerate(model.cards.get(name, [])):
            taper = taper_of(card)
            if taper is not None and taper.is_none:
                model.cards[name][k] = _property(card, card.integer(1), taper.sizes[0])
            elif taper is not None:
                tapers[card.integer(1)] = (card, taper)
    beams = [card for card in model.of("CBEAM") if _property_number(card) in tapers]
    if not beams:
        return
    last_element = max(card.integer(1, 0) for cards in model.cards.values() for card in cards if card.name[0] == "C")
    last_property = max(card.integer(1) for card in model.of(*PROPERTIES))
    made: dict[int, list[int]] = {}  # property -> properties of its pieces
    untwisted = set()  # properties without J: pieces pass a torque on, and the last one ends without it
    for pid, (card, taper) in tapers.items():
        if card.name == "PBEAM" and not taper.sizes[:, TORSION].any() and model.plane is None:
            untwisted.add(pid)
        made[pid] = [last_property + k for k in range(1, N_PIECES + 1)]
        last_property += N_PIECES
        for k, number in enumerate(made[pid]):
            sizes = taper.at((k + 0.5) / N_PIECES)
            if pid in untwisted:
                sizes[TORSION] = sizes[1] + sizes[2]
            model.cards[card.name].append(_property(card, number, sizes))
    cards = [card for card in model.of("CBEAM") if _property_number(card) not in tapers]
    for beam in beams:
        pid = _property_number(beam)
        cards += _pieces(model, beam, made[pid], last_element, "4" if pid in untwisted else "")
        last_element += N_PIECES - 1
    model.cards["CBEAM"] = cards
    why = f"tapers: {N_PIECES} pieces of one section each, between nodes of their own"
    model.ledger.note("CBEAM", why, count=len(beams))


def _property_number(beam: Card) -> int:
    return beam.integer(2, beam.integer(1))


def _pieces(model: NastranModel, beam: Card, properties: list[int], last: int, released: str) -> list[Card]:
    """Return the pieces of a beam, from its first end to its second end, where further motions are released."""
    ends = line_of_ends(model, beam)
    between = [ends[0] + (ends[1] - ends[0]) * k / N_PIECES for k in range(1, N_PIECES)]
    nodes = [beam.integer(3), *(model.new_point(point) for point in between), beam.integer(4)]
    v = [repr(float(x)) for x in orientation_of(model, beam)]
    offt = (beam.text(8).upper() or "GGG").ljust(3, "G")
    made = []
    for k in range(N_PIECES):
        fields = [""] * 16
        fields[:8] = [
            str(beam.integer(1) if k == 0 else last + k), str(properties[k]), str(nodes[k]), str(nodes[k + 1]), *v,
            f"B{offt[1:]}",
        ]  # fmt: skip
        if k == 0:
            fields[8] = beam.text(9)
            for j in OFFSETS[0]:
                fields[j - 1] = beam.text(j)
        if k == N_PIECES - 1:
            fields[9] = beam.text(10) + released
            for j in OFFSETS[1]:
                fields[j - 1] = beam.text(j)
        made.append(Card("CBEAM", tuple(fields), beam.where))
    return made


def _property(card: Card, number: int, sizes: Array) -> Card:
    """Return a property with one section; fields after the stations of a PBEAM are kept."""
    words = [repr(float(value)) for value in sizes]
    if card.name == "PBEAML":
        return Card(card.name, (str(number), *card.fields[1:8], *words), card.where)
    _, at = _stations(card)
    fields = (str(number), card.text(2), *words, *[""] * 8, *card.fields[at - 1 :])
    return Card(card.name, fields, card.where)


def _stations(card: Card) -> tuple[list[int], int]:
    """Return the first field of each station of a PBEAM, and the field K1 after them."""
    found: list[int] = []
    at = 9 if card.text(9).upper() in YES else 17
    while card.text(at).upper() in YES:
        found.append(at)
        at += 16 if card.text(at).upper() == "YES" else 8
    return found, at


def _pbeam_taper(card: Card) -> Taper | None:
    """Return the taper of a PBEAM; None if it has no stations.

    For blank fields, end B has the values of end A, and other stations have interpolated values.
    """
    first = [card.real(FIRST + j, 0.0) for j in range(SIZES)]
    given: list[tuple[float, list[float | None]]] = []
    for at in _stations(card)[0]:
        x = card.real(at + 1, 1.0)
        given.append((x, [card.real(at + 2 + j) if card.text(at + 2 + j) else None for j in range(SIZES)]))
    if not given:
        return None
    last = next((sizes for x, sizes in given if x == 1.0), [None] * SIZES)
    end = [a if b is None else b for a, b in zip(first, last, strict=True)]
    rows = [(0.0, first), (1.0, end)]
    for x, sizes in given:
        if 0 < x < 1:
            between = [a + (b - a) * x for a, b in zip(first, end, strict=True)]
            rows.append((x, [m if s is None else s for m, s in zip(between, sizes, strict=True)]))
    return _taper(rows)


def _pbeaml_taper(card: Card) -> Taper | None:
    """Return the taper of a PBEAML; None if it has no stations, or if its shape is unknown."""
    n = DIMENSIONS.get(card.text(4).upper(), 0)
    words = list(card.fields[8:])
    first = _numbers(words[: n + 1], [0.0] * (n + 1))
    rows = [(0.0, first)]
    at = n + 1
    if not n or not any(words[at:]):
        return None
    while any(words[at:]):
        if words[at].upper() not in ("YES", "NO", ""):
            return None  # the reader of the section reports the error
        x = real_of(words[at + 1]) if words[at + 1 : at + 2] and words[at + 1] else 1.0
        rows.append((x, _numbers(words[at + 2 : at + 3 + n], first)))
        at += n + 3
    if not any(x == 1.0 for x, _ in rows):
        rows.append((1.0, first))
    return _taper(rows)


def _numbers(words: list[str], default: list[float]) -> list[float]:
    words = words + [""] * (len(default) - len(words))
    return [real_of(word) if word else value for word, value in zip(words, default, strict=True)]


def _taper(rows: list[tuple[float, list[float]]]) -> Taper:
    rows = sorted(rows)
    return Taper(np.array([x for x, _ in rows]), np.array([row for _, row in rows]))
