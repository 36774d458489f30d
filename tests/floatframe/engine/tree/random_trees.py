"""Random trees of rigid bodies with all charts: the same tree as our system and, where asked, as a Pinocchio model."""

from dataclasses import dataclass

import numpy as np

import floatframe as ff
from floatframe.model.joints.axis_frame import normals_of
from floatframe.model.rotations import euler_parameters, euler_parameters_of_rotation_vector, rotation_exp

LEAD = 0.7
KINDS = ("revolute", "prismatic", "cylindrical", "screw", "universal", "planar", "spherical", "fixed", "free")
N_POSITIONS = dict(zip((*KINDS,), (1, 1, 2, 1, 2, 3, 4, 0, 7), strict=True))


@dataclass(frozen=True, eq=False)
class Link:
    """A body and the joint that carries it: frames (R, r) of the joint in the parent and in the body."""

    parent: int
    kind: str
    axis: np.ndarray
    axis_b: np.ndarray  #: second axis of a universal joint, in the outer frame
    in_parent: tuple[np.ndarray, np.ndarray]
    in_body: tuple[np.ndarray, np.ndarray]
    mass: float
    center: np.ndarray
    inertia: np.ndarray  #: about the centre of mass
    is_reversed: bool


def random_frame(rng, size=0.5):
    return rotation_exp(rng.normal(size=3)), size * rng.normal(size=3)


def random_tree(n, rng, *, kinds=KINDS[:-1], branching=0.3, free_base=False, reverse=True):
    """Return n links, depth first."""
    links, path = [], [-1]
    for i in range(n):
        while len(path) > 1 and rng.random() < branching:
            path.pop()
        kind = "free" if i == 0 and free_base else str(rng.choice(kinds))
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        other = np.cross(axis, rng.normal(size=3))
        points = rng.normal(size=(3, 6)) * 0.3
        links.append(
            Link(
                path[-1] if kind != "free" else -1, kind, axis, other / np.linalg.norm(other), random_frame(rng),
                random_frame(rng), rng.uniform(0.5, 2.0) + 3.0 * (kind == "free"), 0.3 * rng.normal(size=3),
                point_inertia(points),
                bool(reverse and rng.random() < 0.5 and kind not in ("spherical", "free")),
            )
        )  # fmt: skip
        path.append(i)
    return links


def point_inertia(points):
    """Return the inertia of unit-mass points about their mean: a possible tensor, (3, 3)."""
    c = points - points.mean(axis=1, keepdims=True)
    return (np.einsum("ak,ak->", c, c) * np.eye(3) - c @ c.T) / points.shape[1]


def system_of(links, gravity=(0.3, -0.4, -9.81)):
    """Return the links as a system, placed at zero coordinates."""
    bodies, joints, poses = [], [], []
    for i, link in enumerate(links):
        R_p, r_p = (np.eye(3), np.zeros(3)) if link.parent < 0 else poses[link.parent]
        (A, a), (B, b) = link.in_parent, link.in_body
        if link.kind == "free":
            R, r = np.eye(3), np.zeros(3)
        else:
            R = R_p @ A @ B.T
            r = r_p + R_p @ a - R @ b
        poses.append((R, r))
        bodies.append(
            ff.RigidBody(f"b{i}", link.mass, link.inertia, link.center, position=r, orientation=euler_parameters(R))
        )
        if link.kind == "free":
            continue
        near = ff.Marker("ground" if link.parent < 0 else f"b{link.parent}", position=a, triad=A)
        far = ff.Marker(f"b{i}", position=b, triad=B)
        ends = (far, near) if link.is_reversed else (near, far)
        joints.append(joint_of(link, f"j{i}", *ends))
    forces = [ff.Gravity(np.array(gravity))]
    return ff.System(bodies, joints, forces)


def joint_of(link, name, a, b):
    axis = link.axis
    match link.kind:
        case "revolute":
            return ff.RevoluteJoint(name, a, b, axis=axis)
        case "prismatic":
            return ff.PrismaticJoint(name, a, b, axis=axis)
        case "cylindrical":
            return ff.joints.CylindricalJoint(name, a, b, axis=axis)
        case "screw":
            return ff.joints.ScrewJoint(name, a, b, axis=axis, lead=LEAD)
        case "universal":
            return ff.joints.UniversalJoint(name, a, b, axis=axis, axis_b=link.axis_b)
        case "planar":
            return ff.joints.PlanarJoint(name, a, b, axis=axis)
        case "spherical":
            return ff.SphericalJoint(name, a, b)
        case _:
            return ff.FixedJoint(name, a, b)


def random_state(links, rng):
    """Return positions, rates and accelerations, body by body."""
    x, n_v = [], 0
    for link in links:
        n = N_POSITIONS[link.kind]
        part = rng.normal(size=n)
        if link.kind in ("spherical", "free"):
            part[-4:] = euler_parameters_of_rotation_vector(rng.normal(size=3))
        x.append(part)
        n_v += n - (link.kind in ("spherical", "free"))
    return np.concatenate([*x, np.zeros(0)]), rng.normal(size=n_v), rng.normal(size=n_v)


