"""Errors of test and model correlation."""

from cms.errors import CmsError

__all__ = ["CorrelationError"]


class CorrelationError(CmsError):
    """Measured modes are damaged, do not match points of the model, or do not determine the requested result."""
