"""The light of pictures, the same in both ways of drawing them; directions right, up and towards the eye.

Colours that mean numbers must be read alike on all sides: there more of the light comes from everywhere, and what
faces downwards is lit from below.
"""

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["GLOSS", "LIGHTS", "ambient", "brightness", "diffuse"]

#: from where, and how strong: key light, light from the side, fill light from below
LIGHTS = (
    (np.array([-0.4, 0.65, 1.0]), 0.72),
    (np.array([0.9, 0.1, 0.9]), 0.34),
    (np.array([-0.1, -1.0, 0.35]), 0.34),
)
GLOSS = {True: 0.08, False: 0.18}  #: strength of highlights, by whether colours mean numbers


def ambient(*, shows_numbers: bool) -> float:
    """Return the share of light that comes from everywhere."""
    return 0.55 if shows_numbers else 0.28


def diffuse(*, shows_numbers: bool) -> float:
    """Return the share of light that depends on the side."""
    return 0.48 if shows_numbers else 0.8


def brightness(normals: Array, *, shows_numbers: bool) -> Array:
    """Return the light on faces of these unit normals (right, up, towards the eye), (n, 3) -> (n,)."""
    total = np.zeros(len(normals))
    for towards, strength in LIGHTS:
        total += strength * np.clip(normals @ (towards / np.linalg.norm(towards)), 0, 1)
    return np.asarray(ambient(shows_numbers=shows_numbers) + diffuse(shows_numbers=shows_numbers) * total)
