"""Materials of Abaqus and CalculiX (isotropic, orthotropic), and axes of materials and nodes."""

from dataclasses import replace

import numpy as np

from fe_models.files.abaqus.blocks import DeckBlock
from fe_models.files.abaqus.draft import Draft
from fe_models.files.decks.deck import DeckMaterial
from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted

__all__ = ["materials_in_axes", "numbers", "read_material", "read_orientation", "read_transform"]

COLLINEAR = 1e-8
#: distance from the axis of *TRANSFORM up to which CalculiX considers a node as on the axis [unit of the deck]
ON_AXIS = 1e-10


def numbers(line: str) -> list[float]:
    """Return the numbers in a data line; empty fields are zero."""
    return [float(word.strip().upper().replace("D", "E") or 0) for word in line.rstrip(", ").split(",")]


def read_material(block: DeckBlock, draft: Draft) -> None:
    """Read elastic constants and density; add other data to the ledger."""
    name = draft.material
    if block.keyword == "MATERIAL":
        draft.materials[name] = DeckMaterial(name)
    elif block.keyword == "ELASTIC" and name in draft.materials:
        _elastic(block, draft)
    elif block.keyword == "DENSITY" and name in draft.materials:
        draft.materials[name] = replace(draft.materials[name], density=numbers(block.lines[0])[0])
    elif block.keyword == "DAMPING":
        draft.ledger.note("*DAMPING", "say it in the table [damping] of the job", line=block.line_number)
    else:
        draft.ledger.note(f"*{block.keyword}", "heat is not part of the body", line=block.line_number)


