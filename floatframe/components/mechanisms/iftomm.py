"""Rigid mechanisms from the IFToMM library of computational benchmark problems.

Sources: [1]_, the pages of the library at that time, and [2]_; docs/field_benchmarks.md lists the source of each value.
Joints are chosen without redundant constraints where possible: a planar link between two others has a ball joint and a
universal joint.

.. [1] González et al. (2006), docs/bibliography.md.
.. [2] Mazzia & Magherini (2008), docs/bibliography.md.
"""

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.units import unit_system
from floatframe.components.mechanisms.rods import turning
from floatframe.errors import ModelError
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import Force, Gravity, JointForce, SpringDamper
from floatframe.model.joints import (
    DistanceJoint,
    Joint,
    PrismaticJoint,
    RevoluteJoint,
    SphericalJoint,
    UniversalJoint,
)
from floatframe.model.rotations import euler_parameters, euler_parameters_of_rotation_vector, rotation_matrix
from floatframe.model.system import Body, System

__all__ = ["andrews_mechanism", "bricard_mechanism", "flyball_governor", "n_four_bar", "point_pendulum"]

X, Y, Z = np.eye(3)
G = 9.81  #: acceleration of gravity in all problems of the library [m/s²]
UNITS = "m-kg-s"


def point_pendulum(*, x: float = -1.0, length: float = 1.0, mass: float = 1.0) -> System:
    """Return a point mass on a massless rod from the origin, at rest at (x, y) with y >= 0: A01 of the library.

    Body "mass", joint "rod". The rod is a distance constraint, which exerts no moment; the inertia of the body has no
    effect.
    """
    if not abs(x) <= length:
        raise ModelError(f"point_pendulum: expected |x| up to the length {length:g}, got x = {x:g}")
    place = np.array([x, np.sqrt(length**2 - x**2), 0.0])
    body = RigidBody("mass", mass, 0.01 * mass * length**2 * np.eye(3), position=place)
    rod = DistanceJoint("rod", Marker(GROUND), Marker("mass", position=np.zeros(3)))
    return System([body], [rod], [Gravity(-G * Y)], unit_system(UNITS), "simple pendulum")


def n_four_bar(n: int = 2, *, length: float = 1.0, mass: float = 1.0, speed: float = 1.0) -> System:
    """Return n four-bar windows in a row, with 2 n + 1 equal rods: A02 of the library.

    All cranks are initially upright, and their tops move at `speed` along x. When all rods are collinear, the windows
    can move independently; the constraints are singular there. Bodies "crank 0" to "crank n" and "coupler 1" to
    "coupler n"; joints "hinge k", "ball k", "cross k".
    """
    if n < 1:
        raise ModelError(f"n_four_bar: n: expected at least 1, got {n}")
    units = unit_system(UNITS)
    inertia = mass * length**2 / 12 * np.array([0.0, 1.0, 1.0]) + 1e-6 * mass * length**2 * X
    bodies: list[Body] = []
    joints: list[Joint] = []
    for k in range(n + 1):
        foot = k * length * X
        crank = rod(f"crank {k}", mass, inertia, length, foot, Y)
        bodies.append(turning(crank, -speed / length * Z, point=foot))
        place = Marker(GROUND, position=foot)
        joints.append(RevoluteJoint(f"hinge {k}", place, Marker(f"crank {k}", position=np.zeros(3)), axis=Z))
        if k:
            coupler = rod(f"coupler {k}", mass, inertia, length, (k - 1) * length * X + length * Y, X)
            bodies.append(turning(coupler, np.zeros(3), point=foot, velocity=speed * X))
            before, top = (Marker(f"crank {j}", position=length * X) for j in (k - 1, k))
            ends = [Marker(f"coupler {k}", position=x * X) for x in (0.0, length)]
            joints.append(SphericalJoint(f"ball {k}", before, ends[0]))
            joints.append(UniversalJoint(f"cross {k}", top, ends[1], axis=Z, axis_b=Y))
    return System(bodies, joints, [Gravity(-G * Y)], units, f"{n} four-bar windows")


#: mass [kg], inertia about the centre [kg m²], centre relative to the suspension point in body axes [m]; Andrews'
#: mechanism
ANDREWS = {
    "OF": (0.04325, 2.194e-6, (0.00092, 0.0)),
    "FE": (0.00365, 4.410e-7, (-0.0115, 0.0)),
    "BDE": (0.02373, 5.255e-6, (0.01043, -0.01874)),
    "GE": (0.00706, 5.667e-7, (0.0, 0.01421 - 0.02)),
    "AG": (0.07050, 1.169e-5, (0.02308, 0.00916)),
    "HE": (0.00706, 5.667e-7, (0.02 - 0.01421, 0.0)),
    "AH": (0.05498, 1.912e-5, (-0.00449, -0.01228)),
}
#: initial beta, Theta, gamma, Phi, delta, Omega, epsilon, with the digits of the test set of initial value problems
ANDREWS_START = (
    -0.0617138900142764496358948458001,
    0.0,
    0.455279819163070380255912382449,
    0.222668390165885884674473185609,
    0.487364979543842550225598953530,
    -0.222668390165885884674473185609,
    1.23054744454982119249735015568,
)


