"""Rows of the constant-velocity joint, for two shafts with equal rotations.

E and Z are normal to the shaft of A and to each other; D and U are the directions of B that coincide with them when
both shafts are in line. The rotation from A to B is about an axis normal to both shafts if EQUAL_TURN is zero:

    EQUAL_TURN   E · U - Z · D = 0          its gradient is along the bisector of the shafts (docs/theory.md §10)
    BISECTOR     M · (E × (Z_A + Z_B)) = 0  Z_A = A_A z and Z_B = A_B y are the shafts; the rows of two directions E
                                            put the moment M along their bisector

Described in `floatframe.model.joints.orientation_joints`.
"""

from floatframe.engine.kernels.compiler.compilation import inner, small
from floatframe.engine.kernels.joints.held_rows import gap_of, gradient_of, of_a, of_b, product_rates, times
from floatframe.engine.kernels.joints.relative_motion import direction
from floatframe.engine.kernels.vector import add, cross, dot, put, scaled, sub, vector

__all__ = [
    "bisector_derivatives",
    "bisector_value",
    "equal_turn_products",
    "equal_turn_rates",
    "equal_turn_value",
]


@small
def equal_turn_products(rows, k):
    """Return the two products of which EQUAL_TURN is the difference."""
    return times(of_a(rows.x[k]), of_b(rows.u[k])), times(of_a(rows.z[k]), of_b(rows.y[k]))


@inner
def equal_turn_value(model, work, k, a, b):
    """Return the value of EQUAL_TURN: E · U - Z · D."""
    markers = work.markers
    first, second = equal_turn_products(model.rows, k)
    zero, m_1, _ = gradient_of(first, markers, a, b)
    _, m_2, _ = gradient_of(second, markers, a, b)
    m = sub(m_1, m_2)
    return gap_of(first, markers, a, b) - gap_of(second, markers, a, b), zero, m, scaled(-1.0, m)


@inner
def equal_turn_rates(model, work, k, a, b):
    """Return the rates of EQUAL_TURN."""
    first, second = equal_turn_products(model.rows, k)
    _, beta_1 = product_rates(first, work.markers, a, b)
    _, beta_2 = product_rates(second, work.markers, a, b)
    return 0.0, beta_1 - beta_2


@inner
def shafts(rows, markers, k, a, b):
    """Return the shaft direction of A, E, and the shaft direction of B."""
    return direction(markers, a, rows.x[k]), direction(markers, a, rows.z[k]), direction(markers, b, rows.y[k])


@inner
def bisector_value(model, work, k, a, b, w):
    """Return the value of BISECTOR: M · (E × (Z_A + Z_B))."""
    rows = model.rows
    E, Z_a, Z_b = shafts(rows, work.markers, k, a, b)
    return dot(vector(w[rows.part[k] :]), cross(E, add(Z_a, Z_b)))


@inner
def bisector_derivatives(model, work, k, a, b, w, c_k, by, V):
    """BISECTOR: M · (dphi × E) × S = dphi · (E × (S × M)), M · E × (dphi × Z) = dphi · (Z × (M × E))."""
    rows = model.rows
    part = rows.part[k]
    E, Z_a, Z_b = shafts(rows, work.markers, k, a, b)
    M, S = vector(w[part:]), add(Z_a, Z_b)
    put(V, part, cross(E, S))
    across = cross(M, E)
    put(by.a, 3, scaled(c_k, add(cross(E, cross(S, M)), cross(Z_a, across))))
    put(by.b, 3, scaled(c_k, cross(Z_b, across)))
