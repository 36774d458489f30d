"""What public elements show of themselves in a page: `Element.drawn()` on their markers, arrows of their outputs."""

import numpy as np

from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.markers import find_marker
from floatframe.errors import ModelError
from floatframe.model.elements.element import Element, markers_of
from floatframe.model.rotations import rotation_exp, rotation_matrix
from floatframe.model.shapes import Arrow, Drawn, Plane, Stretched
from floatframe.pictures.element_looks import drawn_pieces, shown_of
from floatframe.pictures.viewer.carriers import GROUND_CARRIER
from floatframe.pictures.viewer.cast import Between, Cast, Force, Placed
from floatframe.pictures.viewer.connections import distance
from floatframe.results.element_motion import ElementMotion, element_motion

__all__ = ["elements_cast"]


def elements_cast(cast: Cast) -> None:
    """Add what the elements of a system show of themselves."""
    system = cast.carriers.system
    for element in () if system is None else system.elements:
        element_cast(cast, element)


def element_cast(cast: Cast, element: Element) -> None:
    """Add what an element shows of itself."""
    carriers, where = cast.carriers, f"element {element.name!r}"
    system = carriers.system
    shown = () if system is None else shown_of(system, element)
    if system is None or not shown:
        return
    ends = [carriers.of_marker(marker, find_marker(system, where, marker)) for marker in markers_of(element)]
    motion = None
    for each in shown:
        if isinstance(each, Drawn):
            carrier = GROUND_CARRIER if each.marker is None else ends[each.marker]
            drawn_cast(cast, each, carrier, system.units.length)
        elif isinstance(each, Stretched):
            a, b = ends[each.first], ends[each.second]
            length = distance(cast, a, b)
            if length > 0:
                cast.between.append(Between(each.pieces(length), a, b))
        else:
            motion = element_motion(system, carriers.trajectory, element.name) if motion is None else motion
            cast.forces.append(element_force(cast, element.name, each, ends[each.marker], motion))


def drawn_cast(cast: Cast, drawn: Drawn, carrier: int, metres: float) -> None:
    """Add a shape on a carrier; one that stands on the ground once, though several elements show it."""
    found = cast.carriers.found[carrier]
    if found.body < 0 and isinstance(drawn.shape.geometry, Plane):
        cast.add_plane(drawn.shape.geometry, found.position + found.axes @ drawn.shape.position, found.axes)
    for piece in drawn_pieces(drawn, metres):
        if found.body < 0:
            key = (carrier, piece.color, piece.nodes.tobytes())
            if key not in cast.on_ground:
                cast.on_ground.add(key)
                cast.placed.append(Placed(piece, carrier, "scene"))
        else:
            cast.placed.append(Placed(piece, carrier, "body"))


def element_force(cast: Cast, name: str, arrow: Arrow, carrier: int, motion: ElementMotion) -> Force:
    """Return an arrow of three outputs of an element."""
    rows, trajectory = cast.carriers.rows, cast.carriers.trajectory
    missing = [each for each in (*(arrow.outputs or ()), *(arrow.at or ())) if each not in motion.outputs]
    if missing:
        hint = nearest(missing[0], list(motion.outputs))
        raise ModelError(f"element {name!r}: drawn: there is no output {quoted(missing[0])}{hint}")
    if arrow.outputs is None:
        values = motion.wrench[rows, arrow.marker, :3]
    else:
        values = np.stack([motion.outputs[each][rows] for each in arrow.outputs], axis=1)
    if arrow.is_in_marker_axes and arrow.outputs is not None:
        found = cast.carriers.found[carrier]
        axes = np.broadcast_to(found.axes, (len(rows), 3, 3))
        if found.motion is not None:
            axes = rotation_exp(found.motion[:, 3:]) @ axes
        if found.body >= 0:
            axes = rotation_matrix(trajectory.body(trajectory.body_names[found.body]).p[rows]) @ axes
        values = np.einsum("tab,tb->ta", axes, values)
    at = None if arrow.at is None else np.stack([motion.outputs[each][rows] for each in arrow.at], axis=1)
    return Force(name, values, carrier, arrow.color, at, is_of_element=True)
