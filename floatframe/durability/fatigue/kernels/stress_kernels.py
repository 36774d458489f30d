"""Compiled functions: signed scalars of histories of stress tensors.

The components are xx yy zz yz xz xy. Loops over time have no branches, so that they become vector instructions.
"""

import numpy as np

from fe_models.foundation.kernels.jit import jit

__all__ = ["largest_principal", "plane_principal", "plane_von_mises", "signed_von_mises"]


@jit
def signed_von_mises(stress, out):
    """Von Mises stress with the sign of the principal stress of largest absolute value, (n, 6, n_t) -> (n, n_t).

    This is the sign of s_1 + s_3, the middle one of s_1 + s_2 >= s_1 + s_3 >= s_2 + s_3, which are the roots of x³ - e1
    x² + e2 x - e3 with e1 = 2 I1, e2 = I1² + I2, e3 = I1 I2 - I3. All roots are real, so that by Descartes' rule the
    middle one is not negative if e3 >= 0 and e1, e2 > 0, or e3 < 0 and not (e1 < 0 and e2 > 0).
    """
    for n in range(stress.shape[0]):
        for t in range(stress.shape[2]):
            xx, yy, zz = stress[n, 0, t], stress[n, 1, t], stress[n, 2, t]
            yz, xz, xy = stress[n, 3, t], stress[n, 4, t], stress[n, 5, t]
            I1 = xx + yy + zz
            I2 = xx * yy + yy * zz + zz * xx - (yz * yz + xz * xz + xy * xy)
            I3 = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
            e2, e3 = I1 * I1 + I2, I1 * I2 - I3
            is_positive = (I1 > 0.0) & (e2 > 0.0) if e3 >= 0.0 else (I1 >= 0.0) | (e2 <= 0.0)
            shear = 3.0 * (yz * yz + xz * xz + xy * xy)
            d1, d2, d3 = xx - yy, yy - zz, zz - xx
            size = np.sqrt(0.5 * (d1 * d1 + d2 * d2 + d3 * d3) + shear)
            out[n, t] = size if is_positive else -size


@jit
def largest_principal(stress, out):
    """The principal stress of largest absolute value, (n, 6, n_t) -> (n, n_t).

    It is p + 2 r cos(phi) or p + 2 r cos(phi + 2 pi/3), with p = I1/3, r² = s:s/6, cos 3 phi = det s / (2 r³) and the
    deviator s.
    """
    for n in range(stress.shape[0]):
        for t in range(stress.shape[2]):
            yz, xz, xy = stress[n, 3, t], stress[n, 4, t], stress[n, 5, t]
            p = (stress[n, 0, t] + stress[n, 1, t] + stress[n, 2, t]) / 3.0
            a, b, c = stress[n, 0, t] - p, stress[n, 1, t] - p, stress[n, 2, t] - p
            r = np.sqrt((a * a + b * b + c * c + 2.0 * (yz * yz + xz * xz + xy * xy)) / 6.0)
            det = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)
            x = det / (2.0 * r * r * r) if r > 0.0 else 1.0
            phi = np.arccos(min(max(x, -1.0), 1.0)) / 3.0
            high, low = p + 2.0 * r * np.cos(phi), p + 2.0 * r * np.cos(phi + 2.0943951023931953)
            out[n, t] = high if high >= -low else low


@jit
def plane_von_mises(stress, out):
    """Signed von Mises stress of stress in a plane, components xx yy xy, (n, 3, n_t) -> (n, n_t)."""
    for n in range(stress.shape[0]):
        for t in range(stress.shape[2]):
            xx, yy, xy = stress[n, 0, t], stress[n, 1, t], stress[n, 2, t]
            size = np.sqrt(xx * xx + yy * yy - xx * yy + 3.0 * xy * xy)
            out[n, t] = size if xx + yy >= 0.0 else -size


@jit
def plane_principal(stress, out):
    """The principal stress of largest absolute value in plane stress, components xx yy xy, (n, 3, n_t) -> (n, n_t)."""
    for n in range(stress.shape[0]):
        for t in range(stress.shape[2]):
            xx, yy, xy = stress[n, 0, t], stress[n, 1, t], stress[n, 2, t]
            p, d = 0.5 * (xx + yy), 0.5 * (xx - yy)
            r = np.sqrt(d * d + xy * xy)
            out[n, t] = p + r if p >= 0.0 else p - r
