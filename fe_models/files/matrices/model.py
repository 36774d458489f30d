"""Models whose elements are in another program: their matrices take the place of the mesh in an `FEModel`."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fe_models.assembly.model import FEModel
from fe_models.assembly.tables.places import interfaces_of, load_cases_of
from fe_models.body.fe_body import FEBody
from fe_models.files.matrices.body import MatrixReport, body_from_foreign, nodes_of, with_geometry
from fe_models.files.matrices.foreign_matrices import ForeignMatrices
from fe_models.files.matrices.given import body_from_npz
from fe_models.foundation.errors import ArgumentError, BodyError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.stages import Stages
from fe_models.meshes.mesh import Mesh
from fe_models.meshes.node_cloud import NodeCloud

__all__ = ["GivenArrays", "GivenMatrices"]


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class GivenMatrices:
    """Matrices with the nodes on which an `FEModel` selects interfaces and loads.

    Parameters
    ----------
    read
        Matrices from `read_matrices`.
    geometry
        Mesh or nodes from `read_geometry`; None: the matrix files contain the nodes.
    held, remove_supports, repair_mass
        As for `body_from_foreign`.
    """

    read: ForeignMatrices
    geometry: Mesh | NodeCloud | None = None
    held: bool = False
    remove_supports: bool = False
    repair_mass: bool = False

    def assembled(self, model: FEModel, stages: Stages, on_report: Callable[[Any], None] | None) -> FEBody:
        """Return the body, with the interfaces and load cases of the model; `on_report` receives a `MatrixReport`."""
        geometry = nodes_of(self.read) if self.geometry is None else self.geometry
        read = with_geometry(self.read, geometry)
        if on_report is not None:
            on_report(MatrixReport(read))
        interfaces = interfaces_of(model.tables.interfaces, geometry)
        with stages("check matrices"):
            body = body_from_foreign(
                read, geometry, name=model.name, units=model.units, interfaces=interfaces, held=self.held,
                remove_supports=self.remove_supports, repair_mass=self.repair_mass,
                accept=[word for word in model.accept if word == "units"],
            )  # fmt: skip
        return body.with_load_cases(*load_cases_of(model.tables.load_cases, body, geometry))


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class GivenArrays:
    """An .npz archive with matrices, nodes and interfaces of a body.

    Parameters
    ----------
    path, held, repair_mass
        As for `body_from_npz`.
    """

    path: str | Path
    held: bool = False
    repair_mass: bool = False

    def assembled(self, model: FEModel, stages: Stages, on_report: Callable[[Any], None] | None) -> FEBody:
        """Return the body, with the load cases of the model."""
        if model.tables.interfaces:
            raise BodyError(f"model {model.name!r}: interfaces: {self.path} brings its own; remove the tables")
        with stages("read matrices"):
            body = body_from_npz(
                self.path, name=model.name, units=model.units, held=self.held, repair_mass=self.repair_mass,
                accept=[word for word in model.accept if word == "units"],
            )  # fmt: skip
        return body.with_load_cases(*load_cases_of(model.tables.load_cases, body))
