"""Names of inputs and outputs on the command line."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from floatframe.analyses.linear.channels import AnyInput, AnyOutput
    from floatframe.model.system import System

__all__ = ["channel_of", "chosen"]

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")


def chosen(system: "System", texts: list[str], default: Any) -> Any:
    """Return the channels named on the command line, else those of the system."""
    return tuple(channel_of(system, text) for text in texts) if texts else tuple(default)


def channel_of(system: "System", text: str) -> "AnyInput | AnyOutput":
    """Return a channel by name: an input or output, "joint.coordinate" or "body/interface:component"."""
    import numpy as np

    from fe_models.foundation.words import nearest
    from floatframe.analyses.linear.channels import AnyInput, AnyOutput, Column, inputs_of, outputs_of
    from floatframe.errors import ModelError
    from floatframe.model.bodies.markers import Marker
    from floatframe.results.sensors import sensors_of
    from floatframe.results.sensors.channels import Channel, CoordinateChannel

    named: dict[str, AnyInput | AnyOutput] = {}
    for each in (*sensors_of(system), *outputs_of(system.outputs), *inputs_of(system.inputs)):
        named[each.name] = each
    if text in named:
        return named[text]
    owner, _, column = text.rpartition(".")
    if owner in named:
        return Column(named[owner], column)  # type: ignore[arg-type]
    if (driver := drivers(system).get(text)) is not None:
        return driver
    joint, _, coordinate = text.rpartition(".")
    coordinates = [f"{each.name}.{name}" for each in system.joints for name in each.coordinates]
    if text in coordinates:
        return CoordinateChannel(text, joint, coordinate)
    place, _, component = text.rpartition(":")
    body, _, interface = place.partition("/")
    if not body or component not in DIRECTIONS:
        hint = nearest(text, [*named, *coordinates, *drivers(system)]) if "/" not in text and ":" not in text else ""
        raise ModelError(
            f"channel {text!r}: expected a name of [inputs], [outputs] or [sensors], joint.coordinate, "
            "forces.NAME.amplitude, forces.NAME.motor, joints.NAME.COORDINATE (a drive), or "
            f"body/interface:component (interfaces only of flexible bodies) with one of {', '.join(DIRECTIONS)}{hint}"
        )
    index = DIRECTIONS.index(component)
    kind = "translation" if index < 3 else "rotation"
    return Channel(text, Marker(body, interface or None), np.eye(3)[index % 3], kind)


def drivers(system: "System") -> "dict[str, AnyInput]":
    """Return forces.NAME.amplitude, forces.NAME.motor and joints.NAME.COORDINATE (a drive), named as in [fmu]."""
    from floatframe.analyses import DriveMotion, ForceInput
    from floatframe.analyses.linear.force_inputs import forces_with_amplitude
    from floatframe.model.forces import JointForce

    found: dict[str, AnyInput] = {}
    for name, force in forces_with_amplitude(system).items():
        text = f"forces.{name}.{'motor' if isinstance(force, JointForce) else 'amplitude'}"
        found[text] = ForceInput(text, name)
    for joint in system.joints:
        for coordinate in getattr(joint, "motions", {}):
            text = f"joints.{joint.name}.{coordinate}"
            found[text] = DriveMotion(text, joint.name, coordinate)
    return found
