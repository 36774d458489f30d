"""Robots and random trees, for the identification."""

import numpy as np

from floatframe import FixedJoint, Gravity, Marker, PrismaticJoint, RevoluteJoint, RigidBody, SphericalJoint, System
from floatframe.joints import CylindricalJoint, PlanarJoint, UniversalJoint
from floatframe.model.rotations import euler_parameters, rotation_matrix

DOWN = (0.0, 0.0, -9.81)
#: angles between axes [degrees] and distances [m] of a PUMA 560 in the convention of Khalil and Kleinfinger, as they
#: are commonly given; only what is zero or square counts for the number of base parameters
PUMA_ANGLES = (0, -90, 0, -90, 90, -90)
PUMA_ALONG_X = (0, 0, 0.4318, 0.0203, 0, 0)
PUMA_ALONG_Z = (0, 0.2435, -0.0934, 0.4331, 0, 0)
#: offsets and lengths of the order of a KUKA IR 361, three parallel and three meeting axes: chosen, not measured
KUKA_LIKE = {"angles": (0, -90, 0, -90, 90, -90), "along_x": (0, 0, 0.48, 0, 0, 0), "along_z": (0.0, 0, 0, 0.51, 0, 0)}


def some_body(name, rng, position=(0, 0, 0), R=np.eye(3)):
    """A body of eight point masses."""
    c, m = rng.normal(size=(8, 3)) * 0.3, rng.uniform(0.1, 1, 8)
    center = m @ c / m.sum()
    d = c - center
    J = sum(mass * (x @ x * np.eye(3) - np.outer(x, x)) for mass, x in zip(m, d, strict=True))
    return RigidBody(name, m.sum(), J, center_of_mass=center, position=position, orientation=euler_parameters(R))


def six_axes(angles=PUMA_ANGLES, along_x=PUMA_ALONG_X, along_z=PUMA_ALONG_Z, gravity=DOWN, seed=0, base="ground"):
    """A robot of six rotations; base "body": on a free body."""
    rng = np.random.default_rng(seed)
    T, bodies, joints = np.eye(4), [], []
    if base != "ground":
        bodies.append(some_body("base", rng))
    for i in range(6):
        c, s = np.cos(np.deg2rad(angles[i])), np.sin(np.deg2rad(angles[i]))
        here = np.array([[1, 0, 0, along_x[i]], [0, c, -s, -s * along_z[i]], [0, s, c, c * along_z[i]], [0, 0, 0, 1.0]])
        T = T @ here
        bodies.append(some_body(f"link{i + 1}", rng, T[:3, 3], T[:3, :3]))
        below = ("ground" if base == "ground" else "base") if i == 0 else f"link{i}"
        ends = Marker(below, position=here[:3, 3], triad=here[:3, :3]), Marker(f"link{i + 1}")
        joints.append(RevoluteJoint(f"joint{i + 1}", *ends, axis=(0, 0, 1)))
    return System(bodies, joints, [Gravity(gravity)] if np.any(gravity) else [])


def palletizer(gravity=DOWN, wrist=True, hinges="RRRR", seed=6, motions=None):
    """A waist with a parallelogram: arm and lever on it, a rod from the lever to the forearm; a wrist of a hinge.

    hinges: joints of arm and forearm, waist and lever, lever and rod, rod and forearm: R hinges, U and S hold less.
    """
    rng, bodies, joints = np.random.default_rng(seed), [], []
    places = {"waist": (0, 0, 0), "arm": (0.1, 0, 0.4), "lever": (0.1, 0, 0.4), "forearm": (0.3, 0, 1.0)}
    places |= {"rod": (-0.1, 0, 0.3), "hand": (1.0, 0, 1.1)}
    places = {name: np.array(place) for name, place in places.items() if wrist or name != "hand"}
    bodies = [some_body(name, rng, place) for name, place in places.items()]

    def hinge(name, below, above, at, kind="R", axis=(0, 1, 0)):
        at = np.array(at)
        ends = Marker(below, position=at - places.get(below, np.zeros(3))), Marker(above, position=at - places[above])
        moved = {"motions": {"angle": motions[name]}} if motions and name in motions else {}
        joints.append(
            {
                "R": lambda: RevoluteJoint(name, *ends, axis=axis, **moved),
                "U": lambda: UniversalJoint(name, *ends, axis=axis, axis_b=np.cross(axis, (0.6, 0, 0.8))),
                "S": lambda: SphericalJoint(name, *ends),
            }[kind]()
        )

    hinge("turn", "ground", "waist", (0, 0, 0), axis=(0, 0, 1))
    hinge("shoulder", "waist", "arm", places["arm"], hinges[0])
    hinge("crank", "waist", "lever", places["lever"], hinges[1])
    hinge("elbow", "arm", "forearm", places["forearm"])
    hinge("low", "lever", "rod", places["rod"], hinges[2])
    hinge("high", "rod", "forearm", places["rod"] + places["forearm"] - places["arm"], hinges[3])
    if wrist:
        hinge("wrist", "forearm", "hand", places["hand"])
    return System(bodies, joints, [Gravity(gravity)] if np.any(gravity) else [])


