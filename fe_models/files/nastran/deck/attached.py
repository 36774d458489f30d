"""Masses, springs, rigid elements, constraints, supports and loads of Nastran."""

from collections import Counter

import numpy as np

from fe_models.assembly.constraints import weighted_motion
from fe_models.errors import BodyError, MeshError
from fe_models.files.decks.deck import Coupling, DeckMass, Load, RigidGroup
from fe_models.files.decks.equations import Row, solved_equations
from fe_models.files.nastran.bulk_data.cards import Card, real_of
from fe_models.files.nastran.deck.bends import read_bends
from fe_models.files.nastran.deck.model import ALL, NastranModel, components_of, numbers_in, range_at
from fe_models.files.nastran.deck.panels import read_panels
from fe_models.files.nastran.deck.springs import read_springs, scalar_ends, skip_scalar_points, springs_to_ground
from fe_models.files.nastran.deck.supports import in_basic, make_supports, selected_sets
from fe_models.files.nastran.deck.welds import read_welds
from fe_models.foundation.arrays import Array
from fe_models.meshes.cell_shapes import CELL_SHAPES

__all__ = ["read_attached"]

SAME = 1e-9  #: difference of entries of a mass matrix divided by the largest one, up to which they are equal

#: kind of cell and number of corner grids of each solid card
_FACED = {"CTETRA": ("tetra", 4), "CPENTA": ("wedge", 6), "CHEXA": ("hexahedron", 8)}


def read_attached(model: NastranModel) -> None:
    """Read masses, springs, rigid elements, constraints, supports and loads of grid points."""
    skip_scalar_points(model)
    for card in model.of("CONM2"):
        _mass(model, card)
    _scalar_masses(model)
    for card in model.of("CONM1"):
        _mass_matrix(model, card)
    read_springs(model)
    read_bends(model)
    read_panels(model)
    read_welds(model)
    for card in model.of("RBE2", "RBAR"):
        _rigid(model, card)
    for card in model.of("RROD"):
        _rod_of_constant_length(model, card)
    for card in model.of("RBE3"):
        _mean(model, card)
    _equations(model)
    _close_equations(model)
    springs_to_ground(model)
    make_supports(model)
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


def _mass_matrix(model: NastranModel, card: Card) -> None:
    """Read CONM1: the mass matrix of a rigid body in the axes of CID; other matrices are added to the ledger.

    With v_c = v + omega × r, it has M_tt = m, M_rt = m [r]×, M_rr = J - m [r]× [r]×.
    """
    node = card.integer(2)
    axes = model.system(card, card.integer(3, 0), model.point(card, node))
    M = np.zeros((6, 6))
    M[np.tril_indices(6)] = [card.real(k, 0.0) for k in range(4, 25)]
    M = M + np.tril(M, -1).T
    m, arm = float(M[0, 0]), M[3:, :3]
    r = np.array([arm[2, 1], arm[0, 2], arm[1, 0]]) / m if m else np.zeros(3)
    S = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    differences = (M[:3, :3] - m * np.eye(3), M[:3, :3]), (arm - m * S, arm)
    if any(np.abs(difference).max() > SAME * np.abs(whole).max() for difference, whole in differences):
        why = "no mass matrix of a rigid piece: another mass along each axis, or no centre of mass"
        model.ledger.refuse("CONM1", why)
        return
    J = axes @ (M[3:, 3:] + m * S @ S) @ axes.T * model.wtmass
    rows = tuple((float(a[0]), float(a[1]), float(a[2])) for a in J)
    x, y, z = (float(value) for value in axes @ r)
    model.masses.append(DeckMass(model.group(card, [node]), m * model.wtmass, rows, (x, y, z)))


