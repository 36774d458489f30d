"""Conversion of single tables of a job: materials, interfaces, selections, load cases, body frame, mode set."""

import logging
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cms.errors import JobError
from cms.jobs.job import InterfaceSection, Job, LoadCaseSection, PartSection
from cms.jobs.reduction_table import AUTO, LoadSection, NeighbourSection, ReductionSection, mode_set_options
from cms.jobs.tables.material_table import material_of
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.modes.families.families import Families, families_of
from cms.modes.families.interface_loads import InterfaceLoad, condensed_load
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets import MODE_SETS
from cms.modes.mode_sets.characteristic_modes import with_characteristic_modes
from cms.modes.mode_sets.extra_columns import EXTRA_COLUMNS
from fe_models.body.fe_body import MULTIPLIER, FEBody, Interface
from fe_models.body.load_cases import LoadCase
from fe_models.foundation.arrays import Array

if TYPE_CHECKING:
    from cms.assessment.quality.of_reduction.contents import ReductionOptions
    from cms.reduction.basis.frames import Frame, HeldFrame
    from fe_models.body.material import AnyMaterial
    from fe_models.meshes.line_mesh import LineMesh
    from fe_models.meshes.mesh import Mesh
    from fe_models.meshes.node_cloud import NodeCloud
    from fe_models.meshes.shell_mesh import ShellMesh
    from fe_models.meshes.split import AnyMesh

__all__ = [
    "frame_of", "interface_of", "interfaces_of", "job_mode_set", "load_cases_of", "materials_of", "part_of_mesh",
    "reduction_of", "reduction_options", "selection_of",
]  # fmt: skip

log = logging.getLogger(__name__)

COUNT_KEYS = ("n_modes", "cutoff", "verify")  #: keys for the number of modes


def part_of_mesh(part: PartSection, mesh: "AnyMesh") -> "AnyMesh":
    """Return the part of the mesh that the table [body] part requests."""
    from fe_models.meshes.split import split_mesh

    return split_mesh(mesh, part.of, at=part.at, axis=part.axis).parts[part.number - 1]


def materials_of(job: Job) -> "AnyMaterial | dict[str, AnyMaterial]":
    """Return one material for all cells, or the material of each group of cells."""
    made = {name: material_of(name, section) for name, section in job.materials_of_cells.items()}
    if [section.cells for section in job.materials_of_cells.values()] == [("all",)]:
        return next(iter(made.values()))
    return {group: made[name] for name, section in job.materials_of_cells.items() for group in section.cells}


def interfaces_of(job: Job, mesh: "Mesh") -> tuple[Interface, ...]:
    """Return the interfaces of the job on this mesh; no two may share a node."""
    from fe_models.body.couplings.couplings import check_overlap

    interfaces = tuple(interface_of(name, section, mesh) for name, section in job.interfaces.items())
    check_overlap(interfaces, numbers=mesh.node_numbers)
    return interfaces


def interface_of(name: str, section: InterfaceSection, mesh: "Mesh") -> Interface:
    """Return one interface: its selection, kind, reference point and axes."""
    from fe_models.elements.solids import interfaces

    makers = {
        "rigid": interfaces.rigid_interface,
        "distributing": interfaces.distributing_interface,
        "nodes": interfaces.nodes_interface,
    }
    chosen = selection_of(section.selection, getattr(section, section.selection))
    # the job lists axes as rows; here they are columns
    triad = None if section.triad is None else np.array(section.triad).T
    return makers[section.kind](mesh, name, chosen, reference=section.reference, triad=triad)


def selection_of(key: str, given: Any) -> Any:
    """Return the selection for a key of the job and its options."""
    from fe_models.meshes import selections

    types = {
        "faces": selections.FaceGroup,
        "nodes": selections.NodeSet,
        "plane": selections.Plane,
        "cylinder": selections.Cylinder,
        "box": selections.Box,
        "nearest": selections.NearestNode,
    }
    if key == "faces":
        first, *more = [given] if isinstance(given, str) else given
        return selections.FaceGroup(first, tuple(more))
    if isinstance(given, tuple):
        return selections.NodeNumbers(given)
    selection: Any = types[key]
    return selection(given) if isinstance(given, str) else selection(**given.model_dump())


