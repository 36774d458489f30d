"""What public elements show of themselves in a page: `Element.drawn()` on their markers, arrows of their outputs."""

from dataclasses import replace

import numpy as np

from fe_models.foundation.words import nearest, quoted
from floatframe.compiling.markers import find_marker
from floatframe.elements.element import Element, markers_of
from floatframe.errors import ModelError
from floatframe.pictures.glyphs import SPRING_COLOR
from floatframe.results.element_motion import ElementMotion, element_motion
from floatframe.rotations import rotation_exp, rotation_matrix
from floatframe.shapes import Arrow, Drawn, Stretched
from floatframe.viewer.carriers import GROUND_CARRIER
from floatframe.viewer.cast import Between, Cast, Force, Placed
from floatframe.viewer.connections import distance

__all__ = ["elements_cast"]


def elements_cast(cast: Cast) -> None:
    """Add what the elements of a system show of themselves."""
    system = cast.carriers.system
    for element in () if system is None else system.elements:
        element_cast(cast, element)


def element_cast(cast: Cast, element: Element) -> None:
    """Add what an element shows of itself."""
    carriers, where = cast.carriers, f"element {element.name!r}"
    system, shown = carriers.system, tuple(element.drawn())
    if system is None or not shown:
        return
    markers = markers_of(element)
    ends = [carriers.of_marker(marker, find_marker(system, where, marker)) for marker in markers]
    motion = None
    for each in shown:
        require_markers(where, each, len(ends))
        if isinstance(each, Drawn):
            carrier = GROUND_CARRIER if each.marker is None else ends[each.marker]
            pieces = [piece if piece.color else replace(piece, color=SPRING_COLOR) for piece in each.shape.pieces()]
            kind = "scene" if each.marker is None else "body"
            cast.placed += [Placed(piece, carrier, kind) for piece in pieces]
        elif isinstance(each, Stretched):
            a, b = ends[each.first], ends[each.second]
            length = distance(cast, a, b)
            if length > 0:
                cast.between.append(Between(each.pieces(length), a, b))
        else:
            motion = element_motion(system, carriers.trajectory, element.name) if motion is None else motion
            cast.forces.append(element_force(cast, element.name, each, ends[each.marker], motion))


def require_markers(where: str, shown: Drawn | Stretched | Arrow, n: int) -> None:
    """Raise `ModelError` unless an element shows itself at markers it has."""
    if not isinstance(shown, Drawn | Stretched | Arrow):
        raise ModelError(f"{where}: drawn: expected Drawn, Stretched or Arrow, got {shown!r}")
    numbers = (shown.first, shown.second) if isinstance(shown, Stretched) else (shown.marker,)
    wrong = [number for number in numbers if number is not None and not 0 <= number < n]
    if wrong:
        raise ModelError(f"{where}: drawn: marker {wrong[0]}: expected 0 to {n - 1}, the numbers of its markers")


def element_force(cast: Cast, name: str, arrow: Arrow, carrier: int, motion: ElementMotion) -> Force:
    """Return an arrow of three outputs of an element."""
    rows, trajectory = cast.carriers.rows, cast.carriers.trajectory
    missing = [each for each in (*arrow.outputs, *(arrow.at or ())) if each not in motion.outputs]
    if missing:
        hint = nearest(missing[0], list(motion.outputs))
        raise ModelError(f"element {name!r}: drawn: there is no output {quoted(missing[0])}{hint}")
    values = np.stack([motion.outputs[each][rows] for each in arrow.outputs], axis=1)
    if arrow.is_in_marker_axes:
        found = cast.carriers.found[carrier]
        axes = np.broadcast_to(found.axes, (len(rows), 3, 3))
        if found.motion is not None:
            axes = rotation_exp(found.motion[:, 3:]) @ axes
        if found.body >= 0:
            axes = rotation_matrix(trajectory.body(trajectory.body_names[found.body]).p[rows]) @ axes
        values = np.einsum("tab,tb->ta", axes, values)
    at = None if arrow.at is None else np.stack([motion.outputs[each][rows] for each in arrow.at], axis=1)
    return Force(name, values, carrier, arrow.color, at, is_of_element=True)
