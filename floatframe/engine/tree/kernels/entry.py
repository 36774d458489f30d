"""The compiled entry for relative coordinates, with one plain function for each of its tasks."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.kernels.body import NewtonWeights
from floatframe.engine.kernels.compiler.compilation import entry
from floatframe.engine.kernels.compiler.structure import converter
from floatframe.engine.kernels.diagnostics import power
from floatframe.engine.kernels.entry import ADVANCE, OBSERVE, CompiledEntry, Order, Outcome
from floatframe.engine.kernels.generalized_alpha import DONE, SINGULAR
from floatframe.engine.kernels.memory import GIVEN, TAKEN, Memory, Rows
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.records import zeros
from floatframe.engine.kernels.work import Work
from floatframe.engine.tree.kernels.accelerations import accelerate, constrain
from floatframe.engine.tree.kernels.evaluation import evaluate_tree
from floatframe.engine.tree.kernels.kinematics import joint_motion, move_joints, place_bodies
from floatframe.engine.tree.kernels.projection import put_reactions
from floatframe.engine.tree.kernels.steps import advance_tree, correct, renew, write_tree_row
from floatframe.engine.tree.kernels.tangent import assemble, write_tangent
from floatframe.engine.tree.kernels.tree import JointWork, TangentWork, Tree, new_tangent_work

__all__ = [
    "NO_TANGENT",
    "accelerations",
    "constraints",
    "joint_kernels",
    "motion_of_bodies",
    "motion_of_joints",
    "moved",
    "newton_matrix",
    "newton_step",
    "projected",
]

# further tasks of an `Order`
MOTION_OF_JOINTS, MOTION_OF_BODIES, MOVE, PROJECT, TANGENT, CORRECT, CONSTRAIN, ACCELERATE = range(10, 18)


as_model, as_work, as_tree = converter(Model()), converter(Work()), converter(Tree())
as_joints, as_order = converter(JointWork()), converter(Order())
as_memory, as_rows = converter(Memory()), converter(Rows())
as_tangent = converter(TangentWork())


@entry
def run(model_table, work_table, tree_table, joint_table, tangent_table, memory_table, rows_table, order_table):
    """Carry out a request; the arguments are the tables of the records."""
    model, work, tree = as_model(model_table), as_work(work_table), as_tree(tree_table)
    joints, tangent, order = as_joints(joint_table), as_tangent(tangent_table), as_order(order_table)
    memory, rows = as_memory(memory_table), as_rows(rows_table)
    what = order.what
    if what == ADVANCE:
        return advance_tree(model, work, memory, rows, (tree, joints, tangent), order)
    if what == OBSERVE:
        work.counted.rows = 0
        write_tree_row(model, work, memory, tree, joints, order.t0, rows)
        memory.power[GIVEN], memory.power[TAKEN] = power(model, work)
    elif what == MOTION_OF_JOINTS:
        joint_motion(model, work, tree, joints)
    elif what == MOTION_OF_BODIES:
        place_bodies(model, work, tree, joints)
    elif what == MOVE:
        move_joints(tree, joints)
        place_bodies(model, work, tree, joints)
    elif what == PROJECT:
        evaluate_tree(model, work, tree, joints, order.c_k)
        put_reactions(model, work, tree, joints)
    elif what == CONSTRAIN:
        constrain(model, work, tree, joints, tangent, order.n_steps == 1)
    elif what == ACCELERATE:
        if not accelerate(model, work, tree, joints, tangent):
            return SINGULAR, 0, 0, -1, 0.0
    elif what == CORRECT:
        weights, c_k = NewtonWeights(order.c_m, order.c_d, order.c_k), order.c_k
        evaluate_tree(model, work, tree, joints, c_k)
        tangent.is_kept, tangent.exactly = 0, 1 - order.n_steps
        if not renew(model, work, tree, joints, tangent, weights):
            return SINGULAR, 0, 0, -1, 0.0
        correct(model, work, tree, joints, tangent, c_k)
    else:
        weights, c_k = NewtonWeights(order.c_m, order.c_d, order.c_k), order.c_k
        evaluate_tree(model, work, tree, joints, c_k if c_k > 0.0 else 1.0)
        write_tangent(model, work, tree, joints, tangent, weights)
        assemble(model, work, tree, tangent, order.c_d, c_k)
    return DONE, 0, 0, -1, 0.0


NO_TANGENT = zeros(
    TangentWork(),
    dict.fromkeys(
        (
            "n_b",
            "n_s",
            "jets",
            "n_q",
            "n_most",
            "kept rows",
            "numbers of L",
            "numbers of fronts",
            "unknowns and motions",
            "n_dense",
        ),
        0,
    ),
)


joint_kernels = CompiledEntry(run, n_records=5)


def call(
    model: Model, work: Work, tree: Tree, joints: JointWork, tangent: TangentWork = NO_TANGENT, **order: float
) -> Outcome:
    """Carry out a request that needs neither memory nor rows of results."""
    return joint_kernels(model, work, tree, joints, tangent, **order)


def motion_of_joints(model: Model, work: Work, tree: Tree, joints: JointWork) -> None:
    """Write poses, rates and accelerations of all joints from the absolute iterate in `work`."""
    call(model, work, tree, joints, what=MOTION_OF_JOINTS)


def motion_of_bodies(model: Model, work: Work, tree: Tree, joints: JointWork) -> None:
    """Write the absolute iterate from poses, rates and accelerations of joints, and modal coordinates."""
    call(model, work, tree, joints, what=MOTION_OF_BODIES)


def moved(model: Model, work: Work, tree: Tree, joints: JointWork, x: Array) -> None:
    """Write the absolute iterate for joints displaced by x, (n_columns,), from d_start and Q_start."""
    joints.x[:] = np.asarray(x)
    call(model, work, tree, joints, what=MOVE)


def projected(model: Model, work: Work, tree: Tree, joints: JointWork, c_k: float = 1.0) -> Array:
    """Return the projected residual of the iterate, (n_s,); reactions of joints are stored in `work.state.w`."""
    call(model, work, tree, joints, what=PROJECT, c_k=c_k)
    return joints.residual.copy()


def newton_matrix(model: Model, work: Work, tree: Tree, joints: JointWork, c_m: float, c_d: float, c_k: float) -> Array:
    """Return the Newton matrix, (n_s + n_rows)², for the unknowns and for c_k times wrenches of the kept rows."""
    tangent = new_tangent_work(model, tree, is_dense=True)
    call(model, work, tree, joints, tangent, what=TANGENT, c_m=c_m, c_d=c_d, c_k=c_k)
    return tangent.K


def newton_step(
    model: Model,
    work: Work,
    tree: Tree,
    joints: JointWork,
    c_m: float,
    c_d: float,
    c_k: float,
    *,
    is_exact: bool = True,
) -> tuple[Array, Array]:
    """Return Newton's correction of the unknowns, (n_s,), and of c_k times the kept wrenches, (n_rows,).

    is_exact: whether to use the exact matrix instead of that of `kernels.kept_factors`. The result is NaN if the matrix
    is singular.
    """
    tangent = new_tangent_work(model, tree)
    outcome = call(
        model, work, tree, joints, tangent, what=CORRECT, c_m=c_m, c_d=c_d, c_k=c_k, n_steps=int(not is_exact)
    )
    if outcome.status == SINGULAR:
        tangent.step[:], tangent.mu[:] = np.nan, np.nan
    return tangent.step, tangent.mu


def constraints(
    model: Model, work: Work, tree: Tree, joints: JointWork, tangent: TangentWork, *, by_increments: bool
) -> None:
    """Write values and rates of kept rows and their Jacobian C by increments or rates, with joints moved by `x`."""
    call(model, work, tree, joints, tangent, what=CONSTRAIN, n_steps=int(by_increments))


def accelerations(model: Model, work: Work, tree: Tree, joints: JointWork, tangent: TangentWork) -> bool:
    """Write the accelerations of joints and bodies, and the kept wrenches.

    Return whether they exist for the positions and rates.

    Joints are moved by `joints.x`, which is then set to zero.
    """
    return call(model, work, tree, joints, tangent, what=ACCELERATE).status == DONE
