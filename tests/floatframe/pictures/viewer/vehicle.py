"""A vehicle in memory, made without integration: ten seconds on a road that bends, with a body of many nodes."""

from dataclasses import replace

import numpy as np

from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.rotations import euler_parameter_product, euler_parameters_of_rotation_vector
from floatframe.model.shapes import Road, Wheel
from floatframe.model.system import System
from floatframe.results.head import BodyEntry, Head
from floatframe.results.results_file import MemorySource
from floatframe.results.trajectory import Trajectory
from tests.synthetic import synthetic_reduced_body

SPEED, RADIUS, WHEEL = 15.0, 60.0, 0.32  #: m/s, of the bend [m], of the wheels [m]
PLACES = [(1.3, 0.75), (1.3, -0.75), (-1.3, 0.75), (-1.3, -0.75)]
T_END = 10.0


def car_surface(n):
    """A closed shell like the body of a car: nodes of a box with a cabin, (about n, 3), and triangles."""
    n_around = 2 * int(np.sqrt(n / 3))
    n_along = n // n_around
    along, around = np.linspace(-1, 1, n_along), 2 * np.pi * np.arange(n_around) / n_around
    x = 2.1 * along
    cabin = 0.32 / (1 + np.exp(-9 * (along + 0.75))) / (1 + np.exp(14 * (along - 0.18)))
    ends = np.clip(1 - np.abs(along) ** 14, 0.02, 1) ** 0.5
    c, s = np.cos(around), np.sin(around)
    y = 0.86 * np.sign(c) * np.abs(c) ** 0.35
    z = np.sign(s) * np.abs(s) ** 0.35
    nodes = np.empty((n_along, n_around, 3))
    nodes[..., 0] = x[:, None]
    nodes[..., 1] = ends[:, None] * y[None] * (1 - 0.22 * np.maximum(z, 0)[None] * (cabin / 0.32)[:, None])
    nodes[..., 2] = 0.5 + ends[:, None] * z[None] * 0.27 + np.maximum(z, 0)[None] * 2 * cabin[:, None]
    i, j = np.meshgrid(np.arange(n_along - 1), np.arange(n_around), indexing="ij")
    a, b = i * n_around + j, (i + 1) * n_around + j
    d, e = i * n_around + (j + 1) % n_around, (i + 1) * n_around + (j + 1) % n_around
    quads = np.stack([a, b, e, d], axis=-1).reshape(-1, 4)
    return nodes.reshape(-1, 3), np.concatenate([quads[:, [0, 2, 1]], quads[:, [0, 3, 2]]])


def car_body(n, n_modes=20):
    """A reduced body with that surface and smooth modes: bending, torsion, and waves."""
    nodes, triangles = car_surface(n)
    x, y, z = nodes.T
    Phi = np.zeros((len(nodes), 3, n_modes))
    for k in range(n_modes):
        wave = np.cos((k // 3 + 2) * np.pi * (x + 2.1) / 4.2)
        Phi[:, 2, k] = wave if k % 3 == 0 else wave * y if k % 3 == 1 else 0.0
        Phi[:, 1, k] = wave if k % 3 == 2 else -wave * (z - 0.5) if k % 3 == 1 else 0.0
    stress = np.zeros((len(nodes), 6, n_modes))
    stress[:, 0] = 2e9 * (Phi[:, 2] * (z - 0.5)[:, None] + Phi[:, 1] * y[:, None])
    stress[:, 5] = 4e8 * Phi[:, 1]
    reduced = synthetic_reduced_body(n_q=n_modes, n_nodes=40, units="m-kg-s")
    return replace(
        reduced, name="car", nodes=nodes, node_ids=np.arange(len(nodes)), Phi=Phi, surface=triangles, stress=stress,
        kept=None,
    )  # fmt: skip


def vehicle(n=50_000, rows_a_second=200):
    """The system and its motion: straight, then a bend with its roll, over bumps; the body bends and twists."""
    reduced = car_body(n)
    t = np.linspace(0, T_END, int(T_END * rows_a_second) + 1)
    yaw = SPEED / RADIUS * np.clip(t - 4.0, 0, None)
    straight = SPEED * np.minimum(t, 4.0)
    x, y = straight + RADIUS * np.sin(yaw), RADIUS * (1 - np.cos(yaw))
    roll = 0.04 * (t > 4) * (1 - np.exp(-3 * (t - 4).clip(0)))
    heave = 0.03 * np.sin(9 * t) * np.exp(-((t - 2) ** 2))
    about_z = np.array([euler_parameters_of_rotation_vector(np.array([0, 0, a])) for a in yaw])
    about_x = np.array([euler_parameters_of_rotation_vector(np.array([a, 0, 0])) for a in roll])
    p_body = euler_parameter_product(about_z, about_x)
    position = [np.stack([x, y, heave], axis=1)]
    parameters = [p_body]
    for a, b in PLACES:
        c, s = np.cos(yaw), np.sin(yaw)
        position.append(np.stack([x + c * a - s * b, y + s * a + c * b, np.full(len(t), WHEEL)], axis=1))
        spin = np.array([euler_parameters_of_rotation_vector(np.array([0, v, 0])) for v in SPEED * t / WHEEL])
        parameters.append(euler_parameter_product(about_z, spin))
    k = np.arange(reduced.n_q)
    amplitude = 0.012 / (1 + k) ** 1.3
    q = amplitude * np.sin((14 + 5 * k) * t[:, None] + k) * (0.3 + np.exp(-((t[:, None] - 2) ** 2)))
    names = ["car", *(f"wheel {j + 1}" for j in range(4))]
    n_q, n_b = reduced.n_q, 5
    entries = tuple(
        BodyEntry(name, n_q if j == 0 else 0, 0 if j == 0 else n_q, 6 * j + (n_q if j else 0), "", "", False)
        for j, name in enumerate(names)
    )
    u = np.zeros((len(t), 6 * n_b + n_q))
    for j in range(1, n_b):
        u[:, entries[j].u0 + 4] = SPEED / WHEEL
    arrays = {
        "t": t, "position": np.stack(position, axis=1), "euler_parameters": np.stack(parameters, axis=1), "q": q,
        "u": u, "u_dot": np.zeros_like(u), "w": np.zeros((len(t), 0)), "diagnostics": np.zeros((len(t), 12)),
        "drift": np.zeros((len(t), 0, 4)),
    }  # fmt: skip
    head = Head("Car on a road", "m-kg-s", entries, (), (), (0,), {"gravity": [0, 0, -9.81]})
    wheel = Wheel(WHEEL, 0.21)
    bodies = [FlexibleBody("car", reduced)]
    bodies += [RigidBody(name, 15.0, np.eye(3), shapes=[wheel]) for name in names[1:]]
    bend = np.linspace(0, 1.6, 60)
    way = [(-10.0, 0.0), *((s, 0.0) for s in np.arange(0, 60, 10.0))]
    way += [(60 + RADIUS * np.sin(a), RADIUS * (1 - np.cos(a))) for a in bend]
    road = Road([(*place, 0.0) for place in way], 7.0)
    system = System(bodies, scene=[road], name="Car on a road")
    return system, Trajectory(head, MemorySource(arrays), True)
