"""Element types of Abaqus and CalculiX: integration rules of each program, and elements at points."""

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.abaqus.blocks import DeckBlock
from fe_models.files.abaqus.draft import Draft, PointElements
from fe_models.foundation.arrays import IntArray

__all__ = ["PLANE", "SOLID_RULES", "faces_of", "read_element"]

#: program -> type -> integration of the stiffness, mass, difference from the program (empty: none)
SOLID_RULES: dict[str, dict[str, tuple[str, str, str]]] = {
    "calculix": {
        "C3D4": ("reduced", "reduced", ""),
        "C3D6": ("reduced", "reduced", ""),
        "C3D8": ("full", "consistent", ""),
        "C3D8I": ("incompatible", "consistent", ""),
        "C3D8R": ("incompatible", "consistent", "stiffness by incompatible modes instead of one point and hourglasses"),
        "C3D10": ("reduced", "reduced", ""),
        "C3D15": ("reduced", "reduced", ""),
        "C3D20": ("full", "consistent", ""),
        "C3D20R": ("reduced", "reduced", ""),
    },
    "abaqus": {
        "C3D4": ("full", "lumped", ""),
        "C3D5": ("full", "lumped", ""),
        "C3D6": ("full", "lumped", ""),
        "C3D8": ("incompatible", "lumped", "stiffness by incompatible modes instead of selective integration"),
        "C3D8I": ("incompatible", "lumped", ""),
        "C3D8R": ("incompatible", "lumped", "stiffness by incompatible modes instead of one point and hourglasses"),
        "C3D10": ("reduced", "consistent", ""),
        "C3D15": ("full", "consistent", ""),
        "C3D20": ("full", "consistent", ""),
        "C3D20R": ("reduced", "consistent", ""),
    },
}
PLANE = ("CPS", "CPE", "CAX", "SAX", "MAX", "M3D", "DC", "F3D", "F2D", "AC", "D", "COH", "GK", "R3D", "SFM3D")
_POINTS = {"MASS": 1, "ROTARYI": 1, "SPRINGA": 2, "SPRING1": 1, "SPRING2": 2, "DASHPOTA": 2, "DASHPOT1": 1}
_POINTS |= {"DASHPOT2": 2, "DCOUP3D": 1}
_QUADS: dict[int, tuple[int, ...]] = {
    1: (0, 1, 2, 3),
    2: (4, 7, 6, 5),
    3: (0, 4, 5, 1),
    4: (1, 5, 6, 2),
    5: (2, 6, 7, 3),
    6: (3, 7, 4, 0),
}
_TETS: dict[int, tuple[int, ...]] = {1: (0, 1, 2), 2: (0, 3, 1), 3: (1, 3, 2), 4: (2, 3, 0)}
_WEDGES: dict[int, tuple[int, ...]] = {1: (0, 1, 2), 2: (3, 5, 4), 3: (0, 3, 4, 1), 4: (1, 4, 5, 2), 5: (2, 5, 3, 0)}
_PYRAMIDS: dict[int, tuple[int, ...]] = {1: (0, 1, 2, 3), 2: (0, 4, 1), 3: (1, 4, 2), 4: (2, 4, 3), 5: (3, 4, 0)}
_FACES: dict[str, dict[int, tuple[int, ...]]] = {
    "hexa": _QUADS,
    "tetr": _TETS,
    "wedg": _WEDGES,
    "pyra": _PYRAMIDS,
}  #: local corner nodes of each face, by the first letters of the element kind


def read_element(here: str, block: DeckBlock, draft: Draft) -> None:
    """Read elements at points (masses, springs); elements of the mesh have been read before."""
    name = block.parameters["TYPE"].upper()
    if name in _POINTS:
        n = _POINTS[name]
        words = [int(word) for word in block.tokens]
        if len(words) % (n + 1):
            raise MeshError(f"{here}: {name} elements have {n} nodes: expected a multiple of {n + 1} numbers below")
        rows = np.array(words, dtype=np.int64).reshape(-1, n + 1).tolist()
        key = block.parameters.get("ELSET", "").upper()
        if draft.points.setdefault(key, PointElements(name)).kind != name:
            key = f"{key} {name}"  # not the name of a set: these elements are found by their numbers
        draft.points.setdefault(key, PointElements(name)).rows.update({row[0]: tuple(row[1:]) for row in rows})
    elif name in draft.mesh.ignored:
        draft.ledger.refuse(name, "this element is not known here", count=len(block.lines), line=block.line_number)


def faces_of(draft: Draft, elements: IntArray, face: int) -> dict[str, IntArray]:
    """Return rows of corner nodes, by "triangle" and "quad", for face number `face` of these solid cells."""
    found: dict[str, list[IntArray]] = {}
    for _, kind, table in draft.mesh.elements:
        local = _FACES.get(kind[:4], {}).get(face)
        mine = table[np.isin(table[:, 0], elements)]
        if local is not None and len(mine):
            rows = draft.mesh.rows_of(mine[:, 1:][:, list(local)])
            found.setdefault({3: "triangle", 4: "quad"}[len(local)], []).append(rows)
    return {kind: np.concatenate(rows) for kind, rows in found.items()}
