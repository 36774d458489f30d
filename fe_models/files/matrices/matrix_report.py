"""What was read of matrices, for the user: files, rows, which triangle, what was assumed."""

from dataclasses import dataclass

import numpy as np

from fe_models.files.matrices.foreign_matrices import ROLES, ForeignMatrices

__all__ = ["MatrixReport"]


@dataclass(frozen=True, eq=False)
class MatrixReport:
    """Numbers and notes of matrices that were read, shown before they are judged."""

    read: ForeignMatrices

    @property
    def title(self) -> str:
        """Head of the table."""
        return "Matrices"

    def rows(self) -> list[tuple[str, str]]:
        """Return (what, value) of a table."""
        read = self.read
        rows = [("files", ", ".join(path.rpartition("/")[2] for path in read.files))]
        rows += [("program", read.program)] if read.program else []
        nodes = "" if read.dofs is None else f" of {len(np.unique(read.dofs[:, 0]))} nodes"
        rows.append(("rows", f"{read.n_dof}{nodes}"))
        for role in ROLES:
            if (matrix := getattr(read, role)) is not None:
                rows.append((role, f"{matrix.nnz} entries, stored: {read.triangle.get(role, 'both')}"))
        rows += [("load", name) for name in read.loads]
        return rows + [("note", note) for note in read.notes]
