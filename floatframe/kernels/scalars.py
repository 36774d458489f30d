"""Products of vectors given as three numbers each, for the kernels that are not yet written with vectors."""

from floatframe.kernels.compiler.compilation import inner

__all__ = ["cross", "rotate", "rotate_back"]


@inner
def cross(a0, a1, a2, b0, b1, b2):
    """Return a × b as three numbers."""
    return a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0


@inner
def rotate(R, x0, x1, x2):
    """Return R x as three numbers."""
    return (
        R[0, 0] * x0 + R[0, 1] * x1 + R[0, 2] * x2,
        R[1, 0] * x0 + R[1, 1] * x1 + R[1, 2] * x2,
        R[2, 0] * x0 + R[2, 1] * x1 + R[2, 2] * x2,
    )


@inner
def rotate_back(R, x0, x1, x2):
    """Return Rᵀ x as three numbers."""
    return (
        R[0, 0] * x0 + R[1, 0] * x1 + R[2, 0] * x2,
        R[0, 1] * x0 + R[1, 1] * x1 + R[2, 1] * x2,
        R[0, 2] * x0 + R[1, 2] * x1 + R[2, 2] * x2,
    )
