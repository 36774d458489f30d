"""File .sub of ANSYS: a superelement from substructuring or component mode synthesis."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from fe_models.errors import MatrixError
from fe_models.files.ansys.records import AnsysFile
from fe_models.foundation.arrays import SYMMETRY_DEFECT, Array, IntArray

__all__ = ["SCALAR", "AnsysSuperelement", "read_sub"]

SCALAR = -1  #: component number of a modal coordinate
SUB = 8  #: kind of a .sub file
ROWS, LABELS, NODES, N_TRANSFORMED, N_MODES = 1, 4, 8, 20, 43  #: positions of words in the header
UNSYMMETRIC, HAS_STIFFNESS, HAS_MASS, HAS_DAMPING, HAS_STRESS_STIFFNESS, N_LOADS = 9, 10, 11, 12, 13, 14
#: positions of pointers in the header
LOADS, MATRICES, MASS_AT, LABELS_AT, DOFS, NUMBERS, POSITIONS = 19, 21, 26, 30, 31, 34, 35
MASS_TOLERANCE = 1e-6  #: relative difference between the mass in the header and the mass of the matrix


@dataclass(frozen=True, eq=False)
class AnsysSuperelement:
    """Content of a .sub file in its units; matrices are in nodal coordinate systems."""

    where: str
    K: Array  #: stiffness, (n_dof, n_dof)
    M: Array | None  #: mass, (n_dof, n_dof)
    D: Array | None  #: damping, (n_dof, n_dof)
    dofs: (
        IntArray  #: (node number, component 0-5, or `SCALAR` with the modal coordinate from 1) of each row, (n_dof, 2)
    )
    positions: Mapping[int, Array]  #: position of each node, (3,), by node number
    #: axes of the dofs of a node as columns, (3, 3), by node number; other nodes: global axes
    systems: Mapping[int, Array]
    loads: Array  #: load vectors, (n_dof, n_loads)
    mass: float | None  #: mass of the whole part as stated in the file; None: unknown


def read_sub(path: str | Path) -> AnsysSuperelement:
    """Read a superelement of ANSYS.

    (1) header at word 103: sizes, and word pointers of the records
    (2) rows: dof numbers (node - 1) n_labels + label; the last rows are modal coordinates, whose dofs belong to
        additional nodes with far higher numbers than the nodes of the mesh
    (3) full matrices row by row: stiffness, mass, damping; load vectors
    (4) check that the mass stated in the file is the mass of its matrix

    Raises
    ------
    MatrixError
        If the file is truncated, damaged or unsymmetric, or has a stress stiffness or rotated copies; also if its rows
        do not belong to its nodes, or the mass that it states is not the mass of its matrix.
    """
    path = Path(path)
    file = AnsysFile(f"SUB file {path}", path, (SUB,))  # (1)
    where, header = file.where, file.header
    if len(header) <= N_MODES:
        raise MatrixError(f"{where}: expected a header of {N_MODES + 1} words, got {len(header)}")
    n, n_nodes, n_modes = (int(header[k]) for k in (ROWS, NODES, N_MODES))
    if not (0 < n <= file.n_words and 0 < n_nodes <= file.n_words and 0 <= n_modes < n):
        raise MatrixError(
            f"{where}: {n} rows, {n_nodes} nodes, {n_modes} modes do not fit a file of {4 * file.n_words} bytes"
        )
    if 2 * n * n > file.n_words:
        raise MatrixError(
            f"{where}: matrices of {n} rows do not fit a file of {4 * file.n_words} bytes: it is truncated"
        )
    for word, what in (
        (UNSYMMETRIC, "unsymmetric"),
        (HAS_STRESS_STIFFNESS, "with a stress stiffness"),
        (N_TRANSFORMED, "transformed"),
    ):
        if header[word]:
            raise MatrixError(f"{where}: the superelement is {what}, which is not read here; write it without")
    if not header[HAS_STIFFNESS]:
        raise MatrixError(f"{where}: expected a stiffness, got none")
    numbers = file.integers(int(header[NUMBERS]), "node numbers", n_nodes)  # (2)
    dofs, carriers = _rows(file, n, n_modes, numbers)
    positions, systems = _places(file, numbers, carriers)
    kinds = [k for k in (HAS_STIFFNESS, HAS_MASS, HAS_DAMPING) if header[k]]  # (3)
    matrices = {kind: np.zeros((n, n)) for kind in kinds}
    at = int(header[MATRICES])
    for row in range(n):
        for kind in kinds:
            here = f"row {row + 1} of the matrices"
            matrices[kind][row] = file.reals(at, here, n)
            at = file.record(at, here, 0)[1]
    loads = np.zeros((n, int(header[N_LOADS]) if 0 <= header[N_LOADS] <= file.n_words // n else 0))
    at = int(header[LOADS])
    for k in range(loads.shape[1]):
        loads[:, k] = file.reals(at, f"load {k + 1}", n)
        at = file.record(at, f"load {k + 1}", 0)[1]
    M = matrices.get(HAS_MASS)
    mass = float(file.reals(int(header[MASS_AT]), "mass and centre")[0]) if header[MASS_AT] > 0 else None
    if mass and M is not None:
        _require_mass(where, M, dofs, mass)  # (4)
    for kind, matrix in matrices.items():
        defect = np.abs(matrix - matrix.T).max()
        if not defect <= SYMMETRY_DEFECT * np.abs(matrix).max():
            name = {HAS_STIFFNESS: "stiffness", HAS_MASS: "mass", HAS_DAMPING: "damping"}[kind]
            raise MatrixError(
                f"{where}: expected a symmetric {name}, got |A - A.T| = {defect:.1e} beside a largest entry of "
                f"{np.abs(matrix).max():.1e}: the file is damaged"
            )
    return AnsysSuperelement(
        where, matrices[HAS_STIFFNESS], M, matrices.get(HAS_DAMPING), dofs, positions, systems, loads, mass or None
    )


def _rows(file: AnsysFile, n: int, n_modes: int, numbers: IntArray) -> tuple[IntArray, IntArray]:
    """Return the dofs of the rows, and the nodes in the list that represent modal coordinates."""
    header = file.header
    labels = file.integers(int(header[LABELS_AT]), "labels of dofs", int(header[LABELS]))
    if not len(labels) or labels.min() < 1 or labels.max() > 6:
        raise MatrixError(
            f"{file.where}: expected displacements and rotations (labels 1 to 6), got {labels.tolist()}: other dofs "
            "are no part of a body"
        )
    listed = file.integers(int(header[DOFS]), "dofs of the rows", n) - 1
    if listed.min() < 0:
        raise MatrixError(f"{file.where}: a row has the dof {listed.min() + 1}; expected numbers from 1: it is damaged")
    dofs = np.stack([listed // len(labels) + 1, labels[listed % len(labels)] - 1], axis=1)
    physical = dofs[: n - n_modes]
    unknown = np.setdiff1d(physical[:, 0], numbers)
    carriers = np.setdiff1d(numbers, physical[:, 0])
    shared = np.intersect1d(dofs[n - n_modes :, 0], physical[:, 0])
    if len(unknown) or len(shared) or len(carriers) != len(np.unique(dofs[n - n_modes :, 0])):
        raise MatrixError(
            f"{file.where}: {len(unknown)} nodes of rows are not in its list of nodes, {len(carriers)} of the list "
            f"have no rows, and {n_modes} rows are modal: they cannot be brought together; compress the node numbers "
            "(NUMCMP,NODE) before the superelement is generated"
        )
    if len(np.unique(physical, axis=0)) < len(physical):
        raise MatrixError(f"{file.where}: two rows are the same dof: the file is damaged")
    dofs[n - n_modes :] = np.stack([np.arange(1, n_modes + 1), np.full(n_modes, SCALAR)], axis=1)
    return dofs, carriers


def _places(file: AnsysFile, numbers: IntArray, carriers: IntArray) -> tuple[dict[int, Array], dict[int, Array]]:
    """Return positions and nodal systems; angles turn about z, then the new x, then the new y [degrees]."""
    positions, systems = {}, {}
    at = int(file.header[POSITIONS])
    for number in numbers.tolist():
        here = f"position of node {number}"
        values = file.reals(at, here, 6)
        at = file.record(at, here, 0)[1]
        if number in carriers:
            continue
        positions[number] = values[:3].copy()
        if values[3:].any():
            systems[number] = Rotation.from_euler("ZXY", values[3:], degrees=True).as_matrix()
    return positions, systems


def _require_mass(where: str, M: Array, dofs: IntArray, mass: float) -> None:
    """Raise an error if the translations of a mass matrix do not have the mass stated in the file."""
    e = np.zeros((len(M), 3))
    for k in range(3):
        e[dofs[:, 1] == k, k] = 1.0
    found = float(np.trace(e.T @ M @ e)) / 3
    if abs(found - mass) > MASS_TOLERANCE * mass:
        raise MatrixError(
            f"{where}: says a mass of {mass:.6g}, its matrix has {found:.6g}; the rows are not understood, or the "
            "file is damaged"
        )
