"""Springs, dampers, bushings and gaps of Nastran; gaps become linear springs in their initial state."""

import numpy as np

from fe_models.files.decks.deck import DeckSpring, as_triad, axes_along
from fe_models.files.nastran.bulk_data.cards import Card
from fe_models.files.nastran.deck.model import ALL, ALONG, NastranModel
from fe_models.foundation.arrays import MOTION_COMPONENTS, Array

__all__ = ["read_springs", "scalar_ends", "skip_scalar_points", "springs_to_ground"]


def read_springs(model: NastranModel) -> None:
    """Read elements between two grid points, or between one grid point and the ground."""
    for card in model.of("CBUSH"):
        _bush(model, card)
    for card in model.of("CBUSH1D"):
        _bush_1d(model, card)
    for card in model.of("CGAP"):
        _gap(model, card)
    for card in model.of("CELAS1", "CELAS2", "CDAMP1", "CDAMP2"):
        _scalar_spring(model, card)
    for card in model.of("CVISC"):
        _axial_damper(model, card)


def springs_to_ground(model: NastranModel) -> None:
    """Treat springs to points without other elements, which are fixed in all components, as springs to the ground."""
    springs, model.springs = model.springs, []
    attached = model.used_points() | {node for row in model.plain_rows for node, _ in row}
    attached |= {node for _, row in model.rows for node, _ in row}
    attached |= {node for link in model.couplings for group, _ in link.members for node in model.groups[group]}
    for spring in springs:
        ends = [model.groups[name][0] for name in spring.nodes]
        is_ground = [set(ALL) <= model.held.get(node, set()) and node not in attached for node in ends]
        if is_ground[0] == is_ground[1]:
            model.springs.append(spring)
            continue
        free = ends[is_ground.index(False)]
        why = (
            f"tie grid point {free} to point {ends[is_ground.index(True)]}, which is held; the body is free here: put "
            "them into the system file"
        )
        model.ledger.note("springs", why)
        damping = spring.damping or (0.0,) * 6
        is_used = [bool(spring.stiffness[k] or damping[k]) for k in ALL]
        whole = [k for first in (0, 3) for k in range(first, first + 3) if any(is_used[first : first + 3])]
        model.grounded.setdefault(free, set()).update(whole)