def _scalar_masses(model: NastranModel) -> None:
    """Read CMASS1 and CMASS2 at one grid point; equal masses along all axes form a point mass.

    Axes along which the deck fixes the point are not compared, because no mass moves along them. Other masses are added
    to the ledger.
    """
    along: dict[int, list[float]] = {}
    cards: dict[int, list[Card]] = {}
    for card in model.of("CMASS1", "CMASS2"):
        m = card.real(2, 0.0) if card.name == "CMASS2" else model.property_value(card, "PMASS", 2)
        if m is None:
            model.ledger.refuse(card.name, f"names PMASS {card.text(2)}, which is not defined")
            continue
        ends = scalar_ends(model, card)
        grids = [end for end in ends if end is not None] if ends is not None else []
        if len(grids) != 1 or grids[0][1] > 2:
            why = "between two points, at a scalar point, or about an axis: no mass that moves with a body frame"
            model.ledger.refuse(card.name, why)
            continue
        node, component = grids[0]
        along.setdefault(node, [0.0, 0.0, 0.0])[component] += m * model.wtmass
        cards.setdefault(node, []).append(card)
    for node, masses in along.items():
        free = [mass for mass, is_held in zip(masses, _holds_along(model, node), strict=True) if not is_held] or masses
        if max(free) - min(free) > SAME * max(np.abs(free)):
            why = f"grid point {node} has another mass along each axis, {masses}: no body frame can move with it"
            model.ledger.refuse("CMASS", why, count=len(cards[node]))
        else:
            model.masses.append(DeckMass(model.group(cards[node][0], [node]), float(np.mean(free))))
            if len(free) < 3 and node in model.held:
                why = f"at grid point {node} along the axes that the deck leaves free: a point mass, along all axes"
                model.ledger.note("CMASS", why, count=len(cards[node]))


def _holds_along(model: NastranModel, node: int) -> list[bool]:
    """Return whether the deck fixes a point along each of its displacement axes, by supports or by its plane."""
    held = model.held.get(node, set())
    across = -1 if model.plane is None else int(np.argmax(np.abs(model.axes(node)[model.plane])))
    return [k in held or k == across for k in range(3)]


def _rigid(model: NastranModel, card: Card) -> None:
    if card.name == "RBE2":
        words = [word for word in card.fields[3:] if word]
        while words and "." in words[-1]:  # ALPHA, TREF
            words = words[:-1]
        leader, components = card.integer(2), components_of(card, card.text(3))
        followers = numbers_in(card, words)
    else:
        independent = [components_of(card, card.text(k) or "0") for k in (4, 5)]
        first = 0 if independent[0] else 1  # the end that leads
        leader, followers = card.integer(2 + first), [card.integer(3 - first)]
        if independent[first] != ALL or independent[1 - first] or components_of(card, card.text(6 + first) or "0"):
            model.ledger.refuse("RBAR", "only with all six components of one grid point independent")
            return
        components = components_of(card, card.text(7 - first) or "123456")
    name = f"{card.name.lower()}_{card.text(1)}"
    turned = [node for node in followers if not in_basic(model, [node], components)]
    for node in turned:
        model.rows += _rigid_rows(model, card, leader, node, components)
    followers = [node for node in followers if node not in turned]
    if not followers:
        return
    group = model.group(card, followers, f"{name}_nodes")
    model.rigid.append(RigidGroup(name, model.group(card, [leader]), group, components))


def _rigid_rows(
    model: NastranModel, card: Card, leader: int, node: int, components: tuple[int, ...]
) -> list[tuple[tuple[int, int], Row]]:
    """Return an equation for each component of a point, along its axes, that rigidly follows another point.

    e · u = e · (u_L + theta_L × r) = e · u_L + theta_L · (r × e), and e · theta = e · theta_L.
    """
    made = []
    r = model.point(card, node) - model.point(card, leader)
    for c in components:
        e, first = model.axes(node)[:, c % 3], c - c % 3
        row = {(node, first + j): float(e[j]) for j in range(3)}
        row |= {(leader, first + j): -float(e[j]) for j in range(3)}
        if first == 0:
            row |= {(leader, 3 + j): -float(value) for j, value in enumerate(np.cross(r, e))}
        made.append(((node, first), row))
    return made


