"""The corotational superelement: a reduced body described by position and rotation of its two interface nodes."""

from collections.abc import Sequence

import numpy as np

from cms.body.reduced_body import ReducedBody, ReducedInterface
from fe_models.foundation.arrays import Array
from floatframe.components.flexible_parts.flexible_part import FlexiblePart
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.rigid_body import RigidBody, euler_parameters_from_user
from floatframe.model.checked_values import array_of_shape
from floatframe.model.forces import Bushing
from floatframe.model.rotations import euler_parameters, rotation_matrix, tilde

__all__ = ["corotational", "node_inertias", "relative_stiffness"]

RANK = 1e-12  #: eigenvalue of the scaled flexibility between the nodes below which it counts as zero
ALIKE = 1e-6  #: difference of the axes of a node in two elements up to which they count as equal


def corotational(
    name: str,
    reduced: ReducedBody | Sequence[ReducedBody],
    *,
    position: Array | None = None,
    orientation: Array | None = None,
    ends: tuple[str, str] = ("start", "end"),
    damping: float = 0.0,
) -> FlexiblePart:
    """Return a reduced body, or several in a row, described by the motion of their interface nodes.

    Each node is a rigid body with its share of the mass; elements in a row share the node between them. The usual modal
    file is used; its frame and its vibration modes have no effect, only the static shapes of its interfaces.

    (1) flexibility between both nodes at the point p in the middle between them: F = Psi_p K⁻¹ Psi_pᵀ, Psi_p = X_2(p) -
        X_1(p), with X_i(p) the motion of the point p carried by node i; its inverse K_p is the complete free stiffness
        of two nodes
    (2) the corotated frame is half way between the axes of the nodes, as in the `Bushing` at p with stiffness K_p. Its
        energy is the deformation energy in this frame for any rotation of the element, and the forces are its
        derivatives
    (3) inertia: the consistent mass of the static shapes times a rigid motion, M Psi_R. Each node takes its rows as a
        rigid body; mass, centre and inertia of the whole are preserved, independently of the frame

    Vibration within an element is neglected. An element must be short compared with the waves; otherwise use several.

    Parameters
    ----------
    name
        Name of the part; its bodies are "name 1", "name 2", ..., its forces "name element 1", ....
    reduced
        One body, or bodies in a row; the first interface of each lies on the second interface of the previous one.
    position, orientation
        Those of the mesh axes of the first body, as for a `FlexibleBody`.
    ends
        Interfaces of every body that become its nodes.
    damping
        Stiffness-proportional damping of the elements: damping divided by stiffness [s].

    Returns
    -------
    FlexiblePart
        Markers "start", "end" and "node 1", "node 2", ... with the position and axes of the interfaces.

    Raises
    ------
    ModelError
        If a body has no flexibility between its nodes in some direction, or the share of a node is not a rigid body.
    """
    where = f"corotational {name!r}"
    parts = [reduced] if isinstance(reduced, ReducedBody) else list(reduced)
    if not parts:
        raise ModelError(f"{where}: expected a reduced body or several, got none")
    if not 0 <= damping < np.inf:
        raise ModelError(f"{where}: damping: expected zero or more, got {damping:g}")
    r = array_of_shape(f"{where}: position", np.zeros(3) if position is None else position, (3,))
    R = rotation_matrix(
        euler_parameters_from_user(f"{where}: orientation", np.eye(4)[0] if orientation is None else orientation)
    )
    places: list[tuple[Array, Array]] = []  #: position and axes of the nodes, in ground axes
    inertias: list[tuple[float, Array, Array]] = []  #: mass, first moment and inertia about the node, in its axes
    elements = []
    for number, body in enumerate(parts):
        a, b = (body.interface(end) for end in ends)
        axes = R @ body.frame.axes  # axes of B in ground axes
        if number:  # placed on the previous node
            r = places[-1][0] - axes @ a.position - R @ body.frame.origin
        for interface in (a, b):
            place = (r + R @ body.frame.origin + axes @ interface.position, axes @ interface.triad)
            if interface is a and number:
                if np.abs(place[1] - places[-1][1]).max() > ALIKE:
                    raise ModelError(
                        f"{where}: interface {a.name!r} of body {number + 1} has other axes than {b.name!r} of the one "
                        "before, with which it shares a node"
                    )
                continue
            places.append(place)
        own = node_inertias(where, body, a, b)
        inertias[-1:] = [own[0]] if not number else [sum_of(inertias[-1], own[0])]
        inertias.append(own[1])
        middle = (a.position + b.position) / 2
        K = relative_stiffness(where, body, a, b)
        first, second = (
            Marker(f"{name} {node}", position=i.triad.T @ (middle - i.position), triad=i.triad.T)
            for i, node in ((a, number + 1), (b, number + 2))
        )
        called = f"{name} element {number + 1}"
        elements.append(Bushing(called, first, second, stiffness=K, damping=damping * K, axes="half way"))
    bodies = []
    for k, ((point, axes), (mass, moment, inertia)) in enumerate(zip(places, inertias, strict=True)):
        center = moment / mass
        about_center = inertia - mass * (center @ center * np.eye(3) - np.outer(center, center))
        bodies.append(
            RigidBody(
                f"{name} {k + 1}",
                mass,
                (about_center + about_center.T) / 2,
                center_of_mass=center,
                position=point,
                orientation=euler_parameters(axes),
            )
        )
    nodes = {f"node {k + 1}": Marker(body.name, position=np.zeros(3)) for k, body in enumerate(bodies)}
    nodes |= {"start": nodes["node 1"], "end": nodes[f"node {len(bodies)}"]}
    return FlexiblePart(name, tuple(bodies), (), tuple(elements), nodes)


