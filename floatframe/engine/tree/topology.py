"""The tree of a system: joints that become coordinates, and joints that stay constraints (docs/relative.md §1).

The graph has bodies (and the ground) as nodes and joints with a chart as edges. Prim's algorithm, starting from the
ground, finds the spanning tree with the fewest freedoms: a cut joint of f freedoms leads to 6 - f constraints, a joint
of the tree to f coordinates, so that it is best to cut joints with many freedoms. Among joints with equally many
freedoms it takes the one at the body nearest to the ground, then the first in the order of the system. So loops open in
their middle, and the tree is unique. A part without a joint to the tree begins with a free body, its heaviest one.
"""

import heapq
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.compiling.bodies import axis_of_inertia, point_inertia
from floatframe.engine.compiling.markers import joint_markers, marker_pose, n_q_of
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.kernels.model import COUPLER, JOINT, Model
from floatframe.engine.kernels.records import filled
from floatframe.engine.tree.kernels.tree import COLUMN, FAR_MODE, NEAR_MODE, Tree
from floatframe.errors import ModelError
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints import SlidingJoint
from floatframe.model.joints.joint import MOVES_IN_A, SIDE_B, TURNS_IN_B, Column
from floatframe.model.joints.rows import is_held
from floatframe.model.rotations import rotation_matrix
from floatframe.model.system import System

__all__ = ["CoordinateName", "SystemTree", "tree_of"]

#: relative difference of two moments of inertia below which the spin may be integrated separately
NEARLY_SYMMETRIC = 0.3
#: ratio of transverse angular velocity to spin up to which the spin of these bodies is integrated separately
MOST_ACROSS = 0.5


@dataclass(frozen=True)
class CoordinateName:
    """Names that identify a column of the tree."""

    joint: str  #: name of the joint, "" for a free body
    body: str  #: name of the body that the joint carries
    coordinate: str
    unit: str
    is_driven: bool

    @property
    def name(self) -> str:
        """Name of the joint, or of the free body, followed by the coordinate."""
        return f"{self.joint or self.body}/{self.coordinate}"


