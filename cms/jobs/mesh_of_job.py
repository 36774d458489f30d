"""The solid mesh of a job, read from a mesh file or made of a CAD file."""

from typing import TYPE_CHECKING

from cms.errors import JobError
from cms.jobs.job import Job

if TYPE_CHECKING:
    from fe_models.meshes.mesh import Mesh

__all__ = ["is_cad", "solid_mesh_of"]


def is_cad(job: Job) -> bool:
    """Whether the body comes from a CAD file, which is meshed here."""
    return job.mesh_size is not None


def solid_mesh_of(job: Job) -> "Mesh":
    """Return the complete solid mesh; faces that interfaces and loads select are groups."""
    from fe_models.files import read_mesh

    if job.body.mesh is None:
        raise JobError("job: expected a mesh, got none")
    if job.mesh_size is None:
        return read_mesh(job.body.mesh)
    from fe_models.files.cad.cad_mesh import MeshSize, mesh_cad

    size = MeshSize(**job.mesh_size.model_dump())
    chosen = [table.faces for table in job.interfaces.values()] + [table.faces for table in job.load_cases.values()]
    faces = [text for texts in chosen for text in texts or ()]
    return mesh_cad(job.body.mesh, size, units=job.body.units, faces=faces)
