"""Reduction of a coupled FEBody by a mode set to a ReducedBody in a body frame."""

import logging
import platform
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from importlib import metadata
from typing import Any

import numpy as np

from cms.body.error_estimates import ErrorEstimates
from cms.body.invariants import NEGATIVITY, Moments, NodalSums, moments_from_gram
from cms.body.reduced_body import BodyFrame, ReducedBody, ReducedInterface, unit_findings
from cms.errors import ModeSetError
from cms.modes.families.cost import (
    chosen_words,
    left_out_words,
    require_room_for_stiffness,
)
from cms.modes.families.families import Families, body_of, families_of
from cms.modes.mode_set import ModeSet
from cms.reduction.basis.damping import Damping, modal_damping
from cms.reduction.basis.finishing import FinishedBasis, finish
from cms.reduction.basis.frames import Frame, FrameCondition, HeldFrame, TisserandFrame, frame_condition
from cms.reduction.basis.free_basis import basis_of_finished
from cms.reduction.basis.matrix_moments import gram_from_matrices
from cms.reduction.basis.node_results import (
    kept_points,
    nodal_stress_modes,
    node_weights,
    point_stress_modes,
    reference_motion,
    translation_rows,
    weighted_rigid_modes,
)
from cms.reduction.basis.strain_damping import StrainDamping
from cms.reduction.error_estimates import error_estimates, require_one_process
from cms.reduction.geometric_stiffness.geometric_reduction import stiffness_of_states
from cms.reduction.geometric_stiffness.quadratic_modes import quadratic_modes
from cms.reduction.geometric_stiffness.unit_states import (
    UnitStates,
    has_geometric_stiffness,
    require_geometric_stiffness,
    unit_states,
)
from cms.reduction.recovery.load_columns import nodes_of_loads
from cms.reduction.recovery.matrices import recovery_of_model, unique
from cms.reduction.recovery.request import RecoveryRequest
from fe_models.body.fe_body import FEBody, Interface
from fe_models.body.kept_nodes import keep_nodes
from fe_models.body.load_cases import LoadCase, ReducedLoadCase
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.tall.columns import in_memory, inner, rows_times
from fe_models.foundation.tall.on_disk import release, zeros_like
from fe_models.foundation.threads import one_blas_thread

__all__ = ["assembled", "reduce"]

log = logging.getLogger(__name__)

#: distance of the frame from the mesh origin divided by the radius of gyration, beyond which R loses two digits
FAR = 10.0
OF_MASSES = 1e-9  #: largest negativity that rounding causes in the moments of a mass distribution
ROUNDING = 1e3 * np.finfo(float).eps  #: relative rounding error of a second moment about the mesh origin
SHAPES_AT_ONCE = 64  #: number of shapes whose displacements of all nodes are in memory at a time


