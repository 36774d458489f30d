"""Couplings of Abaqus and CalculiX: equations, rigid bodies, kinematic and distributing couplings, ties of surfaces."""

import numpy as np

from fe_models.files.abaqus.assembly import TURNED
from fe_models.files.abaqus.blocks import DeckBlock
from fe_models.files.abaqus.draft import Draft
from fe_models.files.abaqus.elements import faces_of
from fe_models.files.abaqus.multipoint import LINEARISED, read_linearised
from fe_models.files.decks.deck import Coupling, Equation, RigidGroup
from fe_models.files.decks.equations import Row, solved_equations
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.cell_shapes import CELL_SHAPES, facet_tables, shape_values

__all__ = ["equations_in_basic_axes", "read_coupling", "read_tie", "surface_nodes"]

# couplings ------------------------------------------------------------------------------------------------------------


def read_coupling(here: str, block: DeckBlock, draft: Draft) -> None:
    """Read one block that couples nodes."""
    keyword, given = block.keyword, block.parameters
    if keyword == "EQUATION" and "REMOVE" in given:
        draft.ledger.note("*EQUATION, REMOVE", "constraints change between steps; those of the model are taken")
    elif keyword == "EQUATION":
        _equations(here, block, draft)
    elif keyword == "RIGID BODY":
        _rigid_body(here, block, draft)
    elif keyword == "COUPLING":
        draft.pending = dict(given)
    elif keyword in ("KINEMATIC", "DISTRIBUTING") and draft.pending:
        _coupling(here, block, draft)
        draft.pending = {}
    elif keyword == "DISTRIBUTING COUPLING":
        _distributing_coupling(here, block, draft)
    elif keyword == "TIE" and "CYCLIC SYMMETRY" not in given and "MULTISTAGE" not in given:
        read_tie(here, block, draft, surface_nodes(here, draft, block.lines[0].split(",")[0].strip()))
    elif keyword == "MPC":
        _mpcs(here, block, draft)
    else:
        draft.ledger.refuse(f"*{keyword}", "this coupling is not known here", line=block.line_number)


def _equations(here: str, block: DeckBlock, draft: Draft) -> None:
    """Read *EQUATION: number of terms, then node, component and coefficient of each, up to four on a line."""
    words = [word.strip() for line in block.lines for word in line.rstrip(", ").split(",")]
    turn = block.parameters.get(TURNED)
    axes = None if turn is None else np.array(turn.split(), dtype=float).reshape(3, 3).T
    at = 0
    while at < len(words):
        n = int(words[at])
        rows = [words[at + 1 + 3 * k : at + 4 + 3 * k] for k in range(n)]
        at += 1 + 3 * n
        terms = []
        for node, component, coefficient in rows:
            nodes = draft.nodes_of(here, node)
            is_one = len(nodes) == 1 and int(nodes[0]) not in draft.rotations
            if not is_one or not 1 <= int(component) <= 6:
                why = "equations of sets, of rotations at a ROT NODE, or of other components than 1 to 6"
                draft.ledger.refuse("*EQUATION", why, line=block.line_number)
                break
            terms.append((int(nodes[0]), int(component) - 1, float(coefficient)))
        else:
            draft.raw_equations.append((terms, axes))


def equations_in_basic_axes(draft: Draft) -> None:
    """Convert the equations of a deck to components in basic axes.

    (1) component c of a node with its own axes R, or those of its instance, is R[c] · u; terms of the same component
        are added
    (2) n equations whose first terms are components of one such node are solved together for n of its components in
        basic axes, which are eliminated
    """
    turned: list[tuple[tuple[int, int], Row]] = []
    for terms, of_instance in draft.raw_equations:
        node, component, _ = terms[0]
        row: Row = {}
        for other, c, a in terms:
            first = c - c % 3
            axes = draft.transformed.get(other, of_instance)
            parts = [(c, 1.0)] if axes is None else [(first + j, float(axes[c % 3, j])) for j in range(3)]
            for j, r in parts:
                row[other, j] = row.get((other, j), 0.0) + a * r  # (1)
        if node in draft.transformed or of_instance is not None:
            turned.append(((node, component - component % 3), row))
        else:
            _keep(draft, row)
    made, refused = solved_equations(turned)  # (2)
    for node, count in refused:
        why = f"equations that say more of a node (first: {node}) than its components, or the same twice"
        draft.ledger.refuse("*EQUATION", why, count=count)
    for row in made:
        _keep(draft, row)


def _keep(draft: Draft, row: Row) -> None:
    """Add an equation without its zero terms; the first term remains."""
    terms = [
        (draft.node_group(draft.where, [node]), c, float(a))
        for k, ((node, c), a) in enumerate(row.items())
        if a != 0 or k == 0
    ]
    draft.equations.append(Equation(tuple(terms)))


