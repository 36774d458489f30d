"""Reduce: a coupled FEBody and a mode set become a ReducedBody in a body frame."""

import platform
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import metadata

import numpy as np

from cms.arrays import Array, IntArray
from cms.couplings import mean_motion
from cms.errors import BodyError, ModeSetError
from cms.fe_body import FEBody, Interface
from cms.finishing import FinishedBasis, finish
from cms.frames import Frame, TisserandFrame, frame_condition
from cms.invariants import Moments, moments_from_gram
from cms.matrix_moments import gram_from_matrices
from cms.mode_set import ModeSet
from cms.reduced_body import BodyFrame, ReducedBody, ReducedInterface

__all__ = ["Damping", "ModalDamping", "RayleighDamping", "reduce"]


@dataclass(frozen=True)
class ModalDamping:
    """The same damping ratio for every mode: D = diag(2 ratio omega)."""

    ratio: float  #: of critical damping, 0 <= ratio

    def __post_init__(self) -> None:
        if not 0 <= self.ratio < np.inf:
            raise ModeSetError(f"damping: ratio = {self.ratio}; expected 0 or more (0.01 is 1 % of critical)")


@dataclass(frozen=True)
class RayleighDamping:
    """D = alpha M + beta K."""

    alpha: float = 0.0  #: [1/s]
    beta: float = 0.0  #: [s]

    def __post_init__(self) -> None:
        if not (0 <= self.alpha < np.inf and 0 <= self.beta < np.inf):
            raise ModeSetError(f"damping: alpha = {self.alpha}, beta = {self.beta}; expected 0 or more")


Damping = ModalDamping | RayleighDamping


def reduce(body: FEBody, modes: ModeSet, *, frame: Frame | None = None, damping: Damping | None = None) -> ReducedBody:
    """Reduce a body to the span of a mode set.

    Parameters
    ----------
    body
        A coupled body.
    modes
        A mode set of that body.
    frame
        Body reference frame; Tisserand (mean axis) by default.
    damping
        Added to the body's own D, which is projected; none by default.

    Raises
    ------
    ModeSetError
        If the set does not belong to the body, or nothing elastic is left.
    BodyError
        If the body is a mechanism, or the frame cannot be attached.
    """
    if modes.columns.shape[0] != body.n_dof:
        raise ModeSetError(
            f"reduce: mode set {modes.name!r} has columns of {modes.columns.shape[0]} dofs, body "
            f"{body.name!r} has {body.n_dof}; make the set from this body"
        )
    frame = frame or TisserandFrame()
    condition = frame_condition(body, frame)
    finished = finish(body, modes, condition)
    kept = kept_nodes(body)
    axes, origin = condition.frame.axes, condition.frame.origin
    sources = tuple(dict.fromkeys(modes.groups))
    in_source = np.array([[group == source for source in sources] for group in modes.groups], dtype=float)
    # components in B; exact zeros of aligned axes stay exact
    Phi_kept = np.einsum("ba,nbk->nak", axes, body.translations(finished.Phi)[kept])
    index_of = np.full(len(body.nodes), -1, np.int64)
    index_of[kept] = np.arange(len(kept))
    return ReducedBody(
        name=body.name,
        units=body.units,
        frame=condition.frame,
        M=finished.M,
        K=finished.K,
        D=reduced_damping(body, finished, damping),
        labels=mode_labels(modes, finished),
        energy_shares=finished.energy_shares @ in_source,
        sources=sources,
        moments=reduced_moments(body, finished.Phi, condition.frame),
        free_frequencies=np.sqrt(np.maximum(finished.free_omega2, 0.0)) / (2 * np.pi),
        nodes=(body.nodes[kept] - origin) @ axes,
        node_ids=kept,
        Phi=Phi_kept,
        surface=index_of[body.surface],
        interfaces=tuple(
            reduced_interface(body, interface, finished.Phi, condition.frame, index_of) for interface in body.interfaces
        ),
        provenance=reduction_provenance(body, modes, finished, damping),
    )


def kept_nodes(body: FEBody) -> IntArray:
    """Return the nodes a reduced body keeps: surface, interface members and reference nodes, ascending."""
    parts = [body.surface.ravel()] + [interface.nodes for interface in body.interfaces]
    parts += [body.dofs[interface.dofs, 0] for interface in body.interfaces if interface.dofs is not None]
    return np.unique(np.concatenate(parts))


