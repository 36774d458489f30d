"""Content of a deck of any program: mesh, materials, sections, attachments, couplings, supports, loads, ledger.

Nodes are referred to by groups of the mesh (`RawMesh.node_sets`). For nodes that the deck refers to by number, readers
add groups such as `node_17` or `rbe2_5`, so that a job can name them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fe_models.files.decks.ledger import Ledger
from fe_models.foundation.arrays import Array
from fe_models.meshes.cells.raw_mesh import RawMesh

__all__ = [
    "Coupling",
    "Deck",
    "DeckLayer",
    "DeckMass",
    "DeckMaterial",
    "DeckSpring",
    "Equation",
    "LineSection",
    "Load",
    "RigidGroup",
    "RodSection",
    "ShellSection",
    "SolidSection",
    "Support",
    "as_triad",
    "axes_along",
]

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class DeckMaterial:
    """Linear material, isotropic or orthotropic. Constants missing in the deck are None."""

    name: str
    young: float | Vector | None = None  #: Young's modulus; three values E_1, E_2, E_3 if orthotropic
    poisson: float | Vector | None = None  #: Poisson's ratio; three values nu_12, nu_13, nu_23 if orthotropic
    density: float | None = None
    shear: Vector | None = None  #: shear moduli G_12, G_13, G_23 of an orthotropic material
    axes: tuple[Vector, Vector, Vector] | None = None  #: material axes 1, 2, 3 as rows in basic axes; None: basic axes
    #: anisotropic: stress by strain in its axes, six rows 11 22 33 23 13 12, shear strains doubled; no other constants
    elasticity: tuple[tuple[float, ...], ...] | None = None

    def in_plane_strain(self, name: str) -> "DeckMaterial | None":
        """Return the sheet material for plane strain of this isotropic material; None for other materials.

        eps_z = 0 gives sigma_z = nu (sigma_x + sigma_y). In the plane, the material then behaves like a sheet in plane
        stress with E' = E/(1 - nu²), nu' = nu/(1 - nu) and the same G.
        """
        E, nu = self.young, self.poisson
        if not isinstance(E, float) or not isinstance(nu, float):
            return None
        G = E / (2 * (1 + nu))
        return DeckMaterial(name, (E / (1 - nu**2),) * 3, (nu / (1 - nu), 0.0, 0.0), self.density, (G, G, G))


@dataclass(frozen=True)
class SolidSection:
    """Solid cells with the same material and formulation."""

    group: str  #: name of the cell group
    material: str
    integration: str = "full"  #: rule, one of `fe_models.elements.solids.elements.INTEGRATIONS`, or "incompatible"
    mass: str = "consistent"
    orientation: str = ""  #: name of the material axes


@dataclass(frozen=True)
class DeckLayer:
    """Layer of a shell."""

    material: str
    thickness: float
    angle: float = 0.0  #: angle from the layup direction to material axis 1, about the normal [degree]
    orientation: str = ""  #: name of axes or an angle, as written in the deck; used only while the deck is read


@dataclass(frozen=True)
class ShellSection:
    """Shell cells with the same thickness or the same layers."""

    group: str
    material: str  #: name of the material; empty: each layer has its own
    thickness: float  #: total thickness of all layers
    offset: float = 0.0  #: distance of the middle surface from the nodes along the normal
    added_mass: float = 0.0  #: additional mass per area
    layers: tuple[DeckLayer, ...] = ()  #: layers from bottom to top
    direction: Vector = (1.0, 0.0, 0.0)  #: direction whose projection onto the shell is angle 0 of the layers
    orientation: str = ""  #: name of the axes of the material; used only while the deck is read
    bending_ratio: float = 1.0  #: bending stiffness divided by that of the material and thickness
    shear_ratio: float = 1.0  #: transverse shear stiffness divided by that of the material and thickness
    #: rows of [[A, B], [B, D]] over N_x N_y N_xy M_x M_y M_xy; if given, the section has neither material nor layers
    stiffness: tuple[tuple[float, ...], ...] = ()
    #: rows of the transverse shear stiffness; used together with `stiffness`
    shear_stiffness: tuple[tuple[float, ...], ...] = ()

    @property
    def materials(self) -> tuple[str, ...]:
        """Names of the materials of the layers, or of the one material; none if the stiffness is given."""
        if self.stiffness:
            return ()
        return tuple(layer.material for layer in self.layers) or (self.material,)


@dataclass(frozen=True)
class LineSection:
    """Lines with the same cross-section."""

    group: str
    material: str
    shape: Mapping[str, object]  #: keys of a table [sections.NAME] of a job: shape and dimensions
    #: vector towards the local y axis; None: each line has its own vector in the mesh, or none
    orientation: Vector | None = None
    offset: tuple[float, float] = (0.0, 0.0)
    shear: bool = True
    rotary_inertia: bool = True
    added_mass: float = 0.0  #: additional mass per length


@dataclass(frozen=True)
class RodSection:
    """Lines with axial force only (trusses)."""

    group: str
    material: str
    area: float


@dataclass(frozen=True)
class DeckMass:
    """Point mass with inertia at each node of a group."""

    nodes: str
    mass: float
    inertia: tuple[tuple[float, float, float], ...] = ((0.0,) * 3,) * 3  #: inertia about the centre of mass, basic axes
    offset: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class DeckSpring:
    """Spring between two nodes; each node is given by a group with one node."""

    nodes: tuple[str, str]
    stiffness: tuple[float, ...]  #: stiffness along and about the axes x, y, z of the triad
    damping: tuple[float, ...] | None = None
    triad: tuple[Vector, Vector, Vector] | None = None  #: axes of the spring as rows in basic axes; None: basic axes
    point: Vector | None = None  #: point at which the spring acts; None: midway between its nodes


def axes_along(x: Array) -> Array:
    """Return axes as rows, (3, 3), with the first along x; x must not be zero, the other two are arbitrary."""
    x = x / np.linalg.norm(x)
    y = np.cross(x, np.eye(3)[int(np.argmin(np.abs(x)))])
    y = y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)])


def as_triad(rows: Array) -> tuple[Vector, Vector, Vector]:
    """Return axes, (3, 3) as rows, in the form of the triad of a `DeckSpring`."""
    triad = [(float(a[0]), float(a[1]), float(a[2])) for a in rows]
    return triad[0], triad[1], triad[2]


@dataclass(frozen=True)
class RigidGroup:
    """Nodes that move rigidly with one node (RBE2, *RIGID BODY, *KINEMATIC COUPLING, *MPC BEAM)."""

    name: str
    node: str  #: group of the leader node
    followers: str
    components: tuple[int, ...] = (0, 1, 2, 3, 4, 5)


@dataclass(frozen=True)
class Coupling:
    """A node that follows the weighted mean motion of others (RBE3, *DISTRIBUTING COUPLING)."""

    name: str
    node: str
    #: groups of nodes, and the weight of each of their nodes: one number for translations, or six
    members: tuple[tuple[str, float | tuple[float, ...]], ...]
    components: tuple[int, ...] = (0, 1, 2, 3, 4, 5)  #: components of the follower node


@dataclass(frozen=True)
class Equation:
    """Linear equation Σ coefficient × component of a node = 0; the first component is eliminated (*EQUATION, MPC)."""

    terms: tuple[tuple[str, int, float], ...]  #: group with one node, component 0-5, and coefficient of each term


@dataclass(frozen=True)
class Support:
    """Components that are fixed at the nodes of a group, or kept as the boundary of a superelement."""

    name: str
    nodes: str
    components: tuple[int, ...]
    is_boundary: bool = False
    axes: tuple[Vector, Vector, Vector] | None = None  #: directions of the components as rows; None: basic axes


@dataclass(frozen=True)
class Load:
    """Load of one kind: forces at nodes, a pressure on faces, or gravity. Only the fields of its kind are set."""

    name: str
    forces: Mapping[str, tuple[float, ...]] | None = None  #: force and moment at each node of a group, (6,), by group
    faces: str | None = None
    pressure: float | None = None
    acceleration: Vector | None = None


@dataclass(frozen=True, eq=False)
class Deck:
    """Complete deck, and the ledger of unconverted data."""

    path: Path
    program: str
    mesh: RawMesh
    ledger: Ledger
    materials: Mapping[str, DeckMaterial] = field(default_factory=dict)
    solids: tuple[SolidSection, ...] = ()
    shells: tuple[ShellSection, ...] = ()
    lines: tuple[LineSection, ...] = ()
    masses: tuple[DeckMass, ...] = ()
    springs: tuple[DeckSpring, ...] = ()
    rigid: tuple[RigidGroup, ...] = ()
    couplings: tuple[Coupling, ...] = ()
    equations: tuple[Equation, ...] = ()
    supports: tuple[Support, ...] = ()
    loads: tuple[Load, ...] = ()
    rods: tuple[RodSection, ...] = ()
    plane: int | None = None  #: axis normal to the plane to which the deck confines all points; None: not planar
    lumped: frozenset[str] = frozenset()  #: kinds of elements whose mass the program lumps: "lines", "shells", "rods"
    is_plain_mesh: bool = False  #: whether the deck contains only nodes, elements and sets, as written by a mesher
