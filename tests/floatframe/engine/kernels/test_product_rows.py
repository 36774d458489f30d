"""Rows that are products of two vectors, beside truncated series of the formulas in `floatframe.model.joints.rows`."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import PrismaticJoint, RevoluteJoint
from floatframe.engine.kernels.compiler.compilation import entry
from floatframe.engine.kernels.entry import as_model, as_work
from floatframe.engine.kernels.joints.row_formulas import held_rates, held_value
from floatframe.joints import ConstantVelocityJoint, CylindricalJoint, DistanceJoint, UniversalJoint
from floatframe.model.functions.time_functions import harmonic
from floatframe.model.joints.rows.kinds import DISTANCE, DOT, EQUAL_TURN, POINT, SLIDE, TURN, TURN_B
from tests.floatframe.engine.kernels.examples import Iterate
from tests.floatframe.model.joints.examples import AXIS, pair

T = 0.37
DRIVE = harmonic(0.3, 2.0, 0.4, 1.1)
JOINTS = {
    "revolute": lambda *ends: RevoluteJoint("j", *ends, axis=AXIS, motions={"angle": DRIVE}),
    "prismatic": lambda *ends: PrismaticJoint("j", *ends, axis=AXIS),
    "cylindrical": lambda *ends: CylindricalJoint("j", *ends, axis=AXIS, motions={"distance": DRIVE}),
    "distance": lambda *ends: DistanceJoint("j", *ends),
    "driven distance": lambda *ends: DistanceJoint("j", *ends, motions={"distance": DRIVE}),
    "universal": lambda *ends: UniversalJoint("j", *ends, motions={"angle_b": DRIVE}),
    "constant velocity": lambda *ends: ConstantVelocityJoint("j", *ends, axis=AXIS, axis_b=(0, 1, 0.1)),
}  # fmt: skip
KINDS = (POINT, DOT, TURN, TURN_B, SLIDE, DISTANCE, EQUAL_TURN)


def write_rows(model_table, work_table, kinds, found):
    model, work = as_model(model_table), as_work(work_table)
    a, b = model.connections.a[0], model.connections.b[0]
    for k in range(kinds.shape[0]):
        if kinds[k] >= 0:
            g, n, m_a, m_b = held_value(kinds[k], model, work, k, a, b)
            rate, second = held_rates(kinds[k], model, work, k, a, b)
            found[k, 0], found[k, 10], found[k, 11] = g, rate, second
            for i in range(3):
                found[k, 1 + i], found[k, 4 + i], found[k, 7 + i] = n[i], m_a[i], m_b[i]


compiled_write_rows = entry(write_rows, cache=False)


def times(x, y):
    """Return the product of two series of three terms."""
    return np.convolve(x, y)[:3]


def product(P, Q):
    """Return P · Q of two vectors of series, (3, 3)."""
    return sum(times(p, q) for p, q in zip(P, Q, strict=True))


def turning(A, x, omega):
    """Return the series of the direction A x, x of series, if A rotates at a constant velocity."""
    W = np.cross(omega, np.eye(3)).T
    terms = np.array([A, W @ A, 0.5 * W @ W @ A])
    return np.array([sum(times(terms[:, i, j], x[j]) for j in range(3)) for i in range(3)])


def fixed(x):
    """Return the series of a constant vector."""
    return np.array([x, 0 * x, 0 * x]).T


def value(rows, k, r, v, A, omega):
    """Return the series of row k for positions, velocities, axes and angular velocities of A and B."""
    kind, x, y, z, u = int(rows.kind[k]), *(fixed(part[k]) for part in (rows.x, rows.y, rows.z, rows.u))
    d = np.array([r[1] - r[0], v[1] - v[0], np.zeros(3)]).T
    is_driven = rows.motion[k] >= 0
    f = np.array([DRIVE(T), DRIVE(T, 1), 0.5 * DRIVE(T, 2)] if is_driven else [rows.c[k], 0.0, 0.0])
    if kind == POINT:
        return -product(x, d)
    if kind == SLIDE:
        return product(turning(A[0], x, omega[0]), d) - f
    if kind == DISTANCE:
        inverse = np.array([1 / f[0], -f[1] / f[0] ** 2, f[1] ** 2 / f[0] ** 3 - f[2] / f[0] ** 2])
        return 0.5 * (times(product(d, d), inverse) - f)
    if kind == DOT:
        return product(turning(A[0], x, omega[0]), turning(A[1], y, omega[1])) - f
    if kind == EQUAL_TURN:
        first = product(turning(A[0], x, omega[0]), turning(A[1], u, omega[1]))
        return first - product(turning(A[0], z, omega[0]), turning(A[1], y, omega[1]))
    f = f if kind == TURN else -f
    c, s = np.cos(f[0]), np.sin(f[0])
    cosine = np.array([c, -s * f[1], -s * f[2] - 0.5 * c * f[1] ** 2])
    sine = np.array([s, c * f[1], c * f[2] - 0.5 * s * f[1] ** 2])
    e = np.array([times(x[i], cosine) + times(z[i], sine) for i in range(3)])
    holder, other = (0, 1) if kind == TURN else (1, 0)
    return product(turning(A[holder], e, omega[holder]), turning(A[other], y, omega[other]))


@pytest.mark.parametrize("make", JOINTS.values(), ids=JOINTS)
def test_product_rows_are_the_series_of_their_formulas(make):
    """In general position, at an open joint: value, gradient, rate in time and second rate without accelerations."""
    iterate = Iterate(pair(make), 2)
    model, work = iterate.model, iterate.work
    work.state.time[...] = T
    iterate.residual(np.zeros_like(iterate.u), np.zeros_like(iterate.w))
    rows, markers = model.rows, work.markers
    ends = [int(model.connections.a[0]), int(model.connections.b[0])]
    kinds = np.where(np.isin(rows.kind, KINDS), rows.kind, -1)
    found = np.zeros((len(kinds), 12))
    compiled_write_rows(model.table, work.table, kinds, found)
    r, v, omega, A = markers.r[ends], markers.v[ends], markers.omega[ends], markers.A[ends]
    rest = np.zeros((2, 3))
    for k in np.flatnonzero(kinds >= 0):
        g, rate, second = value(rows, k, r, v, A, omega)
        n, m_a, m_b = (
            [value(rows, k, r, move, A, turn)[1] for move, turn in motions]
            for motions in (
                [(np.array([0 * e, e]), rest) for e in np.eye(3)],
                [(rest, np.array([e, 0 * e])) for e in np.eye(3)],
                [(rest, np.array([0 * e, e])) for e in np.eye(3)],
            )
        )
        in_time = value(rows, k, r, rest, A, rest)[1]
        wanted = np.array([g, *n, *m_a, *m_b, in_time, 2 * second])
        wanted[1:10] -= in_time
        assert_allclose(found[k], wanted, rtol=0, atol=1e-12 * max(np.abs(wanted).max(), 1.0))
        assert_allclose(found[k, 1:4] @ (v[1] - v[0]) + found[k, 4:7] @ omega[0] + found[k, 7:10] @ omega[1] + in_time,
                        rate, rtol=0, atol=1e-12 * max(np.abs(wanted).max(), 1.0))  # fmt: skip


def test_these_joints_have_every_kind_of_product_row():
    held = [kind for make in JOINTS.values() for kind in Iterate(pair(make), 2).model.rows.kind]
    assert set(KINDS) <= set(held)