def reduced_moments(body: FEBody, Phi: Array, frame: BodyFrame) -> Moments:
    """Canonical moments of the shapes in the frame B, by the exact element integrals where the body has them."""
    if body.element_model is not None:
        gram = body.element_model.mass_gram(body.mesh_displacement(Phi))
    else:
        gram = gram_from_matrices(body, Phi)
    # a_B = L a_mesh with c_B = axesᵀ (c - origin), phi_B = axesᵀ phi
    n = Phi.shape[1]
    L = np.zeros((4 + 3 * n, 4 + 3 * n))
    L[0, 0] = 1.0
    L[1:4, 0] = -frame.axes.T @ frame.origin
    L[1:4, 1:4] = frame.axes.T
    L[4:, 4:] = np.kron(frame.axes.T, np.eye(n))
    return moments_from_gram(L @ gram @ L.T, is_exact=body.element_model is not None)


def reduced_interface(
    body: FEBody, interface: Interface, Phi: Array, frame: BodyFrame, index_of: IntArray
) -> ReducedInterface:
    """Motion of an interface with the modes: of its reference node, or the mean motion of its nodes."""
    if interface.dofs is None:
        raise BodyError(f"body {body.name!r}: interface {interface.name!r} is not coupled; call cms.couple(body)")
    has_reference_node = len(interface.dofs) == 6 and len(np.unique(body.dofs[interface.dofs, 0])) == 1
    if has_reference_node:
        Psi = Phi[interface.dofs]
        reference = body.nodes[body.dofs[interface.dofs[0], 0]]
    else:
        members = body.translations(Phi)[interface.nodes]
        reference = interface.reference
        Psi = _mean_motion_or_translation(body, interface) @ members.reshape(-1, Phi.shape[1])
    R = frame.axes.T
    return ReducedInterface(
        interface.name,
        interface.kind,
        position=R @ (reference - frame.origin),
        triad=R @ interface.triad,
        Psi=np.concatenate([R @ Psi[:3], R @ Psi[3:]]),
        members=index_of[interface.nodes],
    )


def _mean_motion_or_translation(body: FEBody, interface: Interface) -> Array:
    """Mean motion of a nodes interface; its translation only where the nodes are on one line."""
    points, weights = body.nodes[interface.nodes], np.asarray(interface.weights)
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if len(points) >= 3 and spread[1] > 1e-6 * spread[0]:
        return mean_motion(points, weights, interface.reference)
    translation = np.kron(weights, np.eye(3))
    return np.vstack([translation, np.zeros_like(translation)])


def reduced_damping(body: FEBody, finished: FinishedBasis, damping: Damping | None) -> Array:
    """Return D* = Phiᵀ D Phi plus the modal or Rayleigh part, (n_q, n_q) [1/s]."""
    omega2, mass = np.diag(finished.K), np.diag(finished.M)
    D = np.zeros((len(omega2), len(omega2)))
    if body.D is not None:
        D += finished.Phi.T @ (body.D @ finished.Phi)
        D = (D + D.T) / 2
    if isinstance(damping, ModalDamping):
        D += np.diag(2 * damping.ratio * np.sqrt(omega2) * mass)
    elif isinstance(damping, RayleighDamping):
        D += np.diag(damping.alpha * mass + damping.beta * omega2)
    return D


def mode_labels(modes: ModeSet, finished: FinishedBasis) -> tuple[str, ...]:
    """Say in words which columns carry a mode's energy: the largest one or two with their shares."""
    labels = []
    for shares in finished.energy_shares:
        order = np.argsort(shares)[::-1]
        parts = [order[0]] if shares[order[0]] > 0.9 or len(order) < 2 or shares[order[1]] < 0.05 else order[:2]
        labels.append(", ".join(f"{modes.labels[k]} ({100 * shares[k]:.0f} %)" for k in parts))
    return tuple(labels)


def reduction_provenance(
    body: FEBody, modes: ModeSet, finished: FinishedBasis, damping: Damping | None
) -> Mapping[str, str]:
    """Record what the reduced body was made from and by which versions."""
    versions = {f"version {name}": metadata.version(name) for name in ("numpy", "scipy")}
    try:
        versions["version floatframe"] = metadata.version("floatframe")
    except metadata.PackageNotFoundError:  # run from a checkout that is not installed
        versions["version floatframe"] = "unknown"
    return {
        **dict(body.provenance),
        "mode set": modes.name,
        **{f"mode set {key}": value for key, value in modes.options.items()},
        "mode set columns": str(modes.columns.shape[1]),
        "mode set redundant": "; ".join(finished.dropped) or "none",
        "mode set rigid-body motions removed": str(finished.n_rigid),
        "full dofs": str(body.n_dof),
        "damping": str(damping) if damping else "none",
        "version python": platform.python_version(),
        **versions,
    }
