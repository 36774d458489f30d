"""Body of the shells of a job: triangles and quads, with stiffeners and attachments."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from cms.jobs.job import InterfaceSection, Job
from cms.jobs.shell_tables import ShellSection
from cms.jobs.tables.material_table import isotropic_of, material_of
from fe_models.body.fe_body import FEBody, Interface
from fe_models.foundation.stages import Stages
from fe_models.foundation.units import unit_system

if TYPE_CHECKING:
    from fe_models.elements.shells.shell_property import AnyShellProperty
    from fe_models.meshes.shell_mesh import ShellMesh

__all__ = ["body_of_shell", "shell_interface_of", "shell_mesh"]


def body_of_shell(job: Job, stages: Stages, on_report: Callable[[Any], None] | None) -> FEBody:
    """Read and check the mesh, and return the body with thicknesses, stiffeners and attachments of the job."""
    from cms.jobs.attachments_of_job import attachments_of, properties_of
    from cms.jobs.parts_of_job import load_cases_of, part_of_mesh
    from fe_models.checks.shell_report import report_shell
    from fe_models.elements.shells.body import shell_body
    from fe_models.elements.shells.quality import WARP_LIMIT

    units = unit_system(job.body.units)
    with stages("read mesh"):
        mesh = shell_mesh(job)
        if job.body.part is not None:
            mesh = part_of_mesh(job.body.part, mesh)
    properties = shell_properties_of(job)
    stiffeners = properties_of(job) if job.sections else None
    masses, springs, links = attachments_of(job, mesh)
    with stages("check mesh"):
        materials = {made: None for item in properties.values() for made in item.materials}
        materials |= {item.material: None for item in (stiffeners or {}).values()}
        report = report_shell(mesh, materials, units=units, springs=springs, links=links)
        if on_report is not None:
            on_report(report)
        report.raise_for_errors(accept=job.body.accept)
        interfaces = tuple(shell_interface_of(name, section, mesh) for name, section in job.interfaces.items())
    with stages("assemble"):
        body = shell_body(
            mesh,
            properties["all"] if set(properties) == {"all"} else properties,
            name=str(job.body.name),
            units=units,
            interfaces=interfaces,
            stiffeners=stiffeners,
            point_masses=masses,
            springs=springs,
            links=links,
            warp_limit=180.0 if "warped" in job.body.accept else WARP_LIMIT,
        )
        return body.with_load_cases(*load_cases_of(job, body, mesh))


def shell_mesh(job: Job) -> "ShellMesh":
    """Read all triangles and quads of the mesh, and the lines of its stiffeners; `shell_body` checks their thickness.

    If the job accepts that others are left out, only the cells of the groups that it names are read.
    """
    from fe_models.files.read_mesh import read_shell_mesh

    groups = [group for shell in job.shells.values() for group in shell.cells]
    lines = [group for section in job.sections.values() for group in section.lines]
    is_part = groups != ["all"] and "left-out" in job.body.accept
    return read_shell_mesh(str(job.body.mesh), groups=groups if is_part else None, stiffeners=lines)


def shell_properties_of(job: Job) -> "dict[str, AnyShellProperty]":
    """Return thickness and material, or layers, for each group of cells."""
    from fe_models.elements.shells.shell_property import ShellProperty

    made: dict[str, AnyShellProperty] = {}
    for shell in job.shells.values():
        if shell.stiffness is not None:
            made |= dict.fromkeys(shell.cells, _given_stiffness(shell))
            continue
        if shell.layers:
            made |= dict.fromkeys(shell.cells, _laminate_of(job, shell))
            continue
        assert shell.thickness is not None  # the job has checked it
        name = shell.material or next(iter(job.materials))
        table = job.materials[name]
        material = isotropic_of(name, table, "shells of one thickness (not of layers)")
        item = ShellProperty(
            shell.thickness, material, offset=shell.offset, added_mass=shell.added_mass,
            bending_ratio=shell.bending_ratio, shear_ratio=shell.shear_ratio,
        )  # fmt: skip
        made |= dict.fromkeys(shell.cells, item)
    return made


def _given_stiffness(shell: ShellSection) -> "AnyShellProperty":
    from fe_models.elements.shells.shell_property import StiffnessProperty

    # the job has checked that all are given
    assert shell.thickness is not None
    assert shell.stiffness is not None
    assert shell.shear_stiffness is not None
    assert shell.direction is not None
    return StiffnessProperty(
        shell.thickness,
        tuple(tuple(row) for row in shell.stiffness),
        tuple(tuple(row) for row in shell.shear_stiffness),
        shell.direction,
        offset=shell.offset,
        added_mass=shell.added_mass,
    )


def _laminate_of(job: Job, shell: ShellSection) -> "AnyShellProperty":
    from fe_models.elements.shells.shell_property import LaminateProperty, Layer, symmetric

    layers = []
    for layer in shell.layers:
        name = layer.material or next(iter(job.materials))
        layers.append(Layer(material_of(name, job.materials[name]), layer.thickness, layer.angle))
    assert shell.direction is not None  # the job has checked it
    stack = symmetric(layers) if shell.symmetric else tuple(layers)
    return LaminateProperty(
        stack, shell.direction, offset=shell.offset, added_mass=shell.added_mass,
        bending_ratio=shell.bending_ratio, shear_ratio=shell.shear_ratio,
    )  # fmt: skip


def shell_interface_of(name: str, section: InterfaceSection, mesh: "ShellMesh") -> Interface:
    """Return one interface on the shell: its selection, kind, reference point and axes."""
    from cms.jobs.parts_of_job import selection_of
    from fe_models.elements.shells.body import shell_interface

    chosen = selection_of(section)
    # axes are rows in the job, but columns here
    triad = None if section.triad is None else np.array(section.triad).T
    return shell_interface(mesh, name, chosen, kind=section.kind, reference=section.reference, triad=triad)
