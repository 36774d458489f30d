"""The compiled entry of relative coordinates, and a plain function for each thing it does."""

from typing import NamedTuple

import numpy as np
from numba import types

from fe_models.foundation.arrays import Array, IntArray
from floatframe.kernels.compiler.choice import is_lean
from floatframe.kernels.compiler.compilation import entry
from floatframe.kernels.compiler.sources import source_digest
from floatframe.kernels.compiler.structure import converter, kept_table_of, table_of
from floatframe.kernels.model import Model
from floatframe.kernels.records import filled, integer, real, zeros
from floatframe.kernels.work import Work
from floatframe.relative.kernels.evaluation import evaluate_tree
from floatframe.relative.kernels.kinematics import joint_motion, move_joints, place_bodies
from floatframe.relative.kernels.projection import put_reactions
from floatframe.relative.kernels.tree import JointWork, Tree

__all__ = ["motion_of_bodies", "motion_of_joints", "moved", "projected"]

MOTION_OF_JOINTS, MOTION_OF_BODIES, MOVE, PROJECT = range(4)


class RelativeOrder(NamedTuple):
    """What the entry is asked for."""

    what: IntArray = integer()
    c_k: Array = real(unit="s²")


as_model, as_work, as_tree = converter(Model()), converter(Work()), converter(Tree())
as_joints, as_order = converter(JointWork()), converter(RelativeOrder())


def make_entry(digest):
    """Return the cached entry; the digest of the sources enters its key."""

    def run(model_table, work_table, tree_table, joint_table, order_table):
        if digest == 0:
            return 0
        model, work, tree = as_model(model_table), as_work(work_table), as_tree(tree_table)
        joints, order = as_joints(joint_table), as_order(order_table)
        what = order.what
        if what == MOTION_OF_JOINTS:
            joint_motion(model, work, tree, joints)
        elif what == MOTION_OF_BODIES:
            place_bodies(model, work, tree, joints)
        elif what == MOVE:
            move_joints(tree, joints)
            place_bodies(model, work, tree, joints)
        else:
            evaluate_tree(model, work, tree, joints, order.c_k)
            put_reactions(model, work, tree, joints)
        return 0

    try:
        return entry(run)
    except RuntimeError:  # nowhere to keep the cache: compiled anew in each process
        return entry(run, cache=False)


run = make_entry(source_digest(__name__, "lean" if is_lean else "plain"))
SIGNATURE = (types.Array(types.int64, 1, "C"),) * 5
NOTHING = zeros(RelativeOrder(), {})


def call(model: Model, work: Work, tree: Tree, joints: JointWork, **order: float) -> int:
    """Run the entry with an order, what it does not name being zero."""
    if not run.signatures:
        run.compile(SIGNATURE)
    ordered = filled(RelativeOrder(), **(NOTHING._asdict() | order))
    tables = kept_table_of(model), kept_table_of(work), kept_table_of(tree), kept_table_of(joints), table_of(ordered)
    return run(*tables)


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
