"""System files: of every run that is accepted the motion must obey the equations of the text.

The oracle reads the system with `tomllib` and the results with h5py. At every output time it asks of each rigid body
whether mass times acceleration is the sum of its weight, its springs and point forces (computed here) and the reactions
in the file, likewise about its centre of mass; whether the joints are closed, velocities are the rates of positions and
accelerations those of velocities; and whether start, times and masses are those of the text.
"""

import json
import tomllib
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tests.campaign.mutation import damaged_toml
from tests.campaign.verdict import ACCEPTED, WRONG, Verdict, ask, judged

__all__ = ["SYSTEM", "system_case", "wrong_motion"]

SYSTEM = """\
[system]
units = "m-kg-s"
gravity = [0.0, 0.0, -9.81]

[bodies.stick]
mass = 2.0
inertia = [[0.01, 0.0, 0.0], [0.0, 0.2, 0.001], [0.0, 0.001, 0.2]]
center_of_mass = [0.05, 0.0, 0.0]
position = [0.5, 0.0, 0.0]

[bodies.ball]
mass = 1.0
inertia = [[0.02, 0.0, 0.0], [0.0, 0.03, 0.0], [0.0, 0.0, 0.02]]
position = [1.3, 0.2, 0.0]

[joints.pin]
type = "revolute"
body_a = "ground"
body_b = "stick"
marker_b = [-0.5, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]

[joints.link]
type = "spherical"
body_a = "stick"
body_b = "ball"
marker_a = [0.5, 0.0, 0.0]
marker_b = [-0.3, -0.2, 0.0]

[forces.stay]
type = "spring-damper"
body_a = "ground"
marker_a = [0.0, 0.0, 1.0]
body_b = "ball"
marker_b = [0.0, 0.1, 0.0]
stiffness = 50.0
damping = 1.0
free_length = 1.2

[forces.push]
type = "point-force"
body = "ball"
marker = [0.0, 0.0, 0.0]
force = [0.5, 0.2, 0.0]

[sensors.tip]
type = "velocity"
body = "ball"
marker = [0.0, 0.0, 0.0]

[run]
t_end = 0.1
h = 1e-3
output_every = 2
"""
MOST_STEPS = 5000  #: of a run in the campaign; longer ones are only read (`floatframe info`)
BALANCE = 1e-6  #: of forces, over the largest of them: the tolerance of Newton's method is in it
GAP = 1e-7  #: of joints, over the size of the system
KNOWN = {
    "bodies": {"mass", "inertia", "center_of_mass", "position", "rotation_vector"},
    "joints": {"type", "body_a", "body_b", "marker_a", "marker_b", "axis"},
    "spring-damper": {
        "type",
        "body_a",
        "marker_a",
        "body_b",
        "marker_b",
        "stiffness",
        "damping",
        "free_length",
        "preload",
    },
    "point-force": {"type", "body", "marker", "force"},
}
CLOSED = ("revolute", "spherical")  #: joints whose markers stay together


def system_case(seed: int, folder: Path) -> Verdict:
    """Run a damaged system."""
    rng = np.random.default_rng([3, seed])
    text = damaged_toml(SYSTEM, rng) if seed else SYSTEM.encode()
    path, out = folder / "system.toml", folder / "out.h5"
    path.write_bytes(text)
    if not 0 <= steps_of(text) <= MOST_STEPS and not steps_of(text) > 1e12:
        return judged(ask("floatframe", "info", path), folder=folder)
    verdict = judged(ask("floatframe", "run", path, "-o", out), folder=folder)
    if verdict.kind != ACCEPTED:
        return verdict
    reason = wrong_motion(tomllib.loads(text.decode("utf-8-sig")), out)
    return verdict if reason is None else Verdict(WRONG, reason) if reason else Verdict(ACCEPTED, "compared")


