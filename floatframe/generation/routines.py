"""What can be generated: inputs and outputs of a routine, and its outputs as terms."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from floatframe.generation.derivatives import jacobian, position_seeds, seeds_of
from floatframe.generation.graph import Graph, Operations, Scalar, Terms, operations
from floatframe.generation.grouping import carried_inwards
from floatframe.generation.links import TreeTerms, symbols_of, terms
from floatframe.generation.recursions import (
    cross,
    forward_dynamics,
    inverse_dynamics,
    joints_of,
    mass_matrix,
)

__all__ = ["ROUTINES", "Output", "Routine", "routine_of"]


@dataclass(frozen=True, eq=False)
class Output:
    """One array of results."""

    name: str
    values: Terms  #: terms, of the shape that the array has
    meaning: str


@dataclass(frozen=True, eq=False)
class Routine:
    """A function to be written out."""

    name: str
    inputs: tuple[tuple[str, int, str], ...]  #: name, length, meaning
    outputs: tuple[Output, ...]
    graph: Graph
    meaning: str
    asked: tuple[int, int]  #: additions and multiplications of the same recursion with all zeros and ones

    @property
    def values(self) -> list[Scalar]:
        """Return all outputs one after the other, rows first."""
        return [value for output in self.outputs for value in output.values.ravel()]

    @property
    def operations(self) -> Operations:
        """Return the operations of a call."""
        return operations(self.values)


def force_output(name: str, values: Terms) -> Output:
    """Return forces along rates as an output."""
    return Output(name, values, "forces along the rates [N, N m]")


def inverse(tree: TreeTerms) -> list[Output]:
    """Return the forces that a motion needs."""
    return [force_output("force", inverse_dynamics(tree, tree.v, tree.a, joints_of(tree)))]


def residual(tree: TreeTerms) -> list[Output]:
    """Return what is left of the equations of motion."""
    given = symbols_of(tree.graph, "force", len(tree.v))
    force = inverse_dynamics(tree, tree.v, tree.a, joints_of(tree))
    return [Output("residual", force - given, "M z_ddot + h - force [N, N m]")]


def mass(tree: TreeTerms) -> list[Output]:
    """Return the mass matrix."""
    return [Output("mass_matrix", mass_matrix(tree, joints_of(tree)), "M, symmetric [kg, kg m, kg m2]")]


def forward(tree: TreeTerms) -> list[Output]:
    """Return the accelerations under forces."""
    given = symbols_of(tree.graph, "force", len(tree.v))
    return [Output("acceleration", forward_dynamics(tree, given, joints_of(tree)), "z_ddot [m/s2, rad/s2]")]


def derivatives(tree: TreeTerms) -> list[Output]:
    """Return the derivatives of the forces of a motion."""
    joints = joints_of(tree)
    force = inverse_dynamics(tree, tree.v, tree.a, joints)
    return [
        Output("by_z", jacobian(tree.graph, force, position_seeds(tree)), "force by z along the rates"),
        Output("by_z_dot", jacobian(tree.graph, force, seeds_of(tree.graph, list(tree.v))), "force by z_dot"),
        Output("by_z_ddot", mass_matrix(tree, joints), "force by z_ddot: the mass matrix"),
    ]


def sensitivity(tree: TreeTerms) -> list[Output]:
    """Return the derivatives of the forces of a motion by parameters."""
    force = inverse_dynamics(tree, tree.v, tree.a, joints_of(tree))
    by = jacobian(tree.graph, force, seeds_of(tree.graph, tree.parameters))
    return [Output("by_parameters", by, "force by parameters, (rates, parameters)")]


def kinematics(tree: TreeTerms) -> list[Output]:
    """Return place, axes and velocity of the frames of all bodies, ground axes."""
    graph, zero = tree.graph, terms(tree.graph, np.zeros(3))
    placed: list[tuple[Terms, Terms, Terms, Terms]] = []
    for link, joint in zip(tree.links, joints_of(tree), strict=True):
        r, R, v, omega = (zero, terms(graph, np.eye(3)), zero, zero) if link.parent < 0 else placed[link.parent]
        R_in = R @ link.A
        p = R @ link.r + R_in @ joint.d
        R = R_in @ joint.E
        v = v + cross(omega, p)
        if link.n_z:
            rate = tree.v[link.v0 : link.v0 + link.n_z]
            v, omega = v + R @ (rate @ joint.columns[:, :3]), omega + R @ (rate @ joint.columns[:, 3:])
        placed.append((r + p, R, v, omega))
    results = []
    for k, axes, origin in tree.frames:
        r, R, v, omega = placed[k]
        arm = R @ origin
        results.append((r + arm, R @ axes, v + cross(omega, arm), omega))
    meanings = {
        "position": "origins of the body frames, (bodies, 3) [m]",
        "axes": "R_GB of the bodies, (bodies, 3, 3)",
        "velocity": "of the origins, (bodies, 3) [m/s]",
        "angular_velocity": "ground axes, (bodies, 3) [rad/s]",
    }
    columns = zip(*results, strict=True)
    return [Output(name, np.stack(each), text) for (name, text), each in zip(meanings.items(), columns, strict=True)]


@dataclass(frozen=True)
class Kind:
    """What a name of a routine stands for."""

    make: Callable[[TreeTerms], list[Output]]
    inputs: tuple[str, ...]
    meaning: str
    is_force: bool = True  #: follows from the forces along the rates alone


MOTION = ("z", "z_dot", "z_ddot")
ROUTINES = {
    "inverse": Kind(inverse, MOTION, "Inverse dynamics: the forces that a motion needs"),
    "residual": Kind(residual, (*MOTION, "force"), "Residual of the equations of motion"),
    "mass": Kind(mass, ("z",), "Mass matrix"),
    "forward": Kind(forward, ("z", "z_dot", "force"), "Forward dynamics: accelerations under forces"),
    "kinematics": Kind(kinematics, ("z", "z_dot"), "Places and velocities of all bodies", is_force=False),
    "jacobian": Kind(derivatives, MOTION, "Derivatives of the forces of a motion"),
    "sensitivity": Kind(sensitivity, MOTION, "Derivatives of the forces of a motion by parameters"),
}
INPUTS = {
    "z": "positions [m, rad, 1]",
    "z_dot": "rates",
    "z_ddot": "rates of the rates",
    "force": "forces along the rates [N, N m]",
    "parameters": "numbers kept as symbols",
}


def routine_of(tree: TreeTerms, what: str, name: str) -> Routine:
    """Return a routine by one of the names in `ROUTINES`."""
    kind = ROUTINES[what]
    if kind.is_force:
        tree = carried_inwards(tree)
    before = tuple(tree.graph.asked)
    outputs = tuple(kind.make(tree))
    asked = (tree.graph.asked[0] - before[0], tree.graph.asked[1] - before[1])
    sizes = dict.fromkeys(INPUTS, len(tree.v)) | {"z": len(tree.x), "parameters": len(tree.parameters)}
    wanted = (*kind.inputs, *(("parameters",) if tree.parameters else ()))
    inputs = tuple((each, sizes[each], INPUTS[each]) for each in wanted)
    return Routine(name, inputs, outputs, tree.graph, kind.meaning, asked)
