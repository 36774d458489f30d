"""Matrices of CalculiX, `*FREQUENCY, SOLVER=MATRIXSTORAGE`: .sti, .mas, and the list of dofs .dof."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fe_models.errors import MatrixError
from fe_models.files.matrices.foreign_matrices import ForeignMatrices
from fe_models.files.matrices.request import Request
from fe_models.files.matrices.text_files.triplet_text import triplet_matrix

__all__ = ["calculix_neighbours", "read_calculix_dofs", "read_calculix_matrix"]

ROLES_OF_SUFFIXES = {".sti": "K", ".mas": "M"}
WRITTEN_TOGETHER = (".sti", ".mas", ".dof")  #: by one run, under one name


def calculix_neighbours(paths: Sequence[Path]) -> list[Path]:
    """Return the files that CalculiX wrote beside the given ones: all have one name, and these stand there unnamed.

    Parameters
    ----------
    paths
        Of one model. Files of several names, or of other kinds among them, were chosen one by one: nothing is added.
    """
    names = {path.with_suffix("") for path in paths}
    given = {path.suffix.lower() for path in paths}
    if len(names) != 1 or not given <= set(WRITTEN_TOGETHER) or given == {".dof"}:
        return []
    beside = [next(iter(names)).with_suffix(suffix) for suffix in WRITTEN_TOGETHER if suffix not in given]
    return [path for path in beside if path.is_file()]


def read_calculix_matrix(path: Path, request: Request) -> ForeignMatrices:
    """Read lines `row column value` of the upper triangle, numbered from 1; the rows are those of the .dof beside it.

    Raises
    ------
    MatrixError
        If a line is something else, or an entry is listed twice.
    """
    where = f"matrices {path}"
    role = request.role_of(where, ROLES_OF_SUFFIXES.get(path.suffix.lower()))
    matrix, triangle, _ = triplet_matrix(where, role, path.read_bytes())
    return ForeignMatrices(**{role: matrix}, triangle={role: triangle}, program="CalculiX")


def read_calculix_dofs(path: Path, request: Request) -> ForeignMatrices:
    """Read lines `node.component`, one for each row, components from 1.

    Raises
    ------
    MatrixError
        If a line is something else.
    """
    where = f"matrices {path}"
    lines = path.read_text("ascii", "replace").split()
    parts = [line.partition(".") for line in lines]
    for k, (node, dot, component) in enumerate(parts):
        if not (dot and node.isdigit() and component in "123456" and len(component) == 1):
            raise MatrixError(f"{where}, line {k + 1}: expected node.component such as 12.3, got {lines[k][:40]!r}")
    dofs = np.array([(int(node), int(component) - 1) for node, _, component in parts], dtype=np.int64)
    return ForeignMatrices(dofs=dofs.reshape(-1, 2), program="CalculiX")