def reduce(
    source: FEBody | Families,
    modes: ModeSet,
    *,
    frame: Frame | HeldFrame | None = None,
    damping: Damping | StrainDamping | None = None,
    stress: bool = True,
    geometric: bool | UnitStates | None = None,
    quadratic: bool = False,
    keep: Sequence[Any] = (),
    recovery: RecoveryRequest | Iterable[RecoveryRequest] = (),
    errors: bool | None = None,
) -> ReducedBody:
    """Reduce a body to the span of a mode set.

    Parameters
    ----------
    source
        A coupled body, or the `Families` that made `modes`; the geometric stiffness then reuses their factorisation.
    modes
        A mode set of this body.
    frame
        Body reference frame. Default: the frame of the given static states, else Tisserand (mean axis), or the ground
        for a held body.
    damping
        Damping in addition to the projection of the body's own D; default: none.
    stress
        Whether to keep the stress of the modes at the kept nodes and the stress points, if the body provides it.
    geometric
        Whether to add the geometric stiffness of the unit loads (`cms.body.GeometricStiffness`). With it, a multibody
        system stiffens the body by its spin, accelerations and interface loads. Default: True if the elements are
        known and it needs at most 2 GB (`cms.modes.families.cost`); otherwise a warning and the provenance say that
        it is left out. It costs a factorisation (unless `source` has one), the static solution of 12 + 6 n_interfaces
        loads, and one pass over the elements. The static states of the unit loads (`unit_states`) may be given instead
        of True: they need no further factorisation, and `frame` is then omitted.
    quadratic
        Whether to add quadratic modes, the second-order displacement of every kept node (`quadratic_modes`), together
        with the geometric stiffness that supplies their inertia. They are meant for slender bodies and cost three
        static solutions per kept node.
    keep
        Nodes to keep with translations and rotations, in addition to surface and interfaces: numbers of the user's
        mesh, names of sets, or positions [x, y, z] in mesh axes (`fe_models.body.keep_nodes`); "all" keeps every node.
        Nodes of lines and point masses are always kept.
    recovery
        Tables of recovery rows to add (`ReducedBody.recovery`): motions, stress, forces in elements and at interfaces,
        with their static part, which needs the factorisation.
    errors
        Whether to estimate the errors of frequencies, shapes and static responses (`ReducedBody.errors`), which needs
        the factorisation and about as many solutions as the set has vibration modes. Default: True if `source` is
        `Families` that have been factorised.

    Raises
    ------
    ModeSetError
        If the set does not belong to the body, or no elastic shape is left.
    BodyError
        If the body is a mechanism or the frame cannot be attached; if the geometric stiffness is requested of a body
        without an element model, or does not fit into the memory of this machine; or if errors are requested of a body
        that is distributed over ranks.
    RecoveryError
        If the body does not know a requested recovery row.
    """
    body = body_of(source)
    states = geometric if isinstance(geometric, UnitStates) else None
    of_interfaces = None if states is None else [interface.name for interface in states.interfaces]
    left_out = ""
    if geometric or quadratic:
        require_geometric_stiffness(body)
        require_room_for_stiffness(body, modes.columns.shape[1], of_interfaces)
    elif geometric is None:
        geometric = has_geometric_stiffness(body)
        left_out = left_out_words(body, modes.columns.shape[1]) if geometric else ""
    if modes.columns.shape[0] != body.n_dof:
        raise ModeSetError(
            f"reduce: mode set {modes.name!r} has columns of {modes.columns.shape[0]} dofs, body "
            f"{body.name!r} has {body.n_dof}; make the set from this body"
        )
    if errors:
        require_one_process(body)
    if left_out:
        log.warning("body %r: %s", body.name, left_out)
        geometric = False
    if states is None:
        condition = frame_condition(body, frame or (HeldFrame() if body.is_held else TisserandFrame()))
        states = unit_states(source, frame=condition) if geometric or quadratic else None
    elif states.body is body and frame is None:
        condition = states.condition
    else:
        raise ModeSetError(
            f"reduce: the unit states belong to body {states.body.name!r} in a {states.condition.frame.kind} frame; "
            f"expected states of this body object {body.name!r}, and no other frame"
        )
    finished = finish(body, modes, condition)
    keeping = keep_nodes(body, keep) if keep else body
    if recovery and len(loaded := nodes_of_loads(body, unique(recovery))):
        keeping = replace(keeping, kept=np.concatenate([keeping.kept, loaded]))
    kept = kept_nodes(keeping)
    moments = reduced_moments(body, finished.Phi, condition.frame)
    told = {"geometric stiffness": left_out if of_interfaces is None else chosen_words(body, of_interfaces)}
    if moments.is_exact and moments.negativity > OF_MASSES:
        told[NEGATIVITY] = f"{moments.negativity:.3g}"
    reduced = assembled(keeping, modes, finished, condition, kept=kept, moments=moments, damping=damping)
    for _, text in unit_findings(reduced):
        log.warning("body %r: %s", body.name, text)
    if errors is None:
        errors = isinstance(source, Families) and source.has_factor
    return replace(
        reduced,
        errors=errors_of(source, modes, finished, condition.frame) if errors else None,
        provenance={**reduced.provenance, **{key: words for key, words in told.items() if words}},
        recovery=recovery_of_model(source, in_memory(finished.Phi), condition, reduced, recovery) if recovery else {},
        stress=nodal_stress_modes(body, finished.Phi, kept, condition.frame.axes) if stress else None,
        point_stress=point_stress_modes(body, body.stress_points, finished.Phi, condition.frame)
        if stress and body.stress_points is not None
        else None,
        geometric=None if states is None else stiffness_of_states(body, finished.Phi, states),
        quadratic=quadratic_modes(source, in_memory(finished.Phi), condition, kept) if quadratic else None,
    )


def errors_of(source: FEBody | Families, modes: ModeSet, finished: FinishedBasis, frame: BodyFrame) -> ErrorEstimates:
    """Return the estimated errors, from a factorisation of its own if the source has none."""
    with families_of(source) as families, one_blas_thread():
        return error_estimates(families, modes, basis_of_finished(families, finished), finished.Phi, frame)


