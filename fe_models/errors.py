"""Errors of this package: one root class, and leaves that also derive from `ValueError` or `RuntimeError`."""

from fe_models.foundation.errors import ArgumentError, BodyError, FeModelsError, TableError, UnitsError

__all__ = [
    "ArgumentError",
    "BeamError",
    "BodyError",
    "FeModelsError",
    "InterfaceError",
    "LoadError",
    "MaterialError",
    "MatrixError",
    "MeshError",
    "MeshingError",
    "SectionError",
    "ShellError",
    "TableError",
    "UnitsError",
]


class MeshError(FeModelsError, ValueError):
    """A mesh cannot be read without guessing, or cannot serve as a finite element model."""


class MatrixError(FeModelsError, ValueError):
    """The matrices of another program cannot be read without guessing, or do not make a body."""


class MeshingError(FeModelsError, RuntimeError):
    """The mesher is missing or cannot be loaded."""


class MaterialError(FeModelsError, ValueError):
    """A material is impossible, or cells have no material or two materials."""


class SectionError(FeModelsError, ValueError):
    """The cross-section of a beam is impossible, or lines have no section or two sections."""


class BeamError(FeModelsError, ValueError):
    """A beam model is impossible: a line has no length or direction, a node follows two nodes, or a node is unknown."""


class ShellError(FeModelsError, ValueError):
    """A shell model is impossible: a cell has no thickness or area or is warped too much, or a node is unknown."""


class InterfaceError(BodyError):
    """An interface selects no nodes, too few nodes, or nodes of another interface."""


class LoadError(FeModelsError, ValueError):
    """A load case is impossible on this body: the node, its dof or the loaded face does not exist."""
