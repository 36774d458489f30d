"""Sections of Abaqus and CalculiX, masses and springs."""

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fe_models.files.abaqus.assembly import TURNED
from fe_models.files.abaqus.blocks import DeckBlock
from fe_models.files.abaqus.draft import GROUNDED, Draft, PointElements
from fe_models.files.abaqus.elements import PLANE, SOLID_RULES
from fe_models.files.abaqus.layups import layers_of_block
from fe_models.files.abaqus.materials import numbers, read_orientation, read_transform
from fe_models.files.abaqus.thickness import read_nodal_thickness
from fe_models.files.abaqus.uneven_box import uneven_box
from fe_models.files.decks.deck import (
    DeckMass,
    DeckSpring,
    LineSection,
    RodSection,
    ShellSection,
    SolidSection,
    as_triad,
    axes_along,
)
from fe_models.foundation.arrays import MOTION_COMPONENTS, IntArray

__all__ = ["ellipses_in_numbers", "read_section"]

_SHELLS = ("triangle", "triangle6", "quad", "quad8", "quad9")
_LINES = ("line", "line3")
#: first letters of elements -> why they are refused
_PLANAR = {
    "CPS": "plane stress along axes of its own (ORIENTATION)",
    "CPEG": "generalized plane strain: a body between planes that move",
    "CPE": "plane strain along axes of its own (ORIENTATION), or with other unknowns than displacements",
    "CAX": "axisymmetric: a body of revolution; mesh it in space",
}
#: plane elements that are membranes: plane stress, and plane strain by displacements alone
SHEETS = re.compile(r"CPS.*|CPE[34568](I|R|H|RH|IH|M|MH)?")
ALONG = 1e-9  #: component of a vector normal to a line divided by its length, below which it is along the line


def read_section(here: str, block: DeckBlock, draft: Draft) -> None:
    """Read one block with properties of elements or nodes."""
    makers = {
        "SOLID SECTION": _solid_section,
        "SHELL SECTION": _shell_section,
        "BEAM SECTION": _beam_section,
        "BEAM GENERAL SECTION": _beam_section,
        "MASS": _masses,
        "SPRING": _springs,
        "DASHPOT": _springs,
    }
    if block.keyword in makers:
        makers[block.keyword](here, block, draft)
    elif block.keyword == "TRANSFORM":
        read_transform(here, block, draft)
    elif block.keyword == "ORIENTATION":
        read_orientation(block, draft)
    elif block.keyword == "NODAL THICKNESS":
        read_nodal_thickness(here, block, draft)
    elif block.keyword == "NORMAL":
        draft.ledger.note("*NORMAL", "normals follow from the mesh", line=block.line_number)
    else:
        draft.ledger.refuse(f"*{block.keyword}", "not known here", line=block.line_number)
        if draft.points_of(block.parameters.get("ELSET", "")) is None and "ELSET" in block.parameters:  # told once
            draft.sectioned.append(draft.elements_of(here, block.parameters["ELSET"]))


def _of_set(here: str, block: DeckBlock, draft: Draft) -> tuple[str, dict[tuple[str, str], IntArray]]:
    """Return the element set of a section as written in the deck, and its elements by type."""
    word = block.parameters.get("ELSET", "")
    elements = draft.elements_of(here, word)
    draft.sectioned.append(elements)
    key = word.strip().upper() if word.strip().upper() in draft.mesh.element_sets else word.rpartition(".")[2].upper()
    return draft.mesh.spelling.get(f"ELSET {key}", word), draft.types_of(elements)


