"""Errors of the quality checks."""

from cms.errors import CmsError

__all__ = ["QualityError"]


class QualityError(CmsError, ValueError):
    """A quality check was requested for a missing full model, interface or band."""
