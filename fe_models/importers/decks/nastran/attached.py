"""Masses, springs, rigid elements, constraints, supports and loads of Nastran."""

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array
from fe_models.foundation.components import MOTION_COMPONENTS
from fe_models.importers.bulk_data.cards import Card, real_of
from fe_models.importers.decks.deck import Coupling, DeckMass, DeckSpring, Equation, Load, RigidGroup, Support, Vector
from fe_models.importers.decks.nastran.model import NastranModel, components_of, numbers_of
from fe_models.meshes.cell_shapes import CELL_SHAPES

__all__ = ["read_attached"]

_FACED = {"CTETRA": ("tetra", 4), "CPENTA": ("wedge", 6), "CHEXA": ("hexahedron", 8)}  #: card -> kind, corner grids
ALL = (0, 1, 2, 3, 4, 5)
ALONG = 1e-9  #: part of a vector across a line, below which it is along it


def read_attached(model: NastranModel) -> None:
    """Take what is attached to grid points, what couples them, what holds and what loads them."""
    for card in model.of("CONM2"):
        _mass(model, card)
    _scalar_masses(model)
    for card in model.of("CBUSH"):
        _bush(model, card)
    for card in model.of("CELAS1", "CELAS2", "CDAMP1", "CDAMP2"):
        _scalar_spring(model, card)
    for card in model.of("CVISC"):
        _axial_damper(model, card)
    for card in model.of("RBE2", "RBAR"):
        _rigid(model, card)
    for card in model.of("RBE3"):
        _mean(model, card)
    _equations(model)
    _supports(model)
    _loads(model)


def _mass(model: NastranModel, card: Card) -> None:
    node, cid = card.integer(2), card.integer(3, 0)
    at = model.point(card, node)
    x = np.array([card.real(k, 0.0) for k in (5, 6, 7)])
    axes = np.eye(3) if cid <= 0 else model.system(card, cid, at)
    offset = x - at if cid == -1 else axes @ x
    I11, I21, I22, I31, I32, I33 = (card.real(k, 0.0) for k in range(9, 15))
    inertia = axes @ np.array([[I11, -I21, -I31], [-I21, I22, -I32], [-I31, -I32, I33]]) @ axes.T * model.wtmass
    rows = tuple((float(a[0]), float(a[1]), float(a[2])) for a in inertia)
    where = (float(offset[0]), float(offset[1]), float(offset[2]))
    model.masses.append(DeckMass(model.group(card, [node]), card.real(4, 0.0) * model.wtmass, rows, where))


def _scalar_masses(model: NastranModel) -> None:
    """CMASS1 and CMASS2 of one grid point: the same mass along all three axes is a point mass; others are refused."""
    along: dict[int, list[float]] = {}
    counts: dict[int, int] = {}
    for card in model.of("CMASS1", "CMASS2"):
        m = card.real(2, 0.0) if card.name == "CMASS2" else model.property_value(card, "PMASS", 2)
        if m is None:
            model.ledger.refuse(card.name, f"names PMASS {card.text(2)}, which is not defined")
            continue
        ends = _scalar_ends(model, card)
        grids = [end for end in ends if end is not None] if ends is not None else []
        if len(grids) != 1 or grids[0][1] > 2:
            why = "between two points, at a scalar point, or about an axis: no mass that moves with a body frame"
            model.ledger.refuse(card.name, why)
            continue
        node, component = grids[0]
        along.setdefault(node, [0.0, 0.0, 0.0])[component] += m * model.wtmass
        counts[node] = counts.get(node, 0) + 1
    for node, masses in along.items():
        if len(set(masses)) > 1:
            why = f"grid point {node} has another mass along each axis, {masses}: no body frame can move with it"
            model.ledger.refuse("CMASS", why, count=counts[node])
        else:
            card = next(card for card in model.cards["GRID"] if card.integer(1) == node)
            model.masses.append(DeckMass(model.group(card, [node]), masses[0]))


