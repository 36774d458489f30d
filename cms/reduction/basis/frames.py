"""Body reference frames: the condition that separates elastic displacement from rigid-body motion (docs/theory.md §4).

A frame is a condition Wᵀ u = 0 with six rows. It changes columns v to v - Psi_R (Wᵀ Psi_R)⁻¹ Wᵀ v, the same deformation
relative to the frame. M depends on the frame, K does not.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cms.body.reduced_body import BodyFrame
from cms.errors import BodyError
from cms.linear_algebra.lu_factors import solve_factored
from cms.reduction.basis.node_results import node_weights, weighted_rigid_modes
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.foundation.arrays import MOTION_COMPONENTS, Array, IntArray
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import checked_fields
from fe_models.foundation.tall.columns import inner, rows_times
from fe_models.foundation.words import nearest, quoted
from fe_models.meshes.numbering import Numbering

__all__ = [
    "FRAMES", "BuckensFrame", "Frame", "FrameCondition", "HeldFrame", "NodalFrame", "TisserandFrame",
    "determinate_rows", "frame_condition",
]  # fmt: skip

NO_INERTIA = 1e-12  #: moment of inertia relative to the largest, below which it counts as zero
RANK_TOLERANCE = 1e-8  #: smallest pivot of the fixed dofs: a lever arm divided by the extent of the nodes
Axes = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class NodalFrame:
    """Frame attached to six dofs that do not deform: dofs of an interface, given dofs, or automatically chosen dofs.

    Its origin is the reference point of the interface (or the centre of mass if none is named); its axes are the mesh
    axes. For an interface of kind "nodes", pivoted QR chooses six determinate dofs to fix.

    Parameters
    ----------
    at
        Name of the interface; None: given dofs, or six chosen from all boundary dofs.
    origin
        Origin in mesh coordinates, (3,) [m]; None: the reference point of the interface, or the centre of mass.
    axes
        x, y and z axis of the frame in mesh axes, orthonormal; None: the mesh axes.
    dofs
        Six statically determinate dofs, each (node, component): the node as an index from 0 with a component 0 to 5, or
        as a number in the user's mesh (or "INSTANCE.number") with a component name "ux" to "rz".
    """

    at: str | None = None
    origin: tuple[float, float, float] | None = None
    axes: Axes | None = None
    dofs: tuple[tuple[int | str, int | str], ...] | None = None


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class TisserandFrame:
    """Mean-axis frame: Psi_Rᵀ M u = 0 minimises relative kinetic energy; origin at the undeformed centre of mass [1]_.

    Parameters
    ----------
    origin
        Origin in mesh coordinates, (3,) [m]; None: the undeformed centre of mass.
    axes
        x, y and z axis of the frame in mesh axes, orthonormal; None: the mesh axes.

    References
    ----------
    .. [1] Canavin & Likins (1977), docs/bibliography.md; docs/theory.md §4.
    """

    origin: tuple[float, float, float] | None = None
    axes: Axes | None = None


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class BuckensFrame:
    """Frame of least deformation: Psi_Rᵀ W u = 0 minimises Σ w |u|² over the nodes; origin at their weighted centre.

    w is the volume of each node (`FEBody.node_volumes`), or 1 if it is unknown; only translations count.

    Parameters
    ----------
    origin
        Origin in mesh coordinates, (3,) [m]; None: the weighted centre of the nodes.
    axes
        x, y and z axis of the frame in mesh axes, orthonormal; None: the mesh axes.
    """

    origin: tuple[float, float, float] | None = None
    axes: Axes | None = None


@dataclass(frozen=True)
class HeldFrame:
    """Frame of a body that is fixed to the ground: the mesh axes, which elastic displacement does not move."""

    origin: tuple[float, float, float] | None = None  #: origin in mesh coordinates [m]; None: the mesh origin
    axes: Axes | None = None  #: x, y and z axes of the frame in mesh axes, orthonormal; None: the mesh axes


Frame = NodalFrame | TisserandFrame | BuckensFrame
FRAMES: dict[str, type[Frame]] = {"nodal": NodalFrame, "tisserand": TisserandFrame, "buckens": BuckensFrame}


@dataclass(frozen=True, eq=False)
class FrameCondition:
    """A frame condition evaluated for one body."""

    frame: BodyFrame
    rigid_part: Callable[[Array], Array]  #: maps columns (n_dof, k) to C (6, k); the frame removes Psi_R C
    Psi_R: Array  #: rigid-body modes about the centre of mass, (n_dof, 6); (n_dof, 0) for a held body
    M_Psi_R: Array  #: M Psi_R, of the same shape as Psi_R
    W: Array  #: W Psi_R, (n_dof, 6); the frame condition is (W Psi_R)ᵀ u = 0
    center: Array  #: centre of mass, the reference point of Psi_R, in mesh axes, (3,) [m]


def frame_condition(body: FEBody, frame: Frame | HeldFrame) -> FrameCondition:
    """Evaluate a frame for a body: find its fixed dofs or its mass matrix, and its origin.

    Raises
    ------
    BodyError
        If the named interface or the given dofs do not hold the body, or the body has no mass or no inertia.
    """
    if isinstance(frame, HeldFrame) != body.is_held:
        raise BodyError(
            f"body {body.name!r}: is declared as held to the ground; its frame is the ground: omit the frame"
            if body.is_held
            else f"body {body.name!r}: is free; a HeldFrame is for a body that is held to the ground"
        )
    if isinstance(frame, HeldFrame):
        none = np.zeros((body.n_dof, 0))
        at = placed("held", frame, np.zeros(3))
        return FrameCondition(at, lambda columns: np.zeros((0, columns.shape[1])), none, none, none, np.zeros(3))
    Psi_0 = rigid_motion_of_dofs(body.nodes, body.dofs)
    rigid_mass = Psi_0.T @ (body.M @ Psi_0)
    mass = rigid_mass[0, 0]
    if not mass > 0:
        raise BodyError(f"body {body.name!r}: its mass is {mass:g}; expected a positive mass")
    # first moment from the coupling of translation and rotation: ∫ u·(theta × c) = theta·(c × u)
    center = np.array([rigid_mass[1, 5], rigid_mass[2, 3], rigid_mass[0, 4]]) / mass
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs, center)
    M_Psi_R = body.M @ Psi_R
    factor = cholesky_of_inertia(body.name, Psi_R.T @ M_Psi_R)
    if isinstance(frame, TisserandFrame):
        return FrameCondition(
            placed("tisserand", frame, center),
            lambda columns: la.cho_solve(factor, inner(M_Psi_R, columns)),
            Psi_R,
            M_Psi_R,
            M_Psi_R,
            center,
        )
    if isinstance(frame, BuckensFrame):
        weights = node_weights(body)
        middle = weights @ body.nodes / weights.sum() if weights.any() else center
        W_Psi_R = weighted_rigid_modes(body, center)
        if W_Psi_R is None:
            raise BodyError(
                f"body {body.name!r}: a Buckens frame needs at least three nodes with translations that are not on one "
                "line; take a Tisserand or a nodal frame"
            )
        norm = la.lu_factor(W_Psi_R.T @ Psi_R)
        return FrameCondition(
            placed("buckens", frame, middle),
            lambda columns: solve_factored(norm, inner(W_Psi_R, columns)),
            Psi_R,
            M_Psi_R,
            W_Psi_R,
            center,
        )
    held, rows = nodal_rows(body, frame)
    default = center if frame.at is None else body.interface(frame.at).reference
    lu = la.lu_factor(rows @ Psi_R)
    return FrameCondition(
        placed("nodal", frame, default, held),
        lambda columns: solve_factored(lu, rows_times(rows, columns)),
        Psi_R,
        M_Psi_R,
        rows.T.toarray(),
        center,
    )


def placed(kind: str, frame: Frame | HeldFrame, default_origin: Array, held: IntArray | None = None) -> BodyFrame:
    """Return the body frame with the requested or default origin and axes."""
    origin = default_origin if frame.origin is None else np.asarray(frame.origin, dtype=float)
    axes = np.eye(3) if frame.axes is None else np.array(frame.axes, dtype=float).T
    if axes.shape != (3, 3) or not np.abs(axes.T @ axes - np.eye(3)).max() < 1e-8 or np.linalg.det(axes) < 0:
        raise BodyError(f"{kind} frame: axes: expected three orthonormal right-handed axes, got {frame.axes}")
    at = (frame.at or "") if isinstance(frame, NodalFrame) else ""
    return BodyFrame(kind, origin, axes, at, np.zeros((0, 2), np.int64) if held is None else held)


def nodal_rows(body: FEBody, frame: NodalFrame) -> tuple[IntArray, sp.csr_array]:
    """Return the fixed dofs of a nodal frame, (node, component), (6, 2), and S in u_fixed = S u, (6, n_dof)."""
    if frame.dofs is not None:
        return given_rows(body, frame)
    candidates = body.b if frame.at is None else body.interface(frame.at).dofs
    if candidates is None or len(candidates) == 0:
        raise BodyError(
            f"body {body.name!r}: a nodal frame needs boundary dofs; couple an interface or take a Tisserand frame"
        )
    node, component = body.dofs[candidates].T
    held = candidates[determinate_rows(body.nodes[node], component, f"body {body.name!r}")]
    rows = sp.csr_array((np.ones(6), (np.arange(6), held)), shape=(6, body.n_dof))
    return body.dofs[held], rows


def given_rows(body: FEBody, frame: NodalFrame) -> tuple[IntArray, sp.csr_array]:
    """Return the dofs given by the user, after checking that there are six and that they prevent rigid-body motion."""
    where = f"body {body.name!r}: nodal frame"
    held = checked_dofs(frame, where, body.numbering)
    rows = []
    for node, component in held:
        own = np.flatnonzero((body.dofs == (node, component)).all(axis=1))
        if len(own):
            rows.append(sp.csr_array(([1.0], ([0], own[:1])), shape=(1, body.n_dof)))
            continue
        on_mesh = np.zeros(0, np.int64)
        if body.recovery is not None:
            on_mesh = np.flatnonzero((body.recovery.dofs == (node, component)).all(axis=1))
        if body.recovery is None or not len(on_mesh):
            raise BodyError(f"{where}: node {node} has no component {component}; there are {len(body.nodes)} nodes")
        rows.append(body.recovery.matrix[on_mesh[:1]])
    determinate_rows(body.nodes[held[:, 0]], held[:, 1], where)
    return held, sp.csr_array(sp.vstack(rows))


def checked_dofs(frame: NodalFrame, where: str, numbering: Numbering, index: IntArray | None = None) -> IntArray:
    """Return the given dofs of a nodal frame as (node index, component), (6, 2), after checking their form.

    Parameters
    ----------
    numbering
        Numbering that translates the user's numbers.
    index
        Node index of each row of the numbering; None: the row itself.
    """
    if frame.at is not None:
        raise BodyError(f"{where}: expected either at (an interface) or dofs, got both")
    pairs: list[tuple[int | str, int | str]] = []
    if any(len(pair) != 2 for pair in frame.dofs or ()):
        raise BodyError(f"{where}: dofs: expected six pairs (node, component), got {frame.dofs}")
    for node, component in frame.dofs or ():
        if isinstance(component, str):
            if component not in MOTION_COMPONENTS:
                hint = nearest(component, MOTION_COMPONENTS)
                raise BodyError(f"{where}: dofs: no component {quoted(component)}{hint}")
            row = int(numbering.rows_of_node(f"{where}: dofs", node)[0])
            pairs.append((row if index is None else int(index[row]), MOTION_COMPONENTS.index(component)))
        else:
            pairs.append((node, component))
    held = np.asarray(pairs)
    if held.shape != (6, 2) or held.dtype.kind not in "iu" or held.min() < 0 or held[:, 1].max() > 5:
        raise BodyError(f"{where}: dofs: expected six pairs (node, component 0-5), got {frame.dofs}")
    return held.astype(np.int64)


def determinate_rows(points: Array, components: IntArray, where: str) -> IntArray:
    """Choose six of the dofs (point, component) that exactly prevent rigid-body motion, ascending, (6,).

    Pivoted QR of the rigid-body motions of the dofs about their mean, with rotations scaled by their radius. Only
    translations are used if they suffice.

    Raises
    ------
    BodyError
        If the dofs leave a rigid-body motion free.
    """
    arms = points - points.mean(axis=0)
    radius = float(np.sqrt((arms**2).sum(axis=1).mean())) or 1.0
    arms = np.round(arms / radius, 9)  # rounded, so that rounding errors do not decide between equally good dofs
    motion = np.zeros((len(points), 6))
    is_rotation = components >= 3
    axis = np.eye(3)[components % 3]
    motion[~is_rotation, :3] = axis[~is_rotation]
    motion[~is_rotation, 3:] = np.cross(arms[~is_rotation], axis[~is_rotation])  # e·(theta × c) = theta·(c × e)
    motion[is_rotation, 3:] = axis[is_rotation]
    rank = 0
    for candidates in (np.flatnonzero(~is_rotation), np.arange(len(points))):
        _, R, pivots = la.qr(motion[candidates].T, mode="economic", pivoting=True)
        sizes = np.abs(np.diag(R))
        rank = int((sizes > RANK_TOLERANCE * max(sizes.max(initial=0.0), 1.0)).sum())
        if rank == 6:
            return np.sort(candidates[pivots[:6]])
    raise BodyError(
        f"{where}: {len(points)} dofs hold only {rank} of the 6 rigid-body motions; take an interface with six dofs, "
        "or more nodes that are not on one line"
    )


def cholesky_of_inertia(name: str, rigid_mass: Array) -> tuple[Array, bool]:
    """Factorise the rigid-body mass matrix about the centre of mass, (6, 6), or its moments of inertia, (3, 3).

    Raises
    ------
    BodyError
        If the body has no moment of inertia about some axis. No frame can move with such a body, because its rotation
        about that axis is undetermined.
    """
    turns = np.sqrt(np.abs(np.diag(rigid_mass)[-3:]))
    scale = np.concatenate([np.sqrt(np.diag(rigid_mass)[:-3]), np.maximum(turns, NO_INERTIA * turns.max())])
    is_point = not turns.any()
    values, axes = (np.zeros(1), np.eye(6)) if is_point else np.linalg.eigh(rigid_mass / np.outer(scale, scale))
    if values[0] < NO_INERTIA:
        axis = np.zeros(3) if is_point else (axes[:, 0] / scale)[-3:]
        words = "any axis" if is_point else f"the axis {np.round(axis / np.linalg.norm(axis), 3).tolist()}"
        raise BodyError(
            f"body {name!r}: has no moment of inertia about {words} through its centre of mass, as where all "
            "masses lie on one line; no frame can turn with it: give masses an inertia (CONM2 I11 to I33, [masses.NAME]"
            f" inertia), or the beams a density (expected {NO_INERTIA:.0e} of the largest inertia)"
        )
    return la.cho_factor(rigid_mass)
