"""Checks of initial values before they are computed: motions far from the start, half turns, redundant constraints."""

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.initial_conditions.freedoms import scaled_constraints
from floatframe.engine.initial_conditions.newton_equations import linearized, set_iterate, with_mass_for_all
from floatframe.engine.kernels.model import JOINT, Model
from floatframe.engine.kernels.work import Work
from floatframe.engine.tree.kernels.tree import Tree
from floatframe.engine.tree.tree_motions import coordinate_motions
from floatframe.errors import ModelError
from floatframe.model.joints.rows import DOT, TURN, TURN_B, is_held
from floatframe.model.state import State

__all__ = ["driven_angles", "led_by", "repeated_constraints", "require_no_half_turns", "stages", "way_of_drives"]


# drives of angles that begin far from where their bodies were placed: the root of their row that is meant -------------
# The row of a driven angle, (E cos f + Z sin f) · D = sin(f - th), vanishes at th = f and half a turn from there, and
# Newton's method goes to the nearer one. From far away the drive is led there in steps of an eighth of a turn; a row
# whose axes E, Z are turned by delta asks for f - delta.


FAR = np.pi / 4  #: way of a drive from which it is led, and the longest of its steps


def driven_angles(model: Model) -> IntArray:
    """Return the rows that prescribe an angle over time."""
    is_turn = (model.rows.kind == TURN) | (model.rows.kind == TURN_B)
    return np.flatnonzero(is_turn & (model.rows.motion >= 0))


def way_of_drives(model: Model, work: Work, state: State, w: Array, rows: IntArray) -> Array:
    """Return f - th of driven angles at a state, at the time in `work`, between -pi and pi, (len(rows),) [rad]."""
    set_iterate(work, state, w=w)
    linearized(model, work, 1.0, 0.0, 0.0)
    sense = sense_of(model, rows)
    sine = sense * work.connections.g[rows]
    quarter_back = led_by(model, rows, np.full(len(rows), np.pi / 2))
    linearized(quarter_back, work, 1.0, 0.0, 0.0)
    return np.arctan2(sine, -sense * work.connections.g[rows])


def led_by(model: Model, rows: IntArray, delta: Array) -> Model:
    """Return the model in which driven angles are to be f - delta, delta (len(rows),) [rad]."""
    c, s = np.cos(delta)[:, None], (sense_of(model, rows) * np.sin(delta))[:, None]
    x, z = model.rows.x.copy(), model.rows.z.copy()
    x[rows] = c * model.rows.x[rows] - s * model.rows.z[rows]
    z[rows] = s * model.rows.x[rows] + c * model.rows.z[rows]
    return model._replace(rows=model.rows._replace(x=x, z=z))


def sense_of(model: Model, rows: IntArray) -> Array:
    """Return the sense of an angle as the marker of its axes sees it: -1 about an axis of B."""
    return np.where(model.rows.kind[rows] == TURN_B, -1.0, 1.0)


def stages(way: Array) -> list[Array]:
    """Return how far drives are still from their angles after each step of a lead, (n_drives,) each, the last left out.

    No step where all drives are near: they close by themselves.
    """
    n = int(np.ceil(np.abs(way).max(initial=0.0) / FAR))
    return [way * (1 - k / n) for k in range(1, n)]


# rotations that are closed the wrong way round: rows of products of axes vanish at half a turn as well ----------------
# A fixed orientation is held by x_A·y' = y_A·z' = z_A·x' = 0, axes x', y', z' of B that should lie along those of A, an
# axis by E·n_1 = E·n_2 = 0, E of A, n_1 × n_2 the axis of B. With R the rotation between the two, the first are
# R_12 = R_23 = R_31 = 0: fulfilled where R = 1, at half a turn about x, y or z, and nowhere else (R is orthogonal, so
# that the other numbers of R can only be 1 or -1, or all zero but R_13, R_21, R_32, a third of a turn about the
# diagonal); the second where the axes are parallel or opposite. Newton's method ends at the nearest of them.


