"""Mass and stiffness matrices from files of other programs: a table of readers, and a record that all of them fill."""

from fe_models.files.matrices.foreign_matrices import SCALAR, ForeignMatrices
from fe_models.files.matrices.read_matrices import MATRIX_FORMATS, read_matrices

__all__ = ["MATRIX_FORMATS", "SCALAR", "ForeignMatrices", "read_matrices"]
