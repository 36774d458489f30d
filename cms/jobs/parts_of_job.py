"""Conversion of single tables of a job: materials, interfaces, selections, load cases, body frame."""

from typing import TYPE_CHECKING, Any

import numpy as np

from cms.errors import JobError
from cms.jobs.job import SELECTIONS, InterfaceSection, Job, LoadCaseSection, PartSection
from cms.jobs.tables.material_table import material_of
from fe_models.body.fe_body import FEBody, Interface
from fe_models.body.load_cases import LoadCase

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
    "frame_of", "interface_of", "interfaces_of", "load_cases_of", "materials_of", "part_of_mesh",
    "reduction_options", "selection_of",
]  # fmt: skip


def part_of_mesh(part: PartSection, mesh: "AnyMesh") -> "AnyMesh":
    """Return the part of the mesh that [body] part requests."""
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
    chosen = selection_of(section)
    # axes are rows in the job, but columns here
    triad = None if section.triad is None else np.array(section.triad).T
    return makers[section.kind](mesh, name, chosen, reference=section.reference, triad=triad)


def selection_of(section: Any) -> Any:
    """Return the node selection of a table, given by one of the keys `SELECTIONS`."""
    from fe_models.meshes import selections

    types = {
        "faces": selections.FaceGroup,
        "nodes": selections.NodeSet,
        "plane": selections.Plane,
        "cylinder": selections.Cylinder,
        "box": selections.Box,
        "nearest": selections.NearestNode,
    }
    key = next(key for key in SELECTIONS if getattr(section, key, None) is not None)
    given = getattr(section, key)
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
    """Return one load case; the job has already checked that its keys belong to its kind."""
    from fe_models.body import loads

    if section.acceleration is not None:
        return loads.gravity_load(body, name, section.acceleration)
    force, torque = section.force or (0.0, 0.0, 0.0), section.torque or (0.0, 0.0, 0.0)
    if section.at is not None:
        return loads.interface_load(body, name, section.at, force=force, torque=torque)
    if mesh is None or section.selection is None:
        raise JobError(f"load_cases.{name}: there is no mesh to select on; give at = an interface")
    chosen = selection_of(section)
    if section.pressure is not None:
        return loads.pressure_load(body, mesh, name, chosen, section.pressure)
    return loads.selection_load(body, mesh, name, chosen, force=force, torque=torque, reference=section.reference)


def frame_of(job: Job, *, held: bool = False) -> "Frame | HeldFrame":
    """Return the body frame of the job; for a fixed body, only the ground is allowed."""
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
    """Return the options that determine the expected content of the modal file.

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
