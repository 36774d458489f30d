"""Errors of the parametric parts."""

from fe_models.errors import FeModelsError, MeshError, MeshingError

__all__ = ["MeshError", "MeshingError", "PartError"]


class PartError(FeModelsError, ValueError):
    """The dimensions of a part do not fit together."""