class PinocchioTree:
    """The same tree in Pinocchio, elementary joints with massless links between; positions and rates in our order."""

    def __init__(self, links, gravity=(0.3, -0.4, -9.81)):
        import pinocchio as pin

        self.pin = pin
        model = pin.Model()
        model.gravity.linear = np.array(gravity)
        numbers, joint_of_link, offsets = [], [], []
        for i, link in enumerate(links):
            (A, a), (B, b) = link.in_parent, link.in_body
            joint, place = 0, pin.SE3(A, a)
            if link.kind == "free":
                place, B, b = pin.SE3.Identity(), np.eye(3), np.zeros(3)
            elif link.parent >= 0:
                joint = joint_of_link[link.parent]
                R, r = (np.eye(3), np.zeros(3)) if links[link.parent].kind == "free" else links[link.parent].in_body
                place = offsets[link.parent] * pin.SE3(R, r).inverse() * place
            for elementary, at in self.chain(link):
                joint = model.addJoint(joint, elementary, place, f"{i}.{at}")
                numbers.append((i, at, joint))
                place = pin.SE3.Identity()
            inertia = pin.Inertia(link.mass, B.T @ (link.center - b), B.T @ link.inertia @ B)
            model.appendBodyToJoint(joint, inertia, place)
            joint_of_link.append(joint)
            offsets.append(place)
        self.model, self.data = model, model.createData()
        self.of_x, self.of_v = [], []  # where each of our numbers stands in theirs
        for _, _, joint in sorted(numbers):
            q0, v0 = model.idx_qs[joint], model.idx_vs[joint]
            self.of_x += [q0 + 3, q0, q0 + 1, q0 + 2] if model.nqs[joint] == 4 else range(q0, q0 + model.nqs[joint])
            self.of_v += range(v0, v0 + model.nvs[joint])

    def chain(self, link):
        """Return elementary joints from the parent on, each with its first position among those of the joint."""
        pin, sign = self.pin, -1.0 if link.is_reversed else 1.0
        slide, turn = pin.JointModelPrismaticUnaligned, pin.JointModelRevoluteUnaligned
        e, f = sign * link.axis, sign * link.axis_b
        first, second = (sign * n for n in normals_of(link.axis))
        chains = {
            "revolute": lambda: [(turn(e), 0)],
            "prismatic": lambda: [(slide(e), 0)],
            "cylindrical": lambda: [(slide(e), 0), (turn(e), 1)],
            "screw": lambda: [(pin.JointModelHelicalUnaligned(e, LEAD / (2 * np.pi)), 0)],
            "universal": lambda: [(turn(e), 0), (turn(f), 1)],
            "planar": lambda: [(slide(first), 0), (slide(second), 1), (turn(e), 2)],
            "spherical": lambda: [(pin.JointModelSpherical(), 0)],
            "free": lambda: [(pin.JointModelTranslation(), 0), (pin.JointModelSpherical(), 3)],
            "fixed": list,
        }
        made = chains[link.kind]()
        return made[::-1] if link.is_reversed else made

    def x(self, x):
        """Return positions in their order."""
        result = np.zeros(len(x))
        result[self.of_x] = x
        return result

    def v(self, v):
        """Return rates in their order."""
        result = np.zeros(len(v))
        result[self.of_v] = v
        return result

    def ours(self, A):
        """Return a vector or matrix over rates in our order."""
        return A[self.of_v] if A.ndim == 1 else A[np.ix_(self.of_v, self.of_v)]

    def inverse_dynamics(self, x, v, a):
        """Return generalised forces."""
        return self.ours(self.pin.rnea(self.model, self.data, self.x(x), self.v(v), self.v(a)))

    def mass_matrix(self, x):
        """Return the mass matrix."""
        M = self.pin.crba(self.model, self.data, self.x(x))
        return self.ours(np.triu(M) + np.triu(M, 1).T)

    def forward_dynamics(self, x, v, force):
        """Return accelerations."""
        return self.ours(self.pin.aba(self.model, self.data, self.x(x), self.v(v), self.v(force)))

    def derivatives(self, x, v, a):
        """Return derivatives of the forces by positions, by rates."""
        x, v, a = self.x(x), self.v(v), self.v(a)
        return [self.ours(A) for A in self.pin.computeRNEADerivatives(self.model, self.data, x, v, a)[:2]]

    def forward_derivatives(self, x, v, force):
        """Return derivatives of the accelerations by positions, by rates, by forces."""
        x, v, force = self.x(x), self.v(v), self.v(force)
        made = self.pin.computeABADerivatives(self.model, self.data, x, v, force)
        return [self.ours(A) for A in made]