@dataclass(frozen=True, eq=False)
class SystemTree:
    """A system as a tree, and the names of its coordinates."""

    tree: Tree
    columns: tuple[CoordinateName, ...]
    motions: tuple[TimeFunction | None, ...]  #: functions of time that prescribe the columns, or None
    cut: tuple[str, ...]  #: joints with a chart that stay constraints because they close a loop
    constrained: tuple[str, ...]  #: joints without a chart, or kept as constraints because of their law

    @property
    def is_tree(self) -> bool:
        """Whether every joint is in the tree and no coupler or element closes a loop."""
        return not len(self.tree.kept)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the unknown coordinates in their order."""
        return tuple(each.name for each in self.columns if not each.is_driven)


@dataclass(frozen=True)
class Branch:
    """A body with the joint that carries it."""

    body: int
    parent: int
    joint: int  #: index of the joint, -1 for a free body
    columns: tuple[Column, ...]


def tree_of(system: System) -> SystemTree:
    """Return the tree of a system, computed at the first call and stored in the system."""
    return system.derived(make_tree)


def make_tree(system: System) -> SystemTree:
    """Return the tree of a system."""
    compiled = compiled_system(system)
    charts = charts_of(system, compiled)
    branches = spanning_tree(compiled.model, charts)
    taken = {branch.joint for branch in branches}
    names = compiled.joint_names
    return SystemTree(
        tree_record(compiled, branches),
        tuple(
            CoordinateName(
                "" if each.joint < 0 else names[each.joint],
                compiled.body_names[each.body],
                column.name,
                column.unit,
                each.joint >= 0 and driving_row(compiled, each.joint, column)[0] >= 0,
            )
            for each in sorted(branches, key=lambda branch: branch.body)
            for column in each.columns
        ),
        tuple(
            driving_motion(system, compiled, each, column)
            for each in sorted(branches, key=lambda branch: branch.body)
            for column in each.columns
        ),
        tuple(names[k] for k in charts if k not in taken),
        tuple(names[k] for k in range(len(names)) if k not in charts),
    )


def charts_of(system: System, compiled: CompiledSystem) -> dict[int, tuple[Column, ...]]:
    """Return the columns of each joint that may become part of the tree, by the index of the joint.

    Friction that grows with the normal force needs the reaction of its joint, so that this joint stays a constraint.
    """
    charts = {}
    model, n_q = compiled.model, n_q_of(system)
    for k, joint in enumerate(system.joints):
        if isinstance(joint, SlidingJoint):
            continue
        ends = joint_markers(system, joint, compiled.placed)
        columns = joint.columns(*(marker_pose(marker, compiled.placed, n_q)[1] for marker in ends))
        rows = range(model.connections.w0[k], model.connections.w0[k + 1])
        has_normal_friction = any(
            model.joint_forces.coefficient[model.rows.force0[row] : model.rows.force1[row]].any() for row in rows
        )
        if columns is not None and not has_normal_friction:
            require_freedoms(compiled, k, columns)
            charts[k] = columns
    return charts


def require_freedoms(compiled: CompiledSystem, joint: int, columns: tuple[Column, ...]) -> None:
    """Raise `ModelError` if the constraints of a joint and its columns are not 6 together."""
    model = compiled.model
    rows = slice(int(model.connections.w0[joint]), int(model.connections.w0[joint + 1]))
    n_constraints = int((is_held(model.rows.kind[rows]) & (model.rows.motion[rows] < 0)).sum())
    if n_constraints + len(columns) != 6:
        names = ", ".join(column.name for column in columns) or "none"
        raise ModelError(
            f"joint {compiled.joint_names[joint]!r}: columns: expected {6 - n_constraints}, because its rows are "
            f"{n_constraints} constraints, got {len(columns)} ({names})"
        )


def spanning_tree(model: Model, charts: dict[int, tuple[Column, ...]]) -> list[Branch]:
    """Return the branches of the spanning tree with the fewest freedoms, each after its parent."""
    ends = {
        k: (int(model.markers.body[model.connections.a[k]]), int(model.markers.body[model.connections.b[k]]))
        for k in charts
    }
    at: dict[int, list[int]] = {}
    for k, pair in ends.items():
        for body in pair:
            at.setdefault(body, []).append(k)
    n_b = len(model.bodies.kind)
    mass = model.body_types.mass[model.bodies.kind]
    depth = {-1: 0}
    branches: list[Branch] = []
    heap: list[tuple[int, int, int, int]] = []  # number of freedoms, depth of the inner body, joint, inner body

    def reach(body: int) -> None:
        for k in at.get(body, []):
            heapq.heappush(heap, (len(charts[k]), depth[body], k, body))

    reach(-1)
    while len(branches) < n_b:
        while heap:
            _, _, k, parent = heapq.heappop(heap)
            a, b = ends[k]
            body = b if a == parent else a
            if body not in depth:
                depth[body] = depth[parent] + 1
                branches.append(Branch(body, parent, k, charts[k]))
                reach(body)
        left = [i for i in range(n_b) if i not in depth]
        if left:
            body = max(left, key=lambda i: (mass[i], -i))
            depth[body] = 1
            branches.append(Branch(body, -1, -1, MOVES_IN_A + TURNS_IN_B))
            reach(body)
    return branches


def driving_row(compiled: CompiledSystem, joint: int, column: Column) -> tuple[int, float]:
    """Return the row that prescribes a joint coordinate and the factor of its motion; (-1, 1) if there is none."""
    model = compiled.model
    by = {column.name: 1.0, **dict(column.factors)}
    for row in range(model.connections.w0[joint], model.connections.w0[joint + 1]):
        if model.rows.motion[row] >= 0 and compiled.coordinates[row] in by:
            return row, by[compiled.coordinates[row]]
    return -1, 1.0


def driving_motion(system: System, compiled: CompiledSystem, each: Branch, column: Column) -> TimeFunction | None:
    """Return the motion that prescribes a coordinate, or None."""
    row = -1 if each.joint < 0 else driving_row(compiled, each.joint, column)[0]
    if row < 0:
        return None
    return system.joints[each.joint].motions[compiled.coordinates[row]]  # type: ignore[attr-defined]


def own_row(compiled: CompiledSystem, joint: int, column: Column) -> int:
    """Return the joint row of forces along its coordinate, -1 if there is none."""
    model = compiled.model
    for row in range(model.connections.w0[joint], model.connections.w0[joint + 1]):
        if model.rows.is_loaded[row] and compiled.coordinates[row] == column.name:
            return row
    return -1


def depth_first(branches: list[Branch]) -> list[int]:
    """Return the bodies in depth-first order, with children in ascending order."""
    children: dict[int, list[int]] = {}
    for each in branches:
        children.setdefault(each.parent, []).append(each.body)
    order: list[int] = []
    stack = [-1]
    while stack:
        body = stack.pop()
        order.append(body)
        stack += sorted(children.get(body, []), reverse=True)
    return order[1:]


def jets_of(
    model: Model,
    ordered: list[Branch],
    near: list[int],
    far: list[int],
    unknown: list[int],
    column0: list[int],
    m0: list[int],
) -> tuple[list[int], list[tuple[int, int, int]]]:
    """Return the index of each body's first jet, and kind, item and unknown of each jet, see `Tree`."""
    jet0, jets = [0], []
    for i, each in enumerate(ordered):
        jets += [(COLUMN, k, unknown[k]) for k in range(column0[i], column0[i + 1]) if unknown[k] >= 0]
        if each.parent >= 0 and near[i] >= 0 and model.markers.psi0[near[i]] >= 0:
            jets += [(NEAR_MODE, k, m0[each.parent] + k) for k in range(int(model.bodies.n_q[each.parent]))]
        if far[i] >= 0 and model.markers.psi0[far[i]] >= 0:
            jets += [(FAR_MODE, k, m0[i] + k) for k in range(int(model.bodies.n_q[i]))]
        jet0.append(len(jets))
    return jet0, jets


