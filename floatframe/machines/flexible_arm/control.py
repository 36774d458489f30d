"""Controllers of the arm as user forces, with the generated equations of the rigid arm as expressions.

Computed torque: the inverse dynamics of the rigid arm at the measured angles and rates, for accelerations

    a = phi_aim'' + 2 w (phi_aim' - phi_dot) + w² (phi_aim - phi)

which is exact for a rigid arm. Following an optimal move: the torques of the move, plus the same feedback times the
mass matrix of the rigid arm. Both controllers use only angles and rates of the hinges, and are limited to the largest
torques of the motors.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from floatframe.design.generation.graph import ADD, CONSTANT, COS, DIV, MUL, NEG, SIN, SUB, SYMBOL, Scalar, Terms, terms
from floatframe.design.generation.links import tree_terms
from floatframe.design.generation.recursions import Recursion, inverse_dynamics
from floatframe.engine.tree.recursive import relative_model
from floatframe.errors import ModelError
from floatframe.machines.flexible_arm.collocation import OptimalMove
from floatframe.model.forces import UserForce
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.system import System

__all__ = ["computed_torque", "following", "rate_of"]

SIGNS = {ADD: "+", SUB: "-", MUL: "*", DIV: "/"}


def rate_of(function: TimeFunction) -> TimeFunction:
    """Return the derivative of a piecewise polynomial function; `ModelError` if it contains a sine."""
    if function.pieces[:, 6].any():
        raise ModelError("rate_of: expected a function of polynomials, got one with a sine")
    pieces = np.zeros_like(function.pieces)
    pieces[:, :5] = function.pieces[:, 1:6] * np.arange(1, 6)
    return TimeFunction(function.begins, pieces)


def expression(term: Scalar, names: Mapping[str, str]) -> str:
    """Return a term as an expression of a user force; `names` are those of its symbols."""
    if term.kind == CONSTANT:
        return f"({term.value!r})"
    if term.kind == SYMBOL:
        return names[term.name]
    args = [expression(arg, names) for arg in term.args]
    if term.kind in (SIN, COS):
        return f"{'sin' if term.kind == SIN else 'cos'}({args[0]})"
    return f"(-{args[0]})" if term.kind == NEG else f"({args[0]} {SIGNS[term.kind]} {args[1]})"


def rigid_torques(rigid: System, accelerations: Mapping[str, str], *, is_turning: bool) -> dict[str, str]:
    """Return the torques of the rigid arm for given accelerations, by hinge, as expressions of angles and rates.

    `is_turning`: whether to include the rates; without them, the torques are M a.
    """
    model = relative_model(rigid)
    if any(not name.endswith("/angle") for name in model.names):
        raise ModelError(f"rigid: expected a tree of rigid bodies on hinges, got {', '.join(model.names)}")
    joints = [name.split("/")[0] for name in model.names]
    if set(joints) != set(accelerations):
        raise ModelError(f"rigid: expected its hinges {', '.join(joints)}, got {', '.join(accelerations)}")
    tree = tree_terms(model.expansion)
    rates: Terms = tree.v if is_turning else terms(tree.graph, np.zeros(len(tree.v)))
    names: dict[str, str] = {}
    for k, joint in enumerate(joints):
        names |= {f"z[{k}]": joint, f"z_dot[{k}]": f"{joint}_dot", f"z_ddot[{k}]": f"({accelerations[joint]})"}
    force = inverse_dynamics(Recursion(tree), rates, tree.a)
    return {joint: expression(term, names) for joint, term in zip(joints, force, strict=True)}


def limited(torque: str, largest: float) -> str:
    """Return an expression that limits a torque to both signs of the largest value."""
    return f"max(-{largest!r}, min({largest!r}, {torque}))"


def user_force(name: str, torques: Mapping[str, str], functions: Mapping[str, TimeFunction]) -> UserForce:
    """Return torques at hinges as a user force that reads their angles and rates."""
    angles = {joint: f"{joint}.angle" for joint in torques}
    return UserForce(name, angles, forces=dict(torques), functions=dict(functions))


def computed_torque(
    rigid: System, aims: Mapping[str, TimeFunction], bandwidth: float, torque: Sequence[float]
) -> UserForce:
    """Return the computed-torque control of the arm, based on its rigid model.

    Parameters
    ----------
    rigid
        The arm without modes.
    aims
        Desired angle of each hinge as a function of time, by its name.
    bandwidth
        Bandwidth w [rad/s].
    torque
        Largest torque of each motor, in the order of the aims [N m].
    """
    functions: dict[str, TimeFunction] = {}
    commands = {}
    for joint, aim in aims.items():
        parts = {f"{joint}_aim": aim, f"{joint}_aim_rate": rate_of(aim), f"{joint}_aim_rise": rate_of(rate_of(aim))}
        functions |= parts
        commands[joint] = f"{joint}_aim_rise(t) + {feedback(joint, bandwidth)}"
    torques = rigid_torques(rigid, commands, is_turning=True)
    limits = {joint: limited(torques[joint], float(most)) for joint, most in zip(aims, torque, strict=True)}
    return user_force("computed torque", limits, functions)


def feedback(joint: str, bandwidth: float) -> str:
    """Return the feedback acceleration that drives a hinge to its aim."""
    w = float(bandwidth)
    return f"{2 * w!r}*({joint}_aim_rate(t) - {joint}_dot) + {w * w!r}*({joint}_aim(t) - {joint})"


def following(rigid: System, move: OptimalMove, bandwidth: float, torque: Sequence[float]) -> UserForce:
    """Return the control that follows an optimal move: its torques plus feedback of the hinges times the rigid M.

    Parameters as for `computed_torque`.
    """
    functions: dict[str, TimeFunction] = {}
    commands = {}
    joints = [name.split("/")[0] for name in move.driven]
    for joint, name in zip(joints, move.driven, strict=True):
        aim = move.aim(name)
        functions |= {
            f"{joint}_aim": aim, f"{joint}_aim_rate": rate_of(aim), f"{joint}_torque": move.torque_function(name)
        }  # fmt: skip
        commands[joint] = feedback(joint, bandwidth)
    torques = rigid_torques(rigid, commands, is_turning=False)
    limits = {
        joint: limited(f"{joint}_torque(t) + {torques[joint]}", float(most))
        for joint, most in zip(joints, torque, strict=True)
    }
    return user_force("optimal move", limits, functions)
