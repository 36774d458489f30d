"""Geometrically exact beams from the lines of a finite element model, for arbitrary displacements and rotations.

Two-node elements of the Simo-Reissner beam [1]_ in absolute coordinates. Node i has a position r_i and axes R_i. In the
frame C half way between the rotations of both nodes of an element (the rotations from R_1 to C and from C to R_2 are
equal):

    Gamma = C^T (r_2 - r_1) / L - e_x,   kappa = theta / L,   theta the rotation vector of R_1^T R_2,
    V = L/2 (Gamma, kappa)^T K (Gamma, kappa)

(1) Gamma and kappa are evaluated at the middle, with a straight line and a rotation about a fixed axis between the
    nodes; a single point does not lock. They do not change in an arbitrary rigid-body motion of the element
(2) L² K⁻¹ is the flexibility of the piece under forces at its middle, including the linear bending within it (L³/12 EI
    in addition to L/GA), so that the deflection of small pieces under nodal loads is exact
(3) V is that of a `Bushing` between markers at the nodes, with its zero at the distance L: preload -K e_x / L
(4) half of the mass of each piece is assigned to each node as a rigid body; errors decrease with the square of the
    piece

.. [1] Simo & Vu-Quoc (1986), docs/bibliography.md.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.body.fe_body import FEBody
from fe_models.elements.beams.model import BeamModel
from fe_models.elements.beams.slices import Slices
from fe_models.foundation.arrays import Array
from floatframe.components.flexible_parts.flexible_part import FlexiblePart, placement
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import Bushing
from floatframe.model.rotations import rotation_matrix, tilde

__all__ = ["exact_beams"]

E_X = np.array([1.0, 0.0, 0.0])


@dataclass
class Lump:
    """Moments of the mass lumped at a node, about the node in mesh axes, for a rigid body."""

    place: Array  #: position of the node, (3,)
    mass: float = 0.0
    moment: Array | float = 0.0  #: first moment ∫ o, (3,)
    inertia: Array | float = 0.0  #: inertia ∫ |o|² 1 - o oᵀ, (3, 3)

    def add(self, mass: float, center: Array, inertia: Array) -> None:
        """Add a rigid piece with its centre of mass and the inertia about this centre."""
        arm = center - self.place
        self.mass += mass
        self.moment = self.moment + mass * arm
        self.inertia = self.inertia + inertia + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))


def exact_beams(
    name: str,
    body: FEBody,
    *,
    pieces: int = 1,
    position: Array | None = None,
    orientation: Array | None = None,
    velocity: Array | None = None,
    omega_B: Array | None = None,
    damping: float = 0.0,
) -> FlexiblePart:
    """Return a body of beam elements as geometrically exact beams, ready for a system.

    Parameters
    ----------
    name
        Name of the part; its bodies are "name 12" at node 12 of the mesh, and "name line 3.1", ... between the nodes.
    body
        A body of lines (`fe_models.beam_body`, or from a job with sections), coupled or not, whose interfaces have one
        node each; point masses and springs are included.
    pieces
        Number of elements per line.
    position, orientation, velocity, omega_B
        Those of its mesh axes, as for a `FlexibleBody`; the part is initially undeformed and moves as a rigid body.
    damping
        Stiffness-proportional damping of the elements: damping matrix divided by stiffness matrix [s].

    Returns
    -------
    FlexiblePart
        Markers of the interfaces, with their axes, and "node 12", ... at the nodes of the mesh.

    Raises
    ------
    ModelError
        If the body does not consist of lines only, has rigid links, an interface joins several nodes, or a node has no
        inertia.
    """
    where = f"exact_beams {name!r}"
    model = body.element_model
    if not isinstance(model, BeamModel) or not len(model.dofs):
        raise ModelError(
            f"{where}: body {body.name!r} does not consist of beams alone; take a body of lines with sections, or "
            "divide a solid or a shell into parts"
        )
    if body.recovery is not None and linked(body, model):
        raise ModelError(f"{where}: body {body.name!r} has rigid links, which exact beams do not support; remove them")
    if pieces < 1 or not 0 <= damping < np.inf:
        raise ModelError(f"{where}: expected pieces from 1 and damping from 0, got {pieces} and {damping:g}")
    origin, p, v, omega = placement(where, position, orientation, velocity, omega_B)

    geometry, of_nodes = model.geometry, model.dofs[:, [0, 6]] // 6
    called = [f"{name} {body.numbering.called(node)}" for node in range(model.n_nodes)]
    lumps = {called[node]: Lump(model.nodes[node]) for node in np.unique(of_nodes)}
    springs: list[Bushing] = []
    lines = model.pieces[0]
    for k, (a, b) in enumerate(of_nodes):
        R, L = geometry.R[k], float(geometry.length[k])
        ends = geometry.ends[k]
        names = [called[a], *(f"{name} line {k + 1}.{j}" for j in range(1, pieces)), called[b]]
        axis = [ends[0] + (ends[1] - ends[0]) * j / pieces for j in range(pieces + 1)]
        for between, place in zip(names[1:-1], axis[1:-1], strict=True):
            lumps[between] = Lump(place)
        K = piece_stiffness(model.K_local[k], L, pieces)
        mass, section = float(lines.mass[k].sum()), sectional_inertia(lines, k)
        for j in range(pieces):
            half = L / pieces / 2
            along = np.diag([0.0, 1.0, 1.0]) * half**2 / 12
            J = R @ ((mass * along + section) / (2 * pieces)) @ R.T
            for end, side in ((j, 1), (j + 1, -1)):
                lumps[names[end]].add(mass / (2 * pieces), axis[end] + side * half / 2 * R[:, 0], J)
            first, second = (
                Marker(names[end], position=axis[end] - lumps[names[end]].place, triad=R) for end in (j, j + 1)
            )
            rest = -K @ np.concatenate([L / pieces * E_X, np.zeros(3)])
            called_ = f"{name} element {k + 1}.{j + 1}"
            law = {"stiffness": K, "damping": damping * K, "preload": rest}
            springs.append(Bushing(called_, first, second, axes="half way", **law))
    for piece in model.pieces[1:]:  # point masses
        for k, node in enumerate(piece.dofs[:, 0] // 6):
            E = piece.axes[k, 0] @ np.diag(piece.moments[k, 0]) @ piece.axes[k, 0].T
            lump = lumps.setdefault(called[node], Lump(model.nodes[node]))
            lump.add(float(piece.mass[k, 0]), piece.position[k, 0], np.trace(E) * np.eye(3) - E)
    for k, spring in enumerate(model.springs):
        point = model.nodes[list(spring.nodes)].mean(axis=0) if spring.point is None else np.asarray(spring.point)
        first, second = (Marker(called[n], position=point - model.nodes[n], triad=spring.triad) for n in spring.nodes)
        D = np.zeros((6, 6)) if spring.damping is None else spring.damping
        law = {"stiffness": spring.stiffness, "damping": D}
        springs.append(Bushing(f"{name} spring {k + 1}", first, second, axes="half way", **law))

    Rot = rotation_matrix(p)
    bodies = [
        rigid_body(where, node, lump, origin, p, v + Rot @ np.cross(omega, lump.place), omega)
        for node, lump in lumps.items()
    ]
    places = {f"node {body.numbering.called(node)}": Marker(called[node]) for node in np.unique(of_nodes)}
    for interface in body.interfaces:
        if len(interface.nodes) != 1 or called[interface.nodes[0]] not in lumps:
            raise ModelError(
                f"{where}: interface {interface.name!r} has {len(interface.nodes)} nodes; expected a single node of "
                "the lines"
            )
        node = interface.nodes[0]
        arm = interface.reference - model.nodes[node]
        places[interface.name] = Marker(called[node], position=arm, triad=interface.triad)
    return FlexiblePart(name, tuple(bodies), (), tuple(springs), places)


def linked(body: FEBody, model: BeamModel) -> bool:
    """Return whether dofs of nodes were eliminated that do not belong to an interface."""
    inside = np.concatenate([np.zeros(0, np.int64), *(interface.nodes for interface in body.interfaces)])
    there = body.dofs[body.dofs[:, 0] < model.n_nodes, 0]
    alone = np.setdiff1d(np.arange(model.n_nodes), inside)
    return bool(np.setdiff1d(alone, there).size)


def piece_stiffness(K_local: Array, L: float, pieces: int) -> Array:
    """Return the stiffness of a line piece for relative motion of its ends at mid-length, (6, 6): step (2).

    (a) flexibility F of the line: relative motion of both ends under a force and a moment at the middle
    (b) F = L c + L³/12 Eᵀ c E, with the flexibility c of the section and E f = (0, e_x × f); uniform along the line
    (c) the same for L / pieces
    """
    E = np.zeros((6, 6))
    E[3:, :3] = tilde(E_X)
    arm = np.eye(6)
    arm[:3, 3:] = -tilde(L / 2 * E_X)  # motion of the middle with the first end
    other = np.eye(6)
    other[:3, 3:] = tilde(L / 2 * E_X)
    # relative motion at the middle, for a force at the middle on the second end and a fixed first end
    F = other @ np.linalg.solve(K_local[6:, 6:], other.T)
    c = F / L
    c[:3, :3] -= L**2 / 12 * (E.T @ c @ E)[:3, :3]
    length = L / pieces
    flexibility = length * c + length**3 / 12 * E.T @ c @ E
    K = np.linalg.inv(flexibility)
    return np.asarray((K + K.T) / 2)


def sectional_inertia(lines: Slices, k: int) -> Array:
    """Return the inertia of all sections of a line about its axis, in line axes, (3, 3) [kg m²]."""
    E = np.diag(lines.moments[k].sum(axis=0))
    return np.asarray(np.trace(E) * np.eye(3) - E)


def rigid_body(where: str, name: str, lump: Lump, origin: Array, p: Array, velocity: Array, omega: Array) -> RigidBody:
    """Return the rigid body of a node."""
    center = np.asarray(lump.moment) / lump.mass if lump.mass > 0 else np.zeros(3)
    about = np.asarray(lump.inertia) - lump.mass * (center @ center * np.eye(3) - np.outer(center, center))
    about = (about + about.T) / 2
    if not lump.mass > 0 or not np.linalg.eigvalsh(about)[0] > 0:
        raise ModelError(
            f"{where}: {name!r} has no mass, or no inertia about some axis, and would move without resistance; give "
            "its lines density and sections with rotary inertia"
        )
    return RigidBody(
        name,
        lump.mass,
        about,
        center_of_mass=center,
        position=origin + rotation_matrix(p) @ lump.place,
        orientation=p,
        velocity=velocity,
        omega_B=omega,
    )