def _solid_section(here: str, block: DeckBlock, draft: Draft) -> None:
    name, types = _of_set(here, block, draft)
    material = _material_of(block, draft)
    rules: dict[tuple[str, str], list[IntArray]] = {}
    for (kind_name, kind), elements in types.items():
        if kind_name == "T3D2":
            _rods(name, block, draft, elements)
            continue
        if SHEETS.fullmatch(kind_name) and kind in _SHELLS and "ORIENTATION" not in block.parameters:
            _sheet(name, kind_name, block, draft, elements)
            continue
        rule = SOLID_RULES[draft.program].get(kind_name)
        if rule is None:
            is_plane = kind_name.startswith(PLANE)
            why = "no solid, shell or beam in space" if is_plane else "this element is not known here"
            why = next((text for start, text in _PLANAR.items() if kind_name.startswith(start)), why)
            draft.ledger.refuse(kind_name, why, count=len(elements), line=block.line_number)
            continue
        if rule[2]:
            draft.ledger.note(kind_name, rule[2], count=len(elements), line=block.line_number)
        rules.setdefault(_common_rule(rule), []).append(elements)
    for (integration, mass), parts in rules.items():
        own = name if len(rules) == 1 else f"{name}_{integration}_{mass}"
        orientation = block.parameters.get("ORIENTATION", "").strip('"')
        group = draft.cell_group(own, np.concatenate(parts))
        draft.solids.append(SolidSection(group, material, integration, mass, orientation))


def _sheet(name: str, kind: str, block: DeckBlock, draft: Draft, elements: IntArray) -> None:
    """Read plane elements as membranes of a planar body. The default thickness is 1."""
    thickness = (numbers(block.lines[0])[0] if block.lines else 0.0) or 1.0
    group = draft.cell_group(name if not draft.sheets else f"{name}_{kind}", elements)
    draft.sheets.append(group)
    draft.shells.append(ShellSection(group, _material_of(block, draft), thickness))
    why = "a membrane with rotations at its nodes; the body is planar, plane = 'xy'"
    if kind.startswith("CPE"):
        draft.strained.add(group)
        why += "; in plane strain, a slice: stress across the plane, nu (sx + sy), is not in its results"
    draft.ledger.note(kind, why, count=len(elements), line=block.line_number)


def _rods(name: str, block: DeckBlock, draft: Draft, elements: IntArray) -> None:
    """Read the area of trusses. The default is 1 in both programs."""
    area = numbers(block.lines[0])[0] if block.lines else 1.0
    draft.rods.append(RodSection(draft.cell_group(name, elements), _material_of(block, draft), area))


def _common_rule(rule: tuple[str, str, str]) -> tuple[str, str]:
    return rule[0], rule[1]


def _shell_section(here: str, block: DeckBlock, draft: Draft) -> None:
    name, types = _of_set(here, block, draft)
    kept = _known(draft, types, _SHELLS, "S", block)
    is_nodal = "NODAL THICKNESS" in block.parameters
    layers = layers_of_block(here, block) if "COMPOSITE" in block.parameters else ()
    thickness = 1.0 if is_nodal else sum(layer.thickness for layer in layers) or numbers(block.lines[0])[0]
    offset = block.parameters.get("OFFSET", "0").upper()
    share = {"SPOS": 0.5, "SNEG": -0.5}.get(offset)
    share = float(offset) if share is None else share
    if kept.size:
        # the reference surface lies share x thickness from the middle one, along the normal
        group = draft.cell_group(name, kept)
        made = ShellSection(
            group,
            "" if layers else _material_of(block, draft),
            thickness,
            -share * thickness + 0.0,
            layers=layers,
            orientation=block.parameters.get("ORIENTATION", "").strip('"'),
            added_mass=float(block.parameters.get("DENSITY", 0.0)),
        )
        draft.shells.append(made)
        if is_nodal:
            draft.nodal_shells.add(group)


