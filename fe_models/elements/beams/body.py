"""The finite element body of a frame: beams, point masses, springs and rigid links."""

from collections.abc import Iterable, Mapping

import numpy as np
import scipy.sparse as sp

from fe_models.body.fe_body import FEBody, Interface, Recovery, dofs_of
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.body.unit_check import warn_of_materials
from fe_models.elements.beams.attachments import PointMass, RigidLink, Spring, point_slices, spring_matrix
from fe_models.elements.beams.axes import line_geometry
from fe_models.elements.beams.beam_property import BeamProperty, assign_properties, section_of
from fe_models.elements.beams.elements import Elements
from fe_models.elements.beams.links import link_rigidly
from fe_models.elements.beams.model import BeamModel
from fe_models.elements.beams.section_properties import SectionProperties
from fe_models.elements.beams.skin import Skin, make_skin
from fe_models.errors import BeamError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.units import Units
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.mesh_numbering import line_numbering

__all__ = ["beam_body", "line_orientations"]


def beam_body(
    mesh: LineMesh,
    properties: BeamProperty | Mapping[str, BeamProperty],
    *,
    name: str,
    units: Units,
    interfaces: Iterable[Interface] = (),
    point_masses: Iterable[PointMass] = (),
    springs: Iterable[Spring] = (),
    links: Iterable[RigidLink] = (),
) -> FEBody:
    """Return the body of a frame of straight Timoshenko beams with six dofs per node and consistent mass.

    Parameters
    ----------
    mesh
        Nodes, lines and groups of lines.
    properties
        One property for all lines, or one for each group of lines.
    name
        Name of the body.
    units
        Unit system of all inputs.
    interfaces
        Named places that `cms.couple` couples later; see `line_interface`.
    point_masses, springs, links
        Attachments at the nodes.

    Returns
    -------
    FEBody
        Node i has the dofs 6 i + c, unless it follows a rigid link. The nodes are those of the mesh, then those of the
        skin, which follow the mesh nodes and are drawn. The element model is a `BeamModel`.

    Raises
    ------
    BeamError
        If a line has no length or no y axis, a node has no attached element, or a link is impossible.
    SectionError
        If a group is unknown, or lines have no property or two properties.
    """
    used, of_line = assign_properties(mesh, properties)
    warn_of_materials(name, units, [item.material for item in used])
    point_masses, springs, links = tuple(point_masses), tuple(springs), tuple(links)
    _require_known_nodes(mesh, point_masses, springs, links)
    sections = tuple(section_of(item) for item in used)
    geometry = line_geometry(
        mesh,
        line_orientations(mesh, used, of_line),
        np.array([item.offset for item in used]).reshape(-1, 2)[of_line],
    )
    elements = Elements(geometry, used, sections, of_line)
    n_nodes = len(mesh.nodes)
    dofs_of_line = (6 * mesh.lines[:, :, None] + np.arange(6)).reshape(-1, 12)
    pieces = [elements.slices(dofs_of_line)] if len(mesh.lines) else []
    if point_masses:
        pieces.append(point_slices(mesh.nodes, point_masses))
    stiff = [(dofs_of_line, elements.stiffness())] if len(mesh.lines) else []
    damped = []
    for spring in springs:
        K, dofs = spring_matrix(mesh.nodes, spring, np.asarray(spring.stiffness))
        stiff.append((dofs[None], K[None]))
        if spring.damping is not None:
            D, dofs = spring_matrix(mesh.nodes, spring, np.asarray(spring.damping))
            damped.append((dofs[None], D[None]))
    skin = make_skin(mesh.nodes, mesh.lines, geometry, of_line, sections)
    node_dofs, skin_dofs = dofs_of(np.arange(n_nodes), 6), dofs_of(n_nodes + np.arange(len(skin.points)), 3)
    body = FEBody(
        name=name,
        M=assembled([(piece.dofs, piece.mass_matrices()) for piece in pieces], 6 * n_nodes),
        K=assembled(stiff, 6 * n_nodes),
        D=assembled(damped, 6 * n_nodes) if damped else None,
        nodes=np.concatenate([mesh.nodes, skin.points]),
        dofs=node_dofs,
        interfaces=tuple(interfaces),
        units=units,
        surface=n_nodes + skin.triangles,
        element_model=BeamModel(
            mesh.nodes,
            tuple(pieces),
            geometry,
            elements.K_local,
            dofs_of_line,
            of_line,
            sections,
            skin,
            springs,
            tuple((item.material.E, item.material.mu) for item in used),
        ),
        recovery=Recovery(
            sp.vstack([sp.eye_array(6 * n_nodes), skin_rows(mesh.nodes, skin.points, skin.mover)], format="csr"),
            np.concatenate([node_dofs, skin_dofs]),
        ),
        node_volumes=_node_volumes(n_nodes, geometry.length, of_line, sections, skin),
        numbering=line_numbering(mesh, skin.mover, skin.line_of),
        kept=np.arange(n_nodes),
        provenance=_provenance(mesh, used, of_line, point_masses, springs, links),
    )
    return link_rigidly(body, links)