def steps_of(text: bytes) -> float:
    """Return how many steps a text asks for; 0 where it says nothing."""
    try:
        run = tomllib.loads(text.decode("utf-8-sig"))["run"]
        return float(run["t_end"] / run["h"])
    except Exception:  # not for this to judge
        return 0.0


def wrong_motion(system: dict[str, Any], out: Path) -> str | None:
    """Return what is wrong with a motion, "" if nothing is, None if the oracle does not know such systems."""
    bodies, joints, forces = system["bodies"], system.get("joints", {}), system.get("forces", {})
    tables = [*((t, KNOWN["bodies"]) for t in bodies.values()), *((t, KNOWN["joints"]) for t in joints.values())]
    tables += [(t, KNOWN.get(t["type"], set())) for t in forces.values()]
    if any(not set(table) <= known for table, known in tables) or set(system) & {"couplers", "events"}:
        return None
    if any(table["type"] not in CLOSED for table in joints.values()) or set(system["run"]) - {
        "t_end",
        "h",
        "output_every",
    }:
        return None
    with h5py.File(out, "r") as file:
        head = json.loads(file.attrs["head"])
        data = {name: item[...] for name, item in file.items()}
    motion = Motion(system, head, data)
    return motion.wrong_times() or motion.wrong_start() or motion.wrong_rates() or motion.wrong_joints() or \
        motion.wrong_balance()  # fmt: skip