def _beam_section(here: str, block: DeckBlock, draft: Draft) -> None:
    name, types = _of_set(here, block, draft)
    for unknown in [key for key in types if key[0].startswith("B") and not key[0].startswith(("B31", "B32", "B33"))]:
        why = "planar beams: they move in a plane alone"
        draft.ledger.refuse(unknown[0], why, count=len(types.pop(unknown)), line=block.line_number)
    slender = [elements for (kind_name, _), elements in types.items() if kind_name.startswith("B33")]
    kept = _known(draft, types, _LINES, "B", block)
    kind = block.parameters.get("SECTION", "").upper()
    size = numbers(block.lines[0])
    shapes: dict[str, Callable[[], dict[str, Any]]] = {
        "RECTANGULAR": lambda: {"shape": "rectangle", "width": size[0], "height": (size + size)[1]},
        "RECT": lambda: {"shape": "rectangle", "width": size[0], "height": (size + size)[1]},
        # Abaqus gives the radius, CalculiX the thickness in both directions
        "CIRC": lambda: {"shape": "circle", "radius": size[0] if draft.program == "abaqus" else size[0] / 2},
        "PIPE": lambda: {"shape": "tube", "radius": size[0], "thickness": size[1]},
        "BOX": lambda: {"shape": "box", "width": size[0], "height": size[1], "web": size[2], "flange": size[3]},
    }
    walls = tuple(size[2:6])
    uneven = uneven_box(size[0], size[1], walls) if _is_uneven(kind, walls) else None
    is_ellipse = kind == "CIRC" and draft.program == "calculix" and len(size) > 1 and size[1] not in (0.0, size[0])
    if is_ellipse:
        shapes["CIRC"] = lambda: {"shape": "ellipse", "width": size[0], "height": size[1]}
    offsets = [float(block.parameters.get(key, 0)) for key in ("OFFSET1", "OFFSET2")]
    if kind not in shapes or (_is_uneven(kind, walls) and uneven is None):
        why = "walls that differ both ways" if kind in shapes else "this shape is not known here"
        draft.ledger.refuse(f"*{block.keyword}, SECTION={kind}", why, count=len(kept))
        return
    n1 = numbers(block.lines[1])[:3] if len(block.lines) > 1 else [0.0, 0.0, -1.0]
    shape = shapes[kind]()
    scale = (shape["width"], shape["height"]) if "width" in shape else (2 * float(shape["radius"]),) * 2
    # as of shells, the nodes lie this far from the centroid
    offset = (-offsets[0] * float(scale[0]) + 0.0, -offsets[1] * float(scale[1]) + 0.0)
    if uneven is not None:
        shape, offset = uneven.shape, (offset[0] + uneven.centroid[0], offset[1] + uneven.centroid[1])
    # Euler-Bernoulli beams (B33) are separate from the others, and so are beams with an orientation node; the groups do
    # not depend on the program for which the deck is read
    is_slender = np.isin(kept, np.concatenate(slender)) if slender else np.zeros(len(kept), dtype=bool)
    parts: dict[tuple[bool, tuple[float, float, float]], list[int]] = {}
    for element, has_no_shear in zip(kept.tolist(), is_slender.tolist(), strict=True):
        parts.setdefault((has_no_shear, _first_axis(draft, element, (n1[0], n1[1], n1[2]))), []).append(element)
    for k, ((has_no_shear, axis), elements) in enumerate(parts.items(), start=1):
        own = name if len(parts) == 1 else f"{name}_{k}"
        group = draft.cell_group(own, np.array(elements))
        axis = axis if draft.program == "abaqus" else (n1[0], n1[1], n1[2])
        line = LineSection(group, _material_of(block, draft), shape, axis, offset, shear=not has_no_shear)
        draft.lines.append(line)


