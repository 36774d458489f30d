"""Supports and loads of Abaqus and CalculiX."""

import numpy as np

from fe_models.files.abaqus_deck import DeckBlock
from fe_models.files.decks.abaqus.draft import Draft
from fe_models.files.decks.abaqus.elements import faces_of
from fe_models.files.decks.abaqus.materials import numbers
from fe_models.files.decks.deck import Load
from fe_models.foundation.arrays import IntArray
from fe_models.meshes.cells.raw_mesh import RawBlock

__all__ = ["read_boundary", "read_load"]

_NAMED = {
    "ENCASTRE": (0, 1, 2, 3, 4, 5),
    "PINNED": (0, 1, 2),
    "XSYMM": (0, 4, 5),
    "YSYMM": (1, 3, 5),
    "ZSYMM": (2, 3, 4),
    "XASYMM": (1, 2, 3),
    "YASYMM": (0, 2, 4),
    "ZASYMM": (0, 1, 5),
}  #: fixed components of each named support


def read_boundary(here: str, block: DeckBlock, draft: Draft, step: str) -> None:
    """Record which components of which nodes are fixed, and under which name."""
    for line in block.lines:
        words = [word.strip() for word in line.rstrip(", ").split(",")]
        nodes = draft.nodes_of(here, words[0])
        name = "" if words[0].lstrip("+").isdigit() else words[0].rpartition(".")[2]
        if len(words) > 1 and words[1].upper() in _NAMED:
            components = set(_NAMED[words[1].upper()])
        else:
            first = int(words[1])
            last = int(words[2]) if len(words) > 2 and words[2] else first
            components = {c - 1 for c in range(first, last + 1) if 1 <= c <= 6}
        if len(words) > 3 and float(words[3] or 0) != 0:
            draft.ledger.note(
                "*BOUNDARY", "prescribed displacements: the place is an interface, the motion is not taken"
            )
        known = draft.mesh.rows_of(nodes) >= 0
        if not known.all():
            draft.ledger.note("*BOUNDARY", "nodes that are not in the deck", count=int((~known).sum()))
        for node in nodes[known].tolist():
            if components:
                draft.held.setdefault(node, {}).setdefault(name, set()).update(components)


def read_load(here: str, block: DeckBlock, draft: Draft, step: str) -> None:
    """Read the loads of one block; loads that a load case cannot represent are added to the ledger."""
    if block.keyword == "CLOAD":
        _nodal(here, block, draft, step)
        return
    for line in block.lines:
        words = [word.strip() for word in line.rstrip(", ").split(",")]
        label = words[1].upper() if len(words) > 1 else ""
        name = f"{step}_load{len(draft.loads) + 1}"
        if label == "GRAV" and len(words) >= 6:
            g = np.array(numbers(",".join(words[3:6])))
            g = float(words[2]) * g / np.linalg.norm(g)
            draft.loads.append(Load(name, acceleration=(float(g[0]), float(g[1]), float(g[2]))))
            if words[0]:
                draft.ledger.note(f"*{block.keyword}, GRAV", "acts on the whole body, not on a set of elements")
        elif block.keyword == "DSLOAD" and label == "P":
            faces = _surface_faces(here, draft, words[0])
            _pressure(draft, name, faces, words)
        elif label.startswith("P") and label[1:].isdigit():
            faces = faces_of(draft, draft.elements_of(here, words[0]), int(label[1:]))
            _pressure(draft, name, faces, words)
        else:
            why = "no load case has this kind of load"
            draft.ledger.note(f"*{block.keyword}, {label}", why, line=block.line_number)


def _nodal(here: str, block: DeckBlock, draft: Draft, step: str) -> None:
    """Add nodal forces to the load of this step."""
    forces: dict[str, np.ndarray] = {}
    for line in block.lines:
        words = [word.strip() for word in line.rstrip(", ").split(",")]
        nodes = draft.nodes_of(here, words[0])
        nodes = nodes[draft.mesh.rows_of(nodes) >= 0]
        component = int(words[1]) - 1
        if len(nodes) == 1 and int(nodes[0]) in draft.rotations:  # its components are rotations of the reference node
            nodes, component = np.array([draft.rotations[int(nodes[0])]]), component + 3
        if not 0 <= component < 6 or not nodes.size:
            draft.ledger.note("*CLOAD", "at no node, or of no component 1 to 6", line=block.line_number)
            continue
        for pilot in [node for node in nodes.tolist() if node in draft.pilots]:
            if component == 0:
                moment = forces.setdefault(draft.node_group(here, [pilot]), np.zeros(6))
                moment[3:] += float(words[2]) * draft.pilots[pilot]
            else:
                draft.ledger.note("*CLOAD", "at no node, or of no component 1 to 6", line=block.line_number)
        nodes = np.setdiff1d(nodes, list(draft.pilots))
        turned = [node for node in nodes.tolist() if node in draft.transformed]
        for node in turned:
            force = forces.setdefault(draft.node_group(here, [node]), np.zeros(6))
            first = component - component % 3
            force[first : first + 3] += float(words[2]) * draft.transformed[node][component % 3]
        nodes = np.setdiff1d(nodes, turned)
        if not nodes.size:
            continue
        group = draft.node_group(here, nodes, words[0] if len(nodes) > 1 else "")
        forces.setdefault(group, np.zeros(6))[component] += float(words[2])
    if forces:
        name = f"{step}_load{len(draft.loads) + 1}"
        draft.loads.append(Load(name, forces={group: tuple(f.tolist()) for group, f in forces.items()}))


def _pressure(draft: Draft, name: str, faces: dict[str, IntArray], words: list[str]) -> None:
    if not faces:
        draft.ledger.note("*DLOAD", f"pressure on {words[0]} {words[1]}: no solid has such a face")
        return
    group = f"{name}_faces"
    draft.face_blocks += [RawBlock(kind, rows, {group: np.arange(len(rows))}) for kind, rows in faces.items()]
    draft.loads.append(Load(name, faces=group, pressure=float(words[2])))


def _surface_faces(here: str, draft: Draft, name: str) -> dict[str, IntArray]:
    """Return the faces of a surface, by kind."""
    block = draft.surfaces.get(name.upper())
    found: dict[str, list[IntArray]] = {}
    for line in block.lines if block is not None else []:
        word, _, face = (part.strip() for part in line.partition(","))
        if face[1:2].isdigit():
            for kind, rows in faces_of(draft, draft.elements_of(here, word), int(face[1])).items():
                found.setdefault(kind, []).append(rows)
    return {kind: np.concatenate(rows) for kind, rows in found.items()}
