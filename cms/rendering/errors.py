"""Errors of the rendering."""

from cms.errors import CmsError

__all__ = ["RenderError", "SceneError"]


class SceneError(CmsError, ValueError):
    """A scene is not drawable: shapes that do not fit, nothing to see, an unknown file ending."""


class RenderError(CmsError, RuntimeError):
    """A picture or film could not be written."""