def scalar_ends(model: NastranModel, card: Card) -> list[tuple[int, int] | None] | None:
    """Return (grid point, component) of both ends of a scalar element; None for an end at the ground.

    Return None instead of the list if a point is a scalar point.
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


def skip_scalar_points(model: NastranModel) -> None:
    """Remove elements between scalar points, with a note: no grid point moves them, so they are not in the body."""
    why = "between scalar points, which no grid point moves: no part of the body"
    for kind in ("CELAS", "CDAMP", "CMASS"):
        for name in (f"{kind}1", f"{kind}2"):
            between = [card for card in model.of(name) if _is_between_scalar_points(model, card)]
            if between:
                model.cards[name] = [card for card in model.cards[name] if card not in between]
                model.ledger.note(name, why, count=len(between))
        for card in model.of(f"{kind}3", f"{kind}4"):
            grids = [card.integer(k) for k in (3, 4) if card.integer(k, 0) in model.points.positions]
            if grids:
                model.ledger.refuse(card.name, f"names grid point {grids[0]}; expected scalar points")
            else:
                model.ledger.note(card.name, why)


def _is_between_scalar_points(model: NastranModel, card: Card) -> bool:
    """Return whether a scalar element connects scalar points (component 0 or blank), or one of them and the ground."""
    numbers = [card.integer(k, 0) for k in (3, 5)]
    are_scalar = all((card.text(k) or "0") == "0" for k in (4, 6))
    return any(numbers) and are_scalar and not any(number in model.points.positions for number in numbers)


def _ground(model: NastranModel, card: Card, node: int, components: tuple[int, ...], what: str) -> None:
    """Record an element to the ground as an interface, because the body is free."""
    words = ", ".join(MOTION_COMPONENTS[c] for c in components)
    why = f"ties {words} of grid point {node} to the ground{what}; the body is free here: put it into the system file"
    model.ledger.note(card.name, why)
    model.grounded.setdefault(node, set()).update(components)


def _axial_damper(model: NastranModel, card: Card) -> None:
    """Read CVISC: a damper along and about the line between its grid points."""
    number = card.integer(2, card.integer(1))
    for known in model.of("PVISC"):
        for k in (1, 5):
            if known.text(k) and known.integer(k) == number:
                along, about = known.real(k + 1, 0.0), known.real(k + 2, 0.0)
                axes = _axes_along(model, card, None)
                if axes is None:
                    model.ledger.refuse("CVISC", "has no length between its ends")
                    return
                names = [model.group(card, [card.integer(n)]) for n in (3, 4)]
                damping = (along, 0.0, 0.0, about, 0.0, 0.0)
                model.springs.append(DeckSpring((names[0], names[1]), (0.0,) * 6, damping, as_triad(axes.T)))
                return
    model.ledger.refuse("CVISC", f"names PVISC {number}, which is not defined")


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
    model.springs.append(DeckSpring((names[0], names[1]), tuple(k), damping, as_triad(triad.T), point))


def _bush_axes(model: NastranModel, card: Card, ends: list[Array]) -> Array | None:
    """Return the axes of a bush as columns, (3, 3): those of CID, or x along the element and y towards the vector.

    Return None if the vector is along the element.
    """
    if card.text(8):
        return model.system(card, card.integer(8), ends[0])
    x = ends[1] - ends[0]
    if not np.linalg.norm(x) or not card.text(5):
        return model.axes(card.integer(3)) if not np.linalg.norm(x) else axes_along(x).T
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


def _scalar_spring(model: NastranModel, card: Card) -> None:
    """Read a spring or damper between equal components of two grid points.

    Two opposite forces along an axis are in balance only if both points are on one line along this axis. Two opposite
    moments always are.
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
    ends = scalar_ends(model, card)
    if ends is None:
        model.ledger.refuse(card.name, "to a scalar point")
        return
    grids = [end for end in ends if end is not None]
    if len(grids) < 2:
        if grids:
            _ground(model, card, grids[0][0], (grids[0][1],), f" with {value:g}")
        return
    (a, c), (b, c_b) = grids
    axes = [model.axes(node) for node in (a, b)]
    apart = model.point(card, b) - model.point(card, a)
    across = apart - (apart @ axes[0][:, c % 3]) * axes[0][:, c % 3]
    has_other_axes = np.abs(axes[0] - axes[1]).max() > ALONG
    if c != c_b or has_other_axes or (c < 3 and np.abs(across).max() > ALONG * np.abs(apart).max()):
        _without_balance(model, card, grids, value)
        return
    names = [model.group(card, [node]) for node in (a, b)]
    six, none = tuple(value if k == c else 0.0 for k in range(6)), (0.0,) * 6
    stiffness, damping = (six, None) if card.name.startswith("CELAS") else (none, six)
    model.springs.append(DeckSpring((names[0], names[1]), stiffness, damping, as_triad(axes[0].T)))


def _without_balance(model: NastranModel, card: Card, ends: list[tuple[int, int]], value: float) -> None:
    """Convert a scalar element whose forces do not balance to an element to the ground if the deck fixes one end.

    Nastran also allows such an element between two free ends; it then holds the body, because the resultant of its
    forces acts on the ground. A free body cannot have it, and omitting it with a mere note would remove stiffness
    between points of the body. It is therefore refused. Its ends become interfaces, so that users who leave it out
    explicitly can add it in the system file.
    """
    free = [(node, c) for node, c in ends if c not in model.held.get(node, set())]
    if not free:
        model.ledger.note(card.name, "between components that are held: without effect in the deck, left out")
    elif len(free) == 1:
        at = next(node for node, c in ends if (node, c) not in free)
        _ground(model, card, free[0][0], (free[0][1],), f" with {value:g}, at grid point {at}, which is held there")
    else:
        for node, c in free:
            model.grounded.setdefault(node, set()).add(c)
        why = (
            "between different components, grid points of different axes, or apart across its direction: its forces do "
            "not balance, and the rest acts on the ground, which a free body does not have. Use a CBUSH, which reaches "
            "its place by rigid arms, or leave it out and put it into the system file: its ends become interfaces"
        )
        model.ledger.refuse(card.name, why)