def spin_axes(compiled: CompiledSystem, ordered: list[Branch], far: list[int]) -> tuple[Array, Array]:
    """Return each body's symmetry axis for separate spin, axes of its joint end, and `most_across`.

    The axis is zero except for bodies that are free or on a ball joint, rigid including all bodies fixed to them, with
    an inertia about the joint, or about the centre of mass, that is symmetric (or nearly so, if they rotate mostly
    about the axis). Bodies with modes or with joints that spin with them are excluded: these coordinates would be in
    other axes than the rotation to which they are added, and stiff ones make steps unstable.
    """
    model, axes, most_across = compiled.model, np.zeros((len(ordered), 3)), np.full(len(ordered), np.inf)
    fixed: list[list[int]] = [[i] for i in range(len(ordered))]  # bodies fixed to each body, including itself
    is_rigid = [model.bodies.n_q[i] == 0 for i in range(len(ordered))]
    for i in reversed(depth_first(ordered)):
        each = ordered[i]
        if is_rigid[i] and [column.side for column in each.columns[-3:]] == [SIDE_B] * 3:
            inertia = common_inertia(compiled, fixed[i], far[i])
            axes[i] = axis_of_inertia(inertia)
            if not axes[i].any():
                axes[i], most_across[i] = axis_of_inertia(inertia, NEARLY_SYMMETRIC), MOST_ACROSS
            if far[i] >= 0:
                axes[i] = model.markers.triad[far[i]].T @ axes[i]
        if each.parent >= 0:
            fixed[each.parent] += fixed[i]
            is_rigid[each.parent] = is_rigid[each.parent] and is_rigid[i] and not each.columns
    return axes, most_across


def common_inertia(compiled: CompiledSystem, bodies: list[int], marker: int) -> Array:
    """Return the inertia of rigid bodies about a marker on the first one, or about their centre of mass (-1).

    The result, (3, 3), is in axes of the first body.
    """
    model, placed = compiled.model, compiled.placed
    mass, first, inertia = 0.0, np.zeros(3), np.zeros((3, 3))
    R, origin = rotation_matrix(placed.p[bodies[0]]), placed.r[bodies[0]]
    for i in bodies:
        t = model.bodies.kind[i]
        A, m = R.T @ rotation_matrix(placed.p[i]), float(model.body_types.mass[t])
        s, p = A @ model.body_types.S[t] / m, R.T @ (placed.r[i] - origin)
        inertia += A @ model.body_types.J0[t] @ A.T - point_inertia(m, s) + point_inertia(m, s + p)
        mass, first = mass + m, first + m * (s + p)
    centre = first / mass
    about = centre if marker < 0 else model.markers.position[marker]
    return inertia - point_inertia(mass, centre) + point_inertia(mass, centre - about)


def loop_markers(model: Model, ordered: list[Branch], near: list[int], kept: list[int]) -> list[tuple[int, int]]:
    """Return the bodies in loops, each with the marker at which the loop leaves it outwards."""
    found: set[tuple[int, int]] = set()
    for c in kept:
        if model.connections.law[c] != JOINT:
            continue
        ways = []
        for marker in (int(model.connections.a[c]), int(model.connections.b[c])):
            body, way = int(model.markers.body[marker]), []
            while body >= 0:
                way.append((body, marker))
                body, marker = ordered[body].parent, near[body]
            ways.append(way)
        common = {body for body, _ in ways[0]} & {body for body, _ in ways[1]}
        found |= {each for way in ways for each in way if each[0] not in common}
    return sorted(found)


