"""Errors of the parametric parts."""

from fe_models.errors import FeModelsError

__all__ = ["PartError"]


class PartError(FeModelsError, ValueError):
    """The dimensions of a part are inconsistent."""