def _elastic(block: DeckBlock, draft: Draft) -> None:
    kind = block.parameters.get("TYPE", "ISO").upper()
    sizes = {"ISO": 2, "ORT": 9, "ENG": 9, "ANI": 21}
    n = sizes.get(kind[:3])
    what = f"*ELASTIC, TYPE={kind}"
    if n is None:
        draft.ledger.refuse(what, "this law is not known here", line=block.line_number)
        return
    n_lines = -(-n // 8)
    values = [value for line in block.lines[:n_lines] for value in numbers(line)]
    if n == 2 and len(values) == 1:
        draft.ledger.note("*ELASTIC", "no Poisson's ratio: 0, as the programs take it", line=block.line_number)
        values.append(0.0)
    if len(values) < n:
        raise ValueError(f"expected {n} constants, got {len(values)}")
    if len(block.lines) > n_lines:
        draft.ledger.note("*ELASTIC", "of several temperatures the first line is taken", line=block.line_number)
    material = draft.materials[draft.material]
    if n == 2:
        draft.materials[draft.material] = replace(
            material, young=values[0], poisson=values[1], shear=None, elasticity=None
        )
        return
    if kind[:3] == "ENG":
        young, poisson, shear = np.split(np.array(values[:9]), 3)
        normal = np.linalg.inv(_compliance(young, poisson)) if young.all() else np.zeros((3, 3))
    else:
        C = _tensor(values[:n])
        if np.any(C[:3, 3:]) or np.any(C[3:, 3:] - np.diag(np.diag(C)[3:])):
            _anisotropic(what, block, draft, C)
            return
        normal, shear = C[:3, :3], np.diag(C)[3:]
    if np.linalg.eigvalsh(normal).min() <= 0 or shear.min() <= 0:
        why = "the stiffness is not positive definite: some strain would cost no energy"
        draft.ledger.refuse(what, why, line=block.line_number)
        return
    S = np.linalg.inv(normal)
    young = 1 / np.diag(S)
    nu = (-S[0, 1] * young[0], -S[0, 2] * young[0], -S[1, 2] * young[1])
    changed = replace(material, young=_three(young), poisson=_three(nu), shear=_three(shear), elasticity=None)
    draft.materials[draft.material] = changed


def _anisotropic(what: str, block: DeckBlock, draft: Draft, C: Array) -> None:
    """Take stress by strain, (6, 6), rows 11 22 33 12 13 23, where shear and stretch are coupled."""
    if np.linalg.eigvalsh(C).min() <= 0:
        why = "the stiffness is not positive definite: some strain would cost no energy"
        draft.ledger.refuse(what, why, line=block.line_number)
        return
    order = [0, 1, 2, 5, 4, 3]  # 12 13 23 -> 23 13 12
    rows = tuple(tuple(float(x) for x in row) for row in C[np.ix_(order, order)])
    material = draft.materials[draft.material]
    draft.materials[draft.material] = replace(material, young=None, poisson=None, shear=None, elasticity=rows)


def _tensor(values: list[float]) -> Array:
    """Return stress by strain, (6, 6), rows 11 22 33 12 13 23, of the 9 or 21 constants of Abaqus and CalculiX.

    21 constants are the upper triangle column by column. 9 constants are the upper triangle of the rows 11 22 33, then
    the three shear moduli.
    """
    C = np.zeros((6, 6))
    size = 6 if len(values) == 21 else 3
    at = [(i, j) for j in range(size) for i in range(j + 1)]
    at += [] if size == 6 else [(k, k) for k in range(3, 6)]
    for (i, j), value in zip(at, values, strict=True):
        C[i, j] = C[j, i] = value
    return C


def _compliance(young: Array, poisson: Array) -> Array:
    """Return the (3, 3) matrix from stresses 11 22 33 to strains."""
    S = np.diag(1 / young)
    S[0, 1] = S[1, 0] = -poisson[0] / young[0]
    S[0, 2] = S[2, 0] = -poisson[1] / young[0]
    S[1, 2] = S[2, 1] = -poisson[2] / young[1]
    return np.asarray(S)


def read_orientation(block: DeckBlock, draft: Draft) -> None:
    """Read named axes: the first through point a, the second in the plane of a and b.

    If the block gives an angle, the axes are then rotated about one of the three.
    """
    given = block.parameters
    name = given.get("NAME", "").strip('"').upper()
    is_plain = given.get("SYSTEM", "RECTANGULAR").upper().startswith("R")
    if not is_plain or given.get("DEFINITION", "COORDINATES").upper() != "COORDINATES" or not block.lines:
        draft.orientations[name] = None
        return
    words = numbers(block.lines[0])
    origin = np.array(words[6:9]) if len(words) >= 9 else np.zeros(3)
    axes = _plane_axes(np.array(words[:3]) - origin, np.array(words[3:6]) - origin)
    if len(block.lines) > 1:
        about, angle = (*numbers(block.lines[1]), 0.0)[:2]
        i, j = {1: (1, 2), 2: (2, 0), 3: (0, 1)}[int(about)]
        c, s = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
        axes[i], axes[j] = c * axes[i] + s * axes[j], c * axes[j] - s * axes[i]
    draft.orientations[name] = axes


def _plane_axes(x: Array, y: Array) -> Array:
    """Return three axes as rows: along x, in the plane of x and y, and normal to both."""
    z = np.cross(x, y)
    if np.linalg.norm(z) <= COLLINEAR * np.linalg.norm(x) * np.linalg.norm(y):
        raise ValueError("points a and b lie on one line through the origin")
    axes = np.stack([x, np.cross(z, x), z])
    return np.asarray(axes / np.linalg.norm(axes, axis=1)[:, None])


def read_transform(here: str, block: DeckBlock, draft: Draft) -> None:
    """Read the axes of nodes: from points a and b (R), or radial, tangential and along the line from a to b (C)."""
    words = numbers(block.lines[0])
    a, b = np.array(words[:3]), np.array(words[3:6])
    kind = block.parameters.get("TYPE", "R").upper()
    members = draft.nodes_of(here, block.parameters.get("NSET", ""))
    members = members[draft.mesh.rows_of(members) >= 0]
    if kind == "R":
        draft.transformed |= dict.fromkeys(members.tolist(), _plane_axes(a, b))
        return
    if kind != "C" or not np.any(b - a):
        raise ValueError(f"TYPE={kind}: expected R or C, and two different points")
    axis = (b - a) / np.linalg.norm(b - a)
    for node, point in zip(members.tolist(), draft.mesh.coordinates[draft.mesh.rows_of(members)], strict=True):
        arm = point - a
        radial = arm - axis * (axis @ arm)
        if draft.program == "calculix" and np.linalg.norm(radial) < ON_AXIS:
            radial = _across(axis)
        elif np.linalg.norm(radial) <= COLLINEAR * max(np.linalg.norm(arm), np.linalg.norm(b - a)):
            raise ValueError(f"node {node} lies on the axis, where no direction is radial")
        axes = np.stack([radial, np.cross(axis, radial), axis])
        draft.transformed[node] = axes / np.linalg.norm(axes, axis=1)[:, None]


def _across(axis: Array) -> Array:
    """Return the direction that CalculiX uses as radial direction at a node on the axis.

    If component k is the first nonzero component of the axis, component k + 1 of the direction is 1, component k + 2
    is 0, and component k makes it normal to the axis.
    """
    first = next((k for k in (0, 1) if abs(axis[k]) > ON_AXIS), 2)
    radial = np.zeros(3)
    radial[(first + 1) % 3] = 1.0
    radial[first] = -axis[(first + 1) % 3] / axis[first]
    return radial


def materials_in_axes(draft: Draft) -> None:
    """Assign to each solid section with an orthotropic material a copy of the material in its own axes."""
    used = set(draft.used_orientations)
    spelt = {name.upper(): name for name in draft.materials}
    for k, solid in enumerate(draft.solids):
        material = draft.materials.get(spelt.get(solid.material.upper(), ""))
        if material is None or (material.shear is None and material.elasticity is None) or not solid.orientation:
            continue
        key = solid.orientation.upper()
        if key not in draft.orientations:
            raise ValueError(
                f"a section names the orientation {quoted(solid.orientation)}{nearest(key, draft.orientations)}"
            )
        axes = draft.orientations[key]
        used.add(key)
        if axes is None:
            why = "axes that vary in space, or are not given by points"
            draft.ledger.refuse("*ORIENTATION", why)
            continue
        name = f"{material.name}_{solid.orientation}"
        rows = tuple(_three(axis) for axis in axes)
        draft.materials[name] = replace(material, name=name, axes=(rows[0], rows[1], rows[2]))
        draft.solids[k] = replace(solid, material=name)
    unused = len(set(draft.orientations) - used)
    if unused:
        draft.ledger.note("*ORIENTATION", "axes of materials; isotropic ones need none", count=unused)
    for name in [*(line.material for line in draft.lines), *(rod.material for rod in draft.rods)]:
        material = draft.materials.get(spelt.get(name.upper(), ""))
        if material is not None and (material.shear is not None or material.elasticity is not None):
            draft.ledger.refuse("*ELASTIC", "beams and trusses of materials that are not isotropic")
    for name in [name for shell in draft.shells for name in shell.materials]:
        material = draft.materials.get(spelt.get(name.upper(), ""))
        if material is not None and material.elasticity is not None:
            draft.ledger.refuse("*ELASTIC", "shells of anisotropic materials")


def _three(values: Array | tuple[float, ...]) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
