"""Ties of surfaces: each node of the slave surface follows the face of the master surface on which it lies."""

import numpy as np

from fe_models.files.abaqus_deck import DeckBlock
from fe_models.files.decks.abaqus.draft import Draft
from fe_models.files.decks.abaqus.elements import faces_of
from fe_models.files.decks.deck import Equation
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.cell_shapes import CELL_SHAPES, facet_tables, shape_values

__all__ = ["read_tie"]

CANDIDATES = 6  #: number of closest faces that are tried for a node
SHARE = 0.025  #: largest distance of a node from a face over the size of the face, if the deck gives none
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