def _rigid_body(here: str, block: DeckBlock, draft: Draft) -> None:
    spaced = {"REFNODE": "REF NODE", "ROTNODE": "ROT NODE"}  # blanks may be left out
    given = {spaced.get(key, key): value for key, value in block.parameters.items()}
    if "NSET" in given:
        members = draft.nodes_of(here, given["NSET"])
    elif "ELSET" in given:
        members = _nodes_of_elements(draft, draft.elements_of(here, given["ELSET"]))
    else:
        members = np.zeros(0, np.int64)
    if not members.size or "REF NODE" not in given:
        draft.ledger.refuse("*RIGID BODY", "without NSET or ELSET, or without REF NODE", line=block.line_number)
        return
    if "ROT NODE" in given:
        leader = int(draft.nodes_of(here, given["REF NODE"])[0])
        draft.rotations[int(draft.nodes_of(here, given["ROT NODE"])[0])] = leader
    _rigid_group(here, draft, int(draft.nodes_of(here, given["REF NODE"])[0]), members)


def _rigid_group(
    here: str, draft: Draft, leader: int, members: IntArray, components: tuple[int, ...] = (0, 1, 2, 3, 4, 5)
) -> None:
    name = f"rigid_{len(draft.rigid) + 1}"
    followers = draft.node_group(here, np.setdiff1d(members, [leader]), f"{name}_nodes")
    draft.rigid.append(RigidGroup(name, draft.node_group(here, [leader]), followers, components))


def _coupling(here: str, block: DeckBlock, draft: Draft) -> None:
    given = draft.pending
    leader = int(draft.nodes_of(here, given.get("REF NODE", ""))[0])
    members = surface_nodes(here, draft, given.get("SURFACE", ""))
    if "INFLUENCE RADIUS" in given:
        members = _within(draft, leader, members, float(given["INFLUENCE RADIUS"]))
    weighting = block.parameters.get("WEIGHTING METHOD", "UNIFORM").upper()
    if weighting != "UNIFORM":
        why = f"weights that fall with the distance ({weighting}): only UNIFORM"
        draft.ledger.refuse("*DISTRIBUTING, WEIGHTING METHOD", why, line=block.line_number)
        return
    if block.keyword == "KINEMATIC":
        components = tuple(sorted(_limits(block))) or (0, 1, 2, 3, 4, 5)
        whole = all(set(part) <= set(components) or not set(part) & set(components) for part in ((0, 1, 2), (3, 4, 5)))
        has_axes = "ORIENTATION" in given or TURNED in block.parameters
        if not whole and (has_axes or draft.transformed.keys() & {leader, *members.tolist()}):
            why = "single components along axes of their own (ORIENTATION, *TRANSFORM, a turned instance)"
            draft.ledger.refuse("*KINEMATIC", why, line=block.line_number)
            return
        _rigid_group(here, draft, leader, members, components)
        return
    if block.lines and _limits(block) != set(range(6)):
        draft.ledger.refuse("*DISTRIBUTING", "of some components of the reference node", line=block.line_number)
        return
    name = given.get("CONSTRAINT NAME", f"coupling_{len(draft.couplings) + 1}")
    draft.ledger.note("*DISTRIBUTING", "every node of the surface has the same weight", line=block.line_number)
    group = draft.node_group(here, np.setdiff1d(members, [leader]), f"{name}_nodes")
    draft.couplings.append(Coupling(name, draft.node_group(here, [leader]), ((group, 1.0),)))


def _within(draft: Draft, leader: int, members: IntArray, radius: float) -> IntArray:
    """Return the nodes within a distance from a node (INFLUENCE RADIUS)."""
    at = draft.mesh.coordinates[draft.mesh.rows_of(np.array([leader]))][0]
    away = np.linalg.norm(draft.mesh.coordinates[draft.mesh.rows_of(members)] - at, axis=1)
    if not (away <= radius).any():
        raise ValueError(f"no node of the surface within INFLUENCE RADIUS = {radius:g} of node {leader}")
    return members[away <= radius]


def _limits(block: DeckBlock) -> set[int]:
    """Return the components, 0 to 5, of lines with a first and a last component."""
    held: set[int] = set()
    for line in block.lines:
        limits = [int(word) for word in line.rstrip(", ").split(",")]
        held |= set(range(limits[0] - 1, limits[-1]))
    return held


