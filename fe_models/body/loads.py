"""Load cases of a body: pressure, gravity, forces at nodes, force and torque at an interface or on a selection.

Every load is consistent: its virtual work equals the work of the given load on any displacement field of the elements,
so its resultant force and moment are exact. All functions accept a body before or after coupling. After coupling, a
load on the members of a rigid interface acts on its reference node.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from fe_models.body.fe_body import FEBody
from fe_models.body.load_cases import LoadCase
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.errors import LoadError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.boundary import boundary_facets, facet_weights, first_of_equal_rows
from fe_models.meshes.cell_shapes import quadrature, shape_values
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.mesh import Mesh
from fe_models.meshes.selections import AnyMesh, Selection, selected_facets

__all__ = ["gravity_load", "interface_load", "nodal_load", "pressure_load", "selection_load"]

UNREACHED = 1e-9  #: largest share of a force or torque that the nodes cannot transmit; a load above it is rejected


def pressure_load(body: FEBody, mesh: AnyMesh, name: str, selection: Selection, pressure: float) -> LoadCase:
    """Make the load case of a uniform pressure on facets of the surface.

    f_n = -p ∫ N_n n dA with n dA = ∂x/∂xi × ∂x/∂eta. The integrand is a polynomial on every face, so the quadrature is
    exact. The resultant is -p times the area vector of the facets.

    Parameters
    ----------
    body
        The body that was made of the mesh, with the nodes of the mesh first.
    mesh
        Mesh of a solid or of a shell; lines have no faces.
    name
        Name of the load case.
    selection
        Facets of the surface of a solid, or cells of a shell.
    pressure
        Pressure [Pa]. A positive value pushes on the surface; on a shell it pushes on the top, against the cell
        normals.

    Raises
    ------
    LoadError
        If the pressure is not finite, or the selection holds no facet of the surface or also other faces.
    InterfaceError
        If the selection is empty.
    """
    where = f"load case {name!r}"
    value = float(_finite(f"{where}: pressure", pressure, ()))
    if isinstance(mesh, LineMesh):
        raise LoadError(f"{where}: lines have no faces to press on; give the force at nodes or an interface")
    _require_mesh_of(body, mesh, where)
    facets = selected_facets(mesh, selection)
    if not facets:
        raise LoadError(f"{where}: the selected nodes make up no complete facet of the surface; select faces")
    forces = np.zeros((len(body.nodes), 6))
    for kind, rows in facets.items():
        if isinstance(mesh, Mesh):
            _require_outward(mesh, where, kind, rows)
        points, weights = quadrature(kind)
        N, dN = shape_values(kind, points)
        tangents = np.einsum("fnd,pna->fpad", mesh.nodes[rows], dN)
        area_vectors = np.cross(tangents[:, :, 0], tangents[:, :, 1]) * weights[:, None]
        np.add.at(forces[:, :3], rows, -value * np.einsum("pn,fpd->fnd", N, area_vectors))
    return LoadCase(name, "pressure", _generalised(body, forces, where))


def gravity_load(body: FEBody, name: str, acceleration: ArrayLike) -> LoadCase:
    """Make the load case of gravity: f = M Psi_t g, where Psi_t holds the three unit translations.

    Parameters
    ----------
    body
        Any body with mass.
    name
        Name of the load case.
    acceleration
        Acceleration g of free fall, mesh axes, (3,) [m/s²].
    """
    g = _finite(f"load case {name!r}: acceleration", acceleration, (3,))
    component = body.dofs[:, 1]
    fall = np.where((component >= 0) & (component < 3), g[np.clip(component, 0, 2)], 0.0)
    return LoadCase(name, "gravity", body.M @ fall)


def nodal_load(body: FEBody, name: str, loads: Mapping[int, ArrayLike]) -> LoadCase:
    """Make the load case of given forces and moments at nodes.

    Parameters
    ----------
    body
        Any body.
    name
        Name of the load case.
    loads
        For each node its force, (3,) [N], or force and moment, (6,) [N, N m], mesh axes.

    Raises
    ------
    LoadError
        If a node does not exist, or lacks the dof of a non-zero component.
    """
    where = f"load case {name!r}"
    table = np.zeros((len(body.nodes), 6))
    for node, load in loads.items():
        if not 0 <= node < len(body.nodes):
            raise LoadError(f"{where}: no node {node}; expected 0..{len(body.nodes) - 1}")
        row = np.asarray(load, dtype=float)
        row = _finite(f"{where}: node {node}", row, (6,) if row.shape == (6,) else (3,))
        table[node, : len(row)] += row
    return LoadCase(name, "force", _generalised(body, table, where))


def interface_load(
    body: FEBody, name: str, interface: str, *, force: ArrayLike = (0, 0, 0), torque: ArrayLike = (0, 0, 0)
) -> LoadCase:
    """Make the load case of a force and a torque at the reference point of an interface.

    On a distributing interface the members carry f = W G (Gᵀ W G)⁻¹ F, where G holds the rigid motions of the members
    and W their weights. This does the same work as F at the reference node, for rigid and distributing interfaces
    alike.

    Parameters
    ----------
    body
        Body that has the interface.
    name
        Name of the load case.
    interface
        Name of the interface.
    force, torque
        Force, (3,) [N], and torque, (3,) [N m], at the reference point, mesh axes.

    Raises
    ------
    LoadError
        If the members cannot carry the load, such as a torque at a single node without rotations.
    BodyError
        If the body has no such interface.
    """
    where, at = f"load case {name!r}", body.interface(interface)
    wrench = _wrench(where, force, torque)
    nodes = np.unique(body.dofs[at.dofs, 0]) if at.dofs is not None else np.zeros(0, np.int64)
    if at.dofs is not None and len(at.dofs) == 6 and len(nodes) == 1:
        table = np.zeros((len(body.nodes), 6))
        table[nodes[0]] = wrench
    else:
        table = _spread(body, at.nodes, np.asarray(at.weights), at.reference, wrench, f"{where}: {interface!r}")
    return LoadCase(name, "force", _generalised(body, table, where))


def selection_load(
    body: FEBody,
    mesh: AnyMesh,
    name: str,
    selection: Selection,
    *,
    force: ArrayLike = (0, 0, 0),
    torque: ArrayLike = (0, 0, 0),
    reference: ArrayLike | None = None,
) -> LoadCase:
    """Make the load case of a total force and torque that is distributed over selected nodes.

    The nodes are weighted as in a distributing coupling: by their area if the selection consists of facets, else
    equally.

    Parameters
    ----------
    body, mesh, name
        As for `pressure_load`.
    selection
        The loaded nodes.
    force, torque
        Resultant force, (3,) [N], and torque about the reference point, (3,) [N m], mesh axes.
    reference
        Point at which the force acts, (3,) [m]; None: the weighted mean of the nodes.

    Raises
    ------
    LoadError
        If the nodes cannot carry the load.
    InterfaceError
        If the selection is empty.
    """
    where = f"load case {name!r}"
    _require_mesh_of(body, mesh, where)
    nodes = selection.members(mesh)
    facets = selected_facets(mesh, selection)
    area = facet_weights(mesh.nodes, facets)[nodes] if facets else np.ones(len(nodes))
    weights = np.maximum(area, 0.0) / np.maximum(area, 0.0).sum()
    center = weights @ mesh.nodes[nodes]
    point = center if reference is None else _finite(f"{where}: reference", reference, (3,))
    table = _spread(body, nodes, weights, point, _wrench(where, force, torque), where)
    return LoadCase(name, "force", _generalised(body, table, where))


def _spread(body: FEBody, nodes: IntArray, weights: Array, reference: Array, wrench: Array, where: str) -> Array:
    """Return nodal forces and moments whose resultant about the reference point is the wrench, (n_nodes, 6).

    Translations carry the wrench where they can. Otherwise moments are added at nodes that have rotations.
    """
    dofs = body.dofs if body.recovery is None else np.concatenate([body.recovery.dofs, body.dofs])
    has_rotation = np.isin(nodes, dofs[dofs[:, 1] >= 3, 0])
    G = np.zeros((len(nodes), 6, 6))
    G[:, :3] = rigid_motion_of_points(body.nodes[nodes], reference)
    G[has_rotation, 3:, 3:] = np.eye(3)
    arms = np.linalg.norm(body.nodes[nodes] - reference, axis=1)
    length = float(arms.max()) or 1.0  # length that makes force and torque comparable
    unit = np.repeat([1.0, length], 3)
    for moments in (0.0, length**2):
        W = weights[:, None] * np.repeat([1.0, moments], 3)
        N = np.einsum("nic,ni,nid->cd", G, W, G) / np.outer(unit, unit)
        x = np.linalg.lstsq(N, wrench / unit, rcond=1e-10)[0]
        spread = W * np.einsum("nic,c->ni", G, x / unit)
        missing = np.abs((np.einsum("nic,ni->c", G, spread) - wrench) / unit).max()
        if missing <= UNREACHED * np.abs(wrench / unit).max():
            table = np.zeros((len(body.nodes), 6))
            table[nodes] = spread
            return table
    raise LoadError(
        f"{where}: {len(nodes)} nodes cannot carry this force and torque about ({_numbers(reference)}): one point or "
        "line has no lever arm; take more nodes, or move the reference point onto them"
    )


def _generalised(body: FEBody, table: Array, where: str) -> Array:
    """Convert forces and moments at nodes, (n_nodes, 6), to generalised forces over the dofs, (n_dof,)."""
    on_body = _scattered(body.dofs, table)
    if body.recovery is None:
        is_known = _known(body.dofs, table.shape)
    else:
        is_reference = ~np.isin(body.dofs[:, 0], body.recovery.dofs[:, 0])
        on_body = np.where(is_reference, on_body, 0.0) + body.recovery.matrix.T @ _scattered(body.recovery.dofs, table)
        is_known = _known(body.recovery.dofs, table.shape) | _known(body.dofs[is_reference], table.shape)
    lost = np.argwhere((table != 0) & ~is_known)
    if len(lost):
        node, component = lost[0]
        what = "rotations: spread a torque over several nodes" if component >= 3 else "this translation"
        raise LoadError(f"{where}: node {node} at ({_numbers(body.nodes[node])}) has no {what}")
    return on_body


def _scattered(dofs: IntArray, table: Array) -> Array:
    return np.where(dofs[:, 1] >= 0, table[dofs[:, 0], np.maximum(dofs[:, 1], 0)], 0.0)


def _known(dofs: IntArray, shape: tuple[int, ...]) -> np.ndarray:
    known = np.zeros(shape, dtype=bool)
    real = dofs[dofs[:, 1] >= 0]
    known[real[:, 0], real[:, 1]] = True
    return known


def _require_outward(mesh: Mesh, where: str, kind: str, rows: IntArray) -> None:
    """Raise `LoadError` unless every face is on the boundary of the mesh, where normals point outward."""
    facets = boundary_facets(mesh).get(kind, np.zeros((0, rows.shape[1]), np.int64))
    classes, _ = first_of_equal_rows(np.concatenate([facets, rows]))
    inside = ~np.isin(classes[len(facets) :], classes[: len(facets)])
    if inside.any():
        raise LoadError(
            f"{where}: {int(inside.sum())} of {len(rows)} faces ({kind}) are not facets of the surface and so have no "
            "outside; select faces of the surface"
        )


def _require_mesh_of(body: FEBody, mesh: AnyMesh, where: str) -> None:
    n = len(mesh.nodes)
    if len(body.nodes) < n or not np.array_equal(body.nodes[:n], mesh.nodes):
        raise LoadError(f"{where}: the mesh is not that of body {body.name!r}; pass the mesh the body was made of")


def _wrench(where: str, force: ArrayLike, torque: ArrayLike) -> Array:
    return np.concatenate([_finite(f"{where}: force", force, (3,)), _finite(f"{where}: torque", torque, (3,))])


def _finite(where: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    array = np.asarray(values, dtype=float)
    if array.shape != shape or not np.isfinite(array).all():
        expected = f"{shape[0]} finite numbers" if shape else "a finite number"
        raise LoadError(f"{where}: expected {expected}, got {values!r}")
    return array


def _numbers(point: Array) -> str:
    return ", ".join(f"{x:.6g}" for x in point)
