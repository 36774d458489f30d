"""File .full of ANSYS: upper triangles of assembled stiffness, mass and damping."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe_models.errors import MatrixError
from fe_models.files.ansys.records import INTEGERS, REALS, AnsysFile
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["AnsysMatrices", "read_full"]

FULL = -4  #: kind of a file with symbolic assembly
COMPONENTS = 6  #: number of component labels: UX UY UZ ROTX ROTY ROTZ
EQUATIONS, LUMPED, UNSYMMETRIC, N_EQUATIONS_CE, N_NODES = 1, 10, 13, 20, 32  #: positions of words in the header
#: positions of pointers in the header
STIFFNESS, MASS, DAMPING, DOFS, SCALES = (18, 19), (26, 27), (28, 29), (35, 36), (59, 60)


@dataclass(frozen=True, eq=False)
class AnsysMatrices:
    """Content of a .full file without constrained rows, because the file lacks their stiffness."""

    where: str
    K: sp.csc_array  #: stiffness, (n_dof, n_dof), both triangles, in nodal coordinate systems
    M: sp.csc_array | None  #: mass, (n_dof, n_dof)
    D: sp.csc_array | None  #: damping, (n_dof, n_dof)
    dofs: IntArray  #: (node number, component 0-5) of each row, (n_dof, 2)
    removed: IntArray  #: (node number, component) of the constrained rows, (n_removed, 2)


def read_full(path: str | Path) -> AnsysMatrices:
    """Read a .full file.

    (1) header: sizes and pointers; nodes, labels of dofs, dofs of each node, and which of them are constrained
    (2) each matrix: for every row a record of columns, from 1, and one of values; upper triangle
    (3) constrained rows have only a one on the diagonal of K: they are removed

    Raises
    ------
    MatrixError
        If the file is truncated, damaged, unsymmetric or scaled, or has constraint equations, which are not part of
        its matrices; also if it has dofs other than displacements and rotations, or no stiffness.
    """
    path = Path(path)
    file = AnsysFile(f"FULL file {path}", path, (FULL,))
    where, header = file.where, file.header  # (1)
    if len(header) <= max(SCALES):
        raise MatrixError(f"{where}: expected a header of {max(SCALES) + 1} words, got {len(header)}")
    n, n_nodes = int(header[EQUATIONS]), int(header[N_NODES])
    if not 0 < n_nodes <= n <= file.n_words:
        raise MatrixError(f"{where}: {n} equations, {n_nodes} nodes do not fit a file of {4 * file.n_words} bytes")
    if header[UNSYMMETRIC]:
        raise MatrixError(f"{where}: the matrices are unsymmetric; a body needs symmetric ones")
    if header[N_EQUATIONS_CE]:
        raise MatrixError(
            f"{where}: has {header[N_EQUATIONS_CE]} constraint equations (CE, CP, RBE3, contact), which are separate "
            "from the matrices; expected a model without them: define couplings here, as interfaces"
        )
    _, behind = file.record(103, "the header", INTEGERS)
    _, behind = file.record(behind, "labels of dofs", INTEGERS)
    nodes = file.integers(behind, "nodes", n_nodes)
    at = file.pointer(*DOFS)
    dofs_of_node = file.integers(at, "dofs of each node", n_nodes)
    _, behind = file.record(at, "dofs of each node", INTEGERS)
    signed = file.integers(behind, "dofs", n)
    if dofs_of_node.min() < 0 or dofs_of_node.sum() != n:
        raise MatrixError(f"{where}: the dofs of the nodes are {dofs_of_node.sum()}, the equations {n}: it is damaged")
    component = np.abs(signed)
    if component.min() < 1 or component.max() > COMPONENTS:
        raise MatrixError(
            f"{where}: expected displacements and rotations (labels 1 to 6), got a dof with the label "
            f"{component.max()}: temperatures, pressures and voltages are no part of a body"
        )
    dofs = np.stack([np.repeat(nodes, dofs_of_node), component - 1], axis=1)
    if (scales := file.pointer(*SCALES)) and not (file.reals(scales, "scales", n) == 1).all():
        raise MatrixError(f"{where}: the equations are scaled; expected a file of an analysis without scaling")
    is_free = signed > 0
    K = _matrix(file, "stiffness", STIFFNESS, n)  # (2)
    if K is None:
        raise MatrixError(f"{where}: expected a stiffness, got none; write the file in a modal analysis (WRFULL)")
    matrices = (K, _mass(file, n), _matrix(file, "damping", DAMPING, n))
    free = np.flatnonzero(is_free)
    if not len(free):
        raise MatrixError(f"{where}: every dof is held; expected a body that can move")
    kept = [None if matrix is None else sp.csc_array(matrix[free][:, free]) for matrix in matrices]  # (3)
    assert kept[0] is not None
    return AnsysMatrices(where, kept[0], kept[1], kept[2], dofs[free], dofs[~is_free])


def _mass(file: AnsysFile, n: int) -> sp.csc_array | None:
    """Return the mass matrix, or the diagonal matrix of a single record if the mass is lumped."""
    if not file.header[LUMPED]:
        return _matrix(file, "mass", MASS, n)
    raise MatrixError(
        f"{file.where}: the mass is lumped, and its layout was never tried here; expected a consistent one (LUMPM,OFF)"
    )


def _matrix(file: AnsysFile, what: str, pointer: tuple[int, int], n: int) -> sp.csc_array | None:
    """Return a full matrix from its upper triangle; None if the file does not contain it."""
    at = file.pointer(*pointer)
    if not at:
        return None
    counts = np.zeros(n, dtype=np.int64)
    columns, values = [], []
    for row in range(n):
        here = f"{what}, row {row + 1}"
        index, at = file.record(at, here, INTEGERS)
        data, at = file.record(at, here, REALS)
        if 2 * len(index) != len(data):
            raise MatrixError(f"{file.where}: {here}: {len(index)} columns and {len(data) / 2:g} values: it is damaged")
        counts[row] = len(index)
        columns.append(index)
        values.append(data)
    column: IntArray = np.concatenate(columns).astype(np.int64) - 1
    value: Array = AnsysFile.doubles(np.concatenate(values))
    row_of = np.repeat(np.arange(n), counts)
    if len(column) and not (column.min() >= 0 and column.max() < n and (column >= row_of).all()):
        raise MatrixError(f"{file.where}: {what}: expected columns of the upper triangle up to {n}: damaged")
    upper = sp.csc_array(sp.coo_array((value, (row_of, column)), shape=(n, n)))
    if upper.nnz < len(value):
        raise MatrixError(f"{file.where}: {what}: lists an entry twice: the file is damaged")
    return sp.csc_array(upper + upper.T - sp.diags_array(upper.diagonal()))