def _distributing_coupling(here: str, block: DeckBlock, draft: Draft) -> None:
    of_set = draft.points_of(block.parameters.get("ELSET", ""))
    if of_set is None or len(of_set.rows) != 1:
        draft.ledger.refuse("*DISTRIBUTING COUPLING", "expected one element DCOUP3D", line=block.line_number)
        return
    members = []
    for line in block.lines:
        word, weight = [part.strip() for part in line.rstrip(", ").split(",")][:2]
        members.append((draft.node_group(here, draft.nodes_of(here, word), word), float(weight)))
    name = f"coupling_{len(draft.couplings) + 1}"
    draft.couplings.append(Coupling(name, draft.node_group(here, next(iter(of_set.rows.values()))), tuple(members)))


def _mpcs(here: str, block: DeckBlock, draft: Draft) -> None:
    listed: list[list[str]] = []
    for line in block.lines:
        words = [word.strip() for word in line.rstrip(", ").split(",")]
        if listed and words[0].isdigit():  # continues the line above
            listed[-1] += words[1:] if words[0] == "0" else words
        else:
            listed.append(words)
    for kind, *words in listed:
        name = f"*MPC, {kind.upper()}"
        if kind.upper() in LINEARISED:
            why = read_linearised(here, draft, kind.upper(), words)
            if why:
                draft.ledger.refuse(name, why, line=block.line_number)
            continue
        if kind.upper() == "DIST":
            why = "a limit of a distance, closed or open like a gap, is not linear"
            draft.ledger.refuse(name, why, line=block.line_number)
            continue
        if kind.upper() not in ("BEAM", "TIE", "PIN") or len(words) != 2:
            draft.ledger.refuse(name, "this constraint is not known here", line=block.line_number)
            continue
        members, leaders = (draft.nodes_of(here, word) for word in words)
        if len(leaders) != 1:
            draft.ledger.refuse(name, "of nodes in pairs; write a line for each pair", line=block.line_number)
        elif kind.upper() != "BEAM":
            _equal(here, draft, int(leaders[0]), members, is_tied=kind.upper() == "TIE")
        elif draft.program == "abaqus":
            _rigid_group(here, draft, int(leaders[0]), members)
        else:
            why = "CalculiX keeps the distance of the nodes alone, Abaqus all of their motion: read it as abaqus, or"
            draft.ledger.refuse(name, f"{why} write *RIGID BODY", line=block.line_number)


def _equal(here: str, draft: Draft, leader: int, members: IntArray, *, is_tied: bool) -> None:
    """Convert PIN (equal displacements) and TIE (also equal rotations).

    Displacements are equal even if the nodes are apart, without the term of a rigid arm.
    """
    first = draft.node_group(here, [leader])
    for member in np.setdiff1d(members, [leader]).tolist():
        other = draft.node_group(here, [member])
        draft.equations += [Equation(((other, c, 1.0), (first, c, -1.0))) for c in range(3)]
    if is_tied:
        _rigid_group(here, draft, leader, members, (3, 4, 5))


def surface_nodes(here: str, draft: Draft, name: str) -> IntArray:
    """Return the node numbers of a surface, which consists of element faces or nodes."""
    block = draft.surfaces.get(name.upper())
    if block is None:
        return draft.nodes_of(here, name)
    found = [np.zeros(0, np.int64)]
    for line in block.lines:
        word, _, face = (part.strip() for part in line.partition(","))
        if block.parameters.get("TYPE", "ELEMENT").upper() == "NODE":
            found.append(draft.nodes_of(here, word))
        else:
            elements = draft.elements_of(here, word)
            label = face.upper().split(",")[0].strip()
            if label in ("SPOS", "SNEG", "") or not label[1:].isdigit():
                found.append(_nodes_of_elements(draft, elements))
                continue
            rows = faces_of(draft, elements, int(label[1:]))
            corners = np.unique(np.concatenate([np.zeros(0, np.int64), *(r.ravel() for r in rows.values())]))
            found.append(_with_middles(draft, elements, draft.mesh.node_numbers[corners]))
    return np.unique(np.concatenate(found))


def _with_middles(draft: Draft, elements: IntArray, corners: IntArray) -> IntArray:
    """Return the corner nodes of faces, and the middle nodes of edges between two of them."""
    from fe_models.meshes.cell_shapes import CELL_SHAPES

    found = [corners]
    for _, kind, table in draft.mesh.elements:
        if kind in CELL_SHAPES and CELL_SHAPES[kind].middles:
            cells = table[np.isin(table[:, 0], elements), 1:]
            n = len(CELL_SHAPES[kind].corners)
            for k, parents in enumerate(CELL_SHAPES[kind].middles):
                both = np.isin(cells[:, list(parents)], corners).all(axis=1)
                found.append(cells[both, n + k])
    return np.unique(np.concatenate(found))


def _nodes_of_elements(draft: Draft, elements: IntArray) -> IntArray:
    parts = [table[np.isin(table[:, 0], elements), 1:].ravel() for _, _, table in draft.mesh.elements]
    return np.unique(np.concatenate([np.zeros(0, np.int64), *parts]))