def human(gravity=DOWN):
    """A free trunk with head, arms of two bodies and legs of three: 12 bodies, spherical joints and hinges."""
    rng = np.random.default_rng(12)
    bodies, joints, places = [some_body("trunk", rng)], [], {"trunk": np.zeros(3)}

    def hang(name, parent, off, kind):
        places[name] = places[parent] + off
        bodies.append(some_body(name, rng, places[name]))
        ends = Marker(parent, position=off), Marker(name)
        joint = f"{name} joint"
        joints.append(SphericalJoint(joint, *ends) if kind == "S" else RevoluteJoint(joint, *ends, axis=(0, 1, 0)))

    hang("head", "trunk", (0, 0, 0.55), "S")
    for side, y in (("left", 1), ("right", -1)):
        hang(f"{side} upper arm", "trunk", (0, 0.2 * y, 0.45), "S")
        hang(f"{side} forearm", f"{side} upper arm", (0, 0, -0.3), "R")
        hang(f"{side} thigh", "trunk", (0, 0.1 * y, 0), "S")
        hang(f"{side} shank", f"{side} thigh", (0, 0, -0.43), "R")
    for side in ("left", "right"):
        hang(f"{side} foot", f"{side} shank", (0, 0, -0.43), "R")
    return System(bodies, joints, [Gravity(gravity)])


def random_tree(seed, n, kinds):
    """A tree of n bodies by joints of given kinds, with gravity along z, y, anywhere or without; many axes parallel."""
    rng = np.random.default_rng(seed)
    bodies, joints, poses = [], [], []
    for i in range(n):
        parent = int(rng.integers(-1, i)) if rng.random() < 0.3 else i - 1
        place, axes = (np.zeros(3), np.eye(3)) if parent < 0 else poses[parent]
        p = rng.normal(size=4)
        turned = np.eye(3) if rng.random() < 0.7 else rotation_matrix(p / np.linalg.norm(p))
        off = rng.normal(size=3) * rng.choice([0.0, 1.0], p=[0.3, 0.7])
        off *= np.array([0, 0, 1]) if rng.random() < 0.3 else 1.0
        R, r = axes @ turned, place + axes @ off
        poses.append((r, R))
        bodies.append(some_body(f"body{i}", rng, r, R))
        A = Marker("ground" if parent < 0 else f"body{parent}", position=off, triad=turned)
        ends = (A, Marker(f"body{i}"))[:: rng.choice([1, -1])]
        axis = np.eye(3)[rng.integers(3)] if rng.random() < 0.8 else rng.normal(size=3)
        axis = axis / np.linalg.norm(axis)
        other = np.cross(axis, rng.normal(size=3))
        name = f"joint{i}"
        make = {
            "R": lambda: RevoluteJoint(name, *ends, axis=axis),  # noqa: B023
            "P": lambda: PrismaticJoint(name, *ends, axis=axis),  # noqa: B023
            "C": lambda: CylindricalJoint(name, *ends, axis=axis),  # noqa: B023
            "U": lambda: UniversalJoint(name, *ends, axis=axis, axis_b=other / np.linalg.norm(other)),  # noqa: B023
            "S": lambda: SphericalJoint(name, *ends),  # noqa: B023
            "L": lambda: PlanarJoint(name, *ends, axis=axis),  # noqa: B023
            "F": lambda: FixedJoint(name, *ends),  # noqa: B023
        }
        kind = kinds[rng.integers(len(kinds))] if i else "R"
        if kind != "free":
            joints.append(make[kind]())
    gravity = [np.zeros(3), np.array(DOWN), np.array((0, -9.81, 0)), rng.normal(size=3) * 5][rng.integers(4)]
    return System(bodies, joints, [Gravity(gravity)] if gravity.any() else [])
