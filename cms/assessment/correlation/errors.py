"""Errors of test and model correlation."""

from cms.errors import CmsError

__all__ = ["CorrelationError"]


class CorrelationError(CmsError):
    """Measured modes are damaged, cannot be located on the model, or do not determine the requested result."""