def _scalar_ends(model: NastranModel, card: Card) -> list[tuple[int, int] | None] | None:
    """Return (grid point, component) of both ends of a scalar element, None for the ground.

    None in place of the list if a point is scalar.
    """
    ends: list[tuple[int, int] | None] = []
    for k in (3, 5):
        number, word = card.integer(k, 0), card.text(k + 1) or "0"
        if number == 0:
            ends.append(None)
        elif number in model.points.positions and word in set("123456"):
            ends.append((number, int(word) - 1))
        else:
            return None
    return ends


def _ground(model: NastranModel, card: Card, node: int, components: tuple[int, ...], what: str) -> None:
    """Note an element to the ground: a body is free here, and gets an interface where it would be attached."""
    words = ", ".join(MOTION_COMPONENTS[c] for c in components)
    why = f"ties {words} of grid point {node} to the ground{what}; the body is free here: put it into the system file"
    model.ledger.note(card.name, why)
    model.grounded.setdefault(node, set()).update(components)


def _axial_damper(model: NastranModel, card: Card) -> None:
    """CVISC: a damper along and about the line between its grid points."""
    number = card.integer(2, card.integer(1))
    for known in model.of("PVISC"):
        for k in (1, 5):
            if known.text(k) and known.integer(k) == number:
                along, about = known.real(k + 1, 0.0), known.real(k + 2, 0.0)
                ends = [model.point(card, card.integer(n)) for n in (3, 4)]
                R = _any_axes(ends[1] - ends[0])
                names = [model.group(card, [card.integer(n)]) for n in (3, 4)]
                damping = (along, 0.0, 0.0, about, 0.0, 0.0)
                model.springs.append(DeckSpring((names[0], names[1]), (0.0,) * 6, damping, _rows(R)))
                return
    model.ledger.refuse("CVISC", f"names PVISC {number}, which is not defined")


def _rows(axes: Array) -> tuple[Vector, Vector, Vector]:
    """Return axes, (3, 3) columns, as rows of a deck."""
    rows = [(float(a[0]), float(a[1]), float(a[2])) for a in axes.T]
    return rows[0], rows[1], rows[2]


def _bush(model: NastranModel, card: Card) -> None:
    known = model.property_of(card, "PBUSH")
    if known is None:
        model.ledger.refuse("CBUSH", f"names PBUSH {card.text(2) or card.text(1)}, which is not defined")
        return
    if not card.integer(4, 0):
        _ground(model, card, card.integer(3), ALL, f" by PBUSH {known.text(1)}")
        return
    k, b = [0.0] * 6, [0.0] * 6
    keys = {"K": k, "B": b}
    words = list(known.fields)
    for place in range(1, len(words), 8):
        key = words[place].upper()
        if key == "GE" and any(known.real(place + 2 + j, 0.0) for j in range(6)):
            model.ledger.note("PBUSH", "structural damping GE is left out: give the job a table [damping]")
        elif key == "M" and known.real(place + 2, 0.0):
            model.ledger.refuse("PBUSH", f"M = {known.text(place + 2)}: mass of a bushing")
        elif key in keys:
            keys[key][:] = [known.real(place + 2 + j, 0.0) for j in range(6)]
        elif key not in ("", "GE", "M", "RCV", "T", "ALPHA"):
            model.ledger.refuse("PBUSH", f"{key}: expected K, B, GE, M, RCV")
    ends = [model.point(card, card.integer(n)) for n in (3, 4)]
    has_length = bool(np.linalg.norm(ends[1] - ends[0]))
    is_round = all(row[1] == row[2] and row[4] == row[5] for row in (k, b))
    if has_length and not is_round and not card.text(8) and not card.text(5):
        why = "with length, other values along y than along z, and neither orientation nor CID: which is y is not said"
        model.ledger.refuse("CBUSH", why)
        return
    if not has_length and not card.text(8):
        why = "of no length and without CID: its axes are those of the displacements of GA (CD)"
        model.ledger.note("CBUSH", why)
    triad = _bush_axes(model, card, ends)
    if triad is None:
        model.ledger.refuse("CBUSH", "whose orientation is along the element itself, which says no direction of y")
        return
    names = [model.group(card, [card.integer(n)]) for n in (3, 4)]
    damping = tuple(b) if any(b) else None
    point = None
    if card.real(9, 0.5) != 0.5 and has_length:
        at = ends[0] + card.real(9) * (ends[1] - ends[0])
        point = (float(at[0]), float(at[1]), float(at[2]))
    model.springs.append(DeckSpring((names[0], names[1]), tuple(k), damping, _rows(triad), point))


