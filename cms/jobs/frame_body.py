"""Beams of a reduction job: a body of lines, alone or tied to a solid."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from cms.jobs.attachments_of_job import attachments_of, frame_interface, frame_mesh, properties_of
from cms.jobs.job import Job
from fe_models.body.fe_body import FEBody, Interface
from fe_models.foundation.stages import Stages
from fe_models.foundation.units import unit_system

if TYPE_CHECKING:
    pass

__all__ = ["body_of_frame"]


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
        Interfaces to use instead of those of the job; load cases are then left to the caller too.
    """
    from cms.jobs.parts_of_job import load_cases_of, part_of_mesh
    from fe_models.checks.frame_report import report_frame
    from fe_models.elements.beams.body import beam_body

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
