"""The finite element model of one body: the form in which every source passes it to the reduction."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Annotated, Any, Protocol

import numpy as np
import scipy.sparse as sp

from fe_models.body.load_cases import LoadCase, check_load_cases
from fe_models.body.rigid_motion import MassLoads
from fe_models.errors import InterfaceError
from fe_models.foundation.arrays import (
    Array,
    GivenArray,
    IntArray,
    frozen,
    given,
    require_finite,
    require_shape,
    symmetric_csc,
)
from fe_models.foundation.errors import ArgumentError, BodyError
from fe_models.foundation.presentation import Summary, listed, presented
from fe_models.foundation.ranks.row_layout import RowLayout
from fe_models.foundation.ranks.spread_columns import spread_parts
from fe_models.foundation.records import ArrayShape, checked_fields
from fe_models.foundation.tall.columns import elsewhere, in_memory
from fe_models.foundation.tall.on_disk import is_on_disk, release, row_slices, zeros_like
from fe_models.foundation.units import Units, unit_system
from fe_models.foundation.words import nearest, quoted
from fe_models.meshes.numbering import Numbering

__all__ = [
    "INTERFACE_KINDS",
    "MULTIPLIER",
    "ElementModel",
    "FEBody",
    "Interface",
    "NoNodalRotations",
    "Recovery",
    "StressPointModel",
    "dofs_of",
]

MULTIPLIER = -1  #: component number of a Lagrange multiplier of a distributing (RBE3) interface
INTERFACE_KINDS = ("rigid", "distributing", "nodes")


class ElementModel(Protocol):
    """Quantities that only the elements can compute: exact mass integrals, stress and geometric stiffness."""

    @property
    def has_nodal_stress(self) -> bool:
        """Whether `nodal_stress` is available; it is not for bare matrices and pure beam frames."""

    def mass_gram(self, u: Array) -> Array:
        """Return the mass integrals ∫ a aᵀ dm with a = [1, c, u_x, u_y, u_z] (docs/theory.md §5).

        Parameters
        ----------
        u
            Displacement columns over the dofs of the uncoupled body, (n_mesh_dof, k).

        Returns
        -------
        Array
            (4 + 3 k, 4 + 3 k) [kg × units of the products]; u_x of all columns come first, then u_y, u_z.
        """

    def nodal_stress(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return the stress at the nodes, averaged over the adjoining elements of one material.

        Parameters
        ----------
        u
            Displacement columns over the dofs of the uncoupled body, (n_mesh_dof, k).
        nodes
            Nodes whose stress is wanted; None: all nodes. Nodes beyond the mesh, such as those of an interface, have no
            stress. The result may be zero at nodes that are not listed.

        Returns
        -------
        Array
            (n_mesh_nodes, 6, k) [Pa], components xx, yy, zz, yz, xz, xy; zero at nodes without solid elements.
        """

    def nodal_rotation(self, u: Array, nodes: IntArray) -> Array:
        """Return rotation vectors, computed from the adjoining elements, at nodes without rotational dofs.

        Parameters
        ----------
        u
            Displacement columns over the dofs of the uncoupled body, (n_mesh_dof, k).
        nodes
            Indices of nodes, (n,); some may lie beyond the mesh.

        Returns
        -------
        Array
            (n, 3, k); NaN where the elements do not know the rotation.
        """

    @property
    def has_geometric_stiffness(self) -> bool:
        """Whether the three methods below are available; they are not for bare matrices."""

    def mass_forces(self, loads: MassLoads) -> Array:
        """Return consistent nodal forces of loads per unit mass: their work on any u equals the work of the loads.

        Parameters
        ----------
        loads
            Loads per unit mass.

        Returns
        -------
        Array
            (n_mesh_dof, loads.k) [N, N m].
        """

    def internal_forces(self, u: Array, *, nodes: IntArray | None = None) -> Array:
        """Return the nodal forces for displacements u: f_int = K u of the elements, without couplings.

        Parameters
        ----------
        u
            Displacement columns over the dofs of the uncoupled body, (n_mesh_dof, k).
        nodes
            Nodes whose forces are wanted; None: all nodes. The result may be zero at the other nodes.

        Returns
        -------
        Array
            (n_mesh_dof, k) [N, N m].
        """

    def geometric_stiffness(self, u: Array, loads: MassLoads, Phi: Array) -> Array:
        """Return Phiᵀ K_geo(sigma_j) Phi of static states u_j, (k, n, n), symmetric and linear in u_j (theory.md §7).

        K_geo is the second derivative of the potential energy with respect to the displacements, at fixed stress. For
        solids it is ∫ sigma_ab u_c,a u_c,b dV. Elements with rotations take the rotations as rotation vectors. They add
        the work that forces off their axis (section, offset) do on the second-order term of the rotation; for this they
        need the loads. Together: K_geo(sigma_j) applied to the rigid rotation theta, (theta × c, theta), is (theta × f,
        ½ theta × m) plus ∫ (theta × load)·N dm, where f, m are the nodal forces `internal_forces` - `mass_forces`.

        Parameters
        ----------
        u
            Displacements of the static states, (n_mesh_dof, k). Only their stress counts, not their rigid part.
        loads
            The loads per unit mass that act in these states.
        Phi
            Displacement columns over the dofs of the uncoupled body, (n_mesh_dof, n).
        """