def andrews_mechanism(*, torque: float = 0.033) -> System:
    """Return Andrews' squeezer: seven planar links, a spring, and a motor of constant torque [N m]; A03 of the library.

    The angles of the links to the x axis are beta (OF), beta + Theta (FE), gamma (BDE), delta + Phi (GE), delta (AG),
    epsilon + Omega (HE) and epsilon (AH), with initial values `ANDREWS_START`. F on OF is 7 mm from O. Joints: hinges
    "motor", "B", "A 1", "A 2"; balls "F", "G", "H"; universal joints "E 1", "E 2", "E 3". Forces: "spring", "torque".
    """
    beta, theta, gamma, phi, delta, omega, epsilon = ANDREWS_START
    origin, A, B, C = (np.array([*p, 0.0]) for p in ((0, 0), (-0.06934, -0.00227), (-0.03635, 0.03273), (0.014, 0.072)))
    angles = dict(zip(ANDREWS, (beta, beta + theta, gamma, delta + phi, delta, epsilon + omega, epsilon), strict=True))
    ends = {"OF": (0.007, 0), "FE": (-0.028, 0), "BDE": (0, -0.035), "GE": (0, -0.02), "HE": (0.02, 0)}
    ends |= {"AG": (0.04, 0), "AH": (0, -0.04)}

    def end(link: str) -> Array:
        c, s = np.cos(angles[link]), np.sin(angles[link])
        x, y = ends[link]
        return np.array([c * x - s * y, s * x + c * y, 0.0])

    at = {"OF": origin, "BDE": B, "AG": A, "AH": A, "FE": end("OF"), "GE": A + end("AG"), "HE": A + end("AH")}
    bodies = [
        RigidBody(
            link,
            mass,
            J * np.diag([0.5, 0.5, 1.0]),
            center_of_mass=np.array([*center, 0.0]),
            position=at[link],
            orientation=euler_parameters_of_rotation_vector(angles[link] * Z),
        )
        for link, (mass, J, center) in ANDREWS.items()
    ]

    def far(link: str) -> Marker:
        return Marker(link, position=np.array([*ends[link], 0.0]))

    def near(link: str) -> Marker:
        return Marker(link, position=np.zeros(3))

    grounds = (("motor", origin, "OF"), ("B", B, "BDE"), ("A 1", A, "AG"), ("A 2", A, "AH"))
    joints: list[Joint] = [
        RevoluteJoint(name, Marker(GROUND, position=p), near(link), axis=Z) for name, p, link in grounds
    ]
    for name, carrier, link in (("F", "OF", "FE"), ("G", "AG", "GE"), ("H", "AH", "HE")):
        joints.append(SphericalJoint(name, far(carrier), near(link)))
    for name, link, across in (("E 1", "FE", Y), ("E 2", "GE", X), ("E 3", "HE", Y)):
        joints.append(UniversalJoint(name, far("BDE"), far(link), axis=Z, axis_b=across))
    D = Marker("BDE", position=np.array([0.02, -0.018, 0.0]))
    spring = SpringDamper("spring", Marker(GROUND, position=C), D, stiffness=4530.0, free_length=0.07785)
    forces: list[Force] = [spring]
    if torque:
        forces.append(JointForce("torque", "motor", "angle", preload=torque))
    return System(bodies, joints, forces, unit_system(UNITS), "Andrews' squeezer mechanism")


