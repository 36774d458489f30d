"""The Newton matrix in relative coordinates is the derivative of its residual, that of the projection included."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import Marker, SpringDamper
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.initial import consistent_motion
from floatframe.engine.tree.kernels.entry import moved, newton_matrix, newton_step
from tests.floatframe.engine.kernels.examples import C_D, C_K, C_M, system_with_everything
from tests.floatframe.engine.tree.examples import CASES
from tests.floatframe.engine.tree.pairs import RelativeIterate, pair
from tests.floatframe.model.elements.element_accelerations_examples import Heavy


class Point:
    """A random iterate of a system, moved along its unknowns and kept wrenches."""

    def __init__(self, system, is_closed, seed=1, t=0.37):
        start = consistent_motion(system, t=t).state if is_closed else compiled_system(system).placed
        self.iterate = it = RelativeIterate(system, start, t=t)
        if not is_closed:  # joints of the tree are closed at least: none of them leaves a distance free
            it.joints.d_start[:] = 0.0
        rng = np.random.default_rng(seed)
        for part in (it.work.state.q, it.work.state.u, it.work.state.u_dot):
            part[:] = 0.3 * rng.normal(size=len(part))
        self.x = 0.3 * rng.normal(size=len(it.tree.side))  # increments since the beginning of the step
        it.joints.rate[:] = rng.normal(size=len(self.x))
        it.joints.acceleration[:] = rng.normal(size=len(self.x))
        self.w = rng.normal(size=len(it.work.state.w)) * (it.tree.kept_row >= 0)
        state = it.work.state
        self.start = [part.copy() for part in (it.joints.rate, it.joints.acceleration, state.q, state.u, state.u_dot)]

    def residual(self, y):
        """Rows of unknowns times c_k, then rows that are kept, moved by y = (unknowns, c_k wrenches)."""
        it, n_s = self.iterate, int(self.iterate.tree.s0[-1])
        rate, acceleration, q, u, u_dot = (part.copy() for part in self.start)
        x, is_free = self.x.copy(), it.tree.unknown >= 0
        step = y[it.tree.unknown[is_free]]
        x[is_free] += step
        rate[is_free] += C_D / C_K * step
        acceleration[is_free] += C_M / C_K * step
        for i, m0 in enumerate(it.tree.m0):
            n, q0, u0 = int(it.model.bodies.n_q[i]), int(it.model.bodies.q0[i]), int(it.model.bodies.u0[i]) + 6
            own = y[m0 : m0 + n]
            q[q0 : q0 + n] += own
            u[u0 : u0 + n] += C_D / C_K * own
            u_dot[u0 : u0 + n] += C_M / C_K * own
        state = it.work.state
        state.q[:], state.u[:], state.u_dot[:] = q, u, u_dot
        kept = it.tree.kept_row >= 0
        state.w[kept] = self.w[kept] + y[n_s:][it.tree.kept_row[kept]] / C_K
        it.joints.rate[:], it.joints.acceleration[:] = rate, acceleration
        moved(it.model, it.work, it.tree, it.joints, x)
        rows = it.project(C_K)
        return np.concatenate([C_K * rows, it.work.connections.g[kept]])


def matrices(system, is_closed=True):
    """Exact and approximate Newton matrix."""
    point = Point(system, is_closed)
    it = point.iterate
    n = int(it.tree.s0[-1]) + int((it.tree.kept_row >= 0).sum())
    point.residual(np.zeros(n))
    exact = newton_matrix(it.model, it.work, it.tree, it.joints, C_M, C_D, C_K)
    s = 1e-5
    approximate = np.array([(point.residual(s * e) - point.residual(-s * e)) / (2 * s) for e in np.eye(n)]).T
    return exact, approximate


@pytest.mark.parametrize(("make", "is_apart", "n_free", "swap"), CASES)
def test_newton_matrix_is_the_derivative_of_the_residual(make, is_apart, n_free, swap):
    exact, approximate = matrices(pair(make, is_apart=is_apart, swap=swap))
    assert_allclose(exact, approximate, rtol=0, atol=1e-8 * np.abs(approximate).max())


def test_newton_matrix_is_exact_with_loops_and_force_elements():
    exact, approximate = matrices(system_with_everything(), is_closed=False)
    assert_allclose(exact, approximate, rtol=0, atol=1e-8 * np.abs(approximate).max())


@pytest.mark.parametrize("case", ["revolute", "spherical swapped"])
def test_newton_matrix_is_exact_with_an_element_that_feels_accelerations(case):
    """A mass at the outer end of two stiffened flexible bodies, many times as heavy as they are."""
    make, is_apart, _, swap = next(each.values for each in CASES if each.id == case)
    system = replace(pair(make, is_apart=is_apart, swap=swap), elements=[Heavy("heavy", Marker("first", "end_b"))])
    exact, approximate = matrices(system)
    assert_allclose(exact, approximate, rtol=0, atol=1e-8 * np.abs(approximate).max())


@pytest.mark.parametrize(
    ("make", "is_apart", "n_free", "swap"), [case for case in CASES if not case.id.endswith("driven")]
)
def test_the_correction_over_the_tree_is_that_of_the_whole_matrix(make, is_apart, n_free, swap):
    """Elimination body by body against a dense solution, with a spring between the bodies as kept rows."""
    spring = SpringDamper("spring", Marker("first", "end_b"), Marker("second", "end_a"), 30.0, 4.0, 0.5, 2.0)
    assert_step_is_exact(Point(pair(make, is_apart=is_apart, swap=swap, forces=[spring]), True))


def test_the_correction_over_the_tree_is_that_of_the_whole_matrix_with_loops():
    assert_step_is_exact(Point(system_with_everything(), False))


def assert_step_is_exact(point):
    it = point.iterate
    n = int(it.tree.s0[-1]) + int((it.tree.kept_row >= 0).sum())
    residual = point.residual(np.zeros(n))
    exact = np.linalg.solve(newton_matrix(it.model, it.work, it.tree, it.joints, C_M, C_D, C_K), -residual)
    step = np.concatenate(newton_step(it.model, it.work, it.tree, it.joints, C_M, C_D, C_K))
    assert_allclose(step, exact, rtol=0, atol=1e-9 * np.abs(exact).max())


@pytest.mark.parametrize("case", ["revolute", "cylindrical swapped", "universal", "spherical", "planar swapped"])
def test_kept_matrices_leave_out_nothing_of_the_mass(case):
    """With c_d = 0 and c_k next to nothing the correction is that of the exact matrix; with those of a step nearly."""
    make, is_apart, _, swap = next(each.values for each in CASES if each.id == case)
    point = Point(pair(make, is_apart=is_apart, swap=swap), True)
    it = point.iterate
    point.residual(np.zeros(int(it.tree.s0[-1])))
    for weights, allowed in (((1.0, 0.0, 1e-12), 1e-9), ((C_M, 1e-4, 1e-8), 2e-3)):
        exact, _ = newton_step(it.model, it.work, it.tree, it.joints, *weights)
        kept, _ = newton_step(it.model, it.work, it.tree, it.joints, *weights, is_exact=False)
        assert_allclose(kept, exact, rtol=0, atol=allowed * np.abs(exact).max())