def _first_axis(draft: Draft, element: int, given: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return axis n1 of a beam: from its first node to its orientation node, or as given in the section."""
    if element not in draft.mesh.orienting:
        return given
    row = next(row for _, _, table in draft.mesh.elements for row in table[table[:, 0] == element])
    first, other = draft.mesh.coordinates[draft.mesh.rows_of(np.array([row[1], draft.mesh.orienting[element]]))]
    x, y, z = (float(value) for value in np.round(other - first, 12))
    return x, y, z


def _is_uneven(kind: str, walls: tuple[float, ...]) -> bool:
    """Return whether a box has four walls of which opposite ones differ."""
    return kind == "BOX" and len(walls) == 4 and (walls[0] != walls[2] or walls[1] != walls[3])


def ellipses_in_numbers(draft: Draft) -> None:
    """Set area, second moments, torsion constant and Cowper's (1966) shear areas of ellipses.

    The half axis a is along the force, b normal to it: kappa = 12 (1 + nu) a² (3 a² + b²) / ((40 + 37 nu) a⁴ +
    (16 + 10 nu) a² b² + nu b⁴). For a = b, this is the value of the circle; for b -> 0 and nu = 0 it is 9/10, as from
    the energy of the shear flow.
    """
    for k, line in enumerate(draft.lines):
        if line.shape["shape"] != "ellipse":
            continue
        nu = next((m.poisson for name, m in draft.materials.items() if name.upper() == line.material.upper()), None)
        if not isinstance(nu, float):
            draft.ledger.refuse("*BEAM SECTION, SECTION=CIRC", "an ellipse without Poisson's ratio")
            continue
        a, b = float(str(line.shape["width"])) / 2, float(str(line.shape["height"])) / 2
        area, angle = np.pi * a * b, np.linspace(0, 2 * np.pi, 16, endpoint=False)
        shape = {
            "shape": "general",
            "area": area,
            "iy": area * b**2 / 4,
            "iz": area * a**2 / 4,
            "torsion": area * a**2 * b**2 / (a**2 + b**2),
            "shear_area_y": _cowper(a, b, nu) * area,
            "shear_area_z": _cowper(b, a, nu) * area,
            "outline": [[a * float(np.cos(t)), b * float(np.sin(t))] for t in angle],
        }
        draft.lines[k] = replace(line, shape=shape)


def _cowper(a: float, b: float, nu: float) -> float:
    below = (40 + 37 * nu) * a**4 + (16 + 10 * nu) * a**2 * b**2 + nu * b**4
    return 12 * (1 + nu) * a**2 * (3 * a**2 + b**2) / below


def _known(
    draft: Draft, types: dict[tuple[str, str], IntArray], kinds: tuple[str, ...], first: str, block: DeckBlock
) -> IntArray:
    """Return the numbers of elements of these kinds; add others to the ledger as not converted."""
    kept = [np.zeros(0, np.int64)]
    for (name, kind), elements in types.items():
        if kind in kinds and name.startswith(first):
            kept.append(elements)
        else:
            draft.ledger.refuse(name, f"not an element of *{block.keyword}", count=len(elements))
    return np.concatenate(kept)


def _material_of(block: DeckBlock, draft: Draft) -> str:
    """Return the material name of a section as written at *MATERIAL."""
    wanted = block.parameters.get("MATERIAL", "").strip('"')
    return next((name for name in draft.materials if name.upper() == wanted.upper()), wanted)


def _masses(here: str, block: DeckBlock, draft: Draft) -> None:
    of_set = draft.points_of(block.parameters.get("ELSET", ""))
    if block.parameters.get("TYPE", "ISOTROPIC").upper() != "ISOTROPIC":
        draft.ledger.refuse("*MASS", "a mass of its own in each direction", line=block.line_number)
    elif of_set is not None:
        mass = numbers(block.lines[0])[0]
        for row in of_set.rows.values():
            draft.masses.append(DeckMass(draft.node_group(here, row), mass))


def _springs(here: str, block: DeckBlock, draft: Draft) -> None:
    """Read springs and dashpots: along the line of two nodes (A), or in one component of one (1) or two nodes (2)."""
    of_set = draft.points_of(block.parameters.get("ELSET", ""))
    if of_set is None:
        return
    n, is_axial = len(of_set.rows), of_set.kind.endswith("A")
    if "NONLINEAR" in block.parameters:
        draft.ledger.refuse(f"*{block.keyword}, NONLINEAR", "springs here are linear", count=n, line=block.line_number)
        return
    if len(block.lines) > (1 if is_axial and numbers(block.lines[0])[0] else 2):
        why = "of several temperatures the first line is taken"
        draft.ledger.note(f"*{block.keyword}", why, line=block.line_number)
    if is_axial:
        value = numbers(block.lines[1 if len(block.lines) > 1 and not numbers(block.lines[0])[0] else 0])[0]
        for row in of_set.rows.values():
            spring = _axial(here, draft, row, value, is_damper=block.keyword == "DASHPOT")
            if spring is None:
                draft.ledger.refuse(of_set.kind, "has no length between its nodes", line=block.line_number)
            else:
                draft.springs.append(spring)
    elif of_set.kind.endswith("1"):
        _to_ground(block, draft, of_set)
    else:
        _component_springs(here, block, draft, of_set)


def _to_ground(block: DeckBlock, draft: Draft, of_set: PointElements) -> None:
    """Record a spring or dashpot to the ground as an interface, because the body is free."""
    component = int(numbers(block.lines[0])[0]) - 1
    if not 0 <= component < 6 or "ORIENTATION" in block.parameters:
        why = "along axes of its own (ORIENTATION), or of another component than 1 to 6"
        draft.ledger.refuse(of_set.kind, why, line=block.line_number)
        return
    value = numbers(block.lines[1])[0]
    first = component - component % 3
    # in a rotated instance, the axis of the spring can have components along all three basic axes
    is_turned = TURNED in block.parameters
    components = range(first, first + 3) if is_turned else (component,)
    along = MOTION_COMPONENTS[component] + (" along axes of its instance" if is_turned else "")
    for (node,) in of_set.rows.values():
        why = (
            f"ties {along} of node {node} to the ground with {value:g}; the body is free here: put it into the system "
            "file"
        )
        draft.ledger.note(of_set.kind, why, line=block.line_number)
        draft.held.setdefault(node, {}).setdefault(GROUNDED, set()).update(components)


def _component_springs(here: str, block: DeckBlock, draft: Draft, of_set: PointElements) -> None:
    """Read springs between equal components of two nodes, if their forces are in balance.

    Two opposite forces along an axis are in balance only if both nodes are on one line along this axis. Two opposite
    moments always are.
    """
    first, second = (int(number) for number in (numbers(block.lines[0]) * 2)[:2])
    value = numbers(block.lines[1])[0]
    turn = block.parameters.get(TURNED)
    axes = np.eye(3) if turn is None else np.array(turn.split(), dtype=float).reshape(3, 3).T
    for row in of_set.rows.values():
        ends = draft.mesh.coordinates[draft.mesh.rows_of(np.array(row))]
        apart, e = ends[1] - ends[0], axes[(first - 1) % 3]
        across = np.abs(apart - (apart @ e) * e).max() if first <= 3 else 0.0
        if first != second or not 1 <= first <= 6 or across > ALONG * np.abs(apart).max():
            why = "between different components, or between nodes apart across the direction: the forces do not balance"
            draft.ledger.refuse(of_set.kind, why, line=block.line_number)
        elif "ORIENTATION" in block.parameters or draft.transformed.keys() & set(row):
            draft.ledger.refuse(of_set.kind, "along axes of its own (ORIENTATION, *TRANSFORM)", line=block.line_number)
        else:
            six, none = tuple(value if k == first - 1 else 0.0 for k in range(6)), (0.0,) * 6
            stiffness, damping = (none, six) if block.keyword == "DASHPOT" else (six, None)
            names = [draft.node_group(here, [number]) for number in row]
            triad = None if turn is None else as_triad(axes)
            draft.springs.append(DeckSpring((names[0], names[1]), stiffness, damping, triad))


def _axial(here: str, draft: Draft, row: tuple[int, ...], value: float, *, is_damper: bool) -> DeckSpring | None:
    """Return a spring or damper along the line of its nodes; None if they coincide."""
    ends = draft.mesh.coordinates[draft.mesh.rows_of(np.array(row))]
    if not np.linalg.norm(ends[1] - ends[0]) > 0:
        return None
    triad = as_triad(axes_along(ends[1] - ends[0]))
    names = tuple(draft.node_group(here, [number]) for number in row)
    six, none = (value, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0,) * 6
    stiffness, damping = (none, six) if is_damper else (six, None)
    return DeckSpring((names[0], names[1]), stiffness, damping, triad)