def _bush_axes(model: NastranModel, card: Card, ends: list[Array]) -> Array | None:
    """Return the axes of a bush, (3, 3), columns: of CID, else x along the element and y towards the vector.

    None if the vector is along the element.
    """
    if card.text(8):
        return model.system(card, card.integer(8), ends[0])
    x = ends[1] - ends[0]
    if not np.linalg.norm(x) or not card.text(5):
        return model.axes(card.integer(3)) if not np.linalg.norm(x) else _any_axes(x)
    word = card.text(5)
    is_grid = word.isdigit() and not card.text(6)
    v = model.point(card, int(word)) - ends[0] if is_grid else np.array([card.real(k, 0.0) for k in (5, 6, 7)])
    v = v if is_grid else model.axes(card.integer(3)) @ v
    x = x / np.linalg.norm(x)
    z = np.cross(x, v)
    if np.linalg.norm(z) <= ALONG * np.linalg.norm(v):
        return None
    z = z / np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z], axis=1)


def _any_axes(x: Array) -> Array:
    x = x / np.linalg.norm(x)
    y = np.cross(x, np.eye(3)[int(np.argmin(np.abs(x)))])
    y = y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _scalar_spring(model: NastranModel, card: Card) -> None:
    """A spring or damper between the same component of two grid points.

    Two forces along an axis balance only on one line: the points must lie at one place, or apart along this axis. Two
    moments always balance.
    """
    if card.name in ("CELAS2", "CDAMP2"):
        value: float | None = card.real(2)
    else:
        value = model.property_value(
            card, "PELAS" if card.name == "CELAS1" else "PDAMP", 4 if card.name == "CELAS1" else 2
        )
    if value is None:
        kind = card.name.replace("C", "P", 1).rstrip("1")
        model.ledger.refuse(card.name, f"names {kind} {card.text(2)}, which is not defined")
        return
    ends = _scalar_ends(model, card)
    if ends is None:
        model.ledger.refuse(card.name, "to a scalar point")
        return
    grids = [end for end in ends if end is not None]
    if len(grids) < 2:
        if grids:
            _ground(model, card, grids[0][0], (grids[0][1],), f" with {value:g}")
        return
    (a, c), (b, c_b) = grids
    if c != c_b:
        model.ledger.refuse(card.name, "between different components, whose forces do not balance")
        return
    axes = [model.axes(node) for node in (a, b)]
    apart = model.point(card, b) - model.point(card, a)
    across = apart - (apart @ axes[0][:, c % 3]) * axes[0][:, c % 3]
    if np.abs(axes[0] - axes[1]).max() > ALONG or (c < 3 and np.abs(across).max() > ALONG * np.abs(apart).max()):
        model.ledger.refuse(
            card.name, "between grid points of different axes, or apart across its direction: its forces do not balance"
        )
        return
    names = [model.group(card, [node]) for node in (a, b)]
    six, none = tuple(value if k == c else 0.0 for k in range(6)), (0.0,) * 6
    stiffness, damping = (six, None) if card.name.startswith("CELAS") else (none, six)
    model.springs.append(DeckSpring((names[0], names[1]), stiffness, damping, _rows(axes[0])))


def _in_basic(model: NastranModel, nodes: list[int], components: tuple[int, ...]) -> bool:
    """Whether components along the axes of these points are those along basic axes."""
    whole = all(set(part) <= set(components) or not set(part) & set(components) for part in (ALL[:3], ALL[3:]))
    return whole or all(node not in model.points.axes for node in nodes)


