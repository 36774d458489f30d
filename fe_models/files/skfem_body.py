"""Bodies from a vector basis of scikit-fem and the stiffness and mass matrices that its user assembled."""

from collections.abc import Iterable
from importlib.metadata import version
from typing import Any

import numpy as np

from fe_models.body.fe_body import FEBody, Interface
from fe_models.errors import MeshError
from fe_models.files.matrices.given import body_from_matrices
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.errors import BodyError
from fe_models.foundation.units import Units, unit_system
from fe_models.meshes.boundary import boundary_triangles
from fe_models.meshes.objects.as_mesh import as_mesh
from fe_models.meshes.objects.skfem_basis import nodes_of_basis

__all__ = ["body_from_skfem"]


def body_from_skfem(
    basis: Any,
    K: Any,
    M: Any,
    *,
    name: str,
    units: Units | str,
    interfaces: Iterable[Interface] = (),
    D: Any = None,
    held: bool = False,
    accept: Iterable[str] = (),
) -> FEBody:
    """Return a body from matrices that the user assembled from any forms over a vector basis of scikit-fem.

    The basis may use any element whose dofs are the values of a component at a point (`ElementVector` of P1, P2, Q1,
    Q2, serendipity, wedges, Crouzeix-Raviart, higher orders). The shape functions are checked for this property. If M
    is M_s ⊗ 1₃, as for a mass density, all inertia invariants are exact. The body has no stress and no geometric
    stiffness; `solid_body(basis, material)` gives both, also for orthotropic materials.

    Parameters
    ----------
    basis
        `skfem.Basis` over all cells of a three-dimensional mesh.
    K, M, D
        Stiffness, mass and optional damping over the dofs of the basis, without boundary conditions, (N, N).
    name
        Name of the body.
    units
        Unit system of the mesh and the matrices.
    interfaces
        Interfaces made on the same basis: `rigid_interface(basis, "end", Plane(...))`.
    held, accept
        As for `body_from_matrices`.

    Raises
    ------
    MeshError
        If the basis is not three-dimensional, or its dofs are not values at points.
    BodyError
        If the matrices do not fit, or are not those of a free body (see `body_from_matrices`).

    Examples
    --------
    >>> body = body_from_skfem(basis, K, M, name="part", units="m-kg-s")                         # doctest: +SKIP
    """
    where = f"body {name!r}"
    found = nodes_of_basis(basis)
    for key, matrix in (("K", K), ("M", M), ("D", D)):
        shape = getattr(matrix, "shape", (basis.N, basis.N) if matrix is None else None)
        if shape != (basis.N, basis.N):
            raise BodyError(
                f"{where}: {key}: expected a matrix over the {basis.N} dofs of the basis, got {shape}; pass it as "
                "assembled, not condensed"
            )
    mesh = basis.mesh
    record = {
        "mesh": f"skfem.{type(mesh).__name__}",
        "nodes": str(len(found.nodes)),
        "element": f"skfem.{type(getattr(basis.elem, 'elem', basis.elem)).__name__}, {mesh.t.shape[1]} cells",
        "matrices": "assembled by the user",
        "scikit-fem": version("scikit-fem"),
    }
    return body_from_matrices(
        M, K, found.nodes, found.dofs,
        name=name, units=unit_system(units) if isinstance(units, str) else units, interfaces=interfaces, D=D,
        surface=_surface(basis), provenance=record, held=held, accept=accept,
    )  # fmt: skip


def _surface(basis: Any) -> IntArray:
    """Return triangles for drawing; none if no cell type of this package has the same nodes as the element."""
    try:
        return boundary_triangles(as_mesh(basis))
    except MeshError:
        return np.zeros((0, 3), np.int64)
