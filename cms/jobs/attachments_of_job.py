"""Lines of a job: mesh, sections, interfaces, and attachments at nodes."""

from typing import TYPE_CHECKING, Any

import numpy as np

from cms.errors import JobError
from cms.jobs.beam_tables import BeamSection
from cms.jobs.job import Job
from cms.jobs.tables.material_table import isotropic_of
from fe_models.body.fe_body import Interface
from fe_models.foundation.words import nearest

if TYPE_CHECKING:
    from fe_models.elements.beams.beam_property import BeamProperty
    from fe_models.meshes.line_mesh import LineMesh
    from fe_models.meshes.shell_mesh import ShellMesh

__all__ = ["attachments_of", "frame_interface", "frame_mesh", "one_node", "properties_of"]

GENERAL_KEYS = {
    "area": "A",
    "iy": "Iy",
    "iz": "Iz",
    "torsion": "J",
    "shear_area_y": "A_sy",
    "shear_area_z": "A_sz",
}  #: field of `GeneralSection` for each key of the job


def frame_mesh(job: Job) -> "LineMesh":
    """Read the lines of the job, from two tables or from the mesh groups that have sections."""
    from fe_models.files.read_mesh import read_line_mesh
    from fe_models.files.tables import read_tables

    if job.body.nodes is not None and job.body.lines is not None:
        return read_tables(job.body.nodes, job.body.lines)
    if job.body.mesh is None:
        raise JobError("job: expected a mesh, or tables of nodes and lines, got neither")
    groups = [group for section in job.sections.values() for group in section.lines]
    return read_line_mesh(job.body.mesh, groups=None if groups == ["all"] else groups)


def properties_of(job: Job) -> "dict[str, BeamProperty]":
    """Return section, material and beam theory for each group of lines."""
    from fe_models.elements.beams.beam_property import BeamProperty

    made: dict[str, BeamProperty] = {}
    for section in job.sections.values():
        name = section.material or next(iter(job.materials))
        table = job.materials[name]
        item = BeamProperty(
            shape_of(section),
            isotropic_of(name, table, "beams"),
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
    from fe_models.elements.beams.sections import SECTIONS

    given = {GENERAL_KEYS.get(key, key): value for key, value in section.dimensions.items()}
    if "outline" in given:
        given["outline"] = np.array(given["outline"])
    return SECTIONS[section.shape](**given)


def attachments_of(job: Job, mesh: "LineMesh | ShellMesh") -> tuple[list[Any], list[Any], list[Any]]:
    """Return point masses, springs and rigid links of the job on this mesh."""
    from fe_models.elements.beams.attachments import PointMass, RigidLink, Spring

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
            # axes are rows in the job, but columns here
            triad=np.eye(3) if table.triad is None else np.array(table.triad).T,
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


def one_node(mesh: "LineMesh | ShellMesh", where: str, group: str | int) -> int:
    """Return a node by number, or the only node of a group; otherwise raise `JobError` with the key."""
    if isinstance(group, int):
        rows = np.flatnonzero(mesh.node_numbers == group)
        if len(rows) != 1:
            what = f"{len(rows)} nodes have this number" if mesh.node_numbers.size else "its nodes have no numbers"
            raise JobError(f"{where} = {group}: in the mesh {what}; expected one node, or the name of a group of one")
        return int(rows[0])
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
    from cms.jobs.parts_of_job import selection_of
    from fe_models.elements.beams.interfaces import line_interface

    chosen = selection_of(section)
    # axes are rows in the job, but columns here
    triad = None if section.triad is None else np.array(section.triad).T
    return line_interface(mesh, name, chosen, kind=section.kind, reference=section.reference, triad=triad)