def bricard_mechanism(*, length: float = 1.0, mass: float = 1.0, side: float = 0.1) -> System:
    """Return Bricard's mechanism, with five rods along the edges of a cube between six perpendicular hinges: A04.

    It has as many constraints as coordinates, but can move because one is redundant; the joints share the load
    (`redundant = "minimum-norm"`). Bodies "rod 1" to "rod 5"; joints "hinge 1" to "hinge 6", of which the first and the
    last are on the ground. Rod 4 begins at P_3 = (1, -1, 1).
    """
    corners = length * np.array([[0, 0, 0], [1, 0, 0], [1, -1, 0], [1, -1, 1], [0, -1, 1], [0, 0, 1]], dtype=float)
    axes = (Y, Z, X, Y, Z, X)
    slender = mass / 12 * np.array([2 * side**2, length**2 + side**2, length**2 + side**2])
    bodies: list[Body] = [
        rod(f"rod {k + 1}", mass, slender, length, corners[k], (corners[k + 1] - corners[k]) / length) for k in range(5)
    ]
    joints: list[Joint] = []
    for k in range(5):
        body = bodies[k]
        assert isinstance(body, RigidBody)
        carrier = Marker(GROUND) if k == 0 else Marker(f"rod {k}", position=length * X)
        axis = axes[k] if k == 0 else axes_of(bodies[k - 1]).T @ axes[k]
        joints.append(RevoluteJoint(f"hinge {k + 1}", carrier, Marker(f"rod {k + 1}", position=np.zeros(3)), axis=axis))
    last = Marker("rod 5", position=length * X)
    joints.append(RevoluteJoint("hinge 6", Marker(GROUND, position=corners[5]), last, axis=axes[5]))
    return System(
        bodies,
        joints,
        [Gravity(-G * Y)],
        unit_system(UNITS),
        "Bricard's mechanism",
        redundant="minimum-norm",
    )


def flyball_governor(*, stiffness: float = 8e5, damping: float = 4e4, speed: float = 2 * np.pi) -> System:
    """Return Watt's governor, with stiff springs and dampers as coupler rods; A05 of the library.

    A shaft along z, 1 m long, spins freely, initially at `speed`. From its top, two rods of 1 m hang 30 degrees below
    the horizontal, with 5 kg at their ends; their middles are connected to a slider at the height of 0.5 m. Bodies
    "shaft", "slider", "rod 1", "rod 2"; joints "bearing", "guide", "hinge 1", "hinge 2"; the coordinate "distance" of
    "guide" is the position of the slider.
    """
    density, side, ball, height, arm = 3000.0, 0.01, 5.0, 1.0, 0.05
    m = density * side**2 * 1.0
    along, across = m * 2 * side**2 / 12, m * (1.0 + side**2) / 12
    beta = np.pi / 6
    shaft = RigidBody("shaft", m, np.diag([across, across, along]), position=height / 2 * Z)
    block = density * 0.1**3
    slider = RigidBody("slider", block, block * 0.1**2 / 6 * np.eye(3), position=0.5 * Z)
    bodies: list[Body] = [shaft, slider]
    joints: list[Joint] = [
        RevoluteJoint("bearing", GROUND, Marker("shaft", position=-height / 2 * Z), axis=Z),
        PrismaticJoint("guide", Marker("shaft", position=np.zeros(3)), Marker("slider", position=np.zeros(3)), axis=Z),
    ]
    forces: list[Force] = [Gravity(-G * Z)]
    # rod and ball together: centre of mass, and inertia about it
    total, center = m + ball, (m * 0.5 + ball) / (m + ball)
    I_across = across + m * (center - 0.5) ** 2 + ball * (1 - center) ** 2
    for k, sign in ((1, 1.0), (2, -1.0)):
        direction = np.array([sign * np.cos(beta), 0.0, -np.sin(beta)])
        top = np.array([sign * arm, 0.0, height])
        A = np.column_stack([direction, Y, np.cross(direction, Y)])
        bodies.append(
            RigidBody(
                f"rod {k}",
                total,
                np.diag([along, I_across, I_across]),
                center_of_mass=center * X,
                position=top,
                orientation=euler_parameters(A),
            )
        )
        at_top = Marker("shaft", position=top - height / 2 * Z)
        joints.append(RevoluteJoint(f"hinge {k}", at_top, Marker(f"rod {k}", position=np.zeros(3)), axis=Y))
        ends = Marker("slider", position=sign * arm * X), Marker(f"rod {k}", position=0.5 * X)
        forces.append(SpringDamper(f"coupler {k}", *ends, stiffness=stiffness, damping=damping, free_length=0.5))
    spun = [turning(body, speed * Z, point=np.zeros(3)) for body in bodies]
    return System(spun, joints, forces, unit_system(UNITS), "stiff flyball governor")


def rod(name: str, mass: float, inertia: Array, length: float, start: Array, direction: Array) -> RigidBody:
    """Return a rod along its x axis in a direction from `start`, with principal moments about its centre, (3,)."""
    z = Z if abs(direction @ Z) < 0.5 else X
    A = np.column_stack([direction, np.cross(z, direction), z])
    return RigidBody(
        name,
        mass,
        np.diag(inertia),
        center_of_mass=length / 2 * X,
        position=start,
        orientation=euler_parameters(A),
    )


def axes_of(body: Body) -> Array:
    """Return the assembled R_GB of a rigid body, (3, 3)."""
    assert isinstance(body, RigidBody)
    return rotation_matrix(body.orientation)
