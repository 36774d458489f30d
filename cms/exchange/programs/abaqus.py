"""Abaqus: a superelement as a linear user element, the text form of substructures."""

from collections.abc import Iterator

import numpy as np

from cms.body.reduced_body import ReducedBody
from cms.exchange.exporters.writer import Request, WrittenFiles
from cms.reduction.interface_model import BoundaryNode, InterfaceModel, interface_model
from fe_models.foundation.arrays import Array
from fe_models.meshes.numbering import NONE

__all__ = ["make_abaqus"]


FIRST_MODE = 1000001  #: number of the node whose dof 1 is the first mode
#: distance between a kept node and a boundary node, relative to the body size, below which they coincide
SAME_PLACE = 1e-9
PER_LINE = 4  #: matrix entries per line


def make_abaqus(request: Request) -> WrittenFiles:
    """Return a deck to include: nodes, `*USER ELEMENT, LINEAR` with its dofs and matrices, and a single element.

    Each mode is dof 1 of its own node, placed at the origin. Matrices list column j from row 1 to the diagonal.
    """
    model = interface_model(request.body)
    notes = [
        f"interface {node.interface}: node {k + 1}{in_mesh(request.body, node)}" for k, node in enumerate(model.nodes)
    ]
    told = (f"** {note.encode('ascii', 'replace').decode()}" for note in notes)
    lines = [*(f"** {line}" for line in request.header()), *told, *lines_of(model)]
    if model.n_modes:
        notes.append(f"modes: dof 1 of nodes {FIRST_MODE} to {FIRST_MODE + model.n_modes - 1}")
    return WrittenFiles({request.path: ("\n".join(lines) + "\n").encode("ascii")}, tuple(notes))


def in_mesh(body: ReducedBody, node: BoundaryNode) -> str:
    """Return text with the node of the user's mesh at a boundary node: a member of its interface, if there is one."""
    interface = next(each for each in body.interfaces if each.name == node.interface)
    place = body.frame.axes.T @ (node.position - body.frame.origin)
    members = interface.members
    if not body.numbering.nodes.size or not len(members):
        return ""
    away = np.linalg.norm(body.nodes[members] - place, axis=1)
    row, size = int(members[away.argmin()]), float(np.linalg.norm(np.ptp(body.nodes, axis=0)))
    is_there = float(away.min()) <= SAME_PLACE * size and body.numbering.nodes[row] != NONE
    return f", {body.node_name(row)} of the mesh" if is_there else ""


def lines_of(model: InterfaceModel) -> Iterator[str]:
    """Yield the deck after its comments."""
    numbers = [k + 1 for k in range(len(model.nodes))] + [FIRST_MODE + k for k in range(model.n_modes)]
    components = [[int(c) + 1 for c in node.components] for node in model.nodes] + [[1]] * model.n_modes
    places = [node.position for node in model.nodes] + [np.zeros(3)] * model.n_modes
    yield "*NODE"
    for number, place in zip(numbers, places, strict=True):
        yield f"{number}, " + ", ".join(f"{x:.16e}" for x in place)
    yield f"*USER ELEMENT, TYPE=U1, NODES={len(numbers)}, LINEAR"
    yield "** ELEMENT NODES"
    for first in range(0, len(numbers), 10):
        yield "** " + ", ".join(str(number) for number in numbers[first : first + 10])
    for k, own in enumerate(components):
        if k == 0 or own != components[k - 1]:  # a line holds for its node and all following nodes
            yield ", ".join(str(word) for word in (own if k == 0 else [k + 1, *own]))
    for kind, matrix in {"STIFFNESS": model.K, "MASS": model.M, "VISCOUS DAMPING": model.D}.items():
        if np.any(matrix):
            yield f"*MATRIX, TYPE={kind}"
            yield from triangle(matrix)
    yield "*ELEMENT, TYPE=U1, ELSET=BODY"
    words = [str(word) for word in (1, *numbers)]
    for first in range(0, len(words), 16):
        yield ", ".join(words[first : first + 16]) + ("," if first + 16 < len(words) else "")
    yield "*UEL PROPERTY, ELSET=BODY"


def triangle(matrix: Array) -> Iterator[str]:
    """Yield the upper triangle column by column, in full precision."""
    entries = matrix.T[np.tril_indices(len(matrix))].tolist()
    for first in range(0, len(entries), PER_LINE):
        yield ", ".join(f"{value:.16e}" for value in entries[first : first + PER_LINE])
