"""Beams of a reduction job: a body of lines, alone or tied to a solid."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cms.cli.console import Stages
from cms.errors import JobError
from cms.fe_body import FEBody, Interface
from cms.job import Job
from cms.job_beams import BeamSection
from cms.units import unit_system
from cms.words import nearest

if TYPE_CHECKING:
    from fe_models.beams.beam_property import BeamProperty
    from fe_models.beams.line_mesh import LineMesh
    from fe_models.shells.shell_mesh import ShellMesh

__all__ = ["body_of_frame", "frame_interface", "frame_mesh"]

GENERAL_KEYS = {
    "area": "A",
    "iy": "Iy",
    "iz": "Iz",
    "torsion": "J",
    "shear_area_y": "A_sy",
    "shear_area_z": "A_sz",
}  #: key of the job -> field of `GeneralSection`


def body_of_frame(
    job: Job,
    stages: Stages,
    on_report: Callable[[Any], None] | None,
    *,
    interfaces: tuple[Interface, ...] | None = None,
) -> FEBody:
    """Read and check the lines, and make the body with the sections and attachments of the job.

    Parameters
    ----------
    interfaces
        Instead of those of the job; its load cases are then left to the caller, too.
    """
    from cms.cli.reduce_job import load_cases_of, part_of_mesh
    from fe_models.beams.body import beam_body
    from fe_models.beams.frame_report import report_frame

    units = unit_system(job.body.units)
    with stages("read lines"):
        mesh = part_of_mesh(job, frame_mesh(job))
    properties = properties_of(job)
    masses, springs, links = attachments_of(job, mesh)
    with stages("check lines"):
        materials = {item.material: None for item in properties.values()}
        report = report_frame(mesh, materials, units=units, springs=springs, links=links)
        if on_report is not None:
            on_report(report)
        report.raise_for_errors(accept=job.body.accept)
        is_whole = interfaces is None
        if interfaces is None:
            interfaces = tuple(frame_interface(name, section, mesh) for name, section in job.interfaces.items())
    with stages("assemble"):
        body = beam_body(
            mesh,
            next(iter(properties.values())) if set(properties) == {"all"} else properties,
            name=str(job.body.name),
            units=units,
            interfaces=interfaces,
            point_masses=masses,
            springs=springs,
            links=links,
        )
        return body.with_load_cases(*load_cases_of(job, body, mesh)) if is_whole else body


def frame_mesh(job: Job) -> "LineMesh":
    """Read the lines of the job: two tables, or the groups of its mesh that have sections."""
    from fe_models.importers.read_mesh import read_line_mesh
    from fe_models.importers.tables import read_tables

    if job.body.nodes is not None and job.body.lines is not None:
        return read_tables(job.body.nodes, job.body.lines)
    if job.body.mesh is None:
        raise JobError("job: expected a mesh, or tables of nodes and lines, got neither")
    groups = [group for section in job.sections.values() for group in section.lines]
    return read_line_mesh(job.body.mesh, groups=None if groups == ["all"] else groups)


def properties_of(job: Job) -> "dict[str, BeamProperty]":
    """Return group of lines -> its section, material and theory."""
    from fe_models.beams.beam_property import BeamProperty
    from fe_models.material import Material

    made: dict[str, BeamProperty] = {}
    for section in job.sections.values():
        name = section.material or next(iter(job.materials))
        table = job.materials[name]
        item = BeamProperty(
            shape_of(section),
            Material(name, E=table.young, nu=table.poisson, rho=table.density),
            offset=section.offset or (0.0, 0.0),
            orientation=section.orientation,
            shear=section.shear,
            rotary_inertia=section.rotary_inertia,
            added_mass=section.added_mass,
        )
        made |= dict.fromkeys(section.lines, item)
    return made


def shape_of(section: BeamSection) -> Any:
    """Return the cross-section of a table."""
    from fe_models.beams.sections import SECTIONS

    given = {GENERAL_KEYS.get(key, key): value for key, value in section.dimensions.items()}
    if "outline" in given:
        given["outline"] = np.array(given["outline"])
    return SECTIONS[section.shape](**given)


def attachments_of(job: Job, mesh: "LineMesh | ShellMesh") -> tuple[list[Any], list[Any], list[Any]]:
    """Return point masses, springs and rigid links of the job on this mesh."""
    from fe_models.beams.attachments import PointMass, RigidLink, Spring

    masses = [
        PointMass(
            one_node(mesh, f"masses.{name}.node", table.node),
            table.mass,
            table.inertia,
            table.offset or (0.0, 0.0, 0.0),
        )
        for name, table in job.masses.items()
    ]
    springs = [
        Spring(
            (
                one_node(mesh, f"springs.{name}.nodes", table.nodes[0]),
                one_node(mesh, f"springs.{name}.nodes", table.nodes[1]),
            ),
            table.stiffness,
            damping=table.damping,
            point=table.point,
            triad=np.eye(3) if table.triad is None else np.array(table.triad).T,  # the job lists axes, columns are axes
        )
        for name, table in job.springs.items()
    ]
    links = [
        RigidLink(
            one_node(mesh, f"links.{name}.node", table.node),
            np.unique(
                np.concatenate([nodes_named(mesh, f"links.{name}.followers", group) for group in table.followers])
            ),
        )
        for name, table in job.links.items()
    ]
    return masses, springs, links


def one_node(mesh: "LineMesh | ShellMesh", where: str, group: str) -> int:
    """Return the node of a group that holds just one; `JobError` with the key otherwise."""
    nodes = nodes_named(mesh, where, group)
    if len(nodes) != 1:
        raise JobError(f'{where} = "{group}": expected a group of one node, got {len(nodes)} nodes')
    return int(nodes[0])


def nodes_named(mesh: "LineMesh | ShellMesh", where: str, group: str) -> np.ndarray:
    """Return the nodes of a group of the lines."""
    if group not in mesh.node_sets:
        raise JobError(f'{where} = "{group}": the lines have no such group of nodes{nearest(group, mesh.node_sets)}')
    return mesh.node_sets[group]


def frame_interface(name: str, section: Any, mesh: "LineMesh") -> Interface:
    """Return one interface on the lines: its selection, kind, reference point and axes."""
    from cms.cli.reduce_job import selection_of
    from fe_models.beams.interfaces import line_interface

    chosen = selection_of(section.selection, getattr(section, section.selection))
    triad = None if section.triad is None else np.array(section.triad).T  # the job lists axes, columns are axes
    return line_interface(mesh, name, chosen, kind=section.kind, reference=section.reference, triad=triad)


def body_of_mixed(job: Job, stages: Stages, solid: FEBody, solid_mesh: Any, on_report: Any) -> FEBody:
    """Weld the beams of the job to its solid by the ties, and put its interfaces on both.

    Parameters
    ----------
    solid
        The solid without interfaces.
    solid_mesh
        Its mesh, to select on.
    """
    from cms.cli.reduce_job import interface_of, selection_of
    from cms.couplings import couple
    from fe_models import interfaces as on_solid
    from fe_models.beams.interfaces import NodeIndices, line_interface
    from fe_models.weld import weld

    lines = frame_mesh(job)
    makers = {"rigid": on_solid.rigid_interface, "distributing": on_solid.distributing_interface}
    of_solid, of_frame = [], []
    for name, tie in job.ties.items():
        node = one_node(lines, f"ties.{name}.node", tie.node)
        key = "faces" if tie.faces is not None else "nodes"
        point = lines.nodes[node]
        of_solid.append(makers[tie.kind](solid_mesh, name, selection_of(key, getattr(tie, key)), reference=point))
        of_frame.append(line_interface(lines, name, NodeIndices((node,))))
    frame = body_of_frame(job, stages, on_report, interfaces=tuple(of_frame))
    frame = replace(frame, name=f"{frame.name} beams")
    with stages("weld"):
        whole = weld(
            [couple(replace(solid, interfaces=tuple(of_solid))), couple(frame)],
            [((solid.name, name), (frame.name, name)) for name in job.ties],
            name=str(job.body.name),
        )
    first_line_node = len(solid.nodes) + len(of_solid)
    placed = []
    for name, section in job.interfaces.items():
        if section.on == "lines":
            interface = frame_interface(name, section, lines)
            placed.append(replace(interface, nodes=interface.nodes + first_line_node))
        else:
            placed.append(interface_of(name, section, solid_mesh))
    return whole.with_interfaces(*placed)
