"""Linear joint forces as terms: Q = -k (x - x_0) - c x_dot + preload along a coordinate x of a joint.

They act like gravity: a motion requires the external forces M z_ddot + h - Q, and accelerations follow from the given
forces plus Q. Angles of springs are counted from the free angle without limit, not within half a turn.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fe_models.foundation.words import nearest, quoted
from floatframe.design.generation.graph import Terms
from floatframe.design.generation.links import JointSpring, TreeTerms, tree_terms
from floatframe.engine.tree.recursive import RelativeModel, relative_model
from floatframe.errors import ModelError
from floatframe.model.forces import Gravity, JointForce
from floatframe.model.system import System

__all__ = ["model_terms", "spring_forces"]

LINEAR = "gravity, or joint forces with only stiffness, damping and preload"
REMEDY = "remove it, and include its forces along the rates in the input force"


def model_terms(system: System, parameters: Sequence[str] = ()) -> tuple[RelativeModel, TreeTerms]:
    """Return the recursive model of a system without joint forces, and the terms of its tree, which include them.

    Raises
    ------
    ModelError
        If a force is neither gravity nor a linear joint force, the rest is not a tree of bodies, or a parameter does
        not exist.
    """
    forces = [each for each in system.forces if not isinstance(each, Gravity)]
    for force in forces:
        if (got := what_is_not_linear(force)) is not None:
            raise ModelError(f"generate: force {quoted(force.name)}: expected {LINEAR}, got {got}; {REMEDY}")
    model = relative_model(replace(system, forces=[each for each in system.forces if isinstance(each, Gravity)]))
    tree = tree_terms(model.expansion, parameters)
    return model, replace(tree, springs=tuple(spring_of(each, model) for each in forces))  # type: ignore[arg-type]


def what_is_not_linear(force: object) -> str | None:
    """Return the reason why a force is not a linear joint force, as text; None if it is one."""
    if not isinstance(force, JointForce):
        return f"a {type(force).__name__}"
    parts = {
        "a motor": force.motor is not None,
        "a characteristic": force.characteristic is not None,
        "friction": force.friction > 0 or force.friction_coefficient > 0,
    }
    return next((f"one with {name}" for name, has in parts.items() if has), None)


def spring_of(force: JointForce, model: RelativeModel) -> JointSpring:
    """Return a linear joint force with the indices of its coordinate."""
    name = f"{force.joint}/{force.coordinate}"
    both = [each for each in model.names if each in model.rate_names]
    if name not in both:
        raise ModelError(
            f"generate: force {quoted(force.name)}: expected one of the coordinates of the tree, got {quoted(name)}"
            f"{nearest(name, both)}"
        )
    place = model.names.index(name), model.rate_names.index(name)
    return JointSpring(*place, force.stiffness, force.free, force.damping, force.preload)


def spring_forces(tree: TreeTerms) -> Terms:
    """Return the linear joint forces along all rates, (n,)."""
    force = np.full(len(tree.v), tree.graph.zero, dtype=object)
    for each in tree.springs:
        stretch = tree.x[each.position] - each.free
        held = each.preload - each.stiffness * stretch - each.damping * tree.v[each.rate]
        force[each.rate] = force[each.rate] + held
    return force