def _rod_of_constant_length(model: NastranModel, card: Card) -> None:
    """Read RROD: the distance of two grid points is constant; one component, CMA or CMB, is eliminated."""
    ends = [card.integer(2), card.integer(3)]
    x = model.point(card, ends[1]) - model.point(card, ends[0])
    words = [card.text(k) or "0" for k in (4, 5)]
    given = [components_of(card, word) for word in words]
    both = (*given[0], *given[1])
    if not np.linalg.norm(x) > 0 or len(both) != 1 or both[0] > 2:
        model.ledger.refuse("RROD", "expected two points apart, and one translation in CMA or CMB that gives way")
        return
    x = x / np.linalg.norm(x)
    row = {(node, j): sign * float(x[j]) for node, sign in zip(ends, (-1, 1), strict=True) for j in range(3)}
    model.rows.append(((ends[0] if given[0] else ends[1], 0), row))


def _mean(model: NastranModel, card: Card) -> None:
    """Read RBE3: reference grid and its components, then sets of weight, components and grids.

    The mean motion is that of `fe_models.assembly.constraints`. A grid in several sets has the sum of their weights.
    """
    node, components = card.integer(3), components_of(card, card.text(4))
    words = [word for word in card.fields[4:] if word]
    ends = [k for k, word in enumerate(words) if word.upper() in ("UM", "ALPHA")]
    weights = _weights(card, words[: ends[0]] if ends else words)
    if any(words[k].upper() == "UM" for k in ends):
        model.ledger.refuse("RBE3", "with UM")
        return
    if not weights:
        raise MeshError(
            f"{card.where} {card.text(1)}: expected weights, components and grids, got none; it is cut short"
        )
    along_axes = not in_basic(model, [node], components) or any(
        number in model.points.axes and not np.all(six == np.repeat(six[[0, 3]], 3)) for number, six in weights.items()
    )
    if along_axes or not all(np.array_equal(six, [six[0]] * 3 + [0.0] * 3) for six in weights.values()):
        why = "weights of rotations or of single components: the geometric stiffness takes their mean as linear"
        model.ledger.note("RBE3", why)
    if along_axes:
        model.rows += _mean_rows(model, card, node, components, weights)
        return
    name = f"rbe3_{card.text(1)}"
    alike: dict[tuple[float, ...], list[int]] = {}
    for number, six in weights.items():
        alike.setdefault(tuple(six.tolist()), []).append(number)
    groups = tuple(
        (model.group(card, nodes, f"{name}_nodes_{n}"), six[0] if six == (six[0],) * 3 + (0.0,) * 3 else six)
        for n, (six, nodes) in enumerate(alike.items(), start=1)
    )
    model.couplings.append(Coupling(name, model.group(card, [node]), groups, components))


def _mean_rows(
    model: NastranModel, card: Card, node: int, components: tuple[int, ...], weights: dict[int, Array]
) -> list[tuple[tuple[int, int], Row]]:
    """Return an equation for each component of a mean motion; weights and components are along nodal axes.

    e · u = Σ A_i u_i, where e is the axis of the component and A that of `weighted_motion`.
    """
    points = np.array([model.point(card, number) for number in weights])
    axes = np.array([model.axes(number) for number in weights])
    try:
        A = weighted_motion(
            points, np.array([*weights.values()]), model.point(card, node), axes=axes, components=components,
            triad=model.axes(node),
        )  # fmt: skip
    except BodyError as error:
        raise MeshError(f"{card.where} {card.text(1)}: {error}") from error
    names = [(number, c) for number in weights for c in ALL]
    made = []
    for c, part in zip(components, A, strict=True):
        first = c - c % 3
        row = {(node, first + j): float(value) for j, value in enumerate(model.axes(node)[:, c % 3])}
        row |= {name: -float(a) for name, a in zip(names, part, strict=True) if a}
        made.append(((node, first), row))
    return made


