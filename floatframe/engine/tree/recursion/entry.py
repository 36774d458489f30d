"""The compiled entry of the recursive equations, and a plain function for each thing it does."""

from dataclasses import dataclass
from typing import NamedTuple

from fe_models.foundation.arrays import IntArray
from floatframe.engine.kernels.compiler.choice import is_lean
from floatframe.engine.kernels.compiler.compilation import kept_entry
from floatframe.engine.kernels.compiler.sources import source_digest
from floatframe.engine.kernels.compiler.structure import converter, table_of
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.records import integer, zeros
from floatframe.engine.kernels.work import Work
from floatframe.engine.tree.recursion.articulated import articulate, solve_articulated, solve_columns
from floatframe.engine.tree.recursion.columns import motion_in_ground, rate_columns
from floatframe.engine.tree.recursion.composite import evaluate_flexible, mass_matrix
from floatframe.engine.tree.recursion.newton_euler import newton_euler
from floatframe.engine.tree.recursion.nodes import Dense, Nodes, NodeWork
from floatframe.engine.tree.recursion.poses import place_in_ground, place_in_parent, set_modes
from floatframe.engine.tree.recursion.tangents import force_tangents

__all__ = ["FORWARD", "INVERSE", "MASS", "PLACE", "SOLVE", "TANGENTS", "Prepared", "Task", "prepared"]

PLACE, INVERSE, MASS, FORWARD, SOLVE, TANGENTS = range(6)  #: values of `Task.what`


class Task(NamedTuple):
    """What the entry is asked for."""

    what: IntArray = integer()
    times: IntArray = integer()  #: how often, for measurements


as_nodes, as_node_work, as_model = converter(Nodes()), converter(NodeWork()), converter(Model())
as_work, as_task, as_dense = converter(Work()), converter(Task()), converter(Dense())


def make_entry(digest):
    """Return the cached entry; the digest of the sources enters its key."""

    def run(nodes_table, work_table, dense_table, model_table, marker_table, task_table):
        if digest == 0:
            return -1
        nodes, work, dense = as_nodes(nodes_table), as_node_work(work_table), as_dense(dense_table)
        model, marker_work, task = as_model(model_table), as_work(marker_table), as_task(task_table)
        for _ in range(task.times):
            what = task.what
            if what == FORWARD:
                for j in range(work.a.shape[0]):
                    work.a[j] = 0.0
            set_modes(nodes, work, marker_work.state)
            place_in_parent(nodes, work, model, marker_work)
            if what == INVERSE:
                newton_euler(nodes, work, model, marker_work)
            else:
                if what == FORWARD or what == TANGENTS:
                    newton_euler(nodes, work, model, marker_work)
                    for j in range(work.right.shape[0]):
                        work.right[j] = work.force_given[j] - work.force[j]
                elif what == MASS or what == SOLVE:
                    evaluate_flexible(nodes, model, marker_work)
                place_in_ground(nodes, work)
                rate_columns(nodes, work, model, marker_work)
                if what == PLACE:
                    motion_in_ground(nodes, work)
                elif what == TANGENTS:
                    motion_in_ground(nodes, work)
                    mass_matrix(nodes, work, dense.M, model, marker_work)
                    force_tangents(nodes, work, dense, model, marker_work)
                elif what == MASS:
                    mass_matrix(nodes, work, dense.M, model, marker_work)
                else:
                    singular = articulate(nodes, work, model, marker_work)
                    if singular >= 0:
                        return singular
                    if what == FORWARD:
                        solve_articulated(nodes, work)
                    else:
                        solve_columns(nodes, work, dense.columns)
        return -1

    return kept_entry(run)


run = make_entry(source_digest(__name__, "lean" if is_lean else "plain"))


@dataclass(frozen=True, eq=False)
class Prepared:
    """The records of a tree with their tables, which take longer to make than a short chain to evaluate."""

    records: tuple[Nodes, NodeWork, Model, Work]  #: kept alive
    tables: tuple[IntArray, ...]
    task: Task
    task_table: IntArray

    def run(self, what: int, dense_table: IntArray, times: int = 1) -> int:
        """Do what is asked for with the numbers in the records; return -1, or the node whose matrix is singular."""
        self.task.what[...] = what
        self.task.times[...] = times
        nodes, work, model, marker_work = self.tables
        return int(run(nodes, work, dense_table, model, marker_work, self.task_table))


def prepared(nodes: Nodes, work: NodeWork, model: Model, marker_work: Work) -> Prepared:
    """Return the records of a tree, ready to run."""
    records, task = (nodes, work, model, marker_work), zeros(Task(), {})
    return Prepared(records, tuple(table_of(each) for each in records), task, table_of(task))