def _rigid(model: NastranModel, card: Card) -> None:
    if card.name == "RBE2":
        last = len(card.fields)
        words = [word for word in card.fields[3:last] if word]
        if words and "." in words[-1]:  # the coefficient of thermal expansion
            words = words[:-1]
        leader, components = card.integer(2), components_of(card, card.text(3))
        followers = [int(word) for word in _written_out(words)]
    else:
        independent = [components_of(card, card.text(k) or "0") for k in (4, 5)]
        first = 0 if independent[0] else 1  # the end that leads
        leader, followers = card.integer(2 + first), [card.integer(3 - first)]
        if independent[first] != ALL or independent[1 - first] or components_of(card, card.text(6 + first) or "0"):
            model.ledger.refuse("RBAR", "only with all six components of one grid point independent")
            return
        components = components_of(card, card.text(7 - first) or "123456")
    if not _in_basic(model, followers, components):
        model.ledger.refuse(card.name, "single components of grid points with axes of their own (CD)")
        return
    name = f"{card.name.lower()}_{card.text(1)}"
    group = model.group(card, followers, f"{name}_nodes")
    model.rigid.append(RigidGroup(name, model.group(card, [leader]), group, components))


def _written_out(words: list[str]) -> list[str]:
    out: list[str] = []
    k = 0
    while k < len(words):
        if k + 2 < len(words) and words[k + 1].upper() == "THRU":
            out += [str(n) for n in range(int(words[k]), int(words[k + 2]) + 1)]
            k += 3
        else:
            out.append(words[k])
            k += 1
    return out


def _mean(model: NastranModel, card: Card) -> None:
    """RBE3: reference grid, its components, then sets of weight, components and grids; six weights for each grid.

    The mean motion is that of `fe_models.body.weighted_motion`. A grid in several sets has the sum of their weights.
    """
    node, components = card.integer(3), components_of(card, card.text(4))
    words = [word for word in card.fields[4:] if word]
    ends = [k for k, word in enumerate(words) if word.upper() in ("UM", "ALPHA")]
    weights = _weights(card, words[: ends[0]] if ends else words)
    turned = [
        number
        for number, six in weights.items()
        if number in model.points.axes and not np.all(six == np.repeat(six[[0, 3]], 3))
    ]
    if any(words[k].upper() == "UM" for k in ends) or turned or not _in_basic(model, [node], components):
        why = "with UM, or with weights of single components along axes of their own (CD)"
        model.ledger.refuse("RBE3", why)
        return
    if not weights:
        raise MeshError(
            f"{card.where} {card.text(1)}: expected weights, components and grids, got none; it is cut short"
        )
    name = f"rbe3_{card.text(1)}"
    alike: dict[tuple[float, ...], list[int]] = {}
    for number, six in weights.items():
        alike.setdefault(tuple(six.tolist()), []).append(number)
    groups = tuple(
        (model.group(card, nodes, f"{name}_nodes_{n}"), six[0] if six == (six[0],) * 3 + (0.0,) * 3 else six)
        for n, (six, nodes) in enumerate(alike.items(), start=1)
    )
    model.couplings.append(Coupling(name, model.group(card, [node]), groups, components))


def _weights(card: Card, words: list[str]) -> dict[int, Array]:
    """Return grid -> weight of each of its components, (6,), of the words `weight, components, grids` of an RBE3."""
    weights: dict[int, Array] = {}
    six = np.zeros(0)
    k = 0
    words = _written_out(words)
    while k < len(words):
        if words[k].isdigit() and len(six):
            weights[int(words[k])] = weights.get(int(words[k]), np.zeros(6)) + six
            k += 1
            continue
        try:
            weight = real_of(words[k])
        except ValueError:
            weight = np.nan
        if words[k].isdigit() or not weight >= 0 or k + 1 == len(words):
            raise MeshError(f"{card.where} {card.text(1)}: expected a weight and components, got {words[k]!r}")
        six = np.zeros(6)
        six[list(components_of(card, words[k + 1]))] = weight
        k += 2
    return weights


def _equations(model: NastranModel) -> None:
    """MPC of the sets that the case control selects; of all sets where there is no case control."""
    chosen = _selected(model, "MPC")
    for card in model.of("MPC"):
        if chosen is not None and card.integer(1) not in chosen:
            model.ledger.note("MPC", "of a set that the case control does not select")
        else:
            _equation(model, card)


