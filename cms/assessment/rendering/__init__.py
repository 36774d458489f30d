"""Off-screen pictures and films of surfaces: describe a `Scene`, then call `render_picture` or `render_animation`."""

from cms.assessment.rendering.errors import RenderError, SceneError
from cms.assessment.rendering.render import Drawing, render_animation, render_picture
from cms.assessment.rendering.scene import Lines, Scene, Surface, Triad

__all__ = [
    "Drawing",
    "Lines",
    "RenderError",
    "Scene",
    "SceneError",
    "Surface",
    "Triad",
    "render_animation",
    "render_picture",
]