def carried(interface: ReducedInterface, point: Array) -> Array:
    """Return X, (6, n_q), the modal motion of a point that an interface carries, in axes of B."""
    lever = tilde(point - interface.position)
    return np.asarray(np.vstack([interface.Psi[:3] - lever @ interface.Psi[3:], interface.Psi[3:]]))


def relative_stiffness(where: str, body: ReducedBody, a: ReducedInterface, b: ReducedInterface) -> Array:
    """Return the stiffness between two interfaces at the middle between them, in axes of B, (6, 6): step (1)."""
    middle = (a.position + b.position) / 2
    Psi = carried(b, middle) - carried(a, middle)
    stiffness = np.diag(body.K)
    F = (Psi / stiffness) @ Psi.T
    scale = np.sqrt(np.maximum(np.diag(F), 0.0))
    if not scale.all() or np.linalg.eigvalsh(F / np.outer(scale, scale))[0] < RANK:
        raise ModelError(
            f"{where}: body {body.name!r} has no flexibility between {a.name!r} and {b.name!r} in some direction; "
            "reduce it with constraint modes of both (Guyan, Craig-Bampton)"
        )
    K = np.linalg.inv(F / np.outer(scale, scale)) / np.outer(scale, scale)
    return np.asarray((K + K.T) / 2)


def node_inertias(
    where: str, body: ReducedBody, a: ReducedInterface, b: ReducedInterface
) -> tuple[tuple[float, Array, Array], tuple[float, Array, Array]]:
    """Return mass, first moment and inertia of both nodes, each about its node and in its axes: step (3)."""
    middle, moments = (a.position + b.position) / 2, body.moments
    Psi = carried(b, middle) - carried(a, middle)
    K_p = relative_stiffness(where, body, a, b)
    # modal coordinates of the static shape for nodal motions (u_a, u_b): q = K⁻¹ Psiᵀ K_p (X_b - X_a)
    to_middle = [rigid(middle - interface.position) for interface in (a, b)]
    q = (Psi.T / np.diag(body.K)[:, None]) @ K_p @ np.hstack([-to_middle[0], to_middle[1]])
    # rigid motion of B about its origin: u_a = rigid x + Psi_a q
    x = np.linalg.solve(rigid(a.position), np.eye(6, 12) - a.Psi @ q)
    T = np.vstack([x, q])
    rigid_mass = np.block([[moments.m * np.eye(3), -tilde(moments.S)], [tilde(moments.S), moments.J0]])
    Y = np.vstack([moments.C1, moments.C2])
    mass = np.block([[rigid_mass, Y], [Y.T, moments.M]])
    M = T.T @ mass @ T
    shares = []
    for k, interface in enumerate((a, b)):
        motion = np.vstack([rigid(node.position - interface.position) for node in (a, b)])
        block = (M @ motion)[6 * k : 6 * k + 6]
        shares.append(rigid_form((block + block.T) / 2))
    # the difference between the whole body and the rigid parts of the shares is divided equally between both nodes
    (m_a, S_a, J_a), (m_b, S_b, J_b) = shares
    half = (moments.S - S_a - m_a * a.position - S_b - m_b * b.position) / 2
    S_a, S_b = S_a + half, S_b + half
    total = sum(about(J, S, m, i.position) for (m, S, J, i) in ((m_a, S_a, J_a, a), (m_b, S_b, J_b, b)))
    rest = (moments.J0 - total) / 2
    done = []
    for m, S, J, interface in ((m_a, S_a, J_a + rest, a), (m_b, S_b, J_b + rest, b)):
        C = interface.triad
        center = J - (S @ S * np.eye(3) - np.outer(S, S)) / m if m > 0 else -np.eye(3)
        if np.linalg.eigvalsh(center)[0] < 0:
            raise ModelError(
                f"{where}: the share of interface {interface.name!r} of body {body.name!r} in mass and inertia is not "
                f"that of a rigid body (mass {m:.4g}); take a `FlexibleBody`, or bodies whose mass lies between their "
                "interfaces"
            )
        done.append((m, C.T @ S, C.T @ J @ C))
    return done[0], done[1]


def rigid(arm: Array) -> Array:
    """Return the matrix [1, -arm~; 0, 1], (6, 6), that transfers motion from a point to another at `arm`."""
    return np.block([[np.eye(3), -tilde(arm)], [np.zeros((3, 3)), np.eye(3)]])


def rigid_form(B: Array) -> tuple[float, Array, Array]:
    """Return mass, first moment and inertia of the rigid body closest to a symmetric 6 × 6 matrix."""
    S = np.array([B[5, 1] - B[4, 2], B[3, 2] - B[5, 0], B[4, 0] - B[3, 1]]) / 2
    return float(np.trace(B[:3, :3]) / 3), S, B[3:, 3:]


def about(J: Array, S: Array, m: float, arm: Array) -> Array:
    """Return the inertia about a point, for the inertia about a node at `arm` from the point."""
    cross = np.outer(S, arm)
    return J + (2 * S @ arm + m * arm @ arm) * np.eye(3) - cross - cross.T - m * np.outer(arm, arm)


def sum_of(a: tuple[float, Array, Array], b: tuple[float, Array, Array]) -> tuple[float, Array, Array]:
    """Return the sum of both parts at a node."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]
