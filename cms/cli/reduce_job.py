"""The whole line of a reduction job: mesh or matrices, interfaces, mode set, reduced body."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cms.cli.console import Stages
from cms.errors import JobError
from cms.fe_body import FEBody, Interface
from cms.job import InterfaceSection, Job, LoadCaseSection
from cms.load_cases import LoadCase
from cms.reduced_body import ReducedBody
from cms.units import unit_system

if TYPE_CHECKING:
    from cms.frames import Frame
    from cms.mode_set import ModeSet
    from cms.unit_states import UnitStates
    from fe_models.beams.line_mesh import LineMesh
    from fe_models.material import Material
    from fe_models.mesh import Mesh
    from fe_models.shells.shell_mesh import ShellMesh
    from fe_models.split import AnyMesh

__all__ = ["coupled_body", "job_body", "reduce_job", "uncoupled_body"]


def reduce_job(
    job: Job, stages: Stages | None = None, *, on_report: Callable[[Any], None] | None = None
) -> ReducedBody:
    """Run a job up to the reduced body.

    Parameters
    ----------
    job
        A checked job.
    stages
        Takes the time of each stage and shows its progress; none by default.
    on_report
        Called with the mesh report, before it is judged.

    Raises
    ------
    CmsError, FeModelsError
        If the mesh, a material, an interface or the mode set does not do.
    """
    from cms.reduction import reduce
    from cms.unit_states import require_geometric_stiffness

    stages = stages or Stages()
    coupled = job_body(job, stages, on_report=on_report)
    if job.reduction.geometric_stiffness or job.reduction.quadratic_modes:
        require_geometric_stiffness(coupled)  # before the long work
    modes, states = modes_and_states(job, coupled, stages)
    with stages("reduce"):
        return reduce(
            coupled,
            modes,
            frame=frame_of(job),
            damping=None if job.damping is None else job.damping.damping,
            stress=job.reduction.stress is not False,
            quadratic=bool(job.reduction.quadratic_modes),
            states=states,
        )


def modes_and_states(job: Job, coupled: FEBody, stages: Stages) -> "tuple[ModeSet, UnitStates | None]":
    """Make what needs the factorisation, which is freed before the reduction: that needs the memory.

    The static states of unit loads are for the geometric stiffness; None where it is left out or not known.
    """
    from cms.cli.job_mode_set import job_mode_set
    from cms.families import Families
    from cms.unit_states import has_geometric_stiffness, unit_states

    wanted = job.reduction.geometric_stiffness
    if wanted is None:
        wanted = has_geometric_stiffness(coupled)
    with Families(coupled) as families:
        with stages(f"mode set {job.reduction.set}"):
            modes = job_mode_set(coupled, job.reduction, families=families)
        if not wanted and not job.reduction.quadratic_modes:
            return modes, None
        with stages("static states"):
            return modes, unit_states(coupled, frame=frame_of(job), families=families)


def job_body(job: Job, stages: Stages | None = None, *, on_report: Callable[[Any], None] | None = None) -> FEBody:
    """Run a job up to the coupled body: read, check, assemble, couple the interfaces."""
    stages = stages or Stages()
    body = uncoupled_body(job, stages, on_report=on_report)
    with stages("couple interfaces"):
        return coupled_body(job, body)


def coupled_body(job: Job, body: FEBody) -> FEBody:
    """Couple the interfaces of the body of a job, and make it planar where that is asked for."""
    from cms.centrifugal import CENTRIFUGAL, centrifugal_loads
    from cms.couplings import couple
    from cms.job_beams import PLANES

    if CENTRIFUGAL in (job.reduction.extra or ()):
        body = body.with_load_cases(*centrifugal_loads(body))  # rigid interfaces eliminate what they act on
    if job.body.plane is None:
        return couple(body)
    from fe_models.planar import planar

    return planar(couple(body), normal=PLANES[job.body.plane])


def uncoupled_body(job: Job, stages: Stages, *, on_report: Callable[[Any], None] | None = None) -> FEBody:
    """Run a job up to the body whose interfaces are still to be coupled."""
    if job.shells:
        from cms.cli.job_shells import body_of_shell

        return body_of_shell(job, stages, on_report)
    if job.sections and not job.ties:
        from cms.cli.job_beams import body_of_frame

        return body_of_frame(job, stages, on_report)
    if job.body.mesh is not None:
        return body_of_mesh(job, job.body.mesh, stages, on_report)
    if job.body.matrices is not None:
        return body_of_matrices(job, job.body.matrices, stages)
    raise JobError("job: expected either mesh or matrices, got neither")


def body_of_mesh(job: Job, path: Path, stages: Stages, on_report: Callable[[Any], None] | None) -> FEBody:
    """Read and check the mesh, and assemble it with the materials and interfaces of the job."""
    from fe_models.importers import read_mesh
    from fe_models.mesh_report import report_mesh
    from fe_models.solid import solid_body
    from fe_models.unused_nodes import drop_unused_nodes

    units = unit_system(job.body.units)
    materials = materials_of(job)
    with stages("read mesh"):
        mesh = part_of_mesh(job, read_mesh(path))
    with stages("check mesh"):
        report = report_mesh(mesh, materials, units=units)
        if on_report is not None:
            on_report(report)
        report.raise_for_errors(accept=job.body.accept)
        mesh = drop_unused_nodes(mesh)
        interfaces = () if job.ties else interfaces_of(job, mesh)
    name = str(job.body.name)
    with stages("assemble") as advance:
        body = solid_body(mesh, materials, name=name, units=units, interfaces=interfaces, progress=advance)
    if job.ties:
        from cms.cli.job_beams import body_of_mixed

        body = body_of_mixed(job, stages, body, mesh, on_report)
    return body.with_load_cases(*load_cases_of(job, body, mesh))


def part_of_mesh(job: Job, mesh: "AnyMesh") -> "AnyMesh":
    """Return the part of the mesh that the job asks for, by default all of it."""
    from fe_models.split import split_mesh

    part = job.body.part
    return mesh if part is None else split_mesh(mesh, part.of, at=part.at, axis=part.axis).parts[part.number - 1]


def body_of_matrices(job: Job, path: Path, stages: Stages) -> FEBody:
    """Read a body of bare matrices, which brings its interfaces along."""
    from fe_models.matrices import body_from_npz

    with stages("read matrices"):
        body = body_from_npz(path, name=job.body.name, units=unit_system(job.body.units))
        return body.with_load_cases(*load_cases_of(job, body))


def materials_of(job: Job) -> "Material | dict[str, Material]":
    """Return one material for all cells, or group of cells -> material."""
    from fe_models.material import Material

    made = {
        name: Material(name, E=section.young, nu=section.poisson, rho=section.density)
        for name, section in job.materials_of_cells.items()
    }
    if [section.cells for section in job.materials_of_cells.values()] == [("all",)]:
        return next(iter(made.values()))
    return {group: made[name] for name, section in job.materials_of_cells.items() for group in section.cells}


def interfaces_of(job: Job, mesh: "Mesh") -> tuple[Interface, ...]:
    """Return the interfaces of the job on this mesh; no two may share a node."""
    from fe_models.interfaces import check_overlap

    interfaces = tuple(interface_of(name, section, mesh) for name, section in job.interfaces.items())
    check_overlap(interfaces)
    return interfaces


def interface_of(name: str, section: InterfaceSection, mesh: "Mesh") -> Interface:
    """Return one interface: its selection, kind, reference point and axes."""
    from fe_models import interfaces

    makers = {
        "rigid": interfaces.rigid_interface,
        "distributing": interfaces.distributing_interface,
        "nodes": interfaces.nodes_interface,
    }
    chosen = selection_of(section.selection, getattr(section, section.selection))
    triad = None if section.triad is None else np.array(section.triad).T  # the job lists axes, columns are axes
    return makers[section.kind](mesh, name, chosen, reference=section.reference, triad=triad)


def selection_of(key: str, given: Any) -> Any:
    """Return the selection that a key of the job names, with the options given."""
    from fe_models import selections

    types = {
        "faces": selections.FaceGroup,
        "nodes": selections.NodeSet,
        "plane": selections.Plane,
        "cylinder": selections.Cylinder,
        "box": selections.Box,
        "nearest": selections.NearestNode,
    }
    selection: Any = types[key]
    return selection(given) if isinstance(given, str) else selection(**given.model_dump())


def load_cases_of(job: Job, body: FEBody, mesh: "Mesh | LineMesh | ShellMesh | None" = None) -> tuple[LoadCase, ...]:
    """Return the load cases of the job on this body, not yet coupled."""
    return tuple(load_case_of(name, section, body, mesh) for name, section in job.load_cases.items())


def load_case_of(
    name: str, section: LoadCaseSection, body: FEBody, mesh: "Mesh | LineMesh | ShellMesh | None"
) -> LoadCase:
    """Return one load case; the job has checked that its keys fit its kind."""
    from fe_models import loads

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


def frame_of(job: Job) -> "Frame":
    """Return the body frame of the job."""
    from cms.frames import FRAMES, NodalFrame

    reduction = job.reduction
    if reduction.frame == "nodal":
        return NodalFrame(reduction.at, reduction.origin, reduction.axes, reduction.dofs)
    return FRAMES[reduction.frame](origin=reduction.origin, axes=reduction.axes)
