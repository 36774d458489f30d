"""Where a step in relative coordinates begins: algorithmic accelerations of the last steps are continued.

They follow a parabola through the last three, so long as steps of one size follow each other.
"""

from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.step_start import begin_step
from floatframe.kernels.time_function import time_function
from floatframe.relative.kernels.kinematics import move_joints, place_bodies

__all__ = ["forget", "learn", "predict"]


@inner
def predicted(tangent, s, a):
    """Return the algorithmic acceleration an unknown probably has after the step: that of the last, continued."""
    if tangent.n_known > 2:
        return a + (a - tangent.a_before[s]) + (a - 2.0 * tangent.a_before[s] + tangent.a_first[s])
    if tangent.n_known > 1:
        return a + (a - tangent.a_before[s])
    return a


@inner
def predict(model, work, tree, joints, tangent, memory, order, h):
    """(1): a_new in every unknown; prescribed coordinates are where their functions lead."""
    alpha_m, alpha_f, beta, gamma = order.alpha_m, order.alpha_f, order.beta, order.gamma
    begin_step(model, work, memory, h, alpha_f)
    state = work.state
    for s in range(tree.slot.shape[0]):
        slot, k = tree.slot[s], tree.column[s]
        a = memory.a[slot]
        a_new = predicted(tangent, s, a)
        u = joints.rate_start[k] if k >= 0 else memory.u[slot]
        now = joints.acceleration_start[k] if k >= 0 else memory.u_dot[slot]
        joints.increment[s] = h * (u + h * ((0.5 - beta) * a + beta * a_new))
        rate = u + h * ((1 - gamma) * a + gamma * a_new)
        acceleration = ((1 - alpha_m) * a_new + alpha_m * a - alpha_f * now) / (1 - alpha_f)
        if k >= 0:
            joints.x[k], joints.rate[k], joints.acceleration[k] = joints.increment[s], rate, acceleration
        else:
            state.q[tree.mode[s]] = memory.q[tree.mode[s]] + joints.increment[s]
            state.u[slot], state.u_dot[slot] = rate, acceleration
    for k in range(tree.motion.shape[0]):
        if tree.motion[k] >= 0:
            factor = tree.factor[k]
            before, _, _ = time_function(model.functions, tree.motion[k], state.time - h)
            value, rate, second = time_function(model.functions, tree.motion[k], state.time)
            joints.x[k] = factor * (value - before)
            joints.rate[k] = factor * rate
            joints.acceleration[k] = factor * second
    move_joints(tree, joints)
    place_bodies(model, work, tree, joints)


@inner
def learn(tree, tangent, memory):
    """Take note of the algorithmic accelerations after a step."""
    for s in range(tree.slot.shape[0]):
        tangent.a_first[s] = tangent.a_before[s]
        tangent.a_before[s] = tangent.a_last[s]
        tangent.a_last[s] = memory.a[tree.slot[s]]
    if tangent.V.shape[0] == 0:  # wrenches that are kept want the iterations that it saves
        tangent.n_known = min(tangent.n_known + 1, 3)


@inner
def forget(tree, tangent, memory):
    """Forget the last steps if they are not those that led to the memory."""
    for s in range(tree.slot.shape[0]):
        if tangent.a_last[s] != memory.a[tree.slot[s]]:
            tangent.n_known = 0
