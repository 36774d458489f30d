"""A basis of small motions in joint and modal coordinates, in which every motion has a name.

Let s be the coordinates of the joints of the tree and of the modes (docs/relative.md §2). The bodies move by
xi = N_s ds, which satisfies the joints of the tree; column k of N_s is the velocity of all bodies at unit rate of
coordinate k. If there are loops, their constraints G N_s ds = 0 make as many coordinates dependent as G N_s has rank:

    ds_d = -(G N_s)_d⁺ (G N_s)_i ds_i,        N = N_s [1; -(G N_s)_d⁺ (G N_s)_i]

Joint coordinates far from the ground are chosen as dependent rather than those near it, and joint coordinates rather
than modes, provided that their column is at least a tenth of the largest one.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.tree.kernels.tree import Tree
from floatframe.engine.tree.topology import tree_of
from floatframe.engine.tree.tree_motions import coordinate_motions
from floatframe.model.joints.rows import is_held_length, is_held_position
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.sensors.measurement import unit_words

__all__ = ["CoordinateBasis", "coordinate_basis", "coordinate_names", "dependent_coordinates"]

RANK = 1e-10  #: size of a column after elimination, relative to the largest, below which it is a rounding error
NEARLY = 0.1  #: smallest column, relative to the largest remaining one, whose coordinate may become dependent
MODE = 1e-3  #: scale of modal relative to joint coordinates, by which modes become dependent last
FRAME = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True, eq=False)
class CoordinateBasis:
    """Independent coordinates, and body motions for each of them."""

    names: tuple[str, ...]  #: names such as "joint.coordinate", "body mode k", "body x"
    units: tuple[str, ...]
    N: Array  #: body motions (body axes of the engine) for unit coordinates, (n_u, n_z)


def coordinate_basis(system: System, state: State, G: Array, shown: tuple[Array, ...]) -> CoordinateBasis:
    """Return the independent coordinates at a state, and the body motions for each of them.

    Parameters
    ----------
    system
        The system.
    state
        A state of the engine that satisfies the joints.
    G
        Rows of all position constraints over the motions of the bodies, (n_held, n_u).
    shown
        For each body, the matrix from motions in the frame of the engine to motions in the frame of its file,
        (6 + n, 6 + n). The motions of a body without joints are named in the frame of its file.
    """
    compiled, tree = compiled_system(system), tree_of(system).tree
    N, units = coordinate_motions(compiled, tree, state), coordinate_units(system)
    T = free_frames(compiled, tree, N, shown)
    if T is not None:
        N = np.asarray(np.linalg.solve(T.T, N.T).T, dtype=float)
    model = compiled.model
    held = is_held_position(model.rows.kind)
    kept = (tree.kept_row >= 0)[held]
    row_size = np.where(is_held_length(model.rows.kind[held]), compiled.length, 1.0)[kept]
    C = G[kept] @ N / row_size[:, None]
    size = np.where(tree.mode >= 0, MODE, [compiled.length if unit == "m" else 1.0 for unit in units])
    dependent = dependent_coordinates(C * size, preference(tree))
    free = np.setdiff1d(np.arange(len(size)), dependent)
    if len(dependent):
        by_free = np.linalg.lstsq(C[:, dependent] * size[dependent], C[:, free], rcond=None)[0]
        N = N[:, free] - N[:, dependent] @ (size[dependent, None] * by_free)
    names = coordinate_names(system)
    words = {"m": system.units.length_symbol, "": unit_words(system.units, "modal")}
    return CoordinateBasis(
        tuple(names[k] for k in free), tuple(words.get(units[k], units[k]) for k in free), np.asarray(N)
    )


def coordinate_names(system: System) -> tuple[str, ...]:
    """Return the names of all unknown coordinates, (n_s,), for each body: its joint coordinates, then its modes."""
    parts, body_names = tree_of(system), compiled_system(system).body_names
    tree, names = parts.tree, []
    for i, body in enumerate(body_names):
        own = parts.columns[tree.column0[i] : tree.column0[i + 1]]
        stems = [f"{body} {name}" for name in FRAME] if tree.joint[i] < 0 else [
            f"{each.joint}.{each.coordinate}" for each in own
        ]  # fmt: skip
        names += [stem for stem, each in zip(stems, own, strict=True) if not each.is_driven]
        names += [f"{body} mode {k + 1}" for k in range(int(tree.s0[i + 1] - tree.m0[i]))]
    return tuple(names)


def coordinate_units(system: System) -> tuple[str, ...]:
    """Return the units of all unknown coordinates, (n_s,): "rad", "m" for lengths, "" for modes."""
    parts = tree_of(system)
    return tuple("" if column < 0 else parts.columns[column].unit for column in parts.tree.column)


def free_frames(compiled: CompiledSystem, tree: Tree, N: Array, shown: tuple[Array, ...]) -> Array | None:
    """Return the matrix from tree coordinates to named coordinates, (n_s, n_s); None if all bodies have joints."""
    free = np.flatnonzero(tree.joint < 0)
    if not len(free):
        return None
    T = np.eye(len(tree.slot))
    for i in free:
        u = slice(int(compiled.model.bodies.u0[i]), int(compiled.model.bodies.u0[i + 1]))
        T[tree.s0[i] : tree.m0[i]] = (shown[i] @ N[u])[:6]
    return T


def preference(tree: Tree) -> IntArray:
    """Return each coordinate's distance from the ground in the tree, (n_s,); modes count as nearer than joints."""
    depth: dict[int, int] = {-1: 0}
    for i in tree.order:
        depth[int(i)] = depth[int(tree.parent[i])] + 1
    body = np.repeat(np.arange(len(tree.parent)), np.diff(tree.s0))
    return np.where(tree.mode >= 0, 0, [depth[int(i)] for i in body])


def dependent_coordinates(C: Array, preferred: IntArray) -> IntArray:
    """Return the dependent columns of C, as many as its rank, by elimination with preferred pivots.

    Candidates are the columns whose remaining part is at least a tenth of the largest one. The pivot is the candidate
    with the highest preference; if several have it, the last of them.
    """
    left = C.copy()
    first = np.linalg.norm(left, axis=0).max(initial=0.0)
    chosen: list[int] = []
    while len(chosen) < min(C.shape):
        size = np.linalg.norm(left, axis=0)
        size[chosen] = 0.0
        if size.max() <= RANK * first:
            break
        good = np.flatnonzero(size >= NEARLY * size.max())
        best = good[np.lexsort((good, preferred[good]))[-1]]
        direction = left[:, best] / size[best]
        for _ in range(2):  # twice, to remove the rounding errors of the first time
            left -= np.outer(direction, direction @ left)
        chosen.append(int(best))
    return np.array(sorted(chosen), dtype=np.int64)
