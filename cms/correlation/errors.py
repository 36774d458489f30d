"""What goes wrong between test and model."""

from cms.errors import CmsError

__all__ = ["CorrelationError"]


class CorrelationError(CmsError):
    """Measured modes are damaged, have no place on the model, or do not determine what was asked."""