class Motion:
    """A motion beside the text it comes from."""

    def __init__(self, system: dict[str, Any], head: dict[str, Any], data: dict[str, np.ndarray]) -> None:
        self.system, self.head, self.data = system, head, data
        self.t = data["t"]
        self.names = [body["name"] for body in head["bodies"]]
        self.R = {name: rotations(data["euler_parameters"][:, i]) for i, name in enumerate(self.names)}
        self.r = {name: data["position"][:, i] for i, name in enumerate(self.names)}
        self.u = {b["name"]: data["u"][:, b["u0"] : b["u0"] + 6] for b in head["bodies"]}
        self.u_dot = {b["name"]: data["u_dot"][:, b["u0"] : b["u0"] + 6] for b in head["bodies"]}
        n_t = len(self.t)
        self.R["ground"], self.r["ground"] = np.broadcast_to(np.eye(3), (n_t, 3, 3)), np.zeros((n_t, 3))
        self.u["ground"] = np.zeros((n_t, 6))
        self.size = max(1e-12, *(float(np.abs(r).max()) for r in self.r.values()))

    def place(self, body: str, marker: Any) -> np.ndarray:
        """Return a point of a body over time, (n_t, 3)."""
        return np.asarray(self.r[body] + self.R[body] @ np.asarray(marker, float))

    def velocity(self, body: str, marker: Any) -> np.ndarray:
        """Return the velocity of a point of a body, (n_t, 3)."""
        turning = np.einsum("tab,tb->ta", self.R[body], np.cross(self.u[body][:, 3:], np.asarray(marker, float)))
        return np.asarray(self.u[body][:, :3] + turning)

    def wrong_times(self) -> str:
        """Compare the output times with those of the text."""
        run = self.system["run"]
        n = max(1, int(np.ceil(run["t_end"] / run["h"] * (1 - 1e-12) - 1e-9)))
        expected = np.linspace(0, run["t_end"], n + 1)[:: run.get("output_every", 1)]
        if sorted(self.names) != sorted(self.system["bodies"]):
            return f"bodies {self.names}"
        same = len(expected) == len(self.t) and np.allclose(expected, self.t, rtol=1e-9, atol=1e-12 * run["t_end"])
        return "" if same else f"times: {len(self.t)} up to {self.t[-1]}, expected {len(expected)} up to {expected[-1]}"

    def wrong_start(self) -> str:
        """Bodies begin where the text places them, unless that leaves a joint open."""
        placed = {name: self.placed(name) for name in (*self.names, "ground")}
        for table in self.system.get("joints", {}).values():
            given = [(placed[table[f"body_{e}"]], table[f"marker_{e}"]) for e in "ab" if f"marker_{e}" in table]
            ends = [r + R @ np.array(marker, float) for (r, R), marker in given]
            if len(ends) == 2 and np.abs(ends[0] - ends[1]).max() > 1e-12 * self.size:
                return ""  # it has to be closed first: the joints are looked at below
        for name in self.names:
            r, R = placed[name]
            if np.abs(self.r[name][0] - r).max() > 1e-9 * self.size or np.abs(self.R[name][0] - R).max() > 1e-9:
                return f"{name} does not begin where it is placed"
        return ""

    def placed(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return place and rotation of a body in the text."""
        table = {} if name == "ground" else self.system["bodies"][name]
        return np.array(table.get("position", (0, 0, 0)), float), turned(table.get("rotation_vector", (0, 0, 0)))

    def wrong_rates(self) -> str:
        """Compare differences of positions and velocities with the mean rates, to the order of a step."""
        h = np.diff(self.t)[:, None]
        for name in self.names:
            for what, value, rate in (("velocity", self.r[name], self.u[name][:, :3]),
                                      ("acceleration", self.u[name], self.u_dot[name])):  # fmt: skip
                change = np.abs(np.diff(value, axis=0) - h * (rate[1:] + rate[:-1]) / 2)
                allowed = h * np.abs(np.diff(rate, axis=0)).max(axis=0) + 1e-9 * (np.abs(value).max() + self.size)
                if (change > allowed).any():
                    return f"{what} of {name} is not the rate it should be"
        return ""

    def marker(self, table: dict[str, Any], end: str) -> np.ndarray:
        """Return the marker of a joint in its body, also where only the other end is given."""
        if f"marker_{end}" in table:
            return np.array(table[f"marker_{end}"], float)
        other = "b" if end == "a" else "a"
        r, R = self.placed(table[f"body_{other}"])
        where = r + R @ np.array(table[f"marker_{other}"], float)
        r, R = self.placed(table[f"body_{end}"])
        return np.asarray(R.T @ (where - r))

    def wrong_joints(self) -> str:
        """Markers of joints stay together, and axes of hinges parallel."""
        for name, table in self.system.get("joints", {}).items():
            a, b = table["body_a"], table["body_b"]
            gap = self.place(a, self.marker(table, "a")) - self.place(b, self.marker(table, "b"))
            if np.abs(gap).max() > GAP * self.size:
                return f"joint {name} is open by {np.abs(gap).max():.1e}"
            if table["type"] == "revolute":
                axis = np.array(table["axis"], float) / np.linalg.norm(table["axis"])
                in_b = self.R[b][0].T @ self.R[a][0] @ axis
                if np.abs(self.R[a] @ axis - self.R[b] @ in_b).max() > 1e-6:
                    return f"axis of joint {name} turns"
        return ""

    def wrong_balance(self) -> str:
        """Newton and Euler for every body at every time."""
        force = {name: np.zeros((len(self.t), 3)) for name in (*self.names, "ground")}
        moment = {name: np.zeros((len(self.t), 3)) for name in (*self.names, "ground")}  # about the ground origin
        scale = np.full(len(self.t), 1e-30)

        def act(body: str, F: np.ndarray, P: np.ndarray, T: Any = 0.0) -> None:
            nonlocal scale
            force[body] += F
            moment[body] += np.cross(P, F) + T
            scale = np.maximum(scale, np.linalg.norm(F, axis=1) * (1 + np.abs(P).max() / self.size))

        joints, forces = self.system.get("joints", {}), self.system.get("forces", {})
        names = [*self.head["joints"], *self.head["springs"]]
        for k, name in enumerate(names):
            w = self.data["w"][:, self.head["w0"][k] : self.head["w0"][k + 1]]
            T = w[:, 3:6] if w.shape[1] >= 6 else np.zeros((len(w), 3))
            if name in joints:
                table = joints[name]
                P = self.place(table["body_a"], self.marker(table, "a"))
                act(table["body_a"], w[:, :3], P, T)
                act(table["body_b"], -w[:, :3], P, -T)
        for name, table in forces.items():
            if table["type"] == "point-force":
                P = self.place(table["body"], table.get("marker", (0, 0, 0)))
                act(table["body"], np.broadcast_to(np.array(table["force"], float), P.shape), P)
                continue
            a, b = table["body_a"], table["body_b"]
            ends = [table.get("marker_a", (0, 0, 0)), table.get("marker_b", (0, 0, 0))]
            A, B = self.place(a, ends[0]), self.place(b, ends[1])
            length = np.linalg.norm(B - A, axis=1)
            e = (B - A) / length[:, None]
            rate = np.einsum("ta,ta->t", e, self.velocity(b, ends[1]) - self.velocity(a, ends[0]))
            free = table.get("free_length")
            if free is None:
                pa, pb = self.placed(a), self.placed(b)
                free = np.linalg.norm(pb[0] + pb[1] @ np.array(ends[1]) - pa[0] - pa[1] @ np.array(ends[0]))
            tension = table.get("stiffness", 0.0) * (length - free) + table.get("damping", 0.0) * rate
            F = (tension + table.get("preload", 0.0))[:, None] * e
            act(a, F, A)
            act(b, -F, B)
            k = names.index(name)
            if np.abs(self.data["w"][:, self.head["w0"][k] :][:, :3] - F).max() > BALANCE * max(np.abs(F).max(), 1e-9):
                return f"force of {name} is not that of its length"
        for name in self.names:
            reason = self.out_of_balance(name, force[name], moment[name], scale)
            if reason:
                return reason
        return ""

    def out_of_balance(self, name: str, force: np.ndarray, moment: np.ndarray, scale: np.ndarray) -> str:
        """Compare the motion of a body with the forces on it, its weight added here."""
        table, R = self.system["bodies"][name], self.R[name]
        m, I = table["mass"], np.array(table["inertia"], float)  # noqa: E741
        c = np.array(table.get("center_of_mass", (0, 0, 0)), float)
        g = np.array(self.system["system"].get("gravity", (0, 0, 0)), float)
        omega, alpha = self.u[name][:, 3:], self.u_dot[name][:, 3:]
        arm = np.cross(alpha, c) + np.cross(omega, np.cross(omega, c))
        a = self.u_dot[name][:, :3] + np.einsum("tab,tb->ta", R, arm)
        weight = m * (np.abs(a).max(axis=1) + np.abs(g).max())
        scale = np.maximum(scale, weight)
        lost = np.abs(m * a - m * g - force).max(axis=1)
        if (lost > BALANCE * scale).any():
            return f"forces on {name} are out of balance by {(lost / scale).max():.1e}"
        center = self.place(name, c)
        about = np.einsum("tba,tb->ta", R, moment - np.cross(center, force))
        Euler = alpha @ I.T + np.cross(omega, omega @ I.T)
        size = scale * self.size + np.abs(I).max() * (np.abs(alpha).max(axis=1) + (omega**2).max(axis=1))
        lost = np.abs(Euler - about).max(axis=1)
        return (
            f"moments on {name} are out of balance by {(lost / size).max():.1e}"
            if (lost > BALANCE * size).any()
            else ""
        )


def rotations(p: np.ndarray) -> np.ndarray:
    """Return rotation matrices of Euler parameters, (n_t, 3, 3)."""
    w, x, y, z = p.T
    rows = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]  # fmt: skip
    return np.moveaxis(np.array(rows), 2, 0)


def turned(vector: Any) -> np.ndarray:
    """Return the rotation matrix of a rotation vector, by the exponential series of Rodrigues."""
    v = np.array(vector, float)
    angle = float(np.linalg.norm(v))
    if angle == 0:
        return np.eye(3)
    x, y, z = v / angle
    S = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * S + (1 - np.cos(angle)) * S @ S)
