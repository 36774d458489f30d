"""Bodies whose elements stay in another program: matrices, their geometry, and interfaces on it."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from cms.errors import JobError
from cms.jobs.job import Job
from cms.jobs.parts_of_job import interfaces_of, load_cases_of, selection_of
from fe_models.body.fe_body import FEBody, Interface
from fe_models.foundation.stages import Stages
from fe_models.foundation.units import unit_system

if TYPE_CHECKING:
    from fe_models.meshes.mesh import Mesh
    from fe_models.meshes.node_cloud import NodeCloud

__all__ = ["body_of_matrices"]


def body_of_matrices(job: Job, stages: Stages, on_report: Callable[[Any], None] | None = None) -> FEBody:
    """Read mass and stiffness, and make a body with the interfaces and load cases of the job.

    An .npz file of this project contains nodes and interfaces. All other files need a deck or a mesh, unless they
    contain node positions. `on_report` is called with the `MatrixReport` before the matrices are checked.
    """
    if job.body.brings_interfaces:
        return body_with_its_interfaces(job, stages)
    from fe_models.files.matrices.body import body_from_foreign, nodes_of, with_geometry
    from fe_models.files.matrices.matrix_report import MatrixReport
    from fe_models.files.matrices.read_matrices import read_matrices
    from fe_models.files.read_mesh import read_geometry

    if job.body.matrices is None:
        raise JobError("job: expected matrices, got none")
    with stages("read matrices"):
        read = read_matrices(job.body.matrices, names=job.body.names)
    with stages("read geometry"):
        geometry = nodes_of(read) if job.body.geometry is None else read_geometry(job.body.geometry)
        read = with_geometry(read, geometry)
        if on_report is not None:
            on_report(MatrixReport(read))
        interfaces = interfaces_on(job, geometry)
    with stages("check matrices"):
        body = body_from_foreign(
            read, geometry, name=str(job.body.name), units=unit_system(job.body.units), interfaces=interfaces,
            held=bool(job.body.held), remove_supports=job.body.remove_supports, mend_mass=bool(job.body.mend_mass),
            accept=[word for word in job.body.accept if word == "units"],
        )  # fmt: skip
    return body.with_load_cases(*load_cases_of(job, body, geometry))


def body_with_its_interfaces(job: Job, stages: Stages) -> FEBody:
    """Read a body of bare matrices whose file contains the interfaces."""
    from pathlib import Path

    from fe_models.files.matrices.given import body_from_npz

    with stages("read matrices"):
        body = body_from_npz(
            Path(str(job.body.matrices)), name=job.body.name, units=unit_system(job.body.units),
            held=bool(job.body.held), mend_mass=bool(job.body.mend_mass),
            accept=[word for word in job.body.accept if word == "units"],
        )  # fmt: skip
        return body.with_load_cases(*load_cases_of(job, body))


def interfaces_on(job: Job, geometry: "Mesh | NodeCloud") -> tuple[Interface, ...]:
    """Return the interfaces of the job, on a solid mesh or on nodes of unknown elements."""
    from fe_models.elements.beams.interfaces import node_interface
    from fe_models.elements.solids.interfaces import check_overlap
    from fe_models.meshes.boundary import facet_weights
    from fe_models.meshes.mesh import Mesh
    from fe_models.meshes.selections import selected_facets

    if isinstance(geometry, Mesh):
        return interfaces_of(job, geometry)
    interfaces = []
    for name, section in job.interfaces.items():
        chosen = selection_of(section.selection, getattr(section, section.selection))
        facets = selected_facets(geometry, chosen)
        weights = facet_weights(geometry.nodes, facets) if facets else np.ones(len(geometry.nodes))
        # the job lists axes as rows; here they are columns
        triad = None if section.triad is None else np.array(section.triad).T
        interfaces.append(
            node_interface(geometry, name, chosen, section.kind, section.reference, triad, np.maximum(weights, 0.0))
        )
    check_overlap(interfaces, numbers=geometry.node_numbers)
    return tuple(interfaces)
