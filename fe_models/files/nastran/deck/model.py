"""Nastran deck while it is read: its cards by name, its grid points, and the results so far."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.decks.deck import (
    Coupling,
    DeckMass,
    DeckMaterial,
    DeckSpring,
    Equation,
    LineSection,
    Load,
    RigidGroup,
    ShellSection,
    SolidSection,
    Support,
)
from fe_models.files.decks.equations import Row
from fe_models.files.decks.ledger import Ledger
from fe_models.files.nastran.bulk_data.cards import Card
from fe_models.files.nastran.bulk_data.coordinate_systems import GridPoints
from fe_models.files.nastran.mesh import ELEMENT_TYPES
from fe_models.foundation.arrays import Array

__all__ = ["ALL", "ALONG", "PROPERTIES", "NastranModel"]

ALL = (0, 1, 2, 3, 4, 5)
ALONG = 1e-9  #: component of a vector normal to a line divided by its length, below which it is along the line
#: properties of solids, shells, bars and beams, which share one range of numbers
PROPERTIES = ("PSOLID", "PLSOLID", "PSHELL", "PLPLANE", "PCOMP", "PCOMPG", "PBAR", "PBARL", "PBEAM", "PBEAML")


@dataclass
class NastranModel:
    """Cards of a deck, and what has been read from them so far."""

    where: str
    cards: dict[str, list[Card]]  #: cards of the deck by name
    points: GridPoints
    ledger: Ledger
    #: "SPC", "MPC" -> the sets that subcases select, 0 for a subcase without one; None: there is no case control
    chosen: dict[str, set[int]] | None
    #: whether the case control selects a material temperature; None: there is no case control
    has_temperature: bool | None = None
    wtmass: float = 1.0  #: value of PARAM,WTMASS, by which all masses are multiplied
    is_lumped: bool = True  #: whether masses are lumped, which PARAM,COUPMASS changes
    materials: dict[str, DeckMaterial] = field(default_factory=dict)
    #: isotropic material -> G of its card, if it is not E/(2 (1 + nu))
    shear_moduli: dict[str, float] = field(default_factory=dict)
    solids: list[SolidSection] = field(default_factory=list)
    shells: list[ShellSection] = field(default_factory=list)
    lines: list[LineSection] = field(default_factory=list)
    masses: list[DeckMass] = field(default_factory=list)
    springs: list[DeckSpring] = field(default_factory=list)
    rigid: list[RigidGroup] = field(default_factory=list)
    couplings: list[Coupling] = field(default_factory=list)
    equations: list[Equation] = field(default_factory=list)
    #: equations in basic axes whose first point has its own axes: (point, 0 or 3 for its rotations), coefficients
    rows: list[tuple[tuple[int, int], Row]] = field(default_factory=list)
    plain_rows: list[Row] = field(default_factory=list)  #: further equations, whose first component is eliminated
    supports: list[Support] = field(default_factory=list)
    loads: list[Load] = field(default_factory=list)
    groups: dict[str, tuple[int, ...]] = field(default_factory=dict)  #: node numbers in each group
    faces: dict[str, list[tuple[int, ...]]] = field(default_factory=dict)  #: corner grids of the faces in each group
    #: card and cell group of each element, by number
    elements: dict[int, tuple[str, str]] = field(default_factory=dict)
    held: dict[int, set[int]] = field(default_factory=dict)  #: components that are fixed at each grid point
    plane: int | None = None  #: axis of the basic system normal to the plane of a planar deck
    #: components at each grid point that elements connect to the ground
    grounded: dict[int, set[int]] = field(default_factory=dict)
    shared: set[int] = field(default_factory=set)  #: grid points that also belong to other superelements
    last_point: int = 0  #: number of the last grid point that the reader added
    #: property cards by kind and number, filled on demand
    properties: dict[str, dict[int, Card]] = field(default_factory=dict)
    ends: dict[tuple[int, int], int] = field(default_factory=dict)  #: separate node of an element at end 0 or 1

    def of(self, *names: str) -> list[Card]:
        """Return the cards with these names, in the order of the names."""
        return [card for name in names for card in self.cards.get(name, ())]

    def point(self, card: Card, number: int) -> Array:
        """Return the position of a grid point in basic axes, (3,)."""
        if number not in self.points.positions:
            raise MeshError(f"{card.where} {card.text(1)}: names grid point {number}, which is not defined")
        return self.points.positions[number]

    def new_point(self, position: Array) -> int:
        """Return the number of a new grid point at this position in basic axes, (3,)."""
        self.last_point = max(self.last_point, *self.points.positions) if not self.last_point else self.last_point
        self.last_point += 1
        self.points.positions[self.last_point] = np.asarray(position)
        return self.last_point

    def add_equation(self, row: Row) -> None:
        """Add an equation in basic axes without zero terms; the first term stays, as its component is eliminated."""
        terms = [(f"node_{node}", c, a) for k, ((node, c), a) in enumerate(row.items()) if a != 0 or k == 0]
        for node in dict.fromkeys(node for node, _ in row):
            self.groups[f"node_{node}"] = (node,)
        self.equations.append(Equation(tuple(terms)))

    def used_points(self) -> set[int]:
        """Return the grid points of elements with a section, masses, springs, leaders, and other superelements."""
        found: set[int] = set()
        for cards in self.cards.values():
            for card in cards:
                name = card.name
                if name in ELEMENT_TYPES and self.elements.get(card.integer(1, -1), ("", ""))[0] == name:
                    first, last = 3, 3 + max(ELEMENT_TYPES[name])
                    words = [card.text(k) for k in range(first, last)]
                    found |= {int(word) for word in words if word.isdigit()}
        found |= set(self.ends.values()) | self.shared
        groups = [mass.nodes for mass in self.masses] + [name for each in self.springs for name in each.nodes]
        groups += [link.node for link in self.rigid] + [coupling.node for coupling in self.couplings]
        return found.union(*(self.groups[name] for name in groups)) & set(self.points.positions)

    def property_of(self, card: Card, *names: str) -> Card | None:
        """Return the property card of an element, by field 2 or, if it is blank, by the element number."""
        key = " ".join(names)
        if key not in self.properties:
            self.properties[key] = {each.integer(1): each for each in self.of(*names)}
        return self.properties[key].get(card.integer(2, card.integer(1)))

    def shear_modulus(self, name: str) -> float:
        """Return G of an isotropic material: from its card, otherwise E/(2 (1 + nu))."""
        material = self.materials[name]
        assert isinstance(material.young, float)
        assert isinstance(material.poisson, float)
        return self.shear_moduli.get(name, material.young / (2 * (1 + material.poisson)))

    def shear_factor(self, name: str) -> float:
        """Return G on the card of an isotropic material divided by E/(2 (1 + nu)); 1 if the card has no other G."""
        material = self.materials.get(name)
        if name not in self.shear_moduli or material is None:
            return 1.0
        assert isinstance(material.young, float)
        assert isinstance(material.poisson, float)
        return self.shear_moduli[name] * 2 * (1 + material.poisson) / material.young

    def property_value(self, card: Card, name: str, size: int) -> float | None:
        """Return a property value of an element; a card contains several properties with `size` fields each."""
        number = card.integer(2, card.integer(1))
        for each in self.cards.get(name, ()):
            for k in range(1, len(each.fields) + 1, size):
                if each.text(k) and each.integer(k) == number:
                    return each.real(k + 1, 0.0)
        return None

    def axes(self, number: int) -> Array:
        """Return the displacement axes of a grid point as columns in basic axes, (3, 3)."""
        return self.points.axes.get(number, np.eye(3))

    def system(self, card: Card, number: int, at: Array) -> Array:
        """Return the axes of a coordinate system at a point as columns in basic axes, (3, 3)."""
        if number not in self.points.systems:
            raise MeshError(f"{card.where} {card.text(1)}: names coordinate system {number}, which is not defined")
        return self.points.systems[number].axes_at(at)

    def group(self, card: Card, numbers: Iterable[int], name: str = "") -> str:
        """Add a group of these grid points, and return its name."""
        nodes = tuple(sorted(set(numbers)))
        for number in nodes:
            self.point(card, number)
        made = f"node_{nodes[0]}" if len(nodes) == 1 else name
        while self.groups.get(made, nodes) != nodes:
            made += "_"
        self.groups[made] = nodes
        return made


def components_of(card: Card, word: str) -> tuple[int, ...]:
    """Return the components in a field such as 123456."""
    if not word.isdigit() or not set(word) <= set("0123456"):
        raise MeshError(f"{card.where} {card.text(1)}: expected components such as 123, got {word!r}")
    return tuple(sorted({int(letter) - 1 for letter in word if letter != "0"}))


def numbers_of(card: Card, first: int) -> list[int]:
    """Return the numbers from a field on, with ranges expanded."""
    return numbers_in(card, [word for word in card.fields[first - 1 :] if word])


def numbers_in(card: Card, words: list[str]) -> list[int]:
    """Return the numbers in words of a card, with ranges expanded."""
    found: list[int] = []
    k = 0
    while k < len(words):
        numbers, n_words = range_at(card, words, k)
        found += numbers
        k += n_words
    return found


def range_at(card: Card, words: list[str], k: int) -> tuple[range, int]:
    """Return the numbers that begin at a word, a or a THRU b or a THRU b BY c, and how many words they take."""
    start = int(words[k])
    if k + 2 >= len(words) or words[k + 1].upper() != "THRU":
        return range(start, start + 1), 1
    stop = int(words[k + 2])
    step, n_words = (int(words[k + 4]), 5) if k + 4 < len(words) and words[k + 3].upper() == "BY" else (1, 3)
    if stop - start > 10_000_000 or step < 1:
        raise MeshError(f"{card.where}: {start} THRU {stop}: not a range of grid points")
    return range(start, stop + 1, step), n_words
