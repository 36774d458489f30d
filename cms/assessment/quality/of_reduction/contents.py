"""Comparison of every field of a modal file with its model, in the modes of the file.

(1) find the modes of the file over all dofs of the model, Phi, from their values at the kept nodes (`full_shapes`)
(2) compute each field from the model and Phi, by the functions that `reduce` uses
(3) divide the largest difference by the size of the field; modes have unit strain energy for stiffness and stress, and
    unit mass for inertia

The body is not reduced a second time, so signs, order and frame of the modes are free. If there are more than `FEW`
modes, the expensive fields are compared in `PROBES` random combinations, and every mode is part of each.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cms.assessment.quality.of_body.identities import mode_size
from cms.assessment.quality.of_reduction.fields import Compared, apart, same
from cms.assessment.quality.of_reduction.full_shapes import FullShapes, finished_in, named_frame
from cms.assessment.quality.record import QualityRecord, information, judge
from cms.body.error_estimates import ErrorEstimates
from cms.body.geometric_stiffness import UNIT_LOADS
from cms.body.invariants import known_P, known_S_kl
from cms.body.left_out_modes import LeftOutModes
from cms.body.recovery_table import N_RIGID, RecoveryTable
from cms.body.reduced_body import ReducedBody
from cms.body.source_columns import SourceColumns
from cms.errors import CmsError
from cms.modes.families.families import Families
from cms.modes.families.rigid_modes import rounding_of_energy
from cms.modes.mode_set import ModeSet
from cms.reduction.basis.damping import Damping, for_readers, modal_damping, stated_damping
from cms.reduction.basis.finishing import SUSPECT_ENERGY, FinishedBasis
from cms.reduction.basis.frames import Frame, FrameCondition, HeldFrame, frame_condition
from cms.reduction.basis.free_basis import FreeBasis
from cms.reduction.basis.node_results import nodal_stress_modes, point_stress_modes
from cms.reduction.basis.strain_damping import StrainDamping
from cms.reduction.error_estimates import STATIC_ROUNDING, error_estimates
from cms.reduction.geometric_stiffness.geometric_reduction import stiffness_of_states
from cms.reduction.geometric_stiffness.quadratic_modes import force_stiffness
from cms.reduction.geometric_stiffness.unit_states import has_geometric_stiffness, unit_states
from cms.reduction.recovery.load_columns import forces_of_loads
from cms.reduction.recovery.matrices import recovery_of_model
from cms.reduction.recovery.request import OF_INTERFACES, OF_MOTION, RecoveryRequest
from cms.reduction.reduction import assembled, kept_nodes, reduced_damping, reduced_moments
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.errors import FeModelsError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.tall.columns import in_memory

__all__ = ["CONTENTS", "ReductionOptions", "contents_records"]

FEW = 24  #: largest number of modes that are compared individually
PROBES = 12  #: number of random combinations of modes, if there are more modes
FEW_NODES = 20  #: largest number of nodes whose quadratic modes are compared individually
NODE_PROBES = 8  #: number of random combinations of nodes, if there are more nodes
ROUNDING_OF_ERRORS = 1e-6  #: estimated error of a mode that is rounding
DECADES_OF_LARGEST = 5.0  #: decades that count as one; largest errors are steps of half a decade at most
NEGLIGIBLE = 1e-3  #: smallest scale of a difference, relative to the largest possible size of the field
STRESS = (1.0, -1.0, -2.0)  #: dimensions of stress: exponents of mass, length and time
CONVERTED = "frame converted from"  #: provenance entry of a file that was converted to another frame
#: provenance that must agree with the model and its mode set; paths, versions and solvers may differ
OF_ORIGIN = ("full dofs", "mode set", "mode set columns", "mode set n_modes", "mesh sha256", "deck sha256")


@dataclass(frozen=True)
class ReductionOptions:
    """Options of `reduce` in the job of a file, which determine the expected content of the file."""

    damping: Damping | StrainDamping | None = None
    frame: Frame | HeldFrame | None = None
    stress: bool = True
    #: whether geometric stiffness is expected, or the interfaces whose loads it includes
    geometric: bool | tuple[str, ...] = False
    quadratic: bool = False
    recovery: tuple[RecoveryRequest, ...] = ()


@dataclass(frozen=True, eq=False)
class Case:
    """A modal file, its model, and its modes over all dofs."""

    body: FEBody
    modes: ModeSet
    reduced: ReducedBody
    Phi: Array  #: modes of the file over all dofs, mesh axes, (n_dof, n_q)
    families: Families
    basis: FreeBasis
    options: ReductionOptions | None

    @cached_property
    def length(self) -> float:
        """Size of the body [m]."""
        return self.body.length

    @cached_property
    def reach(self) -> float:
        """The larger of `length` and the largest distance of a node from the origin of B [m]."""
        own = (self.body.nodes - self.reduced.frame.origin) @ self.reduced.frame.axes
        return max(self.length, float(np.linalg.norm(own, axis=1).max(initial=0.0)))

    @cached_property
    def combined(self) -> Array:
        """Coefficients of the compared shapes: each mode, or random combinations of all modes, (n_q, k)."""
        n = self.reduced.n_q
        if n <= FEW:
            return np.eye(n)
        R = np.random.default_rng(29).normal(size=(n, PROBES))
        return R / np.linalg.norm(R, axis=0)

    @cached_property
    def by_energy(self) -> Array:
        """Coefficients `combined`, with modes scaled to unit strain energy, (n_q, k)."""
        stiffness = np.diag(self.reduced.K)
        return self.combined / np.sqrt(np.where(stiffness > 0, stiffness, 1.0))[:, None]

    @property
    def axes_words(self) -> str:
        """Name of one compared shape."""
        return "mode" if self.reduced.n_q <= FEW else "combination"

    @cached_property
    def condition(self) -> FrameCondition:
        """Frame condition of the frame that the file names, evaluated for the model."""
        return frame_condition(self.body, named_frame(self.reduced.frame))

    @cached_property
    def keeping(self) -> FEBody:
        """Model with a request to keep the nodes whose rotations are in the file."""
        kept = self.reduced.kept
        own = np.zeros(0, np.int64) if kept is None else self.reduced.node_ids[kept.nodes]
        return replace(self.body, kept=np.union1d(self.body.kept, own).astype(np.int64))

    @cached_property
    def node_ids(self) -> IntArray:
        """Node ids that the file must contain, and node ids that it contains."""
        return np.union1d(self.reduced.node_ids, kept_nodes(self.keeping)).astype(np.int64)

    @cached_property
    def finished(self) -> FinishedBasis:
        """Modes of the file over all dofs, with the matrices and columns of the file."""
        n = self.reduced.n_q
        return FinishedBasis(
            self.Phi, self.reduced.M, self.reduced.K,
            self.reduced.columns or SourceColumns(("",), ("",), np.zeros((1, n)), np.zeros((1, n))),
            dropped=(), n_rigid=0, free_omega2=np.zeros(0),
        )  # fmt: skip

    @cached_property
    def expected(self) -> ReducedBody:
        """Expected fields that are cheap to compute from model and modes; moments and columns are those of the file."""
        none = np.zeros((self.body.n_dof, 0))
        condition = FrameCondition(self.reduced.frame, lambda columns: none, none, none, none, np.zeros(3))
        made = assembled(
            self.keeping, self.modes, self.finished, condition, kept=self.node_ids, moments=self.reduced.moments
        )
        D, _ = wanted_damping(self)
        return replace(made, D=self.reduced.D if D is None else D)


def contents_records(
    body: FEBody,
    modes: ModeSet,
    reduced: ReducedBody,
    shapes: FullShapes | None,
    families: Families,
    basis: FreeBasis,
    options: ReductionOptions | None = None,
) -> tuple[QualityRecord, ...]:
    """Return the records that compare the file with its model, one for each of `CONTENTS`.

    Parameters
    ----------
    shapes
        Modes of the file over all dofs of the model; None if the kept nodes do not determine them.
    options
        Expected content of the file. None: damping is compared with the provenance, recovery tables are not compared.
    """
    if shapes is None:
        return tuple(information(name, "the file does not determine its modes over all dofs") for name in CONTENTS)
    case = Case(body, modes, reduced, shapes.Phi, families, basis, options)
    return tuple(record_of(name, case, compare) for name, compare in CONTENTS.items())


def record_of(name: str, case: Case, compare: Callable[[Case], Iterator[Compared]]) -> QualityRecord:
    """Return the record of the fields that one function compares."""
    found: list[Compared] = []
    try:
        found += compare(case)
    except (CmsError, FeModelsError, np.linalg.LinAlgError) as error:
        return judge(
            name, np.inf, f"the model cannot provide it: {error}", {"fields": {e.field: e.defect for e in found}}
        )
    if not found:
        return information(name, "the file contains none, and none was requested")
    worst = found[int(np.argmax([each.defect for each in found]))]  # NaN counts as the largest defect
    data: dict[str, float] = {}
    for each in found:
        data[each.field] = float(np.maximum(data.get(each.field, 0.0), each.defect))
    at = f" ({worst.where})" if worst.where else ""
    reason = f"{worst.field}{at}: {worst.doubt}" if worst.doubt else ""
    if not reason:
        reason = f"largest difference from the model is {worst.defect:.1e}, of {worst.field}{at}; {len(data)} fields"
    return judge(name, worst.defect, reason, {"fields": data})


def missing(field: str, where: str = "") -> Compared:
    """Return the comparison result for a missing field that the file should contain."""
    return Compared(field, np.inf, where, "the file does not contain it")


# Geometry -------------------------------------------------------------------------------------------------------------


def compare_points(case: Case) -> Iterator[Compared]:
    """Compare nodes, their numbers and sets, and the surface."""
    file, expected = case.reduced, case.expected
    yield same("node_ids", file.node_ids, case.node_ids)
    if len(file.node_ids) != len(case.node_ids):
        return
    yield apart("nodes", file.nodes, expected.nodes, case.length, axes="node")
    at = np.zeros((0, 3)) if not file.interfaces else np.array([each.position for each in file.interfaces])
    wanted = np.zeros((0, 3)) if not file.interfaces else np.array([each.position for each in expected.interfaces])
    at, wanted = (np.vstack([x, file.nodes]) for x in (at, wanted)) if at.shape == wanted.shape else (at, wanted)
    yield apart("frame.origin", at, wanted if at.shape == wanted.shape else at, case.length)
    span = np.ptp(expected.nodes, axis=0).max(initial=0.0) or case.length
    yield apart("frame.axes", file.nodes, expected.nodes, span)
    yield same("surface", file.surface, expected.surface)
    for name in ("nodes", "on_skin", "elements", "instances", "node_instance", "element_instance"):
        yield same(f"numbering.{name}", getattr(file.numbering, name), getattr(expected.numbering, name))
    own, sets = file.numbering.sets, expected.numbering.sets
    yield same("numbering.sets.name", tuple(s.name for s in own), tuple(s.name for s in sets))
    for a, b in zip(own, sets, strict=False):
        for name in ("kind", "members", "size"):
            yield same(f"numbering.sets.{name}", getattr(a, name), getattr(b, name), a.name)
    if expected.kept is not None:
        if file.kept is None:
            yield missing("kept.nodes")
        else:
            yield same("kept.nodes", file.kept.nodes, expected.kept.nodes)


def compare_frame(case: Case) -> Iterator[Compared]:
    """Compare the frame: evaluate the condition of the frame that the file names for its modes."""
    frame, made = case.reduced.frame, case.condition.frame
    C = case.condition.rigid_part(case.Phi)
    scale = np.repeat([1.0, case.length], 3)[: len(C)]
    rigid = np.abs(scale[:, None] * C) / mode_size(case.reduced)
    k = int(np.argmax(rigid.max(axis=0, initial=0.0)))
    words = f"rigid motion of mode {k + 1}, which a {frame.kind} frame does not have"
    defect = float(rigid.max(initial=0.0))
    yield Compared("frame.kind", defect, words if defect else "")
    yield Compared("frame.at", defect, words if defect else "")
    if frame.at and len(frame.dofs) and len(made.dofs):
        yield same("frame.dofs", frame.dofs, made.dofs)
    else:
        yield Compared("frame.dofs", defect, words if defect else "")


def compare_interfaces(case: Case) -> Iterator[Compared]:
    """Compare names, kinds, positions, axes, members and motions of the interfaces."""
    file, expected = case.reduced.interfaces, case.expected.interfaces
    yield same("interfaces.name", tuple(each.name for each in file), tuple(each.name for each in expected))
    size = mode_size(case.reduced)
    rows = np.repeat([1.0, 1 / case.length], 3)[:, None]
    for own, made in zip(file, expected, strict=False):
        for name in ("kind", "members", "has_rotation"):
            yield same(f"interfaces.{name}", getattr(own, name), getattr(made, name), own.name)
        yield apart("interfaces.position", own.position, made.position, case.length, own.name)
        yield apart("interfaces.triad", own.triad, made.triad, 1.0, own.name)
        yield apart("interfaces.Psi", own.Psi, made.Psi, rows * size, own.name, "motion mode")


def compare_rotations(case: Case) -> Iterator[Compared]:
    """Compare rotations of the kept points, and the origins of the rotations."""
    file, expected = case.reduced.kept, case.expected.kept
    if expected is None:
        return
    if file is None:
        yield missing("kept.rotation")
        return
    yield same("kept.source", file.source, expected.source)
    turn = np.abs(expected.rotation).max(axis=(0, 1), initial=0.0)
    size = np.maximum(turn, mode_size(case.reduced) / case.length)
    yield apart("kept.rotation", file.rotation, expected.rotation, size, axes="point component mode")


def compare_sums(case: Case) -> Iterator[Compared]:
    """Compare the weighted sums over the nodes."""
    file, expected = case.reduced.nodal_sums, case.expected.nodal_sums
    if file is None or expected is None:
        if expected is not None:
            yield missing("nodal_sums.w")
        elif file is not None:
            yield Compared("nodal_sums.w", np.inf, "", "the model has none")
        return
    w, L, size = expected.w, case.reach, mode_size(case.reduced)
    yield same("nodal_sums.is_volume", file.is_volume, expected.is_volume)
    scales: dict[str, Array | float] = {"w": w, "S": w * L, "R": w * L**2, "U1": w * size, "U2": w * L * size}
    for name, scale in scales.items():
        yield apart(f"nodal_sums.{name}", getattr(file, name), getattr(expected, name), scale)


def compare_errors(case: Case) -> Iterator[Compared]:
    """Compare the estimated errors of a file that has some; differences below 1e-6 are rounding."""
    file = case.reduced.errors
    if file is None:
        return
    expected = error_estimates(case.families, case.modes, case.basis, case.Phi, case.reduced.frame)
    names = ["method", "interface_loads"] + (["mesh_sign", "mesh_method"] if file.mesh_method else [])
    for name in names:
        yield same(f"errors.{name}", getattr(file, name), getattr(expected, name))
    yield same("errors.date", bool(file.date), True)
    for name in ("frequency", "bound", "shape", *(["response"] if len(file.response) else [])):
        wanted = getattr(expected, name)
        yield apart(f"errors.{name}", getattr(file, name), wanted, wanted + ROUNDING_OF_ERRORS, axes="mode")
    if file.mesh_method:  # files of older programs have no estimate
        got, wanted = (np.nan_to_num(each.mesh, nan=-1.0) for each in (file, expected))
        yield apart("errors.mesh", got, wanted, np.abs(wanted) + ROUNDING_OF_ERRORS, axes="mode")
    if len(file.largest):
        got, wanted = decades_of_largest(file), decades_of_largest(expected)
        yield apart("errors.largest", got, wanted, DECADES_OF_LARGEST, axes="mode")
    for name in ("interface", "inertia"):
        got, wanted = (np.nan_to_num(getattr(each, name), nan=-1.0) for each in (file, expected))
        yield apart(f"errors.{name}", got, wanted, np.abs(wanted) + STATIC_ROUNDING, axes="load")
    if file.left_out is not None and expected.left_out is not None:
        yield from compare_left_out(file.left_out, expected.left_out, case.reduced)
    elif file.left_out is not None:
        yield Compared("errors.left_out.mass", np.inf, "", "the modes of the model leave nothing out")


def decades_of_largest(errors: ErrorEstimates) -> Array:
    """Return the decades of the largest errors of frequencies; those without limit count as a thousand estimates."""
    unlimited = 1e3 * np.maximum(errors.frequency, ROUNDING_OF_ERRORS)
    largest = np.where(np.isnan(errors.largest), unlimited, errors.largest)
    return np.asarray(np.log10(np.maximum(largest, ROUNDING_OF_ERRORS)))


def compare_left_out(file: LeftOutModes, expected: LeftOutModes, reduced: ReducedBody) -> Iterator[Compared]:
    """Compare left-out shapes, which are unique up to a rotation, by the energies that their loads leave out.

    Modes that answer a load exactly leave only rounding out, which is compared with their own energy. Rounding also
    decides whether a nearly dependent direction becomes a shape, so vibration shapes that are missing count as
    massless.
    """
    forces = {
        "interfaces": np.concatenate([each.Psi for each in reduced.interfaces] or [np.zeros((0, reduced.n_q))]),
        "load_cases": np.array([each.h for each in reduced.load_cases]).reshape(-1, reduced.n_q),
    }
    n = max(len(file.mass), len(expected.mass))
    a, b = (np.pad(each.mass, (0, n - len(each.mass))) for each in (file, expected))
    yield apart("errors.left_out.mass", a, b, float(expected.mass.max()), axes="shape")
    a, b = ((each.shares * each.mass) @ each.shares.T for each in (file, expected))
    a, b = file.inertia @ a @ file.inertia.T, expected.inertia @ b @ expected.inertia.T
    yield apart("errors.left_out.shares", a, b, float(np.abs(b).max(initial=0.0)) or 1.0, axes="mode mode")
    for name in ("inertia", "interfaces", "spin", "load_cases"):
        x, y = (getattr(each, name).reshape(-1, each.n_left) for each in (file, expected))
        largest = float((y**2).sum(axis=1).max(initial=0.0))
        if name in forces:
            in_modes = (forces[name] ** 2 / np.diag(reduced.K)).sum(axis=1)
            largest += STATIC_ROUNDING**2 * float(in_modes.max(initial=0.0))
        yield apart(f"errors.left_out.{name}", x @ x.T, y @ y.T, largest or 1.0, axes="load load")


# Inertia and damping --------------------------------------------------------------------------------------------------


def compare_moments(case: Case) -> Iterator[Compared]:
    """Compare the moments, divided by the largest possible for a mode of unit mass; 1C to 5C follow from them.

    1C and 2C are also computed from the full mass matrix, which is exact for any body.
    """
    file, R = case.reduced.moments, case.combined
    frame = case.reduced.frame
    L = rigid_motion_of_dofs(case.body.nodes, case.body.dofs, frame.origin).T @ (case.body.M @ case.Phi)
    size = np.sqrt(file.m)
    yield apart("moments.C1", file.C1, frame.axes.T @ L[:3], size, "by the mass matrix", "component mode")
    yield apart(
        "moments.P", file.C2, frame.axes.T @ L[3:], size * case.length, "2C by the mass matrix", "component mode"
    )
    made = reduced_moments(case.body, case.Phi @ R, case.reduced.frame)
    if not file.missing:
        yield same("moments.is_exact", file.is_exact, made.is_exact)
    yield same("moments.missing", file.missing, made.missing)
    word = case.axes_words
    yield apart("moments.C1", file.C1 @ R, made.C1, size, axes=f"component {word}")
    P = known_P(made.P, file.missing)
    yield apart("moments.P", file.P @ R, P, size * case.reach, axes=f"- - {word}")
    S_kl = known_S_kl(made.S_kl, file.missing)
    yield apart("moments.S_kl", R.T @ file.S_kl @ R, S_kl, 1.0, axes=f"- - {word} {word}")


def compare_damping(case: Case) -> Iterator[Compared]:
    """Compare the damping matrix, scaled by frequency, with damping of the model plus that of the job or provenance."""
    D, words = wanted_damping(case)
    if D is None:
        return
    omega = np.sqrt(np.maximum(np.diag(case.reduced.K), 0.0))
    scale = np.sqrt(np.outer(omega, omega))
    scale = np.where(scale > 0, scale, 1.0)
    own, made = case.reduced.D / scale, D / scale
    size = max(np.abs(own).max(initial=0.0), np.abs(made).max(initial=0.0))
    yield apart("D", own, made, size or 1.0, words, "mode mode")


def wanted_damping(case: Case) -> tuple[Array | None, str]:
    """Return the expected damping matrix and its description; None if it is unknown."""
    reduced, options = case.reduced, case.options
    told = reduced.provenance.get("damping", "none")
    damping: Damping | StrainDamping | None = stated_damping(reduced)
    words = f"provenance: {for_readers(told)}"
    if CONVERTED in reduced.provenance:
        if options is None:
            return None, ""
        asked = str(options.damping) if options.damping else "none"
        if asked == told:
            D = carried_damping(case, options.damping, options.frame)
            return D, f"the job: {for_readers(asked)}, transformed to this frame"
        # the conversion replaced all damping by damping ratios of the new modes
        return None if damping is None or isinstance(damping, StrainDamping) else modal_damping(
            damping, reduced.M, reduced.K, second=reduced.units.time
        ), words
    if options is not None:
        damping, words = options.damping, f"the job: {for_readers(str(options.damping or 'none'))}"
    elif damping is None and told != "none":
        return None, ""
    return reduced_damping(case.body, case.finished, damping), words


def carried_damping(case: Case, damping: Damping | StrainDamping | None, frame: Frame | HeldFrame | None) -> Array:
    """Return Tᵀ D T, where D is the damping in the frame of the job, and Phi_job T = Phi up to rigid motion."""
    old = frame or named_frame(replace(case.reduced.frame, kind="tisserand", at=""))
    finished = finished_in(case.body, case.basis, old)
    Phi = in_memory(finished.Phi)
    T = (Phi.T @ (case.body.K @ case.Phi)) / np.diag(finished.K)[:, None]
    return np.asarray(T.T @ reduced_damping(case.body, finished, damping) @ T)


# Loads, stress, columns -----------------------------------------------------------------------------------------------


def compare_load_cases(case: Case) -> Iterator[Compared]:
    """Compare resultants and modal forces of load cases, relative to the sum of the nodal forces.

    A load on dofs that the frame fixes does no work in any mode: its modal forces are rounding errors of the shapes.
    """
    file, expected = case.reduced.load_cases, case.expected.load_cases
    yield same("load_cases.name", tuple(each.name for each in file), tuple(each.name for each in expected))
    is_turn = case.body.dofs[:, 1] >= 3
    for own, made, load in zip(file, expected, case.body.load_cases, strict=False):
        size = np.abs(load.f)
        force = float(size[~is_turn].sum() + size[is_turn].sum() / case.length)
        yield same("load_cases.kind", own.kind, made.kind, own.name)
        yield apart("load_cases.force", own.force, made.force, force, own.name)
        yield apart("load_cases.torque", own.torque, made.torque, force * case.reach, own.name)
        work = np.maximum(size @ np.abs(case.Phi), NEGLIGIBLE * force * mode_size(case.reduced))
        yield apart("load_cases.h", own.h, made.h, work, own.name, "mode")


def compare_sources(case: Case) -> Iterator[Compared]:
    """Compare labels and energy shares, and the columns of the file with those of the mode set, except for their scale.

    The forces of the modes on the columns V are F = VᵀK Phi. The coordinates A satisfy V A = Phi up to rigid motion, so
    that AᵀF = PhiᵀK Phi. Both equations are checked: if columns are nearly dependent, rounding errors of V A are much
    larger than those of AᵀF.
    """
    file = case.reduced
    if file.columns is None:
        return
    yield same("labels", file.labels, file.columns.mode_labels())
    yield same("sources", file.sources, file.columns.sources)
    if len(file.sources) == len(file.columns.sources):
        yield apart("energy_shares", file.energy_shares, file.columns.group_shares(), 1.0, axes="mode source")
    yield same("columns.labels", file.columns.labels, case.modes.labels)
    yield same("columns.groups", file.columns.groups, case.modes.groups)
    V, Z = case.modes.columns, case.by_energy
    if len(file.columns.labels) != V.shape[1]:
        return
    Phi = case.Phi @ Z
    K_Phi = case.body.K @ Phi
    G, F, A = V.T @ K_Phi, np.asarray(file.columns.F) @ Z, np.asarray(file.columns.A) @ Z
    energy = np.einsum("nc,nc->c", V, case.body.K @ V)
    works = energy > SUSPECT_ENERGY * rounding_of_energy(case.body, V)  # the others are rigid-body motions
    works &= np.asarray(file.columns.F).any(axis=1)  # the file stores zeros for a column without forces
    size = np.where(works, np.sqrt(np.maximum(energy, 0.0)), np.inf)
    own = np.einsum("ck,ck->c", F, F)
    scale = np.divide(np.einsum("ck,ck->c", G, F), own, out=np.zeros_like(own), where=works & (own > 0))
    yield apart("columns.F", scale[:, None] * F, G, size[:, None], axes=f"column {case.axes_words}")
    back = np.divide(A, scale[:, None], out=np.zeros_like(A), where=scale[:, None] != 0)
    E = V @ back - Phi
    terms = rounding_of_energy(case.body, np.abs(V) @ np.abs(back))  # rounding of the terms of V A
    defect = np.maximum(np.einsum("nk,nk->k", E, case.body.K @ E) - SUSPECT_ENERGY * terms, 0.0)
    work = Phi.T @ K_Phi
    size = np.sqrt(np.maximum(np.diag(work), 0.0))
    yield apart("columns.A", np.sqrt(defect), np.zeros_like(defect), size, axes=case.axes_words)
    rounding = np.sqrt(np.outer(terms, rounding_of_energy(case.body, Phi)))
    rounding += np.finfo(float).eps * (np.abs(A).T @ np.abs(F))
    error = np.maximum(np.abs(A.T @ F - work) - SUSPECT_ENERGY * rounding, 0.0)
    yield apart("columns.A", error, np.zeros_like(error), np.outer(size, size), axes=f"{case.axes_words} -")


def compare_stress(case: Case) -> Iterator[Compared]:
    """Compare stress of modes of unit strain energy, relative to the largest stress."""
    file, Z, frame, word = case.reduced, case.by_energy, case.reduced.frame, case.axes_words
    is_asked = case.options is not None and case.options.stress
    if file.stress is not None or is_asked:
        made = nodal_stress_modes(case.body, case.Phi @ Z, case.node_ids, frame.axes)
        if made is None and file.stress is not None:
            yield Compared("stress", np.inf, "", "the model does not provide stress at its nodes")
        elif made is not None and file.stress is None:
            yield missing("stress")
        elif made is not None:
            own = np.asarray(file.stress) @ Z
            yield apart("stress", own, made, np.abs(made).max(initial=0.0), axes=f"node component {word}")
    if file.point_stress is not None or is_asked:
        asked = case.body.stress_points
        points = None if asked is None else point_stress_modes(case.body, asked, case.Phi @ Z, frame)
        own_points = file.point_stress
        if points is None or own_points is None:
            if points is not None or own_points is not None:
                yield (
                    missing("point_stress.names")
                    if own_points is None
                    else Compared("point_stress.names", np.inf, "", "the model has no stress points")
                )
            return
        yield same("point_stress.names", own_points.names, points.names)
        yield apart("point_stress.positions", own_points.positions, points.positions, case.length, axes="point")
        largest = np.abs(points.modes).max(initial=0.0)
        yield apart("point_stress.modes", own_points.modes @ Z, points.modes, largest, axes=f"point component {word}")


def compare_recovery(case: Case) -> Iterator[Compared]:
    """Compare recovery tables: their names, and their numbers relative to the size of the quantity."""
    if case.options is None:
        return
    file, requests = case.reduced, case.options.recovery
    asked = {request.name: request for request in requests}
    for name in asked:
        if name not in file.recovery:
            yield missing("recovery.name", name)
    present = [request for name, request in asked.items() if name in file.recovery]
    if not present:
        return
    made = recovery_of_model(case.families, case.Phi, case.condition, case.expected, present, over=case.by_energy)
    for name, table in made.items():
        yield from compare_table(case, file.recovery[name], table)


def compare_table(case: Case, own: RecoveryTable, made: RecoveryTable) -> Iterator[Compared]:
    """Compare rows with the same quantity and dimension in one table.

    A file that was converted to another frame keeps the static part, with the reaction, of its first frame. Only its
    rows of positions, velocities and accelerations are compared.
    """
    is_carried = CONVERTED in case.reduced.provenance
    name = own.name
    yield same("recovery.name", own.name, made.name, name)
    for word in ("labels", "quantities", "entities", "numbers", "components", "loads"):
        yield same(f"recovery.{word}", getattr(own, word), getattr(made, word), name)
    yield same("recovery.system", own.system, made.system, name)
    yield same("recovery.truncated", own.truncated, made.truncated, name)
    for word in ("dimensions", "load_dimensions"):
        yield apart(f"recovery.{word}", getattr(own, word), getattr(made, word), 1.0, name)
    if own.labels != made.labels or own.loads != made.loads:
        return
    Z, reduced = case.by_energy, case.reduced
    omega2 = float(np.diag(reduced.K).min(initial=np.inf))
    rigid = np.repeat([1.0, 1 / case.length], 3) / np.sqrt(reduced.moments.m * omega2)
    X = np.zeros((N_RIGID + reduced.n_q, N_RIGID + Z.shape[1]))
    X[:N_RIGID, :N_RIGID], X[N_RIGID:, N_RIGID:] = np.diag(rigid), Z
    scaled = np.concatenate([rigid, np.ones(Z.shape[1])])
    loads = forces_of_loads(case.expected, own.loads)[N_RIGID:]  # Phiᵀ F
    force = np.array([force_of_load(case, load) for load in own.loads])
    strength = float((np.linalg.norm(loads / np.sqrt(np.diag(reduced.K))[:, None], axis=0) / force).max(initial=0.0))
    typical = typical_sizes(case)
    for quantity in dict.fromkeys(own.quantities):
        of_quantity = np.flatnonzero(np.array(own.quantities) == quantity)
        for dimensions in np.unique(own.dimensions[of_quantity], axis=0):
            rows = of_quantity[(own.dimensions[of_quantity] == dimensions).all(axis=1)]
            where, axes = f"{name}: {quantity}", f"row {case.axes_words}"
            a, b = own.dynamic[:, rows] @ X, made.dynamic[:, rows] * scaled
            anywhere = typical.get((quantity, float(dimensions[1])), 0.0)  # fixed places do not move
            first = max(np.abs(b[0]).max(initial=0.0), 0.0 if quantity in OF_MOTION else anywhere)
            for order in range(3):
                if is_carried and order and quantity not in OF_MOTION:
                    continue
                if is_carried and order != 0 and quantity == "displacement":
                    continue
                at_least = first / omega2 ** (order / 2)
                if quantity in OF_MOTION:
                    at_least = max(at_least, anywhere)
                size = max(np.abs(b[order]).max(initial=0.0), NEGLIGIBLE * at_least)
                yield apart("recovery.dynamic", a[order], b[order], size, f"{where}, order {order}", axes)
            if is_carried:
                continue
            # response of the modes to the same force; a static remainder far below it is negligible
            static = own.dynamic[0][rows][:, N_RIGID:] @ (loads / np.diag(reduced.K)[:, None])
            answer = max((np.abs(static).max(axis=0, initial=0.0) / force).max(initial=0.0), anywhere * strength)
            if quantity in OF_INTERFACES:
                answer = max(answer, case.length ** (dimensions[1] - 1))
            size = np.maximum(np.abs(made.static[rows]).max(axis=0, initial=0.0), NEGLIGIBLE * answer * force)
            yield apart("recovery.static", own.static[rows], made.static[rows], size, where, "row load")


def typical_sizes(case: Case) -> dict[tuple[str, float], float]:
    """Return the largest motions and stresses in modes of unit strain energy, by quantity and exponent of length.

    Differences of recovery rows are judged relative to them.
    """
    shapes = case.Phi @ case.by_energy
    shape = float(np.abs(case.body.translations(shapes)).max(initial=0.0))
    sizes = {(each, length): shape * case.length ** (length - 1) for each in OF_MOTION for length in (0.0, 1.0)}
    stress = nodal_stress_modes(case.body, shapes, case.node_ids, case.reduced.frame.axes)
    if stress is not None:
        sizes["stress", STRESS[1]] = float(np.abs(stress).max(initial=0.0))
    return sizes


def force_of_load(case: Case, load: str) -> float:
    """Return the size of a load of unit amplitude as a force [N]."""
    m, L = case.reduced.moments.m, case.length
    for each in case.body.load_cases:
        if load == f"load case {each.name}":
            return float(np.abs(each.f).sum()) or 1.0
    if load.startswith("gravity"):
        return m
    return m * case.reach if load.startswith("spin ") else 1 / L if load[-2:] in ("mx", "my", "mz") else 1.0


# Second order ---------------------------------------------------------------------------------------------------------


def compare_geometric(case: Case) -> Iterator[Compared]:
    """Compare the geometric stiffness of each kind of load in modes of unit strain energy (inverse buckling loads)."""
    file = case.reduced.geometric
    asked = False if case.options is None else case.options.geometric
    if file is None:
        if asked is not False and has_geometric_stiffness(case.body):
            yield missing("geometric.spin")
        return
    names = [each.name for each in case.body.interfaces]
    if not isinstance(asked, bool):
        yield same("geometric.is_loaded", file.is_loaded, tuple(name in asked for name in names))
    elif asked:
        yield same("geometric.is_loaded", file.is_loaded, (True,) * len(names))
    else:
        yield Compared("geometric.is_loaded", 0.0)
    loaded = [names[k] for k in file.loaded if k < len(names)]
    Z = case.by_energy
    states = unit_states(case.families, frame=case.condition, spread=file.spread is not None, interfaces=loaded)
    made, own = stiffness_of_states(case.body, case.Phi @ Z, states), file.transformed(Z)
    m, L = case.reduced.moments.m, case.reach
    shape = np.abs(case.body.translations(case.Phi @ Z)).max(initial=0.0)
    unit = np.abs(np.asarray(made.interfaces)[:, :3]).max(initial=0.0)  # matrix of a unit force
    force = {"translation": m, "rotation": m * L, "spin": m * L, "interfaces": 1.0}
    by_axis = np.array([1.0, 1, 1, L, L, L])[:, None, None]
    for name in UNIT_LOADS:
        kind = by_axis if name == "interfaces" else 1.0
        words = f"load {case.axes_words} {case.axes_words}"
        words = f"interface {words}" if name == "interfaces" else words
        for part, at_least in ((None, unit), ("turned", shape)):
            if part == "turned" and (own.turned is None or made.turned is None):
                continue
            source, target = (own, made) if part is None else (own.turned, made.turned)
            a, b = (np.asarray(getattr(x, name)) / kind for x in (source, target))
            size = max(np.abs(b).max(initial=0.0), NEGLIGIBLE * at_least * force[name])
            yield apart(f"geometric.{f'{part}.' if part else ''}{name}", a, b, size, axes=words)
    if own.spread is not None and made.spread is not None:
        for name, at_least in (("K", unit), ("turned", shape), ("turned_rigid", L)):
            a, b = (np.asarray(getattr(x.spread, name)) / by_axis for x in (own, made))
            size = max(np.abs(b).max(initial=0.0), NEGLIGIBLE * at_least)
            yield apart(f"geometric.spread.{name}", a, b, size, axes="load")


def compare_quadratic(case: Case) -> Iterator[Compared]:
    """Compare second-order displacements in modes of unit strain energy, for each node or combination of nodes."""
    file = case.reduced.quadratic
    if file is None:
        if case.options is not None and case.options.quadratic and CONVERTED not in case.reduced.provenance:
            yield missing("quadratic")
        return
    Z, n = case.by_energy, 3 * len(file)
    is_few = len(file) <= FEW_NODES
    W = np.eye(n) if is_few else np.random.default_rng(30).normal(size=(n, NODE_PROBES)) / np.sqrt(n)
    if len(case.node_ids) != len(file):
        return
    made = -force_stiffness(case.body, case.Phi @ Z, case.condition, case.node_ids, W, case.families)
    own = Z.T @ np.tensordot(W.T, np.asarray(file).reshape(n, *file.shape[2:]), axes=1) @ Z
    words = "component" if is_few else "combination"
    yield apart("quadratic", own, made, np.abs(made).max(initial=0.0), axes=f"{words} {case.axes_words}")


def compare_origin(case: Case) -> Iterator[Compared]:
    """Compare name, mode set and input digests of the file."""
    yield same("name", case.reduced.name, case.body.name)
    own, made = case.reduced.provenance, case.expected.provenance
    yield Compared("provenance", 0.0)
    for key in OF_ORIGIN:
        if key in own and key in made:
            yield same("provenance", own[key], made[key], key)


#: function that computes the comparison of each record, in the order of the verdicts
CONTENTS: dict[str, Callable[[Case], Iterator[Compared]]] = {
    "points": compare_points,
    "frame": compare_frame,
    "interfaces": compare_interfaces,
    "invariants": compare_moments,
    "damping-matrix": compare_damping,
    "load-cases": compare_load_cases,
    "stress-modes": compare_stress,
    "geometric-stiffness": compare_geometric,
    "quadratic-modes": compare_quadratic,
    "kept-rotations": compare_rotations,
    "recovery-rows": compare_recovery,
    "nodal-sums": compare_sums,
    "error-estimates": compare_errors,
    "sources": compare_sources,
    "origin": compare_origin,
}