def _weights(card: Card, words: list[str]) -> dict[int, Array]:
    """Return the weight of each component of each grid, (6,), from the words `weight, components, grids` of an RBE3."""
    weights: dict[int, Array] = {}
    six = np.zeros(0)
    k = 0
    while k < len(words):
        if words[k].isdigit() and len(six):
            numbers, n_words = range_at(card, words, k)
            for number in numbers:
                weights[number] = weights.get(number, np.zeros(6)) + six
            k += n_words
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
    """Read the MPC sets that the case control selects, or all sets if there is no case control."""
    chosen = selected_sets(model, "MPC")
    found = []
    for card in model.of("MPC"):
        if chosen is not None and card.integer(1) not in chosen:
            model.ledger.note("MPC", "of a set that the case control does not select")
            continue
        terms = _terms(card)
        if all(node in model.points.positions and 0 <= c < 6 for node, c, _ in terms):
            found.append(terms)
        else:
            model.ledger.refuse("MPC", "of scalar points")
    attached = _attached_points(model) | {node for _, row in model.rows for node, _ in row}
    uses = Counter(node for terms in found for node in {node for node, _, _ in terms})
    for terms in found:
        loose = {
            node
            for node, c, a in terms
            if a and uses[node] == 1 and node not in attached and c not in model.held.get(node, set())
        }
        if loose:  # the equation only determines the motion of this point
            why = f"only says how a point of no element moves ({min(loose)}): it does not restrict the body"
            model.ledger.note("MPC", why)
        else:
            _add_row(model, terms)


def _attached_points(model: NastranModel) -> set[int]:
    """Return the grid points of elements, masses, springs, rigid elements and mean motions."""
    groups = [link.followers for link in model.rigid]
    groups += [group for coupling in model.couplings for group, _ in coupling.members]
    return model.used_points().union(*(model.groups[name] for name in groups))


def _terms(card: Card) -> list[tuple[int, int, float]]:
    """Return grid point, component from 0, and coefficient of each term of an MPC."""
    terms = []
    for first in range(2, len(card.fields), 8):
        for k in (first, first + 3):
            if card.text(k):
                terms.append((card.integer(k), card.integer(k + 1, 0) - 1, card.real(k + 2)))
    return terms


def _add_row(model: NastranModel, terms: list[tuple[int, int, float]]) -> None:
    """Add an equation; components in nodal axes are transformed to basic axes."""
    row: Row = {}
    for node, c, a in terms:
        for j, part in enumerate(model.axes(node)[:, c % 3].tolist()):
            if part:
                place = (node, c - c % 3 + j)
                row[place] = row.get(place, 0.0) + a * part
    node, c, _ = terms[0]
    if node in model.points.axes:
        model.rows.append(((node, c - c % 3), row))
    else:
        model.plain_rows.append(row)


def _close_equations(model: NastranModel) -> None:
    """Convert the rows in basic axes to the equations of the deck."""
    made, refused = solved_equations(model.rows)
    for node, count in refused:
        why = f"equations that say more of a grid point (first: {node}) than its components, or the same twice"
        model.ledger.refuse("MPC, RBE2, RBAR", why, count=count)
    for row in (*made, *model.plain_rows):
        model.add_equation(row)


def _loads(model: NastranModel) -> None:
    """Read forces and moments by set, gravity, and pressure on solids; add other loads to the ledger."""
    forces: dict[int, dict[str, Array]] = {}
    attached = _attached_points(model) | {node for row in model.plain_rows for node, _ in row}
    attached |= {node for _, row in model.rows for node, _ in row}
    for card in model.of("FORCE", "MOMENT"):
        node = card.integer(2)
        if node not in attached and node in model.points.positions:
            model.ledger.note(card.name, f"at a point of no element ({node}): left out of its load case")
            continue
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
    """Return why a PLOAD4 is not a uniform normal pressure on one face of a solid; empty if it is."""
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
