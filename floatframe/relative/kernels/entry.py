"""The compiled entry of relative coordinates, and a plain function for each thing it does."""

from typing import NamedTuple

import numpy as np
from numba import types

from fe_models.foundation.arrays import Array, IntArray
from floatframe.kernels.compiler.choice import is_lean
from floatframe.kernels.compiler.compilation import entry
from floatframe.kernels.compiler.sources import source_digest
from floatframe.kernels.compiler.structure import converter, table_of
from floatframe.kernels.model import Model
from floatframe.kernels.records import filled, integer, real, zeros
from floatframe.kernels.work import Work
from floatframe.relative.kernels.evaluation import evaluate_tree
from floatframe.relative.kernels.kinematics import joint_motion, move_joints, place_bodies
from floatframe.relative.kernels.projection import put_reactions
from floatframe.relative.kernels.tangent import assemble, write_tangent
from floatframe.relative.kernels.tree import JointWork, TangentWork, Tree

__all__ = ["motion_of_bodies", "motion_of_joints", "moved", "newton_matrix", "projected"]

MOTION_OF_JOINTS, MOTION_OF_BODIES, MOVE, PROJECT, TANGENT = range(5)


class RelativeOrder(NamedTuple):
    """What the entry is asked for."""

    what: IntArray = integer()
    c_m: Array = real()  #: weights of the parts of mass, damping, stiffness
    c_d: Array = real(unit="s")
    c_k: Array = real(unit="s²")


as_model, as_work, as_tree = converter(Model()), converter(Work()), converter(Tree())
as_joints, as_order = converter(JointWork()), converter(RelativeOrder())
as_tangent = converter(TangentWork())


def make_entry(digest):
    """Return the cached entry; the digest of the sources enters its key."""

    def run(model_table, work_table, tree_table, joint_table, tangent_table, order_table):
        if digest == 0:
            return 0
        model, work, tree = as_model(model_table), as_work(work_table), as_tree(tree_table)
        joints, tangent, order = as_joints(joint_table), as_tangent(tangent_table), as_order(order_table)
        what = order.what
        if what == MOTION_OF_JOINTS:
            joint_motion(model, work, tree, joints)
        elif what == MOTION_OF_BODIES:
            place_bodies(model, work, tree, joints)
        elif what == MOVE:
            move_joints(tree, joints)
            place_bodies(model, work, tree, joints)
        elif what == PROJECT:
            evaluate_tree(model, work, tree, joints, order.c_k)
            put_reactions(model, work, tree, joints)
        else:
            c_m, c_d, c_k = order.c_m, order.c_d, order.c_k
            evaluate_tree(model, work, tree, joints, c_k if c_k > 0.0 else 1.0)
            write_tangent(model, work, tree, joints, tangent, c_m, c_d, c_k)
            assemble(model, work, tree, tangent, c_d, c_k)
        return 0

    try:
        return entry(run)
    except RuntimeError:  # nowhere to keep the cache: compiled anew in each process
        return entry(run, cache=False)


run = make_entry(source_digest(__name__, "lean" if is_lean else "plain"))
SIGNATURE = (types.Array(types.int64, 1, "C"),) * 6
NOTHING = zeros(RelativeOrder(), {})


NO_TANGENT = zeros(TangentWork(), dict.fromkeys(("n_b", "jets", "n_q", "n_most", "n_newton"), 0))


def call(
    model: Model, work: Work, tree: Tree, joints: JointWork, tangent: TangentWork = NO_TANGENT, **order: float
) -> int:
    """Run the entry with an order, what it does not name being zero."""
    if not run.signatures:
        run.compile(SIGNATURE)
    ordered = filled(RelativeOrder(), **(NOTHING._asdict() | order))
    records = (model, work, tree, joints, tangent)
    return run(*(table_of(record) for record in records), table_of(ordered))


def motion_of_joints(model: Model, work: Work, tree: Tree, joints: JointWork) -> None:
    """Write poses, rates and accelerations of all joints from the absolute iterate in `work`."""
    call(model, work, tree, joints, what=MOTION_OF_JOINTS)


def motion_of_bodies(model: Model, work: Work, tree: Tree, joints: JointWork) -> None:
    """Write the absolute iterate from poses, rates and accelerations of joints, and modal coordinates."""
    call(model, work, tree, joints, what=MOTION_OF_BODIES)


def moved(model: Model, work: Work, tree: Tree, joints: JointWork, x: Array) -> None:
    """Write the absolute iterate with joints moved by x, (n_columns,), from d_start, Q_start."""
    joints.x[:] = np.asarray(x)
    call(model, work, tree, joints, what=MOVE)


def projected(model: Model, work: Work, tree: Tree, joints: JointWork, c_k: float = 1.0) -> Array:
    """Return the projected residual, (n_s,), of the iterate; reactions of joints go into `work.state.w`."""
    call(model, work, tree, joints, what=PROJECT, c_k=c_k)
    return joints.residual.copy()


def newton_matrix(
    model: Model, work: Work, tree: Tree, joints: JointWork, tangent: TangentWork, c_m: float, c_d: float, c_k: float
) -> Array:
    """Return the Newton matrix, unknowns and kept wrenches (times c_k), (n_newton, n_newton), at the iterate."""
    call(model, work, tree, joints, tangent, what=TANGENT, c_m=c_m, c_d=c_d, c_k=c_k)
    return tangent.K.copy()
