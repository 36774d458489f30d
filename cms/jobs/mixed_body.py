"""Beams of a job that are welded to its solid."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cms.jobs.job import Job
from fe_models.body.fe_body import FEBody
from fe_models.foundation.stages import Stages

if TYPE_CHECKING:
    pass
from cms.jobs.attachments_of_job import frame_interface, frame_mesh, one_node
from cms.jobs.frame_body import body_of_frame

__all__ = ["body_of_mixed"]


def body_of_mixed(job: Job, stages: Stages, solid: FEBody, solid_mesh: Any, on_report: Any) -> FEBody:
    """Weld the beams of the job to its solid by the ties, and put its interfaces on both.

    Parameters
    ----------
    solid
        The solid without interfaces.
    solid_mesh
        Mesh of the solid, for selections.
    """
    from cms.jobs.parts_of_job import interface_of, selection_of
    from fe_models.body.couplings.couplings import couple
    from fe_models.body.weld import weld
    from fe_models.elements.beams.interfaces import NodeIndices, line_interface
    from fe_models.elements.solids import interfaces as on_solid

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