def tree_record(compiled: CompiledSystem, branches: list[Branch]) -> Tree:
    """Return the tree as a record for the kernels."""
    model = compiled.model
    ordered = sorted(branches, key=lambda branch: branch.body)
    near, far, is_reversed = [], [], []
    lists: dict[str, list] = {name: [] for name in ("tau", "alpha", "side", "unknown", "motion", "factor", "row")}
    column0, s0, m0 = [0], [0], []
    unknowns: list[tuple[int, int, int]] = []  # column, mode, slot
    for each in ordered:
        n_free = 0
        n_q, q0 = int(model.bodies.n_q[each.body]), int(model.bodies.q0[each.body])
        u0 = int(model.bodies.u0[each.body])
        a, b = (
            (-1, -1) if each.joint < 0 else (int(model.connections.a[each.joint]), int(model.connections.b[each.joint]))
        )
        holds_b = each.joint < 0 or int(model.markers.body[b]) == each.body
        near.append(a if holds_b else b)
        far.append(b if holds_b else a)
        is_reversed.append(0 if holds_b else 1)
        for column in each.columns:
            driver, factor = (-1, 1.0) if each.joint < 0 else driving_row(compiled, each.joint, column)
            row = -1 if each.joint < 0 else own_row(compiled, each.joint, column)
            lists["tau"].append(column.tau)
            lists["alpha"].append(column.alpha)
            lists["side"].append(column.side)
            lists["unknown"].append(-1 if driver >= 0 else s0[-1] + n_free)
            if driver < 0:
                unknowns.append((len(lists["unknown"]) - 1, -1, u0 + n_free))
            lists["motion"].append(-1 if driver < 0 else int(model.rows.motion[driver]))
            lists["factor"].append(factor)
            lists["row"].append(row)
            n_free += int(driver < 0)
        column0.append(column0[-1] + len(each.columns))
        m0.append(s0[-1] + n_free)
        s0.append(m0[-1] + n_q)
        unknowns += [(-1, q0 + k, u0 + 6 + k) for k in range(n_q)]
    jet0, jets = jets_of(model, ordered, near, far, lists["unknown"], column0, m0)
    own_jet = np.full(s0[-1], -1)
    for j, (kind, _, s) in enumerate(jets):
        if kind != NEAR_MODE:
            own_jet[s] = j
    taken = {each.joint for each in branches}
    kept = [c for c in range(len(model.connections.size)) if c not in taken]
    is_kept: IntArray = np.isin(np.arange(len(model.connections.size)), kept).astype(np.int64)
    row_is_kept = np.repeat(is_kept, model.connections.size) > 0
    loops = loop_markers(model, ordered, near, kept)
    axes, most_across = spin_axes(compiled, ordered, far)
    tau: Array = np.array(lists.pop("tau")).reshape(-1, 3)
    alpha: Array = np.array(lists.pop("alpha")).reshape(-1, 3)
    return filled(
        Tree(),
        order=depth_first(branches),
        parent=[each.parent for each in ordered],
        joint=[each.joint for each in ordered],
        near=near,
        far=far,
        is_reversed=is_reversed,
        column0=column0,
        s0=s0,
        m0=m0,
        column=[column for column, _, _ in unknowns],
        mode=[mode for _, mode, _ in unknowns],
        slot=[slot for _, _, slot in unknowns],
        tau=tau,
        alpha=alpha,
        **lists,
        kept=kept,
        is_kept=is_kept,
        kept_row=np.where(row_is_kept, np.cumsum(row_is_kept) - 1, -1),
        held=[c for c in kept if model.connections.law[c] in (JOINT, COUPLER)],
        spin_axis=axes,
        most_across=most_across,
        loop_body=[body for body, _ in loops],
        loop_marker=[marker for _, marker in loops],
        jet0=jet0,
        jet_kind=[kind for kind, _, _ in jets],
        jet_item=[item for _, item, _ in jets],
        jet_s=[s for _, _, s in jets],
        own_jet=own_jet,
        l0=np.concatenate([[0], np.cumsum(np.diff(s0) ** 2)]),
        front0=np.concatenate([[0], np.cumsum((np.diff(s0) + 6) ** 2)]),
    )