class NoNodalRotations:
    """Base of element models without rotations at nodes: these are dofs, or the elements are unknown."""

    def nodal_rotation(self, u: Array, nodes: IntArray) -> Array:
        """Return NaN, (n, 3, k)."""
        return np.full((len(nodes), 3, np.shape(u)[1]), np.nan)


class StressPointModel(Protocol):
    """Stress of a displacement field at named points, such as the extreme fibres of beam sections."""

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each point, such as "shaft 3 a top", (n_points,)."""

    @property
    def positions(self) -> Array:
        """Undeformed positions in mesh axes, (n_points, 3) [m]."""

    def stress(self, u: Array) -> Array:
        """Return the stress, (n_points, 6, k) [Pa], components as in `ElementModel.nodal_stress`, mesh axes.

        Parameters
        ----------
        u
            Displacement columns over the dofs of the uncoupled body, (n_mesh_dof, k).
        """


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class Interface:
    """Interface: a named place at which neighbours connect to the body.

    "rigid" (RBE2): the member nodes move rigidly with the reference node.
    "distributing" (RBE3): the reference node follows the weighted mean motion of the members.
    "nodes": every dof of every member node is a boundary dof.

    Parameters
    ----------
    name
        Name of the interface, unique on the body.
    kind
        "rigid", "distributing" or "nodes".
    nodes
        Member nodes, indices into `FEBody.nodes`, (n_members,).
    reference
        Reference point in mesh coordinates, (3,) [m].
    triad
        Interface axes as columns, in mesh axes, (3, 3).
    weights
        Weight of each member (its area), summing to 1, (n_members,); None: equal weights.
    dofs
        Boundary dofs, indices into `FEBody.dofs`; None until `couple` has created them.
    """

    name: str
    kind: str
    nodes: IntArray
    reference: GivenArray = given()
    triad: GivenArray = given(np.eye(3))
    weights: Array | None = None
    dofs: IntArray | None = None

    def __post_init__(self) -> None:
        where = f"interface {self.name!r}"
        if self.kind not in INTERFACE_KINDS:
            raise InterfaceError(f"{where}: unknown kind {quoted(self.kind)}{nearest(self.kind, INTERFACE_KINDS)}")
        object.__setattr__(self, "nodes", frozen(self.nodes, np.int64))
        object.__setattr__(self, "reference", frozen(self.reference))
        object.__setattr__(self, "triad", frozen(self.triad))
        if self.nodes.ndim != 1 or self.nodes.size == 0:
            raise InterfaceError(f"{where}: expected member nodes, got none")
        if np.unique(self.nodes).size != self.nodes.size:
            raise InterfaceError(f"{where}: a member node is listed twice")
        if self.reference.shape != (3,) or not np.isfinite(self.reference).all():
            raise InterfaceError(
                f"{where}: reference: expected three finite coordinates, got {self.reference.tolist()}"
            )
        T = self.triad
        if T.shape != (3, 3) or not np.abs(T.T @ T - np.eye(3)).max() <= 1e-8 or np.linalg.det(T) < 0:
            raise InterfaceError(
                f"{where}: triad: expected orthonormal right-handed axes as columns (3, 3), got {T.tolist()}"
            )
        weights = np.full(self.nodes.size, 1.0) if self.weights is None else np.asarray(self.weights, dtype=float)
        require_shape(f"{where}: weights", weights, (self.nodes.size,))
        require_finite(f"{where}: weights", weights)
        if (weights < 0).any() or weights.sum() <= 0:
            raise InterfaceError(f"{where}: weights: expected no negative weight and a positive sum")
        object.__setattr__(self, "weights", frozen(weights / weights.sum()))
        if self.dofs is not None:
            object.__setattr__(self, "dofs", frozen(self.dofs, np.int64))


@presented
@dataclass(frozen=True, eq=False)
class Recovery:
    """Map from the dofs of a coupled body to its mesh dofs: u_mesh = matrix @ u."""

    matrix: sp.csr_array  #: matrix of the map, (n_mesh_dof, n_dof)
    dofs: IntArray  #: (node, component) of the mesh dofs, (n_mesh_dof, 2)
    layout: RowLayout | None = None  #: distribution of the mesh-dof rows over ranks; None: not distributed


@dataclass(frozen=True, eq=False)
class Tie:
    """Distributing interface inside a welded body: multipliers enforce C u = S (motion - mean) u = 0.

    The mean motion of the members is not linear in large rotations. Only the geometric stiffness needs this record; M
    and K have the linear tie.
    """

    interface: Interface  #: interface without dofs (`dofs` is None)
    motion: sp.csr_array  #: motion of the reference node of the interface as rows over the dofs, (6, n_dof)
    multipliers: IntArray  #: dofs of the multipliers, (n,); n is 6, or less if some are eliminated
    S: Array  #: scale factors of the multiplier rows, (n, 6)
    #: the interface whose members the reference node follows rigidly; None: it follows nodes of the body
    leader: Interface | None = None

    def changed(self, T: sp.sparray, new_index: IntArray) -> "Tie":
        """Return the tie after a substitution u = T u_new, (n_dof, n_new); new_index is -1 for eliminated dofs."""
        stays = new_index[self.multipliers] >= 0
        return replace(
            self, motion=sp.csr_array(self.motion @ T), multipliers=new_index[self.multipliers[stays]], S=self.S[stays]
        )


@dataclass(frozen=True, eq=False)
class MeanNode:
    """Node inside a body without dofs, which follows the mean motion of other nodes (RBE3).

    Only the geometric stiffness needs this record; M and K have the linear mean.
    """

    members: IntArray  #: member nodes of the body, (n_members,)
    weights: Array  #: weights of the translations of the members, with sum 1, (n_members,)
    reference: Array  #: position of the node, mesh axes, (3,) [m]
    follows: sp.csr_array  #: motion of the mesh dofs due to that of the node, including its followers, (n_mesh_dof, 6)

    def placed(self, first_node: int, first_row: int, n_rows: int) -> "MeanNode":
        """Return the record for a body of several parts, in which its nodes and mesh dofs begin at these indices."""
        rows = sp.coo_array(self.follows)
        follows = sp.csr_array((rows.data, (rows.row + first_row, rows.col)), shape=(n_rows, 6))
        return replace(self, members=self.members + first_node, follows=follows)


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class FEBody:
    """Finite element model of one body, free or intentionally fixed to the ground.

    Dof k is component `dofs[k, 1]` (0-2 translation, 3-5 rotation, `MULTIPLIER`) of node `dofs[k, 0]`, in mesh axes. A
    body is *coupled* if every interface has its boundary dofs (`cms.couple`). Mode sets need a coupled body.

    Parameters
    ----------
    name
        Name of the body.
    M
        Mass, (n_dof, n_dof) [kg, kg m²]; a `SpreadMatrix` if the body is distributed over ranks.
    K
        Stiffness, (n_dof, n_dof) [N/m, N m]; a `SpreadMatrix` if the body is distributed over ranks.
    nodes
        Positions in mesh axes, (n_nodes, 3) [m].
    dofs
        (node, component) of every dof, (n_dof, 2).
    interfaces
        Places at which neighbours connect to the body.
    units
        Unit system of all numbers of the body.
    D
        Viscous damping, (n_dof, n_dof) [N s/m, N m s].
    surface
        Triangles of nodes, (n_tri, 3).
    element_model
        Mass integrals, stress and geometric stiffness by the elements; None: bare matrices; only integrals that follow
        from these are exact.
    recovery
        Map from the dofs to those of the mesh; None: the dofs are the mesh dofs.
    load_cases
        Named loads over the dofs of this body.
    stress_points
        Stress at points that are not nodes; None: no such points.
    node_volumes
        Volume that each node represents, not negative, (n_nodes,) [m³]; None: unknown, all nodes with translations
        count equally.
    provenance
        Origin of the body: file, digest, options.
    is_held
        Whether the body is intentionally held to the ground; a floating frame rejects it.
    numbering
        The user's numbers of nodes and elements, and the sets.
    ties
        Distributing interfaces inside the body.
    mean_nodes
        Nodes inside the body that follow the mean motion of others.
    kept
        Nodes that the reduced body keeps with translations and rotations, in addition to surface and interfaces, (n,).

    Raises
    ------
    BodyError
        If shapes do not fit, a matrix is not symmetric or not finite, or an interface names unknown nodes.
    """

    name: str
    M: sp.csc_array
    K: sp.csc_array
    nodes: Annotated[Array, ArrayShape(("n_nodes", 3))]
    dofs: Annotated[IntArray, ArrayShape(("n_dof", 2))]
    interfaces: tuple[Interface, ...] = ()
    units: Units = field(default_factory=lambda: unit_system("m-kg-s"))
    D: sp.csc_array | None = None
    surface: Annotated[IntArray, ArrayShape((None, 3))] = field(default_factory=lambda: np.zeros((0, 3), np.int64))
    element_model: ElementModel | None = None
    recovery: Recovery | None = None
    load_cases: tuple[LoadCase, ...] = ()
    stress_points: StressPointModel | None = None
    node_volumes: Annotated[Array | None, ArrayShape(("n_nodes",))] = None
    provenance: Mapping[str, str] = field(default_factory=dict)
    is_held: bool = False
    numbering: Numbering = field(default_factory=Numbering)
    ties: tuple[Tie, ...] = ()
    mean_nodes: tuple[MeanNode, ...] = ()
    kept: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))

    def summary(self) -> Summary:
        """Return what `repr` and notebooks show: units, size of the model, and the interfaces."""
        rows = [
            ("units", self.units.name),
            ("nodes", str(len(self.nodes))),
            ("dofs", str(len(self.dofs))),
            ("support", "held to the ground" if self.is_held else "free"),
            *([("load cases", listed([case.name for case in self.load_cases]))] if self.load_cases else []),
        ]
        interfaces = [(each.name, each.kind) for each in self.interfaces]
        return Summary(f"FEBody {self.name!r}", rows, ("interface", "kind"), interfaces)

    def __post_init__(self) -> None:
        where = f"body {self.name!r}"
        put = object.__setattr__
        put(self, "interfaces", tuple(self.interfaces))
        put(self, "provenance", MappingProxyType(dict(self.provenance)))
        for name, what in (("nodes", "node"), ("dofs", "dof")):
            if not len(getattr(self, name)):
                raise BodyError(f"{where}: {name}: expected at least one {what}, got none")
        if self.dofs[:, 0].min() < 0 or self.dofs[:, 0].max() >= len(self.nodes):
            raise BodyError(
                f"{where}: dofs: expected nodes 0..{len(self.nodes) - 1}, got "
                f"{self.dofs[:, 0].min()}..{self.dofs[:, 0].max()}"
            )
        if self.dofs[:, 1].min() < MULTIPLIER or self.dofs[:, 1].max() > 5:
            raise BodyError(
                f"{where}: dofs: expected components 0..5, got {self.dofs[:, 1].min()}..{self.dofs[:, 1].max()}"
            )
        n_dof = len(self.dofs)
        for name in ("M", "K", "D"):
            A: Any = getattr(self, name)
            if hasattr(A, "layout"):  # a distributed matrix was already symmetrised when it was assembled
                if A.shape != (n_dof, n_dof) or not np.isfinite(A.largest):
                    raise BodyError(
                        f"{where}: {name}: expected finite entries and shape {(n_dof, n_dof)}, got {A.shape}, up to "
                        f"{A.largest:g}"
                    )
            elif A is not None:
                put(self, name, symmetric_csc(f"{where}: {name}", A, n_dof))
        if self.node_volumes is not None and ((self.node_volumes < 0).any() or not self.node_volumes.any()):
            raise BodyError(f"{where}: node_volumes: expected no negative volume and a positive sum")
        put(self, "load_cases", tuple(self.load_cases))
        if self.load_cases:
            check_load_cases(where, self.load_cases, n_dof)
        names = [interface.name for interface in self.interfaces]
        if len(set(names)) != len(names):
            raise BodyError(f"{where}: two interfaces have the same name; got {', '.join(names)}")
        for interface in self.interfaces:
            if interface.nodes.min() < 0 or interface.nodes.max() >= len(self.nodes):
                raise BodyError(f"{where}: interface {interface.name!r}: nodes outside 0..{len(self.nodes) - 1}")
        if self.surface.size and (self.surface.min() < 0 or self.surface.max() >= len(self.nodes)):
            raise BodyError(f"{where}: surface: nodes outside 0..{len(self.nodes) - 1}")
        self.numbering.require_fit(where, len(self.nodes), len(self.surface))
        put(self, "kept", frozen(np.unique(self.kept), np.int64))
        if self.kept.size and (self.kept.min() < 0 or self.kept.max() >= len(self.nodes)):
            raise BodyError(f"{where}: kept: nodes outside 0..{len(self.nodes) - 1}")

    @property
    def numbered(self) -> tuple[str, Numbering, int, int]:
        """Name, numbering, number of nodes and number of triangles; used to join the numberings of several bodies."""
        return self.name, self.numbering, len(self.nodes), len(self.surface)

    @property
    def to_mesh(self) -> Recovery:
        """Recovery of the mesh dofs; the identity if the dofs are the mesh dofs."""
        if self.recovery is not None:
            return self.recovery
        return Recovery(sp.eye_array(self.n_dof, format="csr"), self.dofs)

    @property
    def n_dof(self) -> int:
        """Number of dofs."""
        return len(self.dofs)

    @property
    def layout(self) -> RowLayout | None:
        """Distribution of the rows of K and M over ranks; None if this process has the whole matrices."""
        return getattr(self.K, "layout", None)

    @property
    def is_coupled(self) -> bool:
        """Whether every interface has its boundary dofs."""
        return all(interface.dofs is not None for interface in self.interfaces)

    @property
    def b(self) -> IntArray:
        """Boundary dofs of all interfaces, in the order of the interfaces, (n_b,)."""
        self.require_coupled()
        parts = [interface.dofs for interface in self.interfaces if interface.dofs is not None]
        return np.concatenate(parts) if parts else np.zeros(0, np.int64)

    @property
    def i(self) -> IntArray:
        """Interior dofs: all dofs that are not boundary dofs, ascending, (n_i,)."""
        return np.setdiff1d(np.arange(self.n_dof), self.b)

    @property
    def length(self) -> float:
        """Diagonal of the bounding box of the nodes [m], used to scale rotations; 1 if all nodes coincide."""
        return float(np.linalg.norm(np.ptp(self.nodes, axis=0))) or 1.0

    def interface(self, name: str) -> Interface:
        """Return the interface with this name; raise `BodyError` with the known names if there is none."""
        for interface in self.interfaces:
            if interface.name == name:
                return interface
        choices = [interface.name for interface in self.interfaces]
        raise BodyError(f"body {self.name!r}: no interface {quoted(name)}{nearest(name, choices)}")

    def require_coupled(self) -> None:
        """Raise `BodyError` unless every interface has its boundary dofs."""
        missing = [interface.name for interface in self.interfaces if interface.dofs is None]
        if missing:
            raise BodyError(
                f"body {self.name!r}: interfaces {', '.join(missing)} have no boundary dofs yet; call cms.couple(body)"
            )

    def mesh_displacement(self, u: Any) -> Any:
        """Return displacement columns over the mesh dofs, (n_mesh_dof, k), from columns u, (n_dof, k).

        Columns on many ranks stay distributed if the recovery has a layout; otherwise the result is an array.
        """
        if self.recovery is None:
            return u
        T, layout = self.recovery.matrix, self.recovery.layout
        if (far := elsewhere(u)) is not None and layout is not None:
            return spread_parts(layout, far.shape[1], (T @ x for _, x in far.parts()))
        if not is_on_disk(u) or not u.flags.c_contiguous:  # a few columns of an array on disk fit in memory
            return T @ in_memory(u)
        T = sp.csr_array(T)
        result = zeros_like(u, (T.shape[0], u.shape[1]))
        for rows in row_slices(T.shape[0], result):
            result[rows] = T[rows] @ u
            release(u)
        return result

    def translations(self, u: Array) -> Array:
        """Return the translations of all nodes, (n_nodes, 3, k) [m], for displacement columns u, (n_dof, k).

        They are zero at nodes without translational dofs. The reference node of a distributing interface has such dofs.
        """
        u = in_memory(u)
        field_ = np.zeros((len(self.nodes), 3, u.shape[1]))
        if self.recovery is not None:
            put_translations(field_, self.recovery.dofs, self.recovery.matrix @ u)
        put_translations(field_, self.dofs, u)
        return field_

    def translation_rows(self, u: Array) -> Array:
        """Return `translations` as rows, (3 n_nodes, k)."""
        return self.translations(u).reshape(3 * len(self.nodes), u.shape[1])

    def with_interfaces(self, *interfaces: Interface) -> "FEBody":
        """Return the body with these interfaces added, not yet coupled."""
        return replace(self, interfaces=(*self.interfaces, *interfaces))

    def with_load_cases(self, *load_cases: LoadCase) -> "FEBody":
        """Return the body with these load cases added."""
        return replace(self, load_cases=(*self.load_cases, *load_cases))


def dofs_of(nodes: IntArray, n: int) -> IntArray:
    """Return node and component of the first n dofs of each node, (n n_nodes, 2)."""
    return np.stack([np.repeat(nodes, n), np.tile(np.arange(n), len(nodes))], axis=1)


def put_translations(field_: Array, dofs: IntArray, u: Array) -> None:
    """Copy the translational rows of u into `field_`, (n_nodes, 3, k)."""
    rows = np.flatnonzero((dofs[:, 1] >= 0) & (dofs[:, 1] < 3))
    field_[dofs[rows, 0], dofs[rows, 1]] = u[rows]
