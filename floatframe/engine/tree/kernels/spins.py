"""Separately integrated spin of axisymmetric bodies that are free or on a ball joint (docs/relative.md §6).

This is done as in absolute coordinates (`kernels.generalized_alpha`), but with omega and alpha of the body relative to
its parent, in axes of the body's end of the joint. If this end is B, they are z_dot and z_ddot of the three columns of
rotation, which are the last ones of the joint; if it is A, they are -Q z_dot and -Q z_ddot. In both cases the
increments x of these columns are theta = across + along e, and rotate the body by exp(across) exp(along e).
"""

from floatframe.engine.kernels.compiler.compilation import inner, loops, small
from floatframe.engine.kernels.generalized_alpha import next_acceleration, takes_spin
from floatframe.engine.kernels.rotation import (
    after_spin,
    changed_spin,
    right_jacobian,
    spin_jacobian,
    turn_of_axis,
    turned_about,
    turned_by_spin,
)
from floatframe.engine.kernels.vector import (
    add,
    cross,
    dot,
    matrix,
    product,
    put,
    put_matrix,
    scaled,
    sub,
    transposed,
    turned,
    turned_back,
    vector,
)

__all__ = [
    "begin_spin",
    "change_spin",
    "first_rotation",
    "put_spin_acceleration",
    "spin_jump",
    "spin_variations",
    "turn_spinning_joint",
    "turning_by_columns",
]


@small
def first_rotation(tree, i):
    """Return the index of the first of three rotation columns of the joint of body i."""
    return tree.column0[i + 1] - 3


@inner
def of_body(tree, i, Q, x):
    """Return three values of rotation columns as a vector relative to the parent, axes of body i's joint end."""
    if tree.is_reversed[i] == 0:
        return vector(x)
    return scaled(-1.0, turned(Q, x))


@inner
def of_columns(tree, i, Q, x):
    """Return a vector relative to the parent as three values of rotation columns of body i."""
    if tree.is_reversed[i] == 0:
        return x
    return scaled(-1.0, turned_back(Q, x))


@inner
def turn_spinning_joint(tree, joints, i):
    """Write the relative rotation Q of the joint of a spinning body."""
    theta, start = vector(joints.x[first_rotation(tree, i) :]), matrix(joints.Q_start[i])
    turn = turned_by_spin(vector(tree.spin_axis[i]), theta)
    if tree.is_reversed[i] == 0:
        put_matrix(joints.Q[i], product(start, turn))
    else:
        put_matrix(joints.Q[i], product(transposed(turn), start))


@inner
def begin_spin(tree, joints, memory, i, alpha_f, h):
    """Decide whether the step integrates the spin of body i separately; if so, predict it with a_new = a."""
    e, k, Q = vector(tree.spin_axis[i]), first_rotation(tree, i), joints.Q_start[i]
    joints.spins[i] = 0
    if dot(e, e) == 0.0:
        return
    omega = of_body(tree, i, Q, joints.rate_start[k:])
    alpha = of_body(tree, i, Q, joints.acceleration_start[k:])
    turn, across = turn_of_axis(e, omega), cross(e, omega)
    if dot(across, across) > (tree.most_across[i] * dot(e, omega)) ** 2 or not takes_spin(turn, alpha):
        return
    joints.spins[i] = 1
    a = sub(of_body(tree, i, Q, memory.a[tree.slot[tree.unknown[k]] :]), turn)
    rest = scaled(1.0 / (1.0 - alpha_f), sub(a, scaled(alpha_f, sub(alpha, turn))))
    theta = scaled(h, add(omega, scaled(0.5 * h, a)))
    omega, alpha = after_spin(e, dot(e, theta), add(omega, scaled(h, a)), rest)
    put_spin(tree, joints, i, theta, omega, alpha)


@inner
def put_spin(tree, joints, i, theta, omega, alpha):
    """Write increments of a spinning body, its rotation, and its motion relative to the parent as rates of columns."""
    k = first_rotation(tree, i)
    put(joints.x, k, theta)
    turn_spinning_joint(tree, joints, i)
    put(joints.rate, k, of_columns(tree, i, joints.Q[i], omega))
    put(joints.acceleration, k, of_columns(tree, i, joints.Q[i], alpha))


@inner
def change_spin(tree, joints, step, i, by_theta, by_rate, by_acceleration):
    """Add by_theta y, by_rate y, by_acceleration y to a spinning body's rotation; y: correction in `step`."""
    k, Q = first_rotation(tree, i), joints.Q[i]
    y = of_body(tree, i, Q, step[tree.unknown[k] :])
    omega, alpha = of_body(tree, i, Q, joints.rate[k:]), of_body(tree, i, Q, joints.acceleration[k:])
    theta, omega, alpha = changed_spin(
        vector(tree.spin_axis[i]),
        vector(joints.x[k:]),
        omega,
        alpha,
        scaled(by_theta, y),
        scaled(by_rate, y),
        scaled(by_acceleration, y),
    )
    put_spin(tree, joints, i, theta, omega, alpha)