def require_no_half_turns(compiled: CompiledSystem, work: Work, state: State) -> None:
    """Raise `ModelError` naming a joint whose axes are closed against each other where they should lie along.

    Parameters
    ----------
    compiled
        The system.
    work
        Working arrays; overwritten.
    state
        With its joints closed, in the frames of the engine.
    """
    model = compiled.model
    if not (model.rows.kind == DOT).any():
        return
    set_iterate(work, state)
    linearized(model, work, 1.0, 0.0, 0.0)
    for c, name in enumerate(compiled.connection_names):
        if model.connections.law[c] != JOINT:
            continue
        rows = np.arange(model.connections.w0[c], model.connections.w0[c + 1])
        rows = rows[model.rows.kind[rows] == DOT]
        if len(rows) < 2 or np.abs(model.rows.c[rows]).any():
            continue
        A, B = work.markers.A[model.connections.a[c]], work.markers.A[model.connections.b[c]]
        x, y = A @ model.rows.x[rows].T, B @ model.rows.y[rows].T  # columns
        if len(rows) == 2 and np.allclose(x[:, 0], x[:, 1]):
            along = [float(x[:, 0] @ np.cross(y[:, 0], y[:, 1]))]
        elif len(rows) == 3:
            along = [float(x[:, k] @ y[:, k - 1]) for k in range(3)]
        else:
            continue
        if min(along) < 0.5:
            turn = "half a turn" if min(along) < -0.5 else "a third of a turn"
            raise ModelError(
                f"joint {name!r} is closed {turn} away from the orientation that it holds, where its equations vanish "
                "as well; place its bodies nearer to it, or turn the axis (axis_b, rotation) that is given for it"
            )


# how many constraints repeat others, told from constraints that are poorly conditioned --------------------------------
# Joints of a tree never repeat each other: each brings a body of its own, and N, the motions of the bodies by the
# coordinates of the tree, spans all that they allow. So the rank of all constraints G is
#
#     rank G = rows of the tree + rank (G_c N),      G_c the rows of what closes loops,
#
# where a chain of any length has no G_c at all, though the least singular value of G, scaled by the masses, falls with
# the square of the number of its links. Rows of G_c N are scaled to length one, coordinates by the mass that they move.
# Its small singular values belong to repeated constraints if there is a gap above them, or if they are rounding; those
# of long trusses fall without a gap. Few constraints that are well conditioned as they are, which is the rule, are not
# looked at so closely: N would want the kernels of relative coordinates, compiled at their first use.


FEW = 200  #: rows, up to which all are looked at first: that takes milliseconds
WELL = 1e-6  #: least eigenvalue of G M⁻¹ Gᵀ, rows scaled to length one, of constraints none of which repeats others
SMALL = 1e-5  #: singular value by the largest, below which constraints may repeat others
GAP = 1e-3  #: of the next larger one, if they do
ROUNDING = 1e-11  #: singular value by the largest, or row by what it holds of bodies alone, that is none


def repeated_constraints(compiled: CompiledSystem, work: Work, tree: Tree, state: State) -> int:
    """Return how many of the rows that joints and elements hold repeat others at a state; arrays are overwritten."""
    model = compiled.model
    closing = is_held(model.rows.kind) & (tree.kept_row >= 0)
    if not closing.any():
        return 0
    if is_held(model.rows.kind).sum() <= FEW:
        rows, _ = scaled_constraints(model, work, state)
        if np.linalg.eigvalsh(rows @ rows.T)[0] > WELL:
            return 0
    set_iterate(work, state)
    parts = linearized(model, work, 1.0, 0.0, 0.0)
    G, N = parts.G[closing], coordinate_motions(compiled, tree, state)
    mass, alone = np.zeros(N.shape[1]), np.zeros(G.shape[0])
    for i, H in enumerate(with_mass_for_all(model, parts.H)):
        u = slice(int(model.bodies.u0[i]), int(model.bodies.u0[i + 1]))
        mass += np.einsum("us,uv,vs->s", N[u], H, N[u], optimize=True)
        alone += (G[:, u].power(2) @ (1 / np.diag(H))) if G[:, u].nnz else 0.0
    C = (G @ N) / np.sqrt(np.maximum(mass, np.finfo(float).tiny))
    size = np.linalg.norm(C, axis=1)
    is_none = size <= ROUNDING * np.sqrt(alone)
    return int(is_none.sum()) + dependent_count(C[~is_none] / size[~is_none, None])


def dependent_count(C: Array) -> int:
    """Return by how much the rank of rows of length one is below their number."""
    if not len(C):
        return 0
    values = np.linalg.svd(C, compute_uv=False)
    ends = [
        k
        for k in range(1, len(values))
        if values[k] <= ROUNDING * values[0] or (values[k] <= SMALL * values[0] and values[k] <= GAP * values[k - 1])
    ]
    return len(C) - (ends[0] if ends else len(values))