def _bush_1d(model: NastranModel, card: Card) -> None:
    """Read CBUSH1D: a spring and damper along the line of its grid points, or along axis x of CID."""
    known = model.property_of(card, "PBUSH1D")
    if known is None:
        model.ledger.refuse("CBUSH1D", f"names PBUSH1D {card.text(2) or card.text(1)}, which is not defined")
        return
    k, c, mass = (known.real(n, 0.0) for n in (2, 3, 4))
    if mass:
        model.ledger.refuse("PBUSH1D", f"M = {known.text(4)}: mass of a bushing")
    if any(known.fields[8:]):
        model.ledger.note("PBUSH1D", "laws that are not linear, or vary with time: K and C are taken")
    if not card.integer(4, 0):
        _ground(model, card, card.integer(3), ALL[:3], f" by PBUSH1D {known.text(1)}")
        return
    axes = _axes_along(model, card, 5)
    if axes is None:
        why = "of no length and without CID, or apart across axis x of CID: its forces do not balance"
        model.ledger.refuse("CBUSH1D", why)
        return
    names = [model.group(card, [card.integer(n)]) for n in (3, 4)]
    none = (0.0,) * 5
    model.springs.append(DeckSpring((names[0], names[1]), (k, *none), (c, *none) if c else None, as_triad(axes.T)))


def _axes_along(model: NastranModel, card: Card, field: int | None) -> Array | None:
    """Return axes whose x is axis x of the system in a field, or from GA to GB if there is no field or it is blank.

    Return None if forces along x cannot be in balance.
    """
    ends = [model.point(card, card.integer(n)) for n in (3, 4)]
    apart = ends[1] - ends[0]
    if field is None or not card.text(field):
        return axes_along(apart).T if np.linalg.norm(apart) else None
    axes = model.system(card, card.integer(field), ends[0])
    across = apart - (apart @ axes[:, 0]) * axes[:, 0]
    return axes if np.abs(across).max() <= ALONG * np.abs(apart).max() else None


def _gap(model: NastranModel, card: Card) -> None:
    """Read CGAP: a linear spring in its initial state, as in linear solutions of Nastran.

    Closed gap (U0 <= 0): KA along x, and KT (MU1 KA if blank) normal to x. Open gap: KB along x. If KB is blank, its
    value is 1e-14 KA, which is taken as zero here.
    """
    known = model.property_of(card, "PGAP")
    if known is None:
        model.ledger.refuse("CGAP", f"names PGAP {card.text(2) or card.text(1)}, which is not defined")
        return
    opening, stiffness = known.real(2, 0.0), known.real(4)
    is_open = opening > 0
    along = known.real(5, 0.0) if is_open else stiffness
    across = 0.0 if is_open else known.real(6) if known.text(6) else known.real(7, 0.0) * stiffness
    state = f"open by {opening:g}" if is_open else "closed"
    model.ledger.note("CGAP", f"{state} at first: a linear spring of {along:g} along and {across:g} across its axis")
    axes = _axes_along(model, card, 8)
    has_length = bool(np.linalg.norm(model.point(card, card.integer(4)) - model.point(card, card.integer(3))))
    if axes is None or (across and has_length):
        why = "apart across its axis, or with stiffness across its length: its forces do not balance"
        model.ledger.refuse("CGAP", why)
        return
    names = [model.group(card, [card.integer(n)]) for n in (3, 4)]
    if along or across:
        six = (along, across, across, 0.0, 0.0, 0.0)
        model.springs.append(DeckSpring((names[0], names[1]), six, None, as_triad(axes.T)))