def assembled(
    body: FEBody,
    modes: ModeSet,
    finished: FinishedBasis,
    condition: FrameCondition,
    *,
    kept: IntArray,
    moments: Moments,
    damping: Damping | StrainDamping | None = None,
) -> ReducedBody:
    """Return the reduced body of a finished basis at the kept nodes, without stress and second-order terms.

    Parameters
    ----------
    kept
        Kept nodes of the body, ascending, (n_kept,); they include the surface and the members of interfaces.
    moments
        Moments of the shapes in the frame of `condition`.
    """
    axes, origin = condition.frame.axes, condition.frame.origin
    Phi_kept = kept_translations(body, finished.Phi, kept, axes)
    index_of = np.full(len(body.nodes), -1, np.int64)
    index_of[kept] = np.arange(len(kept))
    return ReducedBody(
        name=body.name,
        units=body.units,
        frame=condition.frame,
        M=finished.M,
        K=finished.K,
        D=reduced_damping(body, finished, damping),
        labels=finished.columns.mode_labels(),
        energy_shares=finished.columns.group_shares(),
        sources=finished.columns.sources,
        moments=moments,
        free_frequencies=np.sqrt(np.maximum(finished.free_omega2, 0.0)) / (2 * np.pi),
        nodes=(body.nodes[kept] - origin) @ axes,
        node_ids=kept,
        Phi=Phi_kept,
        surface=index_of[body.surface],
        numbering=body.numbering.of_rows(kept, len(body.nodes)),
        kept=kept_points(body, finished.Phi, axes, index_of) if len(body.kept) else None,
        interfaces=tuple(
            reduced_interface(body, interface, finished.Phi, condition.frame, index_of) for interface in body.interfaces
        ),
        provenance=reduction_provenance(body, modes, finished, damping),
        columns=finished.columns,
        nodal_sums=reduced_nodal_sums(body, finished.Phi, condition.frame),
        load_cases=tuple(reduced_load_case(body, case, finished.Phi, condition.frame) for case in body.load_cases),
    )


def kept_translations(body: FEBody, Phi: Array, nodes: IntArray, axes: Array) -> Array:
    """Return the translations of the shapes at some nodes in axes of B, (n, 3, n_q), in blocks of shapes."""
    kept, rows = zeros_like(Phi, (len(nodes), 3, Phi.shape[1])), translation_rows(body, nodes)
    for first in range(0, Phi.shape[1], SHAPES_AT_ONCE):
        some = slice(first, first + SHAPES_AT_ONCE)
        moved = rows_times(rows, Phi[:, some]).reshape(len(nodes), 3, -1)
        kept[:, :, some] = np.einsum("ba,nbk->nak", axes, moved)  # exact zeros remain exact if the axes are aligned
        release(kept)
    return kept


def kept_nodes(body: FEBody) -> IntArray:
    """Return the nodes that a reduced body keeps: surface, interfaces, reference nodes, requested nodes; ascending."""
    parts = [body.surface.ravel(), body.kept] + [interface.nodes for interface in body.interfaces]
    parts += [body.dofs[interface.dofs, 0] for interface in body.interfaces if interface.dofs is not None]
    return np.unique(np.concatenate(parts))


def reduced_moments(body: FEBody, Phi: Array, frame: BodyFrame) -> Moments:
    """Return the canonical moments of the shapes in B, from exact element integrals if the body has them."""
    if body.element_model is None:
        gram = gram_from_matrices(body, Phi, frame.origin)
        return moments_from_gram(gram_in_frame(gram, replace(frame, origin=np.zeros(3))), is_exact=False)
    gram = gram_in_frame(body.element_model.mass_gram(body.mesh_displacement(Phi)), frame)
    return moments_from_gram(with_near_second_moment(gram, body, frame))


def with_near_second_moment(gram: Array, body: FEBody, frame: BodyFrame) -> Array:
    """Return the Gram matrix with more accurate first and second moments if B is far from the mesh origin.

    About the mesh origin R has a relative error of eps (distance / size)². Here the moments are computed about the
    origin of B, from the displacements of unit rotations, which are the coordinates: e_z × c has the y component c_x.
    All dofs of the mesh are used, including fixed dofs. The given array is overwritten if the new moments agree with
    the old ones except for rounding.
    """
    assert body.element_model is not None
    own, far = float(np.trace(gram[1:4, 1:4])), float(gram[0, 0] * (frame.origin @ frame.origin))
    if not far > FAR**2 * own:
        return gram
    turns = rigid_motion_of_dofs(body.nodes, body.to_mesh.dofs, frame.origin)[:, 3:]
    near = body.element_model.mass_gram(turns)
    of = [0, 4 + 3 + 2, 4 + 6 + 0, 4 + 0 + 1]  # rows of mass, y of the third column, z of the first, x of the second
    near = near[np.ix_(of, of)]
    near[1:] = frame.axes.T @ near[1:]
    near[:, 1:] = near[:, 1:] @ frame.axes
    if np.abs(near - gram[:4, :4])[1:, 1:].max() <= ROUNDING * far:
        gram[:4, :4] = near
    return gram