# ties: each node of the slave surface follows the face of the master surface on which it lies -------------------------


CANDIDATES = 6  #: number of closest faces that are tried for a node
SHARE = 0.025  #: largest distance of a node from a face divided by the size of the face, if the deck gives none
NEWTON_STEPS = 20


def read_tie(here: str, block: DeckBlock, draft: Draft, slaves: IntArray) -> None:
    """Add three equations for each slave node: its displacement is that of its point on the face, Σ N_a u_a.

    Parameters
    ----------
    slaves
        Numbers of the nodes of the slave surface.
    """
    master = [word.strip() for word in block.lines[0].split(",")][1]
    faces = _complete_faces(here, draft, master)
    if not faces:
        draft.ledger.refuse("*TIE", "the master surface is not made of faces of solids", line=block.line_number)
        return
    tolerance = float(block.parameters.get("POSITION TOLERANCE") or "nan")
    X = draft.mesh.coordinates
    flat = [(kind, row) for kind, rows in faces.items() for row in rows]
    centres = np.array([X[row].mean(axis=0) for _, row in flat])
    of_master = np.unique(np.concatenate([row for _, row in flat]))
    loose = 0
    for number, row in zip(slaves.tolist(), draft.mesh.rows_of(slaves).tolist(), strict=True):
        if row in of_master:
            continue
        near = np.argsort(np.linalg.norm(centres - X[row], axis=1))[:CANDIDATES]
        found = [(*_foot(flat[k][0], X[flat[k][1]], X[row]), flat[k][1]) for k in near]
        distance, N, face = min(found, key=lambda each: each[0])
        size = float(np.linalg.norm(np.ptp(X[face], axis=0)))
        if distance > (SHARE * size if np.isnan(tolerance) else tolerance):
            loose += 1
            continue
        names = [draft.node_group(here, [int(draft.mesh.node_numbers[n])]) for n in face]
        own = draft.node_group(here, [number])
        for c in range(3):
            terms = [(own, c, 1.0), *((name, c, -float(n)) for name, n in zip(names, N, strict=True) if abs(n) > 1e-12)]
            draft.equations.append(Equation(tuple(terms)))
    if loose:
        draft.ledger.note(
            "*TIE", "slave nodes farther from the master surface than the tolerance: not tied", count=loose
        )


def _complete_faces(here: str, draft: Draft, name: str) -> dict[str, IntArray]:
    """Return the rows of all nodes of the faces of a surface, including middle nodes, by face kind."""
    block = draft.surfaces.get(name.upper())
    found: dict[str, list[IntArray]] = {}
    for line in block.lines if block is not None else []:
        word, _, label = (part.strip() for part in line.partition(","))
        if not label[1:2].isdigit():
            continue
        elements = draft.elements_of(here, word)
        corners = faces_of(draft, elements, int(label[1]))
        wanted = {frozenset(row.tolist()) for rows in corners.values() for row in rows}
        for _, kind, table in draft.mesh.elements:
            if kind not in CELL_SHAPES or CELL_SHAPES[kind].dim != 3:
                continue
            cells = draft.mesh.rows_of(table[np.isin(table[:, 0], elements), 1:])
            for face_kind, local in facet_tables(kind).items():
                n = 3 if face_kind.startswith("triangle") else 4
                rows = cells[:, local].reshape(-1, local.shape[1])
                mine = [row for row in rows if frozenset(row[:n].tolist()) in wanted]
                if mine:
                    found.setdefault(face_kind, []).append(np.array(mine))
    return {kind: np.concatenate(rows) for kind, rows in found.items()}


def _foot(kind: str, X: Array, point: Array) -> tuple[float, Array]:
    """Return the distance of a point from a face, and the shape functions at its projection, (n_nodes,)."""
    xi = np.full(2, 1 / 3 if kind.startswith("triangle") else 0.5)
    for _ in range(NEWTON_STEPS):
        N, dN = shape_values(kind, xi[None])
        tangents = X.T @ dN[0]
        step = np.linalg.lstsq(tangents, point - N[0] @ X, rcond=None)[0]
        xi = _inside(kind, xi + step)
        if np.abs(step).max() < 1e-13:
            break
    N = shape_values(kind, xi[None])[0][0]
    return float(np.linalg.norm(point - N @ X)), N


def _inside(kind: str, xi: Array) -> Array:
    """Return the closest point of the reference face."""
    xi = np.clip(xi, 0, 1)
    excess = xi.sum() - 1
    return np.clip(xi - excess / 2, 0, 1) if kind.startswith("triangle") and excess > 0 else xi
