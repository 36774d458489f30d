"""Errors of the quality checks."""

from cms.errors import CmsError

__all__ = ["QualityError"]


class QualityError(CmsError, ValueError):
    """A quality check was asked for what is not there: a full model, an interface, a band."""
