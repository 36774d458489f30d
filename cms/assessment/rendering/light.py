"""The lights of pictures, common to both drawing libraries; directions are right, up and towards the eye.

Colours that represent numbers must look the same on all sides. In that case more of the light is ambient, and downward
faces are lit from below.
"""

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["GLOSS", "LIGHTS", "ambient", "brightness", "diffuse", "lit"]

#: direction and strength: key light, side light, fill light from below
LIGHTS = (
    (np.array([-0.4, 0.65, 1.0]), 0.72),
    (np.array([0.9, 0.1, 0.9]), 0.34),
    (np.array([-0.1, -1.0, 0.35]), 0.34),
)
HIGHLIGHT = np.array([-0.3, 0.5, 0.85])  #: direction of the normals of faces that reflect the key light to the eye
GLOSS = {True: 0.08, False: 0.18}  #: strength of highlights, depending on whether colours represent numbers


def ambient(*, shows_numbers: bool) -> float:
    """Return the ambient share of the light."""
    return 0.55 if shows_numbers else 0.28


def diffuse(*, shows_numbers: bool) -> float:
    """Return the directional share of the light."""
    return 0.48 if shows_numbers else 0.8


def brightness(normals: Array, *, shows_numbers: bool) -> Array:
    """Return the brightness of faces, (n,), from their unit normals (right, up, towards the eye), (n, 3)."""
    total = np.zeros(len(normals))
    for towards, strength in LIGHTS:
        total += strength * np.maximum(normals @ (towards / np.linalg.norm(towards)), 0)
    return np.asarray(ambient(shows_numbers=shows_numbers) + diffuse(shows_numbers=shows_numbers) * total)


def lit(colors: Array, normals: Array, *, shows_numbers: bool) -> Array:
    """Return the colours of faces with lighting, (n, 3), from those without, (n, 3) or (3,), and normals, (n, 3)."""
    facing = np.maximum(normals @ (HIGHLIGHT / np.linalg.norm(HIGHLIGHT)), 0)
    eighth = ((facing**2) ** 2) ** 2
    gloss = GLOSS[shows_numbers] * eighth**3
    return np.clip(colors * brightness(normals, shows_numbers=shows_numbers)[:, None] + gloss[:, None], 0, 1)
