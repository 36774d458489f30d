"""Floating-frame body in the form of other multibody programs: modes, matrices, integrals, nodal motion."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np

from cms.body.geometric_stiffness import GeometricStiffness
from cms.body.invariants import Moments, moments_from_gram
from cms.body.reduced_body import BodyFrame, ReducedBody, ReducedInterface, unit_findings
from cms.errors import ForeignBodyError
from cms.exchange.importers.superelement import listed
from cms.exchange.importers.superelement_body import ImportOptions
from cms.linear_algebra.elastic_pencil import elastic_eigenvectors, stiffness_scale
from cms.linear_algebra.solvers.eigen import orientation
from cms.reduction.basis.damping import modal_damping
from cms.reduction.basis.frames import TisserandFrame
from cms.reduction.basis.node_results import are_spread, mean_translation
from cms.reduction.frame_conversion import convert_frame
from cms.reduction.free_pencil import free_elastic_modes, has_inertia
from fe_models.body.couplings.couplings import mean_motion
from fe_models.body.load_cases import ReducedLoadCase
from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import ArrayShape, FrozenMapping, checked_fields, frozen_copies
from fe_models.meshes.numbering import Numbering

__all__ = ["ForeignInterface", "ModalBody", "body_of_modes"]


# modal body -----------------------------------------------------------------------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
class ForeignInterface:
    """Interface of a foreign body: its nodes, and its motion if the file contains it."""

    name: str
    nodes: IntArray  #: node numbers, (n,)
    position: Array | None = None  #: position in B, (3,)
    triad: Array = field(default_factory=lambda: np.eye(3))  #: axes in B as columns, (3, 3)
    Psi: Array | None = None  #: translation and rotation in each mode in B, (6, n_q); None: computed from its nodes

    def __post_init__(self) -> None:
        object.__setattr__(self, "nodes", frozen(self.nodes, np.int64))


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError, misfit=ForeignBodyError)
class ModalBody:
    """Matrices and integrals over the modes of a foreign body in its own frame B, in the units of the file.

    Raises
    ------
    ForeignBodyError
        If shapes do not fit or a number is not finite.
    """

    name: str
    M: Annotated[Array, ArrayShape(("n_q", "n_q"))]  #: modal mass
    K: Annotated[Array, ArrayShape(("n_q", "n_q"))]  #: modal stiffness
    D: Annotated[Array | None, ArrayShape(("n_q", "n_q"))]  #: modal damping
    moments: Moments  #: inertia moments in B
    node_numbers: Annotated[IntArray, ArrayShape(("n_nodes",))]
    nodes: Annotated[Array, ArrayShape(("n_nodes", 3))]  #: undeformed node positions in B
    Phi: Annotated[Array, ArrayShape(("n_nodes", 3, "n_q"))]  #: translations of the nodes in each mode
    #: rotations of the nodes in each mode; None: unknown
    rotations: Annotated[Array | None, ArrayShape(("n_nodes", 3, "n_q"))] = None
    #: stress xx yy zz yz xz xy at the nodes in each mode
    stress: Annotated[Array | None, ArrayShape(("n_nodes", 6, "n_q"))] = None
    #: triangles as indices of `nodes`
    surface: Annotated[IntArray, ArrayShape((None, 3))] = field(default_factory=lambda: np.zeros((0, 3), np.int64))
    interfaces: tuple[ForeignInterface, ...] = ()  #: interfaces named in the file
    load_cases: tuple[ReducedLoadCase, ...] = ()
    #: geometric stiffness in mean axes; its interfaces are the nodes, in their order
    geometric: GeometricStiffness | None = None
    program: str = ""
    provenance: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        where = f"body {self.name!r}"
        n, n_nodes = len(self.K), len(self.node_numbers)
        object.__setattr__(self, "provenance", FrozenMapping(dict(self.provenance)))
        if not n:
            raise ForeignBodyError(
                f"{where}: expected at least one mode, got none; a rigid body does not need this file"
            )
        if len(np.unique(self.node_numbers)) != n_nodes:
            raise ForeignBodyError(f"{where}: node_numbers: a number is there twice")
        if self.moments.n_q != n:
            raise ForeignBodyError(f"{where}: {n} modes in the stiffness, {self.moments.n_q} in the mass integrals")
        if self.geometric is not None and self.geometric.interfaces.shape != (n_nodes, 6, n, n):
            raise ForeignBodyError(
                f"{where}: geometric stiffness: expected 6 matrices ({n}, {n}) of each of {n_nodes} nodes, got "
                f"{self.geometric.interfaces.shape}"
            )
        for name in ("M", "K", "D"):
            matrix = getattr(self, name)
            if matrix is not None:
                defect, size = np.abs(matrix - matrix.T).max(), np.abs(matrix).max()
                if defect > 1e-6 * size:
                    raise ForeignBodyError(
                        f"{where}: {name}: expected a symmetric matrix, |A - Aᵀ| is {defect / size:.1e} of |A|"
                    )
                object.__setattr__(self, name, frozen((matrix + matrix.T) / 2))

    @property
    def n_q(self) -> int:
        """Number of modes."""
        return int(np.asarray(self.K).shape[0])


# modal route ----------------------------------------------------------------------------------------------------------
# A body of another multibody program becomes ours: modes made M-orthonormal and K-diagonal, in a frame of ours.


log = logging.getLogger(__name__)

ONE_BODY = 1e-4  #: difference of M* from modal mass divided by the largest entry; above it, the mode order is wrong
MEAN_AXES = 1e-8  #: momentum of a mode divided by the largest for its mass; below it, it is rounding in the file
NO_ENERGY = 1e-13  #: squared frequency of a mode divided by the largest one, up to which it counts as zero
FEW = 12  #: largest number of nodes with rotations that become interfaces if none are named


def body_of_modes(body: ModalBody, options: ImportOptions) -> ReducedBody:
    """Convert a foreign modal body.

    (1) check that integrals and modal mass belong to one body: M* = M
    (2) solve K z = omega² M z for M-orthonormal, K-diagonal modes; none of them may be a rigid-body motion
    (3) transform all data that are linear in the modes to the new modes
    (4) choose the frame: if no mode has momentum, it already is the frame of mean axes; otherwise the body is converted
        to mean axes, or to the requested frame

    Raises
    ------
    ForeignBodyError
        If the file contradicts itself, a rigid-body motion is among its modes, or an interface is unknown.
    """
    where = f"body {body.name!r}"
    if options.inertia is not None:
        raise ForeignBodyError(f"{where}: has its own mass integrals; additional masses are only for superelements")
    require_one_body(where, body)  # (1)
    stiffness, mass = np.diag(body.K), np.diag(body.M)
    if (mass <= 0).all() or not (stiffness > 0).any():
        raise ForeignBodyError(f"{where}: expected modes with mass and stiffness, got none")
    try:
        Z, is_massive = elastic_eigenvectors(body.K, body.M, stiffness_scale(body.K, body.M))  # (2)
    except np.linalg.LinAlgError as error:
        raise ForeignBodyError(f"{where}: {error}; its modes are not independent") from error
    omega2 = np.einsum("lk,lm,mk->k", Z, body.K, Z)
    free = int((omega2 <= NO_ENERGY * omega2.max()).sum())
    if free:
        raise ForeignBodyError(
            f"{where}: {free} of its modes have no energy: a rigid-body motion or a mechanism is among them; a "
            "floating-frame body must have neither: write it without rigid-body modes"
        )
    Z = Z @ orientation((np.asarray(body.Phi) @ Z).reshape(-1, body.n_q), omega2)
    moments = changed(body.moments, Z)  # (3)
    places = {int(number): k for k, number in enumerate(body.node_numbers)}
    interfaces = tuple(
        reduced_interface(where, body, interface, Z, places) for interface in interfaces_of(where, body, options)
    )
    K, M = np.diag(omega2), np.diag(is_massive.astype(float))
    D = np.zeros_like(K) if body.D is None else Z.T @ body.D @ Z
    if options.damping is not None:
        D = D + modal_damping(options.damping, M, K, second=options.units.time)
    names = tuple(f"mode {k + 1} of the file" for k in range(body.n_q))
    shares = (Z**2 * np.diag(body.K)[:, None]).T
    shares = shares / np.maximum(shares.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    in_mean_axes = momentum_of(moments) <= MEAN_AXES
    reduced = ReducedBody(
        name=body.name,
        units=options.units,
        frame=BodyFrame("tisserand" if in_mean_axes else "nodal", np.zeros(3)),
        M=M,
        K=K,
        D=(D + D.T) / 2,
        labels=tuple(label_of(names, share) for share in shares),
        energy_shares=np.ones((body.n_q, 1)),
        sources=("modes of the file",),
        moments=moments,
        free_frequencies=np.zeros(0),
        nodes=body.nodes,
        node_ids=body.node_numbers,
        numbering=Numbering(nodes=body.node_numbers),
        Phi=np.asarray(body.Phi) @ Z,
        surface=body.surface,
        interfaces=interfaces,
        provenance={
            **body.provenance,
            "mode set": "modes of the file",
            "frame of the file": "mean axes" if in_mean_axes else "another one: its modes carry momentum",
            "inertia": f"of the file; missing: {', '.join(moments.missing) or 'nothing'}",
        },
        load_cases=tuple(replace(case, h=Z.T @ case.h) for case in body.load_cases),
        stress=None if body.stress is None else np.asarray(body.stress) @ Z,
        geometric=geometric_at(where, body, interfaces, Z) if in_mean_axes else None,
    )
    reduced = replace(reduced, free_frequencies=free_frequencies(where, reduced))
    require_plausible(where, reduced, options.accept)
    if options.frame is None and in_mean_axes:  # (4)
        return reduced
    if body.geometric is not None and not in_mean_axes:
        log.warning("%s: its geometric stiffness belongs to a frame that the file does not name: left out", where)
    return convert_frame(reduced, options.frame or TisserandFrame())


def require_plausible(where: str, reduced: ReducedBody, accept: tuple[str, ...]) -> None:
    """Raise `ForeignBodyError` if size, density or first frequency is implausible in these units."""
    for is_error, text in unit_findings(reduced):
        if is_error and "units" not in accept:
            raise ForeignBodyError(
                f'{where}: {text}; name the units of the file, or confirm the values by accept = ["units"]'
            )
        log.warning("%s: %s", where, text)


def geometric_at(
    where: str, body: ModalBody, interfaces: tuple[ReducedInterface, ...], Z: Array
) -> GeometricStiffness | None:
    """Return the geometric stiffness over the new modes, if all interfaces are single nodes; otherwise None."""
    if body.geometric is None:
        return None
    if any(len(interface.members) != 1 for interface in interfaces):
        log.warning(
            "%s: its geometric stiffness is known for loads on single nodes, but an interface has several: left out; "
            "name interfaces of one node each",
            where,
        )
        return None
    rows = np.array([interface.members[0] for interface in interfaces], dtype=np.int64)
    return replace(body.geometric, interfaces=body.geometric.interfaces[rows], is_loaded=()).transformed(Z)


def free_frequencies(where: str, reduced: ReducedBody) -> Array:
    """Return the elastic frequencies of the body without joints, ascending; none without inertia about some axis."""
    if not has_inertia(reduced):
        return np.zeros(0)
    try:
        omega2, _, is_massive = free_elastic_modes(reduced)
    except np.linalg.LinAlgError as error:
        raise ForeignBodyError(
            f"{where}: its mass integrals and stiffness have no free modes ({error}); a sign, an order or a unit is "
            "wrong"
        ) from error
    return np.asarray(np.sqrt(np.maximum(omega2[is_massive], 0.0)) / (2 * np.pi))


def require_one_body(where: str, body: ModalBody) -> None:
    """Raise `ForeignBodyError` unless the modal mass agrees with the integrals, and the mass is positive."""
    if not body.moments.m > 0:
        raise ForeignBodyError(f"{where}: expected a mass above zero, got {body.moments.m:g}")
    defect, size = np.abs(body.moments.M - body.M).max(), np.abs(body.M).max()
    if not defect <= ONE_BODY * size:
        raise ForeignBodyError(
            f"{where}: the integrals of the shape functions do not agree with the modal mass: sum of S_aa and M "
            f"differ by {defect / size:.1e} of M; indices may be in another order, or the file mixes two models"
        )


def momentum_of(moments: Moments) -> float:
    """Return the largest ratio of the momentum of a mode to its upper bound; modes have unit mass."""
    c = moments.center_of_mass
    inertia = np.trace(moments.J0) - 2 * moments.m * float(c @ c)
    angular = moments.C2 - np.cross(c, moments.C1, axis=0)
    linear = np.linalg.norm(moments.C1, axis=0) / np.sqrt(moments.m)
    return float(max(linear.max(), (np.linalg.norm(angular, axis=0) / np.sqrt(max(inertia, 1e-300) / 2)).max()))


def changed(moments: Moments, Z: Array) -> Moments:
    """Return the moments of the shapes Phi Z."""
    n = moments.n_q
    L = np.zeros((4 + 3 * n, 4 + 3 * n))
    L[:4, :4], L[4:, 4:] = np.eye(4), np.kron(np.eye(3), Z.T)
    return moments_from_gram(L @ moments.gram @ L.T, is_exact=moments.is_exact, missing=moments.missing)


def interfaces_of(where: str, body: ModalBody, options: ImportOptions) -> Sequence[ForeignInterface]:
    """Return the interfaces: as requested, as named in the file, or one for each of a few nodes with rotations."""
    if options.interfaces is not None:
        wanted: Mapping[str, Sequence[int]] = options.interfaces
        return [ForeignInterface(name, np.array(numbers, dtype=np.int64)) for name, numbers in wanted.items()]
    if body.interfaces:
        return body.interfaces
    if body.rotations is not None and len(body.nodes) <= FEW:
        return [ForeignInterface(f"node {number}", np.array([number])) for number in body.node_numbers]
    log.warning("%s: has no interfaces, which joints need; name nodes (--interface NAME=3,11)", where)
    return []


def reduced_interface(
    where: str, body: ModalBody, interface: ForeignInterface, Z: Array, places: Mapping[int, int]
) -> ReducedInterface:
    """Return an interface with its motion from the file, from a node with rotations, or as mean of several nodes."""
    unknown = [int(number) for number in interface.nodes if int(number) not in places]
    if unknown or (not len(interface.nodes) and interface.Psi is None):
        raise ForeignBodyError(
            f"{where}: interface {interface.name!r}: expected nodes of the file, which are "
            f"{listed(np.asarray(body.node_numbers), 12)}; got {unknown or 'none'}"
        )
    members: IntArray = np.array([places[int(number)] for number in interface.nodes], dtype=np.int64)
    n = body.n_q
    has_rotation = True
    if interface.Psi is not None:
        Psi, position = np.asarray(interface.Psi), interface.position
    elif len(members) == 1:
        position = np.asarray(body.nodes)[members[0]]
        if body.rotations is None:
            raise ForeignBodyError(
                f"{where}: interface {interface.name!r}: node {int(interface.nodes[0])} has no rotations in the file; "
                "give three nodes or more that are not on one line"
            )
        Psi = np.concatenate([np.asarray(body.Phi)[members[0]], np.asarray(body.rotations)[members[0]]])
    else:
        points = np.asarray(body.nodes)[members]
        weights = np.full(len(members), 1 / len(members))
        position = points.mean(axis=0)
        has_rotation = are_spread(points)
        mean = mean_motion(points, weights, position) if has_rotation else mean_translation(weights)
        Psi = mean @ np.asarray(body.Phi)[members].reshape(3 * len(members), n)
    assert position is not None
    kind = "rigid" if interface.Psi is not None and not len(members) else "nodes"
    return ReducedInterface(interface.name, kind, position, interface.triad, Psi @ Z, members, has_rotation)


def label_of(names: tuple[str, ...], share: Array) -> str:
    """Name the one or two modes of the file with the largest energy shares in a mode."""
    order = np.argsort(share)[::-1]
    parts = [order[0]] if share[order[0]] > 0.9 or len(order) < 2 else order[:2]
    return ", ".join(f"{names[k]} ({100 * share[k]:.0f} %)" for k in parts)