@inner
def spin_accelerations(tree, joints, memory, i, alpha_m, alpha_f):
    """Return the algorithmic acceleration of a spinning body before and after the step, in axes that do not spin."""
    e, k, Q = vector(tree.spin_axis[i]), first_rotation(tree, i), joints.Q_start[i]
    turn = turn_of_axis(e, of_body(tree, i, Q, joints.rate_start[k:]))
    a = sub(of_body(tree, i, Q, memory.a[tree.slot[tree.unknown[k]] :]), turn)
    before = sub(of_body(tree, i, Q, joints.acceleration_start[k:]), turn)
    turn = turn_of_axis(e, of_body(tree, i, joints.Q[i], joints.rate[k:]))
    rest = sub(of_body(tree, i, joints.Q[i], joints.acceleration[k:]), turn)
    now = turned_about(e, dot(e, vector(joints.x[k:])), rest)
    return a, next_acceleration(a, before, now, alpha_m, alpha_f)


@inner
def spin_jump(tree, joints, memory, i, alpha_m, alpha_f):
    """Return the change of a spinning body's algorithmic acceleration in a step, as values of columns."""
    e, along = vector(tree.spin_axis[i]), dot(vector(tree.spin_axis[i]), vector(joints.x[first_rotation(tree, i) :]))
    a, after = spin_accelerations(tree, joints, memory, i, alpha_m, alpha_f)
    return of_columns(tree, i, joints.Q[i], turned_about(e, -along, sub(after, a)))


@inner
def put_spin_acceleration(tree, joints, memory, i, alpha_m, alpha_f):
    """Write the algorithmic acceleration of a spinning body after the step into the memory."""
    e, k, Q = vector(tree.spin_axis[i]), first_rotation(tree, i), joints.Q[i]
    _, rest = spin_accelerations(tree, joints, memory, i, alpha_m, alpha_f)
    omega, along = of_body(tree, i, Q, joints.rate[k:]), dot(e, vector(joints.x[k:]))
    after = add(turned_about(e, -along, rest), turn_of_axis(e, omega))
    put(memory.a, tree.slot[tree.unknown[k]], of_columns(tree, i, Q, after))


@loops
def turning_by_columns(tree, joints, i):
    """Return the rotation of body i for changes x of its joint columns fixed in B, axes of B."""
    if joints.spins[i] != 0:
        T = spin_jacobian(vector(tree.spin_axis[i]), vector(joints.x[first_rotation(tree, i) :]))
        if tree.is_reversed[i] == 0:
            return T
        Q = matrix(joints.Q[i])
        return product(transposed(Q), product(T, Q))
    x = (0.0, 0.0, 0.0)
    for k in range(tree.column0[i], tree.column0[i + 1]):
        if tree.side[k] != 0:
            x = add(x, scaled(joints.x[k], vector(tree.alpha[k])))
    return right_jacobian(x)


@inner
def spin_variations(tree, joints, i, y, theta, weights):
    """Return theta_dot, theta_ddot of `kernels.jets` for a change y of a spinning body's unknowns, axes of B.

    omega changes by c_d y, and alpha - w omega × e by c_m y; both are then rotated by c_k (e · y) about -e.
    """
    c_m, c_d, c_k = weights
    k, Q = first_rotation(tree, i), joints.Q[i]
    e, omega, alpha = vector(tree.spin_axis[i]), vector(joints.rate[k:]), vector(joints.acceleration[k:])
    if tree.is_reversed[i] != 0:
        e, omega, alpha = turned_back(Q, e), scaled(-1.0, omega), scaled(-1.0, alpha)
    further, spin = c_k * dot(e, y), dot(e, omega)
    rest = sub(alpha, turn_of_axis(e, omega))
    by_omega = sub(scaled(c_d, y), scaled(further, cross(e, omega)))
    by_alpha = sub(scaled(c_m, y), scaled(further, cross(e, rest)))
    by_alpha = add(by_alpha, add(scaled(dot(e, by_omega), cross(omega, e)), scaled(spin, cross(by_omega, e))))
    if tree.is_reversed[i] != 0:  # omega relative to the parent
        return by_omega, add(by_alpha, cross(omega, by_omega))
    theta_1 = sub(by_omega, scaled(c_k, cross(omega, theta)))
    return theta_1, sub(sub(by_alpha, scaled(c_k, cross(alpha, theta))), cross(omega, theta_1))
