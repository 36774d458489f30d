"""Plain matrices of a reduced body: MATLAB, Simscape and Matrix Market files, and user elements of Abaqus."""

import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from cms.body.reduced_body import ReducedBody
from cms.errors import ExportError
from cms.exchange.exporters.writer import Request, WrittenFiles, in_ascii
from cms.reduction.interface_model import BoundaryNode, InterfaceModel, interface_model
from fe_models.foundation.arrays import MOTION_COMPONENTS, Array
from fe_models.meshes.numbering import NONE

__all__ = ["make_abaqus", "make_mat5", "make_mat73", "make_matrix_market", "make_simscape"]


# Abaqus: a superelement as a linear user element, the text form of substructures --------------------------------------


FIRST_MODE = 1000001  #: number of the node whose dof 1 is the coordinate of the first mode
#: distance between a kept node and a boundary node, relative to the body size, below which they coincide
SAME_PLACE = 1e-9
PER_LINE = 4  #: number of matrix entries per line


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
    """Return a text that names the mesh node at a boundary node: a member of its interface, if there is one."""
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
    """Yield the lines of the deck after its comments."""
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
        if k == 0 or own != components[k - 1]:  # the line applies to its node and all following nodes
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
    """Yield the entries of the upper triangle column by column, in full precision."""
    entries = matrix.T[np.tril_indices(len(matrix))].tolist()
    for first in range(0, len(entries), PER_LINE):
        yield ", ".join(f"{value:.16e}" for value in entries[first : first + PER_LINE])


# matrices -------------------------------------------------------------------------------------------------------------


# matlab ---------------------------------------------------------------------------------------------------------------
# MATLAB: matrices of a body over its interfaces in .mat files of version 5 or 7.3, and Simscape's flexible solid.


TEXT_OF_HEADER = 116  #: length of the text at the start of every .mat file [bytes]
USER_BLOCK = 512  #: length of the header block before HDF5 in version 7.3 [bytes]


def make_mat5(request: Request) -> WrittenFiles:
    """Return a file of version 5, which MATLAB, Octave and SciPy can read."""
    model = interface_model(request.body)
    return WrittenFiles({request.path: mat5(variables(model, request), request)}, notes_of(model))


def make_mat73(request: Request) -> WrittenFiles:
    """Return a file of version 7.3: HDF5 with the header and class attributes of MATLAB."""
    model = interface_model(request.body)
    return WrittenFiles({request.path: mat73(variables(model, request), request)}, notes_of(model))


def make_simscape(request: Request) -> WrittenFiles:
    """Return a file of version 5 with the structure `rom`: P, K, M, C of a Reduced Order Flexible Solid.

    P holds the origins of the interface frames as rows; their axes are the mesh axes. K, M, C have six rows (three
    translations, three rotations) for each frame in the order of P, then the modes.
    """
    model = interface_model(request.body)
    for node in model.nodes:
        if len(node.components) != 6:
            raise ExportError(
                f"export to simscape: interface {node.interface!r} has nodes without rotations, but a frame of the "
                "block has six degrees of freedom; make the interface rigid or distributing"
            )
    rom = {"P": np.array([node.position for node in model.nodes]), "K": model.K, "M": model.M, "C": model.D}
    names = {"frames": rows_of_text([node.interface for node in model.nodes]), "header": rows_of_text(request.header())}
    return WrittenFiles({request.path: mat5({"rom": rom, **names}, request)}, notes_of(model))


def variables(model: InterfaceModel, request: Request) -> dict[str, Any]:
    """Return the variables by name, as listed in docs/formats.md."""
    body = model.body
    rows = [(k + 1, c + 1) for k, node in enumerate(model.nodes) for c in node.components]
    rows += [(FIRST_MODE + k, 0) for k in range(model.n_modes)]
    values: dict[str, Any] = {
        "K": model.K,
        "M": model.M,
        "D": model.D,
        "dofs": np.array(rows, dtype=float),
        "nodes": np.array([node.position for node in model.nodes]),
        "interfaces": rows_of_text([node.interface for node in model.nodes]),
        "omega": model.omega[:, None],
        "T": model.T,
        "header": rows_of_text(request.header()),
    }
    if body.load_cases:
        values |= {"F": model.loads, "load_cases": rows_of_text([case.name for case in body.load_cases])}
    if len(body.nodes):
        n = len(model.K)
        values |= {"R": model.recovery().reshape(-1, n), "R_nodes": model.mesh_positions()}
        numbers = body.numbering.nodes if body.numbering.nodes.size else body.node_ids + 1
        values["R_numbers"] = np.asarray(numbers, dtype=float)[:, None]
    if len(body.surface):
        values["R_triangles"] = np.asarray(body.surface, dtype=float) + 1
    return {name: value for name, value in values.items() if np.size(value)}