def load_cases_of(
    job: Job, body: FEBody, mesh: "Mesh | LineMesh | ShellMesh | NodeCloud | None" = None
) -> tuple[LoadCase, ...]:
    """Return the load cases of the job on this body, not yet coupled."""
    return tuple(load_case_of(name, section, body, mesh) for name, section in job.load_cases.items())


def load_case_of(
    name: str, section: LoadCaseSection, body: FEBody, mesh: "Mesh | LineMesh | ShellMesh | NodeCloud | None"
) -> LoadCase:
    """Return one load case; the job has already checked that its keys fit its kind."""
    from fe_models.body import loads

    if section.acceleration is not None:
        return loads.gravity_load(body, name, section.acceleration)
    force, torque = section.force or (0.0, 0.0, 0.0), section.torque or (0.0, 0.0, 0.0)
    if section.at is not None:
        return loads.interface_load(body, name, section.at, force=force, torque=torque)
    if mesh is None or section.selection is None:
        raise JobError(f"load_cases.{name}: there is no mesh to select on; give at = an interface")
    chosen = selection_of(section.selection, getattr(section, section.selection))
    if section.pressure is not None:
        return loads.pressure_load(body, mesh, name, chosen, section.pressure)
    return loads.selection_load(body, mesh, name, chosen, force=force, torque=torque, reference=section.reference)


def frame_of(job: Job, *, held: bool = False) -> "Frame | HeldFrame":
    """Return the body frame of the job; a held body has the ground as its frame, and no other may be requested."""
    from cms.reduction.basis.frames import FRAMES, HeldFrame, NodalFrame

    reduction = job.reduction
    if held:
        if "frame" in reduction.model_fields_set:
            raise JobError(
                f'reduction.frame = "{reduction.frame}": body {job.body.name!r} is held to the ground, as it was '
                "said; its frame is the ground: remove frame"
            )
        return HeldFrame(reduction.origin, reduction.axes)
    if reduction.frame == "nodal":
        return NodalFrame(reduction.at, reduction.origin, reduction.axes, reduction.dofs)
    return FRAMES[reduction.frame](origin=reduction.origin, axes=reduction.axes)


def reduction_options(job: Job, body: FEBody) -> "ReductionOptions":
    """Return the intended contents of the file of a job.

    Parameters
    ----------
    body
        The coupled body of the job.
    """
    from cms.assessment.quality.of_reduction.contents import ReductionOptions
    from cms.jobs.tables.recovery_section import requests_of

    asked = job.reduction.geometric_stiffness
    is_made = asked is True or bool(job.reduction.quadratic_modes)
    return ReductionOptions(
        damping=None if job.damping is None else job.damping.damping,
        frame=frame_of(job, held=body.is_held),
        stress=job.reduction.stress is not False,
        geometric=tuple(asked) if isinstance(asked, list) else is_made,
        quadratic=bool(job.reduction.quadratic_modes),
        recovery=requests_of(job.recovery),
    )


# mode set -------------------------------------------------------------------------------------------------------------


def job_mode_set(body: FEBody | Families, reduction: ReductionSection) -> ModeSet:
    """Make the mode set of the table [reduction] for a coupled body.

    Parameters
    ----------
    body
        A coupled body, or its `Families`.
    reduction
        The table.

    Raises
    ------
    CmsError, FeModelsError
        If the set cannot be made with these options, or a neighbour cannot be read.
    """
    with families_of(body) as families:
        body = families.body
        options = set_options(body, reduction)
        added = partial(with_additions, families, reduction)
        if reduction.n_modes != AUTO:
            return added(MODE_SETS[reduction.set](families, **options))
        from cms.assessment.compare.mode_selection import select_modes

        has_additions = reduction.extra or reduction.interface_modes is not None or reduction.interface_cutoff
        return select_modes(
            families,
            set=reduction.set,
            error=reduction.error or 0.0,
            band=reduction.band or (0.0, 0.0),
            measure=reduction.measure or "frequency",
            options=options,
            added=added if has_additions else None,
        ).modes


