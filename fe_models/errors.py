"""Errors of this package: one root, leaves that are also the built-in kind a caller would expect."""

from fe_models.foundation.errors import BodyError, FeModelsError, UnitsError

__all__ = [
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
    "UnitsError",
]


class MeshError(FeModelsError, ValueError):
    """A mesh cannot be read truthfully, or is not fit for a finite element model."""


class MatrixError(FeModelsError, ValueError):
    """Matrices of another program cannot be read truthfully, or lack what a body needs."""


class MeshingError(FeModelsError, RuntimeError):
    """The mesher is missing or cannot be loaded."""


class MaterialError(FeModelsError, ValueError):
    """A material is impossible, or cells have none or two."""


class SectionError(FeModelsError, ValueError):
    """A cross-section of a beam is impossible, or lines have none or two."""


class BeamError(FeModelsError, ValueError):
    """A beam model is impossible: a line without length or direction, a follower of two nodes, an unknown node."""


class ShellError(FeModelsError, ValueError):
    """A shell model is impossible: cells without thickness or area, warped beyond the limit, an unknown node."""


class InterfaceError(FeModelsError, ValueError):
    """An interface selects nothing, too little, or what another interface has."""


class LoadError(FeModelsError, ValueError):
    """A load case is impossible on this body: no such node, no dof to carry it, no face to press on."""
