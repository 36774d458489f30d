"""Faces selected by properties: "cylinder r=12 hole", "plane x=100", "x=0..20 z=0..5", "colour=#ff0000", "face 7".

A selector is a list of conditions that a face must all fulfil:

==========================  ===========================================================================================
condition                   faces
==========================  ===========================================================================================
plane, cylinder, ...        faces of that kind (`FACE_KINDS`)
r=12, d=24                  cylinders and spheres of that radius or diameter
hole, outside               round faces with the material outside, or inside
axis=z, axis=1,1,0          cylinders along this direction or opposite to it
normal=-z, normal=0,0,1     planes with this outward normal
x=10                        planes at this coordinate, cylinders whose axis and spheres whose centre is there
x=0..10                     faces that lie completely in this range
colour=#ff0000              faces with that colour in the file; their names are lost in the reader of gmsh
near=0,0,5                  of the faces that meet all other conditions, the one with the nearest centroid
face 7                      number 7 in the list of faces
box                         no condition; the word may introduce ranges
==========================  ===========================================================================================
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from fe_models.errors import InterfaceError
from fe_models.files.cad.cad_faces import FACE_KINDS, CadFace
from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted

__all__ = ["KEYS", "chosen_faces", "face_words"]

RADIUS = 1e-4  #: relative difference of radii up to which they are equal
PLACE = 1e-5  #: difference of positions divided by the body size, up to which they are equal
ANGLE = 1e-4  #: angle between directions up to which they are equal [rad]
KEYS = ("r", "d", "axis", "normal", "x", "y", "z", "colour", "color", "near", "face")
WORDS = (*FACE_KINDS, "hole", "outside", "box", "face", *(f"{key}=" for key in KEYS if key != "face"))
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}

Test = Callable[[CadFace], bool]


@dataclass(frozen=True)
class _Selector:
    """Conditions that a face must all fulfil, and the point to which it must be closest."""

    tests: tuple[Test, ...]
    near: Array | None


def chosen_faces(text: str, faces: Sequence[CadFace]) -> list[CadFace]:
    """Return the outer faces of the body that a selector chooses, by ascending number.

    Raises
    ------
    InterfaceError
        If a word is unknown, a number is invalid, or no face meets all conditions; the message lists the faces of the
        body.
    """
    outer = [face for face in faces if not face.is_inner]
    size = float(np.linalg.norm(np.ptp([[*face.lo, *face.hi] for face in outer], axis=0))) if outer else 1.0
    selector = _parsed(text, PLACE * size)
    found = [face for face in outer if all(test(face) for test in selector.tests)]
    if not found:
        raise InterfaceError(f"faces {quoted(text)}: no face of the body is such; it has {_there_is(text, outer)}")
    if selector.near is not None:
        distances = [float(np.linalg.norm(face.centre - selector.near)) for face in found]
        found = [found[int(np.argmin(distances))]]
    return found


def face_words(face: CadFace) -> str:
    """Return a description of a face in the form of a selector: "cylinder r=12 hole"."""
    words = [face.kind]
    if face.radius is not None:
        words.append(f"r={face.radius:.6g}")
    if face.is_hole is not None:
        words.append("hole" if face.is_hole else "outside")
    return " ".join(words)


def _there_is(text: str, faces: Sequence[CadFace]) -> str:
    """List the existing faces of the named kinds, or of all kinds, each description once."""
    kinds = [kind for kind in FACE_KINDS if kind in text.lower().split()]
    named = [face for face in faces if not kinds or face.kind in kinds]
    if not named:
        named = list(faces)
    sorts: dict[str, int] = {}
    for face in named:
        words = face_words(face)
        if face.normal is not None:
            k = int(np.abs(face.normal).argmax())
            if abs(face.normal[k]) > 1 - ANGLE**2:
                words += f" normal={'-' if face.normal[k] < 0 else ''}{'xyz'[k]} {'xyz'[k]}={face.centre[k]:.6g}"
        sorts[words] = sorts.get(words, 0) + 1
    shown = [f"{words}{f' ({count} faces)' if count > 1 else ''}" for words, count in sorts.items()]
    return ", ".join(shown[:12]) + (f" and {len(shown) - 12} more sorts" if len(shown) > 12 else "")


def _parsed(text: str, slack: float) -> _Selector:
    words = re.sub(r"\s*=\s*", "=", text.strip()).split()
    if not words:
        raise InterfaceError('faces "": expected a selector, such as "cylinder r=12" or "plane x=0"')
    tests: list[Test] = []
    near = None
    k = 0
    while k < len(words):
        word = words[k]
        key, is_pair, value = word.partition("=")
        key = key.lower()
        if key == "face":
            value = value or (words[k + 1] if k + 1 < len(words) else "")
            k += 0 if is_pair else 1
            tests.append(_is_number(text, value))
        elif is_pair and key == "near":
            near = np.array(_numbers(text, word, value, 3))
        elif is_pair and key == "name":
            raise InterfaceError(
                f"faces {quoted(text)}: {quoted(word)}: no reader of CAD files gives the names of faces; "
                "take a colour, a kind or a place, as cms faces lists them"
            )
        elif is_pair and key in KEYS:
            tests.append(_condition(text, word, key, value, slack))
        elif not is_pair and key in FACE_KINDS:
            tests.append(partial(_is_kind, key))
        elif not is_pair and key in ("hole", "outside"):
            tests.append(partial(_is_hole, key == "hole"))
        elif not is_pair and key == "box":
            pass
        else:
            raise InterfaceError(f"faces {quoted(text)}: unknown word {quoted(word)}{nearest(word, WORDS)}")
        k += 1
    if not tests and near is None:
        raise InterfaceError(f'faces {quoted(text)}: expected a condition beside "box", such as x=0..10 y=0..10 z=0..2')
    return _Selector(tuple(tests), near)


def _is_kind(kind: str, face: CadFace) -> bool:
    return face.kind == kind


def _is_hole(hole: bool, face: CadFace) -> bool:
    return face.is_hole is hole


def _is_number(text: str, value: str) -> Test:
    if not value.isdigit():
        raise InterfaceError(f"faces {quoted(text)}: expected the number of a face, as in face 7, got {quoted(value)}")
    number = int(value)
    return lambda face: face.number == number


def _condition(text: str, word: str, key: str, value: str, slack: float) -> Test:
    """Return the test that a pair key=value describes."""
    if key in ("colour", "color"):
        wanted = value.lower()
        if not re.fullmatch(r"#[0-9a-f]{6}", wanted):
            raise InterfaceError(f"faces {quoted(text)}: {word}: expected a colour such as #ff0000")
        return lambda face: face.colour == wanted
    if key in ("r", "d"):
        (number,) = _numbers(text, word, value, 1)
        radius = number if key == "r" else number / 2
        if not radius > 0:
            raise InterfaceError(f"faces {quoted(text)}: {word}: expected a length above zero")
        return lambda face: face.radius is not None and abs(face.radius - radius) <= RADIUS * radius
    if key in ("axis", "normal"):
        direction = _direction(text, word, value)
        if key == "axis":
            return lambda face: face.axis is not None and bool(np.linalg.norm(np.cross(face.axis, direction)) < ANGLE)
        return lambda face: face.normal is not None and bool(np.linalg.norm(face.normal - direction) < ANGLE)
    axis = "xyz".index(key)
    if ".." in value:
        low, _, high = value.partition("..")
        lo, hi = _numbers(text, word, low, 1)[0], _numbers(text, word, high, 1)[0]
        if lo > hi:
            raise InterfaceError(f"faces {quoted(text)}: {word}: expected a range from less to more")
        return lambda face: bool(face.lo[axis] >= lo - slack and face.hi[axis] <= hi + slack)
    (place,) = _numbers(text, word, value, 1)
    return lambda face: _lies_at(face, axis, place, slack)


def _lies_at(face: CadFace, axis: int, place: float, slack: float) -> bool:
    """Return whether a flat face, or the axis or centre of a round face, has this coordinate."""
    if face.point is not None:
        along = 0.0 if face.axis is None else abs(float(face.axis[axis]))
        return along < ANGLE and abs(float(face.point[axis]) - place) <= slack
    return max(abs(float(face.lo[axis]) - place), abs(float(face.hi[axis]) - place)) <= slack


def _direction(text: str, word: str, value: str) -> Array:
    sense = -1.0 if value.startswith("-") else 1.0
    letter = value.lstrip("+-").lower()
    vector = sense * np.array(AXES[letter]) if letter in AXES else np.array(_numbers(text, word, value, 3))
    length = float(np.linalg.norm(vector))
    if length == 0:
        raise InterfaceError(f"faces {quoted(text)}: {word}: expected a direction, got the zero vector")
    return np.asarray(vector / length)


def _numbers(text: str, word: str, value: str, count: int) -> list[float]:
    try:
        numbers = [float(part) for part in value.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count or not np.isfinite(numbers).all():
        expected = "a number" if count == 1 else f"{count} numbers with commas between, as 0,0,1"
        raise InterfaceError(f"faces {quoted(text)}: {quoted(word)}: expected {expected}")
    return numbers