def _selected(model: NastranModel, kind: str) -> set[int] | None:
    """Return the sets of SPC or MPC that the case control selects, those of SPCADD and MPCADD written out.

    None: the deck has no case control, and all sets count. A body has one set of equations: subcases that select
    different ones, or some none, are refused.
    """
    if model.chosen is None:
        return None
    by_subcase = model.chosen[kind]
    if len(by_subcase) > 1:
        words = ", ".join(str(number or "none") for number in sorted(by_subcase))
        if kind == "MPC":
            model.ledger.refuse(kind, f"subcases select different sets ({words}): keep one in the case control")
        else:
            model.ledger.note(kind, f"subcases select different sets ({words}): all of them make interfaces")
    chosen = {number for number in by_subcase if number}
    for card in model.of(f"{kind}ADD"):
        if card.integer(1) in chosen:
            chosen |= set(numbers_of(card, 2))
    return chosen


def _equation(model: NastranModel, card: Card) -> None:
    terms, nodes = [], []
    for first in range(2, len(card.fields), 8):
        for k in (first, first + 3):
            if card.text(k):
                nodes.append(card.integer(k))
                terms.append((card.integer(k), card.integer(k + 1, 0) - 1, card.real(k + 2)))
    is_basic = all(n in model.points.positions and n not in model.points.axes for n in nodes)
    if not is_basic or any(not 0 <= c < 6 for _, c, _ in terms):
        model.ledger.refuse("MPC", "of scalar points, or of grid points with axes of their own (CD)")
        return
    model.equations.append(Equation(tuple((model.group(card, [n]), c, a) for n, c, a in terms)))


def _supports(model: NastranModel) -> None:
    """SPC, SPC1 and permanent constraints of grid points; BSET and ASET as interfaces."""
    held: dict[int, set[int]] = {}
    chosen = _selected(model, "SPC")
    if chosen == set() and any(name in model.cards for name in ("SPC", "SPC1")):
        model.ledger.note("SPC", "the case control selects none: those of all sets make interfaces")
        chosen = None
    last: Card | None = None
    for card in model.of("SPC1", "SPC"):
        if chosen is not None and card.integer(1) not in chosen:
            model.ledger.note(card.name, "of a set that the case control does not select")
            continue
        last = card
        if card.name == "SPC1":
            for node in numbers_of(card, 3):
                held.setdefault(node, set()).update(components_of(card, card.text(2)))
        else:
            for k in (2, 5):
                if card.text(k):
                    held.setdefault(card.integer(k), set()).update(components_of(card, card.text(k + 1)))
    default = next((card.text(7) for card in model.of("GRDSET")), "")
    for card in model.of("GRID"):
        word = card.text(7) or default
        if word and word != "0":
            held.setdefault(card.integer(1), set()).update(components_of(card, word))
            last = card
    if last is not None:
        _groups_of(model, last, held, "support")
    boundary: dict[int, set[int]] = {}
    for card in model.of("BSET1", "BNDFIX1", "ASET1"):
        for node in numbers_of(card, 2):
            boundary.setdefault(node, set()).update(components_of(card, card.text(1)))
        last = card
    for card in model.of("BSET", "BNDFIX", "ASET"):
        for k in range(1, len(card.fields), 2):
            if card.text(k):
                boundary.setdefault(card.integer(k), set()).update(components_of(card, card.text(k + 1)))
        last = card
    if boundary and last is not None:
        _groups_of(model, last, {n: c for n, c in boundary.items() if n not in held}, "boundary")
    grounded = {n: c for n, c in model.grounded.items() if n not in held and n not in boundary}
    if grounded:
        _groups_of(model, model.cards["GRID"][0], grounded, "grounded")


def _groups_of(model: NastranModel, card: Card, held: dict[int, set[int]], what: str) -> None:
    """Make one support for each set of components, each grid point in one."""
    followers = {node for link in model.rigid for node in model.groups[link.followers]}
    by: dict[tuple[int, ...], list[int]] = {}
    for node, components in held.items():
        if node not in model.points.positions or node in followers:
            model.ledger.note("SPC", "of scalar points, or of grid points that follow others")
        elif not _in_basic(model, [node], tuple(sorted(components))):
            model.ledger.note("SPC", "along axes of their own (CD): left out of the interfaces")
        else:
            by.setdefault(tuple(sorted(components)), []).append(node)
    for same, nodes in by.items():
        name = f"{what}_{''.join(str(c + 1) for c in same)}"
        group = model.group(card, nodes, name)
        model.supports.append(Support(name, group, same, what != "support"))


