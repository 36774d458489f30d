"""Supports of a Nastran deck become interfaces; a deck that confines all points to a plane is planar."""

import numpy as np

from fe_models.files.decks.deck import Support
from fe_models.files.nastran.deck.model import ALL, ALONG, NastranModel, components_of, numbers_of
from fe_models.files.nastran.mesh import ELEMENT_TYPES

__all__ = ["hold_points", "in_basic", "make_supports", "selected_sets"]

MOST_AXES = 50  #: largest number of different axes of supports; each becomes an interface of the job
AXES_DIGITS = 7  #: digits in which equal axes agree
#: further elements that must lie in the plane of a planar deck -> grid points
JOINING = {"CROD": 2, "CTUBE": 2, "CSHEAR": 4, "CBEND": 2}


def hold_points(model: NastranModel, *, find_plane: bool = True) -> None:
    """Read SPC, SPC1, PS and GRDSET as fixed components of grid points, and find the plane of a planar deck.

    Parameters
    ----------
    find_plane
        False for a section of a deck, because other sections may leave the plane.
    """
    chosen = selected_sets(model, "SPC")
    if chosen == set() and any(name in model.cards for name in ("SPC", "SPC1")):
        model.ledger.note("SPC", "the case control selects none: those of all sets make interfaces")
        chosen = None
    for card in model.of("SPC1", "SPC"):
        if chosen is not None and card.integer(1) not in chosen:
            model.ledger.note(card.name, "of a set that the case control does not select")
        elif card.name == "SPC1":
            for node in numbers_of(card, 3):
                model.held.setdefault(node, set()).update(components_of(card, card.text(2)))
        else:
            for k in (2, 5):
                if card.text(k):
                    model.held.setdefault(card.integer(k), set()).update(components_of(card, card.text(k + 1)))
    default = next((card.text(7) for card in model.of("GRDSET")), "")
    for card in model.of("GRID"):
        word = card.text(7) or default
        if word and word != "0":
            model.held.setdefault(card.integer(1), set()).update(components_of(card, word))
    if find_plane:
        _find_plane(model)


def _find_plane(model: NastranModel) -> None:
    """Find the plane to which a deck confines all element points, and remove the supports that do so.

    A point is confined to a plane if its translation along the normal and its rotations about the other two axes are
    fixed. The remaining supports hold the body, or fix the rotation in the plane, for which membranes have no
    stiffness.
    """
    points: set[int] = set()
    for name in (*ELEMENT_TYPES, *JOINING):
        for card in model.cards.get(name, ()):
            widest = JOINING[name] if name in JOINING else max(ELEMENT_TYPES[name])
            words = [card.text(k) for k in range(3, 3 + widest)]
            points |= {int(word) for word in words if word.isdigit() and int(word) in model.points.positions}
    for normal in range(3):
        if points and all(_holds(model, node, normal) for node in points):
            break
    else:
        return
    spread = np.ptp([model.points.positions[node][normal] for node in points])
    size = max(np.ptp([model.points.positions[node] for node in points], axis=0))
    if spread > ALONG * size:
        return
    model.plane = normal
    turns = 0
    for node in points & set(model.held):
        own = _across(model, node, normal)
        model.held[node] -= {own, *(3 + k for k in range(3) if k != own)}
        if model.held[node] <= {3 + own}:
            turns += bool(model.held.pop(node))
    plane = "yzx"[normal] + "zxy"[normal]
    why = f"hold all points of elements in a plane: the body is planar, plane = {plane!r}"
    model.ledger.note("SPC, PS", why)
    if turns:
        why = "hold the rotation in the plane alone, which has no stiffness in membranes: left out of the interfaces"
        model.ledger.note("SPC, PS", why, count=turns)


def _across(model: NastranModel, node: int, normal: int) -> int:
    """Return the displacement axis of a point that is closest to an axis of the basic system."""
    return int(np.argmax(np.abs(model.axes(node)[normal])))


def _holds(model: NastranModel, node: int, normal: int) -> bool:
    """Return whether a point is confined to the plane normal to an axis of the basic system."""
    own = _across(model, node, normal)
    out = {own, *(3 + k for k in range(3) if k != own)}
    return abs(model.axes(node)[normal, own]) > 1 - ALONG and out <= model.held.get(node, set())


def in_basic(model: NastranModel, nodes: list[int], components: tuple[int, ...]) -> bool:
    """Return whether components in the axes of these points equal components in basic axes."""
    whole = all(set(part) <= set(components) or not set(part) & set(components) for part in (ALL[:3], ALL[3:]))
    return whole or all(node not in model.points.axes for node in nodes)


def selected_sets(model: NastranModel, kind: str) -> set[int] | None:
    """Return the sets of SPC or MPC that the case control selects, with SPCADD and MPCADD expanded.

    None: the deck has no case control, and all sets are used. A body has one set of equations. Subcases with different
    sets of equations are therefore refused.
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


def make_supports(model: NastranModel) -> None:
    """Make interfaces from supports, from the boundary of a superelement, and from elements to the ground."""
    held = model.held
    _groups_of(model, held, "support")
    boundary: dict[int, set[int]] = {}
    for card in model.of("BSET1", "BNDFIX1", "ASET1"):
        for node in numbers_of(card, 2):
            boundary.setdefault(node, set()).update(components_of(card, card.text(1)))
    for card in model.of("BSET", "BNDFIX", "ASET"):
        for k in range(1, len(card.fields), 2):
            if card.text(k):
                boundary.setdefault(card.integer(k), set()).update(components_of(card, card.text(k + 1)))
    _groups_of(model, {n: c for n, c in boundary.items() if n not in held}, "boundary")
    grounded = {n: c for n, c in model.grounded.items() if n not in held and n not in boundary}
    _groups_of(model, grounded, "grounded")


def _groups_of(model: NastranModel, held: dict[int, set[int]], what: str) -> None:
    """Make a support for each set of components and, if relevant, axes; each grid point is in one support."""
    if not held:
        return
    card = model.cards["GRID"][0]
    followers = {node for link in model.rigid for node in model.groups[link.followers]}
    followers |= {  # whose job has no interface at the reference point
        node
        for link in model.couplings
        if link.components != ALL or any(not isinstance(weight, float) for _, weight in link.members)
        for node in model.groups[link.node]
    }
    used = model.used_points()
    by: dict[tuple[tuple[int, ...], bytes], list[int]] = {}
    for node, found in held.items():
        components = tuple(sorted(found))
        if node not in used or node in followers:
            model.ledger.note("SPC", "of scalar points, of points of no element, or of those that follow others")
            continue
        is_basic = in_basic(model, [node], components)
        axes = b"" if is_basic else (np.round(model.axes(node).T, AXES_DIGITS) + 0.0).tobytes()
        by.setdefault((components, axes), []).append(node)
    if len({axes for _, axes in by if axes}) > MOST_AXES:
        count = sum(len(nodes) for (_, axes), nodes in by.items() if axes)
        why = f"along more than {MOST_AXES} different axes (CD): left out of the interfaces"
        model.ledger.note("SPC", why, count=count)
        by = {key: nodes for key, nodes in by.items() if not key[1]}
    names: set[str] = set()
    for (same, axes), nodes in by.items():
        name = f"{what}_{''.join(str(c + 1) for c in same)}"
        group = model.group(card, nodes, name)
        while name in names:
            name += "_"
        names.add(name)
        rows = [(x, y, z) for x, y, z in model.axes(nodes[0]).T.tolist()] if axes else []
        triad = (rows[0], rows[1], rows[2]) if rows else None
        model.supports.append(Support(name, group, same, what != "support", triad))