def assembled(parts: list[tuple[IntArray, Array]], n_dof: int) -> sp.csc_array:
    """Assemble element matrices, (n, d, d), with dof numbers, (n, d), into a sparse matrix."""
    if not parts:
        return sp.csc_array((n_dof, n_dof))
    rows = [np.repeat(dofs, dofs.shape[1], axis=1).ravel() for dofs, _ in parts]
    columns = [np.tile(dofs, (1, dofs.shape[1])).ravel() for dofs, _ in parts]
    values = np.concatenate([matrices.ravel() for _, matrices in parts])
    matrix = sp.coo_array((values, (np.concatenate(rows), np.concatenate(columns))), shape=(n_dof, n_dof)).tocsc()
    matrix.eliminate_zeros()
    return matrix


def skin_rows(nodes: Array, points: Array, mover: IntArray) -> sp.csr_array:
    """Return the matrix from dofs of nodes to translations of skin points, (3 n_skin, 6 n_nodes)."""
    n = len(points)
    if n == 0:
        return sp.csr_array((0, 6 * len(nodes)))
    motion = rigid_motion_of_points(points - nodes[mover], np.zeros(3))
    columns = np.broadcast_to((6 * mover[:, None] + np.arange(6))[:, None], (n, 3, 6))
    rows = np.broadcast_to((3 * np.arange(n)[:, None] + np.arange(3))[:, :, None], (n, 3, 6))
    is_set = motion != 0
    return sp.csr_array((motion[is_set], (rows[is_set], columns[is_set])), shape=(3 * n, 6 * len(nodes)))


def _node_volumes(
    n_nodes: int, length: Array, of_line: IntArray, sections: tuple[SectionProperties, ...], skin: Skin
) -> Array | None:
    """Assign half of the volume of each line to the ring of points at each end, (n_nodes + n_skin,) [m³]."""
    volumes = np.zeros(n_nodes + len(skin.points))
    for number, section in enumerate(sections):
        lines = np.flatnonzero(of_line == number)
        for end in range(2):
            points = n_nodes + skin.ring_start[lines, end, None] + np.arange(len(section.points))
            volumes[points] += section.A * length[lines, None] / (2 * len(section.points))
    return volumes if volumes.any() else None


def line_orientations(mesh: LineMesh, used: tuple[BeamProperty, ...], of_line: IntArray) -> Array:
    """Return the vector towards y for each line, from the mesh or from its property; NaN if none, (n_lines, 3)."""
    own = [(np.nan,) * 3 if item.orientation is None else item.orientation for item in used]
    of_property = np.array(own, dtype=float).reshape(-1, 3)[of_line]
    if mesh.orientations is None:
        return of_property
    own_line = np.asarray(mesh.orientations)
    has_none = np.isnan(own_line.sum(axis=1))
    return np.where(has_none[:, None], of_property, own_line)


def _require_known_nodes(
    mesh: LineMesh, masses: tuple[PointMass, ...], springs: tuple[Spring, ...], links: tuple[RigidLink, ...]
) -> None:
    n = len(mesh.nodes)
    used = np.zeros(n, dtype=bool)
    used[mesh.lines] = True
    for what, nodes in [
        *[("point mass", [item.node]) for item in masses],
        *[("spring", list(item.nodes)) for item in springs],
        *[("rigid link", [item.node, *item.followers.tolist()]) for item in links],
    ]:
        unknown = [node for node in nodes if not 0 <= node < n]
        if unknown:
            raise BeamError(f"{what}: node {unknown[0]} does not exist; expected 0..{n - 1}")
        used[nodes] = True
    loose = np.flatnonzero(~used)
    if loose.size:
        first = mesh.node_numbers[loose[0]] if mesh.node_numbers.size else loose[0]
        raise BeamError(
            f"{loose.size} nodes belong to no line, point mass, spring or link, first node {first}: they would make "
            "the stiffness singular; remove them"
        )


def _provenance(
    mesh: LineMesh,
    used: tuple[BeamProperty, ...],
    of_line: IntArray,
    masses: tuple[PointMass, ...],
    springs: tuple[Spring, ...],
    links: tuple[RigidLink, ...],
) -> dict[str, str]:
    record = {
        "mesh": mesh.source,
        "mesh sha256": mesh.digest,
        **{f"file {path}": digest for path, digest in mesh.included.items()},
        "nodes": str(len(mesh.nodes)),
        "lines": str(len(mesh.lines)),
    }
    for number, item in enumerate(used):
        theory = ("Timoshenko" if item.shear else "Euler-Bernoulli") + (
            "" if item.rotary_inertia else ", no rotary inertia"
        )
        m = item.material
        record[f"section {number + 1}"] = (
            f"{item.section}; {m.name}: E = {m.E!r}, nu = {m.nu!r}, rho = {m.rho!r}; {theory}; "
            f"{int((of_line == number).sum())} lines"
        )
    counts = {"point masses": len(masses), "springs": len(springs), "rigid links": len(links)}
    record |= {what: str(count) for what, count in counts.items() if count}
    return {key: value for key, value in record.items() if value}