def reduction_of(job: Job, body: FEBody) -> ReductionSection:
    """Return the table [reduction]; for a part of a body with at most as many modes as the part can have.

    The jobs of all parts of a body have the same number of modes, but a small part may have fewer interior dofs. Each
    multiplier of a distributing interface reduces them by one.
    """
    n_i = body.n_dof - len(body.b) - 2 * int((body.dofs[:, 1] == MULTIPLIER).sum())
    asked = job.reduction.n_modes
    if job.body.part is None or not isinstance(asked, int) or asked <= n_i:
        return job.reduction
    log.warning(
        "part %d of the body: n_modes = %d, but it has %d interior dofs: it is reduced with %d modes",
        job.body.part.number, asked, n_i, n_i,
    )  # fmt: skip
    return job.reduction.model_copy(update={"n_modes": n_i})


def with_additions(families: Families, reduction: ReductionSection, modes: ModeSet) -> ModeSet:
    """Reduce interfaces of kind "nodes" to characteristic modes, and add extra columns, as the job requests."""
    if reduction.interface_modes is not None or reduction.interface_cutoff is not None:
        cutoff = None if reduction.interface_cutoff is None else reduction.interface_cutoff * families.body.units.time
        wanted = ModeCount(reduction.interface_modes, cutoff)
        modes = with_characteristic_modes(modes, families.body, wanted, together=bool(reduction.interfaces_together))
    for name in reduction.extra or ():
        modes = EXTRA_COLUMNS[name](modes, families)
    return modes


def set_options(body: FEBody, reduction: ReductionSection) -> dict[str, Any]:
    """Return the options of the set as function arguments, with frequencies in cycles per time unit of the body."""
    options: dict[str, Any] = {}
    time = body.units.time
    is_auto = reduction.n_modes == AUTO
    for key in mode_set_options(reduction.set):
        value = getattr(reduction, key)
        if value is None or key in COUNT_KEYS or (is_auto and key == "band"):
            continue
        if key in ("shifts", "band"):
            options[key] = tuple(x * time for x in value)
        elif key == "loads":
            made = [load_of(name, section) for name, section in value.items()]
            options["loads"] = [*options.get("loads", []), *made]
        elif key == "neighbours":
            options["loads"] = [*options.get("loads", []), *(neighbour_load(body, section) for section in value)]
        else:
            options[key] = value
    if not is_auto and (reduction.n_modes is not None or reduction.cutoff is not None):
        number = None if reduction.n_modes is None else int(reduction.n_modes)
        cutoff = None if reduction.cutoff is None else reduction.cutoff * time
        is_plain = cutoff is None and not reduction.verify
        options["n_modes"] = number if is_plain else ModeCount(number, cutoff, bool(reduction.verify))
    return options


def load_of(name: str, section: LoadSection) -> InterfaceLoad:
    """Return the load of one interface."""
    return InterfaceLoad(
        (name,), _matrix(section.mass, section.inertia), _matrix(section.stiffness, section.rotational_stiffness)
    )


def neighbour_load(body: FEBody, section: NeighbourSection) -> InterfaceLoad:
    """Read the neighbour's job, build its body, and condense it to the shared interfaces."""
    from cms.jobs.body_of_job import job_body
    from cms.jobs.job import read_job

    job = read_job(section.job)
    neighbour = job_body(job)
    if neighbour.units != body.units:
        raise JobError(
            f"{section.job}: the neighbour is in units {neighbour.units.name}, body {body.name!r} in "
            f"{body.units.name}; give both the same units"
        )
    return condensed_load(neighbour, section.interfaces)


def _matrix(translation: tuple[tuple[float, ...], ...] | None, rotation: tuple[float, ...] | None) -> Array:
    if translation is not None and len(translation) == 6:
        return np.array(translation)
    first = (0.0, 0.0, 0.0) if translation is None else translation[0]
    return np.diag([*first, *(rotation or (0.0, 0.0, 0.0))])
