"""A skin for beams without a mesh: an elliptic tube with the radii of gyration of the sections."""

import numpy as np

from fe_models.body.beam_line import BeamLine
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["tube"]

N_RINGS, N_CORNERS = 21, 8
THINNEST = 5e-3  #: radius of the skin relative to the length, for a beam without rotary inertia


def tube(line: BeamLine) -> tuple[Array, Array, IntArray]:
    """Return positions x, offsets (y, z) and triangles of an elliptic tube with the sections' radii of gyration."""
    x = np.linspace(0.0, line.length, N_RINGS)
    mass = line.at("rho_A", x)
    # semi-axes of an ellipse: 2 sqrt(I/A)
    y, z = (2 * np.sqrt(line.at(name, x) / mass) for name in ("rho_Iz", "rho_Iy"))
    angle = 2 * np.pi * np.arange(N_CORNERS) / N_CORNERS
    least = THINNEST * line.length
    ring = np.stack([np.maximum(y, least)[:, None] * np.cos(angle), np.maximum(z, least)[:, None] * np.sin(angle)], 2)
    corner = np.arange(N_CORNERS)
    after = (corner + 1) % N_CORNERS
    strip = np.concatenate([
        np.stack([corner, after, corner + N_CORNERS], 1), np.stack([after, after + N_CORNERS, corner + N_CORNERS], 1)
    ])  # fmt: skip
    cap = np.stack([np.zeros(N_CORNERS - 2, np.int64), corner[1:-1], corner[2:]], 1)
    last = N_CORNERS * (N_RINGS - 1)
    triangles = np.concatenate([*(strip + N_CORNERS * k for k in range(N_RINGS - 1)), cap[:, ::-1], cap + last])
    return np.repeat(x, N_CORNERS), ring.reshape(-1, 2), triangles