def notes_of(model: InterfaceModel) -> tuple[str, ...]:
    """Return the description of the matrix rows."""
    found = [
        f"interface {node.interface}: rows {node.first + 1} to {node.first + len(node.components)}"
        for node in model.nodes
    ]
    if model.n_modes:
        found.append(f"fixed-interface modes: rows {model.n_boundary + 1} to {len(model.K)}")
    return tuple(found)


def rows_of_text(lines: Any) -> np.ndarray:
    """Return strings as a column of equal length, as MATLAB stores them."""
    ascii_lines = [in_ascii(line) for line in lines]
    width = max([len(line) for line in ascii_lines], default=1) or 1
    return np.array([line.ljust(width) for line in ascii_lines])


def mat5(values: Mapping[str, Any], request: Request) -> bytes:
    """Return the file; its header has no date, so that equal bodies give identical files."""
    from scipy.io import savemat

    image = io.BytesIO()
    savemat(image, dict(values), format="5", oned_as="column")
    return header_words("5.0", request) + image.getvalue()[TEXT_OF_HEADER:]


def mat73(values: Mapping[str, Any], request: Request) -> bytes:
    """Return the file: arrays with reversed indices and the attribute MATLAB_class; text as numbers."""
    import h5py

    image = io.BytesIO()
    with h5py.File(image, "w", userblock_size=USER_BLOCK, libver=("earliest", "v108")) as file:
        for name, value in values.items():
            array = np.asarray(value)
            is_text = array.dtype.kind == "U"
            stored = letters(array) if is_text else np.asarray(array, dtype="<f8")
            item = file.create_dataset(name, data=stored.T, track_times=False)
            item.attrs.create("MATLAB_class", np.bytes_(b"char" if is_text else b"double"))
            if is_text:
                item.attrs.create("MATLAB_int_decode", np.int32(2))
    # text, no subsystem data, version 2.0 of the container, byte order
    head = header_words("7.3", request) + bytes(8) + (0x0200).to_bytes(2, "little") + b"IM"
    return head.ljust(USER_BLOCK, b"\0") + image.getvalue()[USER_BLOCK:]


def letters(text: np.ndarray) -> Array:
    """Return rows of text as UTF-16 code units, (n_rows, width)."""
    return np.array([[ord(letter) for letter in row] for row in text.tolist()], dtype="<u2")


def header_words(version: str, request: Request) -> bytes:
    """Return the header text of a file."""
    words = f"MATLAB {version} MAT-file, {'; '.join(request.header()[:3])}"
    return words.encode("ascii")[:TEXT_OF_HEADER].ljust(TEXT_OF_HEADER)


# matrix Market: stiffness, mass and damping of a body over its interfaces, one text file for each matrix --------------


def make_matrix_market(request: Request) -> WrittenFiles:
    """Return FILE_K.mtx, FILE_M.mtx, FILE_C.mtx and, if there are load cases, FILE_F.mtx; comments name the rows."""
    model = interface_model(request.body)
    names = [f"{node.interface} {MOTION_COMPONENTS[c]}" for node in model.nodes for c in node.components]
    names += [f"fixed-interface mode {k + 1}" for k in range(model.n_modes)]
    comment = "\n".join([*request.header(), *(f"row {row + 1}: {in_ascii(name)}" for row, name in enumerate(names))])
    files: dict[Path, bytes] = {}
    for letter, matrix in {"K": model.K, "M": model.M, "C": model.D, "F": model.loads}.items():
        if matrix.shape[1]:
            path = request.path.with_name(f"{request.path.stem}_{letter}.mtx")
            files[path] = text_of(matrix, comment, "general" if letter == "F" else "symmetric")
    cases = enumerate(model.body.load_cases)
    return WrittenFiles(files, tuple(f"load case {case.name}: column {k + 1} of F" for k, case in cases))


def text_of(matrix: Array, comment: str, symmetry: str) -> bytes:
    """Return a matrix as text in coordinate format, in full precision."""
    from scipy.io import mmwrite

    image = io.BytesIO()
    mmwrite(image, sp.coo_array(matrix), comment=comment, field="real", precision=17, symmetry=symmetry)
    return image.getvalue()