def gram_in_frame(gram: Array, frame: BodyFrame) -> Array:
    """Return the Gram matrix of a_B, c_B = axesᵀ (c - origin), phi_B = axesᵀ phi, from that of a = [1, c, phi].

    Components of all shapes are grouped, (4 + 3 n_q, 4 + 3 n_q). The given array is overwritten.
    """
    n = (len(gram) - 4) // 3
    L = np.eye(4)
    L[1:, 0] = -frame.axes.T @ frame.origin
    L[1:, 1:] = frame.axes.T
    gram[:4] = L @ gram[:4]
    gram[:, :4] = gram[:, :4] @ L.T
    if not np.array_equal(frame.axes, np.eye(3)):  # exact numbers stay exact if the axes are aligned
        rows = gram[4:].reshape(3, n * len(gram))
        rows[:] = frame.axes.T @ rows
        for part in np.array_split(gram, max(1, gram.nbytes // 2**26)):
            part[:, 4:] = (frame.axes.T @ part[:, 4:].reshape(len(part), 3, n)).reshape(len(part), 3 * n)
    return gram


def reduced_nodal_sums(body: FEBody, Phi: Array, frame: BodyFrame) -> NodalSums | None:
    """Return weighted sums of the shapes over the nodes in frame B; None if there is no Buckens frame."""
    W_Psi_R = weighted_rigid_modes(body, frame.origin)
    if W_Psi_R is None:
        return None
    U = inner(W_Psi_R, Phi)
    weights, c = node_weights(body), (body.nodes - frame.origin) @ frame.axes
    return NodalSums(
        w=weights.sum(),
        S=weights @ c,
        R=c.T @ (weights[:, None] * c),
        U1=frame.axes.T @ U[:3],
        U2=frame.axes.T @ U[3:],
        is_volume=body.node_volumes is not None,
    )


def reduced_load_case(body: FEBody, case: LoadCase, Phi: Array, frame: BodyFrame) -> ReducedLoadCase:
    """Return the modal forces of a load case, and its resultant wrench about the origin of B."""
    wrench = rigid_motion_of_dofs(body.nodes, body.dofs, frame.origin).T @ case.f
    R = frame.axes.T
    h = inner(Phi, case.f[:, None])[:, 0]
    return ReducedLoadCase(case.name, case.kind, force=R @ wrench[:3], torque=R @ wrench[3:], h=h)


def reduced_interface(
    body: FEBody, interface: Interface, Phi: Array, frame: BodyFrame, index_of: IntArray
) -> ReducedInterface:
    """Return how an interface moves with the modes: motion of its reference node, or mean motion of its nodes."""
    motion = reference_motion(body, interface)
    Psi = rows_times(motion.rows, Phi)
    R = frame.axes.T
    return ReducedInterface(
        interface.name,
        interface.kind,
        position=R @ (motion.point - frame.origin),
        triad=R @ interface.triad,
        Psi=np.concatenate([R @ Psi[:3], R @ Psi[3:]]),
        members=index_of[interface.nodes],
        has_rotation=motion.has_rotation,
    )


def reduced_damping(body: FEBody, finished: FinishedBasis, damping: Damping | StrainDamping | None) -> Array:
    """Return Phiᵀ D Phi plus modal or Rayleigh damping or damping of strain patterns, (n_q, n_q) [1/s]."""
    D = np.zeros_like(finished.K)
    if body.D is not None:
        Phi = in_memory(finished.Phi)
        D += Phi.T @ (body.D @ Phi)
        D = (D + D.T) / 2
    if isinstance(damping, StrainDamping):
        D += damping.reduced(body, finished.Phi, finished.K)
    elif damping is not None:
        D += modal_damping(damping, finished.M, finished.K, second=body.units.time)
    return D


def reduction_provenance(
    body: FEBody, modes: ModeSet, finished: FinishedBasis, damping: Damping | StrainDamping | None
) -> Mapping[str, str]:
    """Return the sources of the reduced body, and the versions of the programs."""
    versions = {f"version {name}": metadata.version(name) for name in ("numpy", "scipy")}
    try:
        versions["version floatframe"] = metadata.version("floatframe")
    except metadata.PackageNotFoundError:  # a checkout that is not installed
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
