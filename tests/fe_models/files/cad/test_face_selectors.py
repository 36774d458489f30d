import numpy as np
import pytest

from fe_models.errors import InterfaceError
from fe_models.files.cad.cad_faces import CadFace
from fe_models.files.cad.face_selectors import chosen_faces


def plane(number, normal, at, half, **more):
    normal, at, half = (np.array(x, dtype=float) for x in (normal, at, half))
    return CadFace(number, number, "plane", 1.0, at, at - half, at + half, normal=normal, **more)


def cylinder(number, radius, point, hole=True, axis=(0, 0, 1)):
    axis, point = np.array(axis, dtype=float), np.array(point, dtype=float)
    half = radius * (1 - np.abs(axis)) + 5 * np.abs(axis)
    return CadFace(
        number, number, "cylinder", 2.0, point, point - half, point + half,
        radius=radius, axis=axis, point=point, is_hole=hole,
    )  # fmt: skip


FACES = (
    plane(1, (-1, 0, 0), (0, 20, 5), (0, 20, 5)),
    plane(2, (1, 0, 0), (100, 20, 5), (0, 20, 5), colour="#ff0000"),
    plane(3, (0, 0, 1), (50, 20, 10), (50, 20, 0)),
    cylinder(4, 6, (20, 20, 5)),
    cylinder(5, 6, (80, 20, 5)),
    cylinder(6, 12, (50, 20, 15), hole=False),
    cylinder(7, 6, (50, 20, 5), axis=(0, 1, 0)),
    plane(8, (1, 0, 0), (40, 20, 5), (0, 20, 5), solids=(1, 2)),
)

CHOSEN = [
    ("cylinder r=6", [4, 5, 7]),
    ("cylinder d = 12", [4, 5, 7]),
    ("cylinder r=6 axis=z", [4, 5]),
    ("cylinder r=6 axis=0,-2,0", [7]),
    ("cylinder hole x=20", [4]),
    ("cylinder outside", [6]),
    ("plane", [1, 2, 3]),
    ("plane x=100", [2]),
    ("plane normal=x", [2]),
    ("plane normal=-x", [1]),
    ("normal=0,0,3", [3]),
    ("box x=0..30 y=0..40 z=0..10", [1, 4]),
    ("colour=#FF0000", [2]),
    ("face 3", [3]),
    ("face=3", [3]),
    ("cylinder near=75,0,0", [5]),
    ("near=0,0,0", [1]),
]


@pytest.mark.parametrize(("text", "numbers"), CHOSEN)
def test_faces_are_chosen_by_what_they_are(text, numbers):
    assert [face.number for face in chosen_faces(text, FACES)] == numbers


WRONG = [
    ("", 'expected a selector, such as "cylinder r=12"'),
    ("name=flange", "no reader of CAD files gives the names of faces"),
    ("cilinder r=12", "unknown word 'cilinder'; did you mean 'cylinder'?"),
    ("cylinder r=7", r"no face of the body is such; it has cylinder r=6 hole \(3 faces\), cylinder r=12 outside"),
    ("plane x=7", "it has plane normal=-x x=0, plane normal=x x=100, plane normal=z z=10"),
    ("cylinder r=x", "'r=x': expected a number"),
    ("cylinder r=0", "expected a length above zero"),
    ("plane normal=0,1", "expected 3 numbers with commas between"),
    ("plane normal=0,0,0", "got the zero vector"),
    ("box", 'expected a condition beside "box"'),
    ("x=5..1", "expected a range from less to more"),
    ("face", "expected the number of a face"),
    ("face 99", "no face of the body is such"),
    ("face 8", "no face of the body is such"),
    ("colour=red", "expected a colour such as #ff0000"),
    ("x=nan", "expected a number"),
]


@pytest.mark.parametrize(("text", "words"), WRONG)
def test_what_cannot_be_meant_is_refused_with_what_there_is(text, words):
    with pytest.raises(InterfaceError, match=words):
        chosen_faces(text, FACES)
