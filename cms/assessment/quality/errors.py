"""Errors of the quality checks."""

from cms.errors import CmsError

__all__ = ["QualityError"]


class QualityError(CmsError, ValueError):
    """A quality check was requested for something that does not exist: a full model, an interface, a band."""