def _loads(model: NastranModel) -> None:
    """Forces and moments by their set, gravity, pressure on solids; other loads are counted."""
    forces: dict[int, dict[str, Array]] = {}
    for card in model.of("FORCE", "MOMENT"):
        node = card.integer(2)
        direction = np.array([card.real(k, 0.0) for k in (5, 6, 7)])
        vector = card.real(4) * (model.system(card, card.integer(3, 0), model.point(card, node)) @ direction)
        six = forces.setdefault(card.integer(1), {}).setdefault(model.group(card, [node]), np.zeros(6))
        six[slice(0, 3) if card.name == "FORCE" else slice(3, 6)] += vector
    for sid, by_group in forces.items():
        given = {group: tuple(six.tolist()) for group, six in by_group.items()}
        model.loads.append(Load(f"load_{sid}", forces=given))
    for card in model.of("GRAV"):
        axes = model.system(card, card.integer(2, 0), np.zeros(3))
        g = card.real(3) * axes @ np.array([card.real(k, 0.0) for k in (4, 5, 6)])
        acceleration = (float(g[0]), float(g[1]), float(g[2]))
        model.loads.append(Load(f"gravity_{card.text(1)}", acceleration=acceleration))
    solids = {card.integer(1): card for name in _FACED for card in model.cards.get(name, ())}
    pressures: dict[tuple[int, float], list[tuple[int, ...]]] = {}
    for card in model.of("PLOAD4"):
        solid = solids.get(card.integer(2))
        if (why := _untaken(card, solid)) or solid is None:
            model.ledger.note("PLOAD4", f"{why}: left out of its load case")
        else:
            pressures.setdefault((card.integer(1), card.real(3)), []).append(_face(card, solid))
    for card in model.of("PLOAD", "PLOAD2"):
        model.ledger.note(card.name, "pressure on shells: no load case of a deck has it")
    for k, ((sid, pressure), faces) in enumerate(pressures.items()):
        again = sum(other == sid for other, _ in list(pressures)[:k])
        name = f"pressure_{sid}" + (f"_{again + 1}" if again else "")
        model.faces[f"{name}_faces"] = faces
        model.loads.append(Load(name, faces=f"{name}_faces", pressure=pressure))


def _untaken(card: Card, solid: Card | None) -> str:
    """Return why a PLOAD4 is no uniform pressure along the normal of one face of a solid; empty where it is."""
    if solid is None:
        return "pressure on shells or on elements that are not there"
    if any(card.text(k) and card.real(k) != card.real(3) for k in (4, 5, 6)):
        return "a pressure that varies over the face"
    if any(card.real(k, 0.0) for k in (10, 11, 12)) or card.text(13).upper() == "LINE":
        return "along a direction, or on the edges"
    return ""


def _face(card: Card, solid: Card) -> tuple[int, ...]:
    """Return the corner grids of a face, outward: G1 on it, and G3 opposite to G1 or, for CTETRA, G4 not on it."""
    kind, n = _FACED[solid.name]
    corners = [solid.integer(k) for k in range(3, 3 + n)]
    first, other = card.integer(7), card.integer(8, 0)
    for local in CELL_SHAPES[kind].facets:
        face = tuple(corners[k] for k in local)
        at = face.index(first) if first in face else -1
        is_opposite = len(face) == 4 and face[at - 2] == other
        is_it = other in corners and other not in face if n == 4 else is_opposite or (len(face) == 3 and not other)
        if at >= 0 and is_it:
            return face
    raise MeshError(
        f"{card.where} {card.text(1)}: element {card.text(2)} has no face of the grid points {card.text(7)} and "
        f"{card.text(8) or 'none'}; expected G1 on it and G3 opposite to G1, or for CTETRA G4 not on it"
    )
