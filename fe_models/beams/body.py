"""A finite element body from a mesh of beams, point masses, springs and rigid links."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from cms.arrays import Array, IntArray
from cms.elimination import eliminate_dofs
from cms.fe_body import FEBody, Interface, Recovery
from cms.rigid_modes import rigid_motion_of_points
from cms.units import Units
from cms.words import nearest
from fe_models.beams.attachments import PointMass, RigidLink, Spring, point_slices, spring_matrix
from fe_models.beams.axes import LineGeometry, line_geometry
from fe_models.beams.element import (
    interpolation,
    local_stiffness,
    shear_parameter,
    stiffness_about_shear_center,
)
from fe_models.beams.line_mesh import LineMesh
from fe_models.beams.model import BeamModel
from fe_models.beams.section_properties import SectionProperties
from fe_models.beams.sections import Section
from fe_models.beams.skin import Skin, make_skin
from fe_models.beams.slices import Slices
from fe_models.errors import BeamError, SectionError
from fe_models.material import Material

__all__ = ["BeamProperty", "beam_body", "link_rigidly"]

N_GAUSS = 4  #: exact for the square of a cubic, degree 6


@dataclass(frozen=True, eq=False)
class BeamProperty:
    """Section, material and theory of a group of lines."""

    section: Section
    material: Material
    offset: tuple[float, float] = (0.0, 0.0)  #: of the centroid from the line, local (y, z) [m]
    orientation: tuple[float, float, float] | None = None  #: vector towards local y; None: that of the mesh, else z up
    shear: bool = True  #: False: no shear deformation (Euler-Bernoulli)
    rotary_inertia: bool = True  #: False: no rotary inertia of bending; that of torsion stays
    added_mass: float = 0.0  #: per length, without stiffness [kg/m]

    def __post_init__(self) -> None:
        for name, size in (("offset", 2), ("orientation", 3)):
            value = getattr(self, name)
            if value is not None and (np.shape(value) != (size,) or not np.isfinite(value).all()):
                raise SectionError(f"beam property: {name}: expected {size} finite numbers, got {value}")
        if not 0 <= self.added_mass < np.inf:
            raise SectionError(f"beam property: added_mass: expected zero or more, got {self.added_mass}")


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
    """Make the body of a frame: straight Timoshenko beams, six dofs per node, consistent mass with rotary inertia.

    Parameters
    ----------
    mesh
        Nodes, lines and groups.
    properties
        One for all lines, or line group -> property.
    name
        Of the body.
    units
        In which everything is.
    interfaces
        Named places, to be coupled later by `cms.couple`; see `line_interface`.
    point_masses, springs, links
        Attached to the nodes.

    Returns
    -------
    FEBody
        Dof 6 i + c of node i but for nodes that follow a rigid link. Its nodes are those of the mesh, then those of
        the skin, which follow them and are drawn; `BeamModel` is the element model.

    Raises
    ------
    BeamError
        If a line has no length or no y axis, a node belongs to nothing, or a link is impossible.
    SectionError
        If a group is unknown, or lines have no property or two.
    """
    used, of_line = assign_properties(mesh, properties)
    point_masses, springs, links = tuple(point_masses), tuple(springs), tuple(links)
    _require_known_nodes(mesh, point_masses, springs, links)
    sections = tuple(section_of(item) for item in used)
    geometry = line_geometry(
        mesh,
        _orientations(mesh, used, of_line),
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
    node_dofs = np.stack([np.repeat(np.arange(n_nodes), 6), np.tile(np.arange(6), n_nodes)], axis=1)
    skin_nodes = n_nodes + np.arange(len(skin.points))
    skin_dofs = np.stack([np.repeat(skin_nodes, 3), np.tile(np.arange(3), len(skin_nodes))], axis=1)
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
            n_nodes, tuple(pieces), geometry, elements.K_local, dofs_of_line, of_line, sections, skin
        ),
        recovery=Recovery(
            sp.vstack([sp.eye_array(6 * n_nodes), skin_rows(mesh.nodes, skin.points, skin.mover)], format="csr"),
            np.concatenate([node_dofs, skin_dofs]),
        ),
        node_volumes=_node_volumes(n_nodes, geometry.length, of_line, sections, skin),
        provenance=_provenance(mesh, used, of_line, point_masses, springs, links),
    )
    return link_rigidly(body, links)


def link_rigidly(body: FEBody, links: Iterable[RigidLink]) -> FEBody:
    """Return the body with the followers of rigid links eliminated: u = u_leader + theta × (c - c_leader).

    A leader may itself follow another link: the chain is resolved to the node that leads all.

    Raises
    ------
    BeamError
        If a node follows two leaders or itself, a leader has not six dofs, or a follower has none.
    """
    leader: dict[int, int] = {}
    for link in links:
        for node in link.followers.tolist():
            if node in leader:
                raise BeamError(f"rigid links: node {node} follows two nodes, {leader[node]} and {link.node}; drop one")
            leader[node] = link.node
    if not leader:
        return body
    row_of = np.full((len(body.nodes), 6), -1, np.int64)
    real = np.flatnonzero(body.dofs[:, 1] >= 0)
    row_of[body.dofs[real, 0], body.dofs[real, 1]] = real
    slaves: list[int] = []
    rows: list[int] = []
    columns: list[int] = []
    values: list[float] = []
    for node in leader:
        root, steps = node, 0
        while root in leader:
            root, steps = leader[root], steps + 1
            if steps > len(leader):
                raise BeamError(f"rigid links: node {node} follows itself round a ring of links; open the ring")
        if (row_of[root] < 0).any():
            raise BeamError(f"rigid links: node {root} leads others, but has not six dofs")
        mine = np.flatnonzero(row_of[node] >= 0)
        if not len(mine):
            raise BeamError(f"rigid links: node {node} follows node {root}, but has no dofs")
        motion = np.eye(6)
        motion[:3] = rigid_motion_of_points(body.nodes[node][None], body.nodes[root])[0]
        first = len(slaves)
        slaves += row_of[node, mine].tolist()
        at = np.nonzero(motion[mine])
        rows += (first + at[0]).tolist()
        columns += row_of[root, at[1]].tolist()
        values += motion[mine][at].tolist()
    T_s = sp.csr_array((values, (rows, columns)), shape=(len(slaves), body.n_dof))
    return eliminate_dofs(body, np.array(slaves), T_s)


class Elements:
    """The beam elements of a mesh, all at once: stiffness and slices."""

    def __init__(
        self,
        geometry: LineGeometry,
        used: tuple[BeamProperty, ...],
        sections: tuple[SectionProperties, ...],
        of_line: IntArray,
    ) -> None:
        def per_line(values: list) -> Array:
            return np.array(values, dtype=float)[of_line]

        self.geometry = geometry
        E, G, rho = (per_line([getattr(p.material, key) for p in used]) for key in ("E", "mu", "rho"))
        A, Iy, Iz, J, A_sy, A_sz = (
            per_line([getattr(s, key) for s in sections]) for key in ("A", "Iy", "Iz", "J", "A_sy", "A_sz")
        )
        shear_center = per_line([s.shear_center for s in sections]).reshape(-1, 2)
        L = geometry.length
        Phi_y, Phi_z = shear_parameter(E * Iz, G * A_sy, L), shear_parameter(E * Iy, G * A_sz, L)
        K = local_stiffness(E * A, G * J, E * Iy, E * Iz, Phi_y, Phi_z, L)
        self.K_local = stiffness_about_shear_center(K, shear_center)  #: over local dofs of the centroid, (n, 12, 12)
        self.mass_per_length = rho * A + per_line([p.added_mass for p in used])
        zero = np.zeros_like(L)
        has_rotary = np.array([p.rotary_inertia for p in used], dtype=bool)[of_line]
        polar = rho * (Iy + Iz) / 2  # J = diag(2 polar, 0, 0) has E = polar diag(-1, 1, 1)
        self.moments_per_length = np.where(
            has_rotary[:, None], np.stack([zero, rho * Iz, rho * Iy], axis=1), np.stack([-polar, polar, polar], axis=1)
        )
        xi, weights = np.polynomial.legendre.leggauss(N_GAUSS)
        self.xi, self.weights = (xi + 1) / 2, weights / 2
        self.N = interpolation(self.xi, Phi_y, Phi_z, L, shear_center)

    def stiffness(self) -> Array:
        """Return the stiffness over the dofs of the nodes, (n, 12, 12)."""
        K = self.geometry.T.transpose(0, 2, 1) @ self.K_local @ self.geometry.T
        return np.asarray((K + K.transpose(0, 2, 1)) / 2)

    def slices(self, dofs: IntArray) -> Slices:
        """Return the slices at the Gauss points."""
        geometry, n, p = self.geometry, len(self.N), N_GAUSS
        R = geometry.R[:, None]
        motion = self.N @ geometry.T[:, None]
        motion = np.concatenate([R @ motion[:, :, :3], R @ motion[:, :, 3:]], axis=2)
        length = geometry.length[:, None] * self.weights
        first, second = geometry.ends[:, 0, None], geometry.ends[:, 1, None]
        return Slices(
            position=first + self.xi[:, None] * (second - first),
            mass=self.mass_per_length[:, None] * length,
            axes=np.broadcast_to(R, (n, p, 3, 3)),
            moments=self.moments_per_length[:, None] * length[..., None],
            motion=motion,
            dofs=dofs,
        )


def section_of(item: BeamProperty) -> SectionProperties:
    """Return the section properties for the material, without shear deformation where that is asked for."""
    section = item.section.properties(item.material.nu)
    return section if item.shear else replace(section, A_sy=np.inf, A_sz=np.inf)


def assign_properties(
    mesh: LineMesh, properties: BeamProperty | Mapping[str, BeamProperty]
) -> tuple[tuple[BeamProperty, ...], IntArray]:
    """Return the properties in use and the number of the property of every line, (n_lines,)."""
    if isinstance(properties, BeamProperty):
        return (properties,), np.zeros(len(mesh.lines), np.int64)
    number = np.full(len(mesh.lines), -1, np.int64)
    used = tuple(dict.fromkeys(properties.values()))
    for group, item in properties.items():
        if group not in mesh.line_sets:
            raise SectionError(f"sections: the mesh has no group of lines {group!r}{nearest(group, mesh.line_sets)}")
        rows, index = mesh.line_sets[group], used.index(item)
        taken = rows[(number[rows] >= 0) & (number[rows] != index)]
        if taken.size:
            raise SectionError(f"sections: {taken.size} lines of group {group!r} have two, first line {taken[0]}")
        number[rows] = index
    missing = np.flatnonzero(number < 0)
    if missing.size:
        groups = [group for group, rows in mesh.line_sets.items() if np.isin(missing, rows).any()]
        where = f"they are in the groups {', '.join(groups)}" if groups else "they are in no group"
        raise SectionError(f"sections: {missing.size} lines have none, first line {missing[0]}; {where}")
    return used, number


def assembled(parts: list[tuple[IntArray, Array]], n_dof: int) -> sp.csc_array:
    """Return the sum of element matrices, (n, d, d) over dofs (n, d), as a sparse matrix."""
    if not parts:
        return sp.csc_array((n_dof, n_dof))
    rows = [np.repeat(dofs, dofs.shape[1], axis=1).ravel() for dofs, _ in parts]
    columns = [np.tile(dofs, (1, dofs.shape[1])).ravel() for dofs, _ in parts]
    values = np.concatenate([matrices.ravel() for _, matrices in parts])
    matrix = sp.coo_array((values, (np.concatenate(rows), np.concatenate(columns))), shape=(n_dof, n_dof)).tocsc()
    matrix.eliminate_zeros()
    return matrix


def skin_rows(nodes: Array, points: Array, mover: IntArray) -> sp.csr_array:
    """Translations of skin points from the dofs of the nodes that move them, (3 n_skin, 6 n_nodes)."""
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
    """Half of the volume of every line on the ring of points at each of its ends, (n_nodes + n_skin,) [m³]."""
    volumes = np.zeros(n_nodes + len(skin.points))
    for number, section in enumerate(sections):
        lines = np.flatnonzero(of_line == number)
        for end in range(2):
            points = n_nodes + skin.ring_start[lines, end, None] + np.arange(len(section.points))
            volumes[points] += section.A * length[lines, None] / (2 * len(section.points))
    return volumes if volumes.any() else None


def _orientations(mesh: LineMesh, used: tuple[BeamProperty, ...], of_line: IntArray) -> Array:
    """Vector towards y of every line: that of its mesh, else of its property, else NaN, (n_lines, 3)."""
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
        raise BeamError(
            f"{loose.size} nodes belong to no line, point mass, spring or link, first node {loose[0]}: they would make "
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
