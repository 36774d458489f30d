"""The finite-segment method: a beam as a row of rigid bodies with springs between them."""

from collections.abc import Mapping, Sequence

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.body.beam_line import BeamLine
from fe_models.foundation.arrays import Array
from floatframe.components.flexible_parts.flexible_part import FlexiblePart, placement
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import Bushing
from floatframe.model.joints import FixedJoint, Joint
from floatframe.model.rotations import rotation_matrix

__all__ = ["element_stiffness", "finite_segments", "floating_parts"]


# a slender body divided into parts: reduced bodies in a row, each with its own floating frame -------------------------


def floating_parts(
    name: str,
    reduced: Sequence[ReducedBody],
    *,
    position: Array | None = None,
    orientation: Array | None = None,
    velocity: Array | None = None,
    omega_B: Array | None = None,
    ends: tuple[str, str] = ("start", "end"),
    stiffening: bool = True,
) -> FlexiblePart:
    """Return reduced bodies in a row, each fixed to the next at its end.

    The row may bend and rotate arbitrarily. Only the bending of each part in its own frame must stay small
    (docs/multibody.md, The range of a linear frame); it decreases with the square of the part's length.

    Parameters
    ----------
    name
        Name of the part; its bodies are "name 1", "name 2", ..., its joints "name joint 1", ....
    reduced
        Bodies in a row (repeated instances if they are equal); the first interface of each lies on the second interface
        of the previous one.
    position, orientation
        Position of the mesh axes of the first body in ground axes, (3,) [m], and their Euler parameters, (4,); all mesh
        axes are parallel.
    velocity, omega_B
        Velocity of this origin in ground axes, (3,) [m/s], and angular velocity in mesh axes, (3,) [rad/s]; initially
        the part moves as a rigid body.
    ends
        Interfaces of every body; they need rotations.
    stiffening
        Whether their geometric stiffness, which is then required, is used.

    Returns
    -------
    FlexiblePart
        Markers "start", "end" and "node 1", "node 2", ... on the interfaces.

    Raises
    ------
    ModelError
        If there is no body, or a body lacks the geometric stiffness that `stiffening` requires.
    """
    where = f"floating_parts {name!r}"
    if not reduced:
        raise ModelError(f"{where}: expected a reduced body or several, got none")
    r, p, v, omega = placement(where, position, orientation, velocity, omega_B)
    R, origin, last = rotation_matrix(p), r, np.zeros(3)
    bodies: list[FlexibleBody] = []
    joints: list[Joint] = []
    markers: dict[str, Marker] = {}
    for number, body in enumerate(reduced, start=1):
        if stiffening and body.geometric is None:
            raise ModelError(
                f"{where}: body {body.name!r} has no geometric stiffness; reduce it with geometric=True, or give "
                "stiffening=False"
            )
        a, b = (body.frame.origin + body.frame.axes @ body.interface(end).position for end in ends)
        if number > 1:
            r = r + R @ (last - a)
        last = b
        called = f"{name} {number}"
        moving = v + R @ np.cross(omega, R.T @ (r - origin))
        bodies.append(
            FlexibleBody(called, body, position=r, orientation=p, velocity=moving, omega_B=omega, stiffening=stiffening)
        )
        markers[f"node {number}"] = Marker(called, ends[0])
        if number > 1:
            before = Marker(f"{name} {number - 1}", ends[1])
            joints.append(FixedJoint(f"{name} joint {number - 1}", before, Marker(called, ends[0])))
    markers |= {"start": markers["node 1"], "end": Marker(bodies[-1].name, ends[1])}
    markers[f"node {len(bodies) + 1}"] = markers["end"]
    return FlexiblePart(name, tuple(bodies), tuple(joints), (), markers)


# finite segments ------------------------------------------------------------------------------------------------------


E_X = np.array([1.0, 0.0, 0.0])


