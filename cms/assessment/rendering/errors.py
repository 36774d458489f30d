"""Errors of rendering."""

from cms.errors import CmsError

__all__ = ["RenderError", "SceneError"]


class SceneError(CmsError, ValueError):
    """A scene cannot be drawn: shapes do not fit, it is empty, or the file suffix is unknown."""


class RenderError(CmsError, RuntimeError):
    """A picture or film could not be written."""
