"""Spatial vectors as pairs ((3,), (3,)): translation of the point at a fixed origin, and rotation."""

from floatframe.engine.kernels.compiler.compilation import inner, loops, small
from floatframe.engine.kernels.vector import (
    add,
    cross,
    dot,
    matrix_sum,
    product,
    put,
    put_block,
    scaled,
    sub,
    tilde,
    transposed,
    turned,
    vector,
)

__all__ = [
    "pair",
    "pair_sum",
    "put_blocks",
    "put_pair_of",
    "scaled_pair",
    "shifted_blocks",
    "spatial_cross",
    "spatial_motion",
    "turned_power",
    "world_screw",
    "wrench_of_column",
]


@small
def pair(x):
    """Return an array of six as a spatial vector."""
    return vector(x), vector(x[3:])


@small
def spatial_cross(V, S):
    """Return the spatial cross product V × S of two motions."""
    return add(cross(V[1], S[0]), cross(V[0], S[1])), cross(V[1], S[1])


@small
def pair_sum(S, U):
    """Return S + U."""
    return add(S[0], U[0]), add(S[1], U[1])


@small
def scaled_pair(f, S):
    """Return f S."""
    return scaled(f, S[0]), scaled(f, S[1])


@small
def put_pair_of(out, first, S):
    """Write a spatial vector into an array."""
    put(out, first, S[0])
    put(out, first + 3, S[1])


@inner
def spatial_motion(p, v, omega, a, alpha):
    """Return spatial velocity of a frame at p from the origin, and its rate, for given motion of the frame."""
    V = (sub(v, cross(omega, p)), omega)
    return V, (sub(sub(a, cross(alpha, p)), cross(omega, v)), alpha)


@small
def world_screw(R, p, S):
    """Return, in ground axes about the origin, a spatial vector given in axes R about point p."""
    ang = turned(R, S[1])
    return add(turned(R, S[0]), cross(p, ang)), ang


@small
def put_blocks(H, A, B, C):
    """Write a symmetric matrix of motions, [A B; Bᵀ C], into the first rows and columns of H."""
    put_block(H, 0, 0, A)
    put_block(H, 0, 3, B)
    put_block(H, 3, 0, transposed(B))
    put_block(H, 3, 3, C)


@loops
def shifted_blocks(A, B, C, p):
    """Shift blocks A, B, C by p, from new to old point: A, B - A p~, C + p~ (B - A p~) - Bᵀ p~."""
    minus = tilde(scaled(-1.0, p))
    B_p = matrix_sum(B, product(A, minus))
    return A, B_p, matrix_sum(C, matrix_sum(product(tilde(p), B_p), product(transposed(B), minus)))


@small
def wrench_of_column(H, c, R, p):
    """Return the wrench in column c of a body matrix H, ground axes; R, p: axes and origin of the body."""
    f = turned(R, (H[0, c], H[1, c], H[2, c]))
    return f, add(turned(R, (H[3, c], H[4, c], H[5, c])), cross(p, f))


@small
def turned_power(xi, screw, F):
    """Return (xi × J) · F, with the screw J and the wrench F as arrays of six."""
    S = spatial_cross(xi, pair(screw))
    return dot(S[0], F) + dot(S[1], F[3:])
