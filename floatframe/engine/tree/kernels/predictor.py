"""Initial guess of a step in relative coordinates, from extrapolated algorithmic accelerations.

While steps have equal size, the accelerations are extrapolated by the constant, the line or the parabola through the
last ones, whichever would have predicted those of the previous step best: smooth motions follow a parabola, while modes
that the step does not resolve change their sign from step to step.
"""

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.step_start import begin_step
from floatframe.engine.kernels.time_function import time_function
from floatframe.engine.tree.kernels.kinematics import move_joints, place_bodies
from floatframe.engine.tree.kernels.spins import begin_spin

__all__ = ["learn", "predict"]


@inner
def predicted(tangent, s, degree):
    """Return the algorithmic acceleration of an unknown after the step, extrapolated by a polynomial."""
    a, before = tangent.a_last[s], tangent.a_before[s]
    if degree == 0:
        return a
    if degree == 1:
        return a + (a - before)
    return a + (a - before) + ((a - before) - (before - tangent.a_first[s]))


@inner
def predict(model, work, tree, joints, tangent, memory, order, h):
    """(1): predict a_new of every unknown; prescribed coordinates follow their functions."""
    alpha_m, alpha_f, beta, gamma = order.alpha_m, order.alpha_f, order.beta, order.gamma
    begin_step(model, work, memory, h, alpha_f)
    state, degree = work.state, min(tangent.degree, tangent.n_known - 1)
    for s in range(tree.slot.shape[0]):
        slot, k = tree.slot[s], tree.column[s]
        a = memory.a[slot]
        a_new = a if degree < 1 else predicted(tangent, s, degree)
        u = joints.rate_start[k] if k >= 0 else memory.u[slot]
        now = joints.acceleration_start[k] if k >= 0 else memory.u_dot[slot]
        x = h * (u + h * ((0.5 - beta) * a + beta * a_new))
        rate = u + h * ((1 - gamma) * a + gamma * a_new)
        acceleration = ((1 - alpha_m) * a_new + alpha_m * a - alpha_f * now) / (1 - alpha_f)
        if k >= 0:
            joints.x[k], joints.rate[k], joints.acceleration[k] = x, rate, acceleration
        else:
            state.q[tree.mode[s]] = memory.q[tree.mode[s]] + x
            state.u[slot], state.u_dot[slot] = rate, acceleration
    for k in range(tree.motion.shape[0]):
        if tree.motion[k] >= 0:
            factor = tree.factor[k]
            before, _, _ = time_function(model.functions, tree.motion[k], state.time - h)
            value, rate, second = time_function(model.functions, tree.motion[k], state.time)
            joints.x[k] = factor * (value - before)
            joints.rate[k] = factor * rate
            joints.acceleration[k] = factor * second
    if order.stabilized != 0:
        for i in range(tree.parent.shape[0]):
            begin_spin(tree, joints, memory, i, alpha_f, h)
    move_joints(tree, joints)
    place_bodies(model, work, tree, joints)


@inner
def learn(tree, tangent, memory):
    """Store the algorithmic accelerations after a step, and the polynomial degree that would have fitted best."""
    miss, best = 0.0, 0
    for degree in range(tangent.n_known):
        total = 0.0
        for s in range(tree.slot.shape[0]):
            error = memory.a[tree.slot[s]] - predicted(tangent, s, degree)
            total += tangent.weight[s] * error * error
        if degree == 0 or total < miss:
            miss, best = total, degree
    tangent.degree = best if tangent.n_known > 0 else 2
    for s in range(tree.slot.shape[0]):
        tangent.a_first[s] = tangent.a_before[s]
        tangent.a_before[s] = tangent.a_last[s]
        tangent.a_last[s] = memory.a[tree.slot[s]]
    if tangent.V.shape[0] == 0:  # with kept wrenches, a better prediction saves no iterations
        tangent.n_known = min(tangent.n_known + 1, 3)