def finite_segments(
    name: str,
    line: BeamLine,
    n: int,
    *,
    position: Array | None = None,
    orientation: Array | None = None,
    velocity: Array | None = None,
    omega_B: Array | None = None,
    stations: Mapping[str, float] | None = None,
    damping: float = 0.0,
) -> FlexiblePart:
    """Return a straight beam, uniform or tapered, as n rigid segments with springs between them.

    (1) nodes at equal distances h = length / (n - 1), the first and the last at the ends. Segment k contains the points
        nearer to node k than to the others; its mass, centre and inertia are integrals of the laws over it. The end
        segments are half as long
    (2) between two nodes, a `Bushing` in the middle has the stiffness of the piece of beam between them. With the
        relative motion (d, theta) of its halves at the middle, under the section force f and moment m there:
        F = ∫ Bᵀ diag(1/EA, 1/GAy, 1/GAz, 1/GJ, 1/EIy, 1/EIz) B dx, B (f, m) = (f, m + (x_m - x) e_x × f);  K = F⁻¹

    For a uniform beam, K = diag(EA/h, 1/(h³/12EIz + h/GAy), 1/(h³/12EIy + h/GAz), GJ/h, EIy/h, EIz/h). The deflection
    under nodal loads is exact, and frequencies converge with h². Displacements and rotations of the whole beam are
    unrestricted; only the rotation between adjacent segments must stay moderate.

    Parameters
    ----------
    name
        Name of the part; its bodies are "name 1", "name 2", ..., its forces "name spring 1", ....
    line
        Mass and stiffness along x, including rotary inertia about x.
    n
        Number of rigid bodies, 2 or more.
    position, orientation
        Position of the start of the beam in ground axes, (3,) [m], and Euler parameters of its axes, (4,).
    velocity, omega_B
        Velocity of the start in ground axes, (3,) [m/s], and angular velocity in the axes of the beam, (3,) [rad/s];
        initially the part moves as a rigid body.
    stations
        Points with a marker: name -> x; default: "start" and "end". Points between nodes are fixed to their segment.
    damping
        Stiffness-proportional damping of the springs: damping divided by stiffness [s].

    Raises
    ------
    ModelError
        If n or damping is out of its range, a station is not on the beam, or the beam has no rotary inertia about x.
    """
    where = f"finite_segments {name!r}"
    if n < 2:
        raise ModelError(f"{where}: n: expected at least 2 segments, got {n}")
    if not 0 <= damping < np.inf:
        raise ModelError(f"{where}: damping: expected zero or more, got {damping:g}")
    origin, p, v, omega = placement(where, position, orientation, velocity, omega_B)
    R = rotation_matrix(p)
    h = line.length / (n - 1)
    nodes = np.linspace(0.0, line.length, n)
    bodies, springs = [], []
    for k, x in enumerate(nodes):
        mass, center, inertia = segment(where, line, max(x - h / 2, 0.0), min(x + h / 2, line.length))
        bodies.append(
            RigidBody(
                f"{name} {k + 1}",
                mass,
                inertia,
                center_of_mass=(center - x) * E_X,
                position=origin + R @ (x * E_X),
                orientation=p,
                velocity=v + R @ np.cross(omega, x * E_X),
                omega_B=omega,
            )
        )
    for k in range(n - 1):
        K = element_stiffness(line, nodes[k], nodes[k + 1])
        ends = (Marker(f"{name} {k + 1}", position=h / 2 * E_X), Marker(f"{name} {k + 2}", position=-h / 2 * E_X))
        springs.append(Bushing(f"{name} spring {k + 1}", *ends, stiffness=K, damping=damping * K, axes="half way"))
    places = {"start": 0.0, "end": line.length} if stations is None else stations
    markers = {}
    for station, x in places.items():
        if not 0 <= x <= line.length:
            raise ModelError(f"{where}: station {station!r}: expected a place within 0 .. {line.length:g}, got {x:g}")
        k = int(np.argmin(np.abs(nodes - x)))
        markers[station] = Marker(f"{name} {k + 1}", position=(x - nodes[k]) * E_X)
    return FlexiblePart(name, tuple(bodies), (), tuple(springs), markers)


def between(line: BeamLine, start: float, end: float, n: int) -> tuple[Array, Array]:
    """Return n Gauss points between two breaks and their weights, from start to end."""
    xi, weight = np.polynomial.legendre.leggauss(n)
    cuts = np.array([start, *(x for x in line.breaks if start < x < end), end])
    half, middle = np.diff(cuts)[:, None] / 2, (cuts[1:] + cuts[:-1])[:, None] / 2
    return (middle + half * xi).ravel(), (half * weight).ravel()


def segment(where: str, line: BeamLine, start: float, end: float) -> tuple[float, float, Array]:
    """Return mass, x of the centre of mass, and inertia about it, of the beam from start to end."""
    x, weight = between(line, start, end, line.degree // 2 + 2)  # exact for a polynomial law times x²
    mass = weight * line.at("rho_A", x)
    Iy, Iz = (float(weight @ line.at(law, x)) for law in ("rho_Iy", "rho_Iz"))
    if not Iy + Iz > 0:
        raise ModelError(
            f"{where}: no rotary inertia about x, so that a segment could turn without resistance; give the beam line "
            "rho_Iy and rho_Iz"
        )
    m = float(mass.sum())
    center = float(mass @ x) / m
    across = float(mass @ (x - center) ** 2)
    return m, center, np.diag([Iy + Iz, Iy + across, Iz + across])


def element_stiffness(line: BeamLine, start: float, end: float) -> Array:
    """Return the stiffness between the halves of a beam piece for relative motion at mid-length, (6, 6): (2)."""
    x, weight = between(line, start, end, max(8, line.degree + 2))  # the inverse of a law is not a polynomial
    laws = np.array([line.at(law, x) for law in ("EA", "GAy", "GAz", "GJ", "EIy", "EIz")])
    arm = (start + end) / 2 - x
    B = np.tile(np.eye(6), (len(x), 1, 1))
    B[:, 4, 2], B[:, 5, 1] = -arm, arm  # e_x × f
    F = np.einsum("pia,pi,pib->ab", B, weight[:, None] / laws.T, B)
    K = np.linalg.inv(F)
    return np.asarray((K + K.T) / 2)
