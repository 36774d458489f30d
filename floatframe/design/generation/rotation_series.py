"""Functions of a rotation vector without a branch: rotation matrix, left Jacobian, and their derivatives of any order.

With x = t², the angle t, and the Stumpff series

    c_k(x) = Σ_j (-x)^j / (2 j + k)!:   c_1 = sin t / t,  c_2 = (1 - cos t)/t²,  c_3 = (t - sin t)/t³

    exp(th) v = v + c_1 th × v + c_2 th × (th × v),    T v = v + c_2 th × v + c_3 th × (th × v)
        (1) dc_k/dx = (k c_k+2 - c_k+1) / 2     derivatives need only further c_k of the same x
        (2) c_k = 1/k! - x c_k+2                only the two highest c_k are polynomials, and the others follow

The polynomials have 15 terms. Their error is below 1e-15 of the sum up to an angle of 4 rad, and below 2e-13 up to 5
rad; larger elastic rotations of a body are meaningless.
"""

import math
from collections.abc import Callable, Sequence

from floatframe.design.generation.graph import (
    ADD,
    COS,
    DIV,
    MUL,
    NEG,
    SIN,
    STUMPFF,
    SUB,
    Graph,
    Scalar,
    Terms,
    reachable,
    terms,
)

__all__ = ["expanded", "rotation_matrix"]

N_TERMS = 15


def rotation_matrix(graph: Graph, th: Terms) -> Terms:
    """Return exp(th), (3, 3), by sine and cosine if th always lies along one axis."""
    turning = [k for k in range(3) if not th[k].is_constant(0.0)]
    if len(turning) < 2:
        k = turning[0] if turning else 0
        i, j = (k + 1) % 3, (k + 2) % 3
        R = terms(graph, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        c, s = graph.cos(th[k]), graph.sin(th[k])
        R[i, i], R[i, j], R[j, i], R[j, j] = c, -s, s, c
        return R
    x, y, z = th
    xx, yy, zz = x * x, y * y, z * z
    t = xx + yy + zz
    s, a = graph.stumpff(1, t), graph.stumpff(2, t)
    sx, sy, sz = s * x, s * y, s * z
    xy, xz, yz = a * (x * y), a * (x * z), a * (y * z)
    return terms(graph, [
        [1.0 - a * (yy + zz), xy - sz, xz + sy],
        [xy + sz, 1.0 - a * (xx + zz), yz - sx],
        [xz - sy, yz + sx, 1.0 - a * (xx + yy)],
    ])  # fmt: skip


def polynomial(graph: Graph, k: int, x: Scalar) -> Scalar:
    """Return c_k(x) as a polynomial, with even and odd powers separated, which halves the chain of operations."""
    y = x * x
    parts = []
    for first in (0, 1):
        total = graph.zero
        for j in reversed(range(first, N_TERMS, 2)):
            total = total * y + (-1) ** j / math.factorial(2 * j + k)
        parts.append(total)
    return parts[0] + x * parts[1]


def stumpff_terms(graph: Graph, found: Sequence[Scalar], written: dict[int, Scalar]) -> None:
    """Expand the functions c_k of one argument by (2); the result is stored by the index of their terms."""
    x = written[found[0].args[0].index]
    wanted = {int(term.value): term.index for term in found}
    for parity in (0, 1):
        orders = [k for k in wanted if k % 2 == parity]
        if not orders:
            continue
        value = polynomial(graph, max(orders), x)
        for k in range(max(orders), min(orders) - 1, -2):
            if k < max(orders):
                value = 1.0 / math.factorial(k) - x * value
            if k in wanted:
                written[wanted[k]] = value


def expanded(graph: Graph, outputs: Sequence[Scalar]) -> list[Scalar]:
    """Return outputs in which all functions c_k are polynomials."""
    order = reachable(outputs)
    groups: dict[int, list[Scalar]] = {}
    for term in order:
        if term.kind == STUMPFF:
            groups.setdefault(term.args[0].index, []).append(term)
    if not groups:
        return list(outputs)
    make: dict[int, Callable[..., Scalar]] = {
        ADD: graph.add, SUB: graph.sub, MUL: graph.mul, DIV: graph.div, NEG: graph.neg, SIN: graph.sin, COS: graph.cos,
    }  # fmt: skip
    written: dict[int, Scalar] = {}
    for term in order:
        if term.kind == STUMPFF:
            if term.index not in written:
                stumpff_terms(graph, groups[term.args[0].index], written)
            continue
        args = [written[arg.index] for arg in term.args]
        is_same = all(new is old for new, old in zip(args, term.args, strict=True))
        written[term.index] = term if is_same else make[term.kind](*args)
    return [written[value.index] for value in outputs]
