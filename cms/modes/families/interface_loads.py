"""Mass and stiffness of neighbouring bodies as loads of the interfaces (Benfield-Hruda, docs/theory.md §3)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.errors import BodyError, ModeSetError
from fe_models.body.couplings.couplings import mean_motion
from fe_models.body.fe_body import FEBody, Interface
from fe_models.foundation.arrays import Array, frozen, require_finite, require_shape
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.tall.columns import of_this_process

__all__ = ["InterfaceLoad", "boundary_load", "condensed_load", "point_load"]

INDEFINITE = 1e-10  #: relative negative eigenvalue of a scaled load, above which it is more than rounding
COLLINEAR = 1e-6  #: ratio of the second radius of the members to the first, below which they are collinear


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class InterfaceLoad:
    """Mass and stiffness over the motions of one interface, or of several interfaces that a neighbour connects.

    The motion of an interface is that of its reference point: three translations and three rotations along its own axes
    (its triad). Rows and columns follow the order of `interfaces`.

    Parameters
    ----------
    interfaces
        Names of the interfaces to which the neighbour connects.
    M
        Mass of the neighbour, (6 n, 6 n) [kg, kg m, kg m²].
    K
        Stiffness of the neighbour, (6 n, 6 n) [N/m, N, N m].
    """

    interfaces: tuple[str, ...]
    M: Array
    K: Array

    def __post_init__(self) -> None:
        where = f"load of interfaces {', '.join(self.interfaces)}"
        object.__setattr__(self, "interfaces", tuple(self.interfaces))
        if len(set(self.interfaces)) != len(self.interfaces) or not self.interfaces:
            raise BodyError(f"{where}: expected the names of interfaces, each once")
        for name in ("M", "K"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
            _require_semidefinite(f"{where}: {name}", getattr(self, name), 6 * len(self.interfaces))


def point_load(
    interface: str,
    *,
    mass: float = 0.0,
    inertia: float | Sequence[float] = 0.0,
    stiffness: float | Sequence[float] = 0.0,
    rotational_stiffness: float | Sequence[float] = 0.0,
) -> InterfaceLoad:
    """Return the load of a point mass and of springs to the ground at the reference point of an interface.

    Parameters
    ----------
    interface
        Name of the interface.
    mass
        Mass [kg].
    inertia
        Moment of inertia about the reference point: one number for all axes, or three for the interface axes [kg m²].
    stiffness
        Translational stiffness: one number or three [N/m].
    rotational_stiffness
        Rotational stiffness: one number or three [N m].

    Raises
    ------
    BodyError
        If a number is negative or not finite.
    """
    three = [np.broadcast_to(np.asarray(v, dtype=float), 3) for v in (mass, inertia, stiffness, rotational_stiffness)]
    return InterfaceLoad(
        (interface,), np.diag(np.concatenate([three[0], three[1]])), np.diag(np.concatenate([three[2], three[3]]))
    )


def condensed_load(neighbour: FEBody, interfaces: Mapping[str, str]) -> InterfaceLoad:
    """Return the load of a neighbouring body, statically condensed (Guyan) to the shared interfaces.

    Its other interfaces are free. Its shared interfaces must be rigid or distributing, with the reference points and
    axes of the interfaces to which they are joined.

    Parameters
    ----------
    neighbour
        A coupled body in the same units.
    interfaces
        Name of the neighbour's interface for each of our interfaces.

    Raises
    ------
    BodyError
        If the neighbour lacks such an interface, or it is of kind "nodes".
    """
    from dataclasses import replace

    from cms.modes.families.families import Families

    shared = tuple(neighbour.interface(name) for name in interfaces.values())
    for interface in shared:
        if interface.dofs is None or len(interface.dofs) != 6 or len(np.unique(neighbour.dofs[interface.dofs, 0])) > 1:
            raise BodyError(
                f"condensed_load: body {neighbour.name!r}: interface {interface.name!r} of kind {interface.kind!r} "
                "has no reference node with six dofs; couple it as a rigid or distributing interface"
            )
    to_motion = la.block_diag(*[_to_interface_axes(interface) for interface in shared])
    with Families(replace(neighbour, interfaces=shared)) as families:
        Psi = of_this_process(families.Psi_C[:, : 6 * len(shared)]) @ to_motion.T
        rigid = to_motion @ families.Psi_R[families.body.b]
    # a free body has no energy in its rigid-body motions; rounding there would act as a spring, perhaps a negative one
    size = np.where(np.arange(len(rigid)) % 6 < 3, 1.0, 1 / neighbour.length)
    elastic = la.null_space((rigid / size[:, None]).T)
    keep = (size[:, None] * elastic) @ (elastic.T / size)
    return InterfaceLoad(
        tuple(interfaces), _gram(Psi, neighbour.M @ Psi), keep.T @ _gram(Psi, neighbour.K @ Psi) @ keep
    )


def boundary_load(body: FEBody, loads: Sequence[InterfaceLoad]) -> tuple[Array, Array]:
    """Return K_load and M_load over the boundary dofs of a coupled body, (n_b, n_b) each.

    Loads of an interface of kind "nodes" act on the mean motion of its nodes.

    Raises
    ------
    BodyError
        If a load names an unknown interface.
    ModeSetError
        If there is no load, or all loads are zero.
    """
    b = body.b
    position = {dof: k for k, dof in enumerate(b.tolist())}
    K, M = np.zeros((len(b), len(b))), np.zeros((len(b), len(b)))
    for load in loads:
        parts = [body.interface(name) for name in load.interfaces]
        rows = np.array([position[dof] for part in parts for dof in np.asarray(part.dofs).tolist()])
        motion = la.block_diag(*[interface_motion(body, part) for part in parts])
        K[np.ix_(rows, rows)] += motion.T @ load.K @ motion
        M[np.ix_(rows, rows)] += motion.T @ load.M @ motion
    if not K.any() and not M.any():
        choices = ", ".join(interface.name for interface in body.interfaces) or "none"
        raise ModeSetError(
            f"body {body.name!r}: loaded-interface modes need the mass or stiffness of the neighbours on at least one "
            f"interface, got none; give loads for one of: {choices}"
        )
    return (K + K.T) / 2, (M + M.T) / 2


def interface_motion(body: FEBody, interface: Interface) -> Array:
    """Return A in [d; theta] = A u, (6, n): motion along the axes of an interface, from its boundary dofs u.

    This is the motion of its single node, or the mean motion of its nodes (mean translation if they are collinear).
    """
    dofs = np.asarray(interface.dofs)
    node, component = body.dofs[dofs].T
    A = np.zeros((6, len(dofs)))
    if len(np.unique(node)) == 1:
        A[component, np.arange(len(dofs))] = 1.0
        return _to_interface_axes(interface) @ A
    nodes, first = np.unique(node, return_index=True)
    nodes = nodes[np.argsort(first)]
    points = body.nodes[nodes]
    member_weights = dict(zip(interface.nodes.tolist(), np.asarray(interface.weights).tolist(), strict=True))
    weights = np.array([member_weights[n] for n in nodes.tolist()])
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if len(points) >= 3 and spread[1] > COLLINEAR * spread[0]:
        mean = mean_motion(points, weights, interface.reference)
    else:
        mean = np.vstack([np.kron(weights, np.eye(3)), np.zeros((3, 3 * len(points)))])
    index = {n: k for k, n in enumerate(nodes.tolist())}
    for k, (n, c) in enumerate(zip(node.tolist(), component.tolist(), strict=True)):
        if c < 3:
            A[:, k] = mean[:, 3 * index[n] + c]
    return _to_interface_axes(interface) @ A


def _to_interface_axes(interface: Interface) -> Array:
    return la.block_diag(interface.triad.T, interface.triad.T)


def _gram(X: Array, AX: Array) -> Array:
    G = X.T @ AX
    return (G + G.T) / 2


def _require_semidefinite(where: str, A: Array, n: int) -> None:
    require_shape(where, A, (n, n))
    require_finite(where, A)
    if np.abs(A - A.T).max(initial=0.0) > 1e-9 * np.abs(A).max(initial=0.0):
        raise BodyError(f"{where}: expected a symmetric matrix, got |A - A.T| = {np.abs(A - A.T).max():.2g}")
    diagonal = np.diag(A)
    if (diagonal < 0).any():
        raise BodyError(f"{where}: expected no negative mass, inertia or stiffness, got {diagonal.min():g}")
    size = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    values = la.eigvalsh(A / np.outer(size, size))
    if values[0] < -INDEFINITE * max(values[-1], 1.0):
        raise BodyError(f"{where}: expected a positive semidefinite matrix, got an eigenvalue below zero")
