"""Bars and beams of Nastran: CBAR and CBEAM with orientation, offsets and released ends."""

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.decks.deck import Equation, LineSection, RigidGroup
from fe_models.files.nastran.bulk_data.cards import Card
from fe_models.files.nastran.deck.bar_shapes import bar_shape
from fe_models.files.nastran.deck.model import NastranModel, components_of
from fe_models.files.nastran.mesh import ELEMENT_TYPES
from fe_models.foundation.arrays import Array

__all__ = ["BARS", "OFFSETS", "line_of_ends", "orientation_of", "read_bars", "with_defaults"]

BARS = ("CBAR", "CBEAM")
ORIENTATION, OFFT = (5, 6, 7), 8
OFFSETS = ((11, 12, 13), (14, 15, 16))  #: field numbers of the offsets of ends A and B
SAME = 1e-9  #: difference of offsets divided by the bar length, up to which they are equal


def with_defaults(model: NastranModel) -> None:
    """Fill blank fields of CBAR and CBEAM with those of BAROR and BEAMOR: property, orientation, OFFT."""
    for name, source in (("CBAR", "BAROR"), ("CBEAM", "BEAMOR")):
        defaults = model.of(source)
        if not defaults:
            continue
        if len(defaults) > 1:
            raise MeshError(f"{defaults[1].where}: expected one {source} in a deck, got {len(defaults)}")
        model.cards[name] = [_filled(card, defaults[0]) for card in model.cards.get(name, ())]


def _filled(card: Card, default: Card) -> Card:
    fields = [*card.fields, *[""] * (OFFT - len(card.fields))]
    if not fields[1]:
        fields[1] = default.text(2)
    if not any(fields[k - 1] for k in ORIENTATION):
        for k in ORIENTATION:
            fields[k - 1] = default.text(k)
    fields[OFFT - 1] = fields[OFFT - 1] or default.text(OFFT)
    return Card(card.name, tuple(fields), card.where)


def read_bars(model: NastranModel, known: Card, cards: list[Card]) -> None:
    """Read the bars of one property, with a group for each orientation and offset.

    (1) axes of the element: x from GA to GB, y in plane 1 towards the orientation vector, z normal to both
    (2) an offset that is equal at both ends and normal to the bar belongs to the section; for any other offset a node
        is added at the end, which moves rigidly with the grid point
    (3) a node is also added at a released end; all its motions except the released ones are those of the grid point
    (4) J = 0 releases the rotation about the axis at the end with fewer bars and shells, so that the inertia of torsion
        stays with the other bars; in a planar body, bars are never twisted
    """
    pid = known.text(1)
    shape = bar_shape(model, known)
    if isinstance(shape, str):
        model.ledger.refuse(known.name, f"property {pid}: {shape}", count=len(cards))
        return
    made = _with_own_shear(model, known.text(2), shape.keys)
    if isinstance(made, str):
        model.ledger.refuse(known.name, f"property {pid}: {made}", count=len(cards))
        return
    material, keys = made
    uses = None if shape.has_torsion or model.plane is not None else _uses(model)
    groups: dict[tuple[Any, ...], list[Card]] = {}
    for card in cards:
        ends = np.array([model.point(card, card.integer(k)) for k in (3, 4)])
        W = _offsets(model, card, ends)
        R = _axes(model, card, ends, ends + W)
        if isinstance(R, str):
            model.ledger.refuse(card.name, R)
            continue
        released = [components_of(card, card.text(k) or "0") for k in (9, 10)]
        if uses is not None:  # (4)
            end = 0 if uses[card.integer(3)] < uses[card.integer(4)] else 1
            end = 1 - end if min(released[end], default=3) < 3 else end
            released[end] = tuple(sorted({*released[end], 3}))
        if any(min(each, default=3) < 3 <= max(each, default=0) for each in released):
            model.ledger.refuse(card.name, "an end with motions released along and about its axes (PA, PB)")
            continue
        length = float(np.linalg.norm(ends[1] + W[1] - ends[0] - W[0]))
        offset = W[0] @ R
        if np.abs(W[0] - W[1]).max() <= SAME * length and abs(offset[0]) <= SAME * length and not any(released):
            across = (float(offset[1]), float(offset[2]))
        else:
            across = (0.0, 0.0)
            _own_ends(model, card, W, R, released)
        c, s = np.cos(shape.turn), np.sin(shape.turn)
        y = c * R[:, 1] + s * R[:, 2]  # first principal axis
        place = across[0] + shape.centroid[0], across[1] + shape.centroid[1]
        place = (c * place[0] + s * place[1], c * place[1] - s * place[0])
        key = (tuple((np.round(y, 12) + 0.0).tolist()), tuple((np.round(place, 12 - _digits(length)) + 0.0).tolist()))
        groups.setdefault(key, []).append(card)
    for k, ((y_key, offset_key), mine) in enumerate(groups.items(), start=1):
        group = f"pid_{pid}" if len(groups) == 1 else f"pid_{pid}_{k}"
        for card in mine:
            model.elements[card.integer(1)] = (card.name, group)
        has_shear = "shear_area_y" in shape.keys or "shear_area_z" in shape.keys or shape.keys["shape"] != "general"
        model.lines.append(
            LineSection(
                group,
                material,
                keys,
                y_key,
                offset_key,
                shear=has_shear,
                rotary_inertia=False,
                added_mass=shape.added_mass,
            )
        )
    for note in (*shape.notes, "inertia of torsion is that of the section; Nastran's has none"):
        model.ledger.note(cards[0].name, note, count=len(cards))


def _uses(model: NastranModel) -> Counter[int]:
    """Return the number of bars and shells at each grid point, which may constrain its rotation."""
    names = [name for name in ELEMENT_TYPES if name in BARS or name.startswith(("CTRIA", "CQUAD"))]
    words = [word for card in model.of(*names) for word in card.fields[2 : 2 + max(ELEMENT_TYPES[card.name])]]
    return Counter(int(word) for word in words if word.isdigit())


def _with_own_shear(model: NastranModel, name: str, keys: dict[str, Any]) -> tuple[str, dict[str, Any]] | str:
    """Return material and section of bars, changed if their MAT1 gives its own G; or a text why G is refused.

    In a general section, G scales the torsion constant and the shear areas. Other shapes get a material with
    nu = E/(2 G) - 1, because bars do not use nu otherwise.
    """
    factor = model.shear_factor(name)
    if factor == 1.0:
        return name, keys
    if not factor > 0:
        return f"material {name}: G = {model.shear_moduli[name]:g}: a beam without stiffness in torsion"
    if keys["shape"] == "general":
        scaled = ("torsion", "shear_area_y", "shear_area_z")
        return name, {key: value * factor if key in scaled else value for key, value in keys.items()}
    material, G, made = model.materials[name], model.shear_moduli[name], f"{name}_line"
    assert isinstance(material.young, float)
    nu = material.young / (2 * G) - 1
    if not -1 < nu < 0.5:
        return f"material {name}: E/(2 G) - 1 = {nu:g} is no Poisson's ratio; give the section as PBAR or PBEAM"
    model.materials[made] = replace(material, name=made, poisson=nu)
    return made, keys


def line_of_ends(model: NastranModel, card: Card) -> Array:
    """Return both ends of a bar including offsets, (2, 3), basic axes."""
    ends = np.array([model.point(card, card.integer(k)) for k in (3, 4)])
    return ends + _offsets(model, card, ends)


def orientation_of(model: NastranModel, card: Card) -> Array:
    """Return the vector that spans plane 1 with the axis of a bar, (3,), basic axes."""
    return _orientation(model, card, model.point(card, card.integer(3)), line_of_ends(model, card)[0])


def _digits(length: float) -> int:
    return int(np.ceil(np.log10(length))) if length > 0 else 0


def _axes(model: NastranModel, card: Card, grids: Array, ends: Array) -> Array | str:
    """Return the axes of an element as columns, (3, 3), or a text with the reason if they are undefined."""
    x = ends[1] - ends[0]
    if not np.linalg.norm(x) > 0:
        return "has no length between its ends"
    x = x / np.linalg.norm(x)
    v = _orientation(model, card, grids[0], ends[0])
    y = v - (v @ x) * x
    if not np.linalg.norm(y) > SAME * np.linalg.norm(v):
        return "its orientation vector is along the bar, or missing"
    y = y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _orientation(model: NastranModel, card: Card, grid: Array, start: Array) -> Array:
    """Return the vector from end A that spans plane 1 with the axis, (3,), basic axes."""
    word = card.text(5)
    if word.lstrip("+").isdigit() and not card.text(6) and not card.text(7):
        return model.point(card, int(word)) - start
    v = np.array([card.real(k, 0.0) for k in ORIENTATION])
    return v if card.text(OFFT).upper()[:1] == "B" else np.asarray(model.axes(card.integer(3)) @ v)


def _offsets(model: NastranModel, card: Card, ends: Array) -> Array:
    """Return the offsets of both ends from their grid points, (2, 3), basic axes.

    OFFT determines for each end whether its offset is along displacement axes (G, the default) or along the axes of the
    element (O), computed without offsets from its grid points.
    """
    W = np.array([[card.real(k, 0.0) for k in fields] for fields in OFFSETS])
    if not np.any(W):
        return W
    words = (card.text(OFFT).upper() or "GGG").ljust(3, "G")
    if not set(words) <= set("GBO"):
        raise MeshError(f"{card.where} {card.text(1)}: OFFT: expected letters such as GGG, BOO, got {words!r}")
    out = np.zeros((2, 3))
    for end in (0, 1):
        if words[1 + end] == "O":
            R = _axes(model, card, ends, ends)
            if isinstance(R, str):
                raise MeshError(f"{card.where} {card.text(1)}: offsets along axes of the element: {R}")
            out[end] = R @ W[end]
        else:
            out[end] = model.axes(card.integer(3 + end)) @ W[end]
    return out


def _own_ends(model: NastranModel, card: Card, W: Array, R: Array, released: list[tuple[int, ...]]) -> None:
    """Steps (2) and (3) of `read_bars`: add nodes to a bar whose end has an offset or released motions.

    A released motion is along or about an axis of the element. The other translations or rotations give E d = 0. The
    rows of E are their axes; d is the motion of the end minus the motion u + theta × W of its place at the grid point.
    """
    for end in (0, 1):
        if not np.any(W[end]) and not released[end]:
            continue
        number = card.integer(3 + end)
        own = model.new_point(model.point(card, number) + W[end])
        model.ends[card.integer(1), end] = own
        leader, follower = model.group(card, [number]), model.group(card, [own])
        whole = [
            first + k for first in (0, 3) for k in range(3) if not set(range(first, first + 3)) & set(released[end])
        ]
        model.rigid.append(
            RigidGroup(f"{card.name.lower()}_{card.text(1)}_{'ab'[end]}", leader, follower, tuple(whole))
        )
        for first in {first for first in (0, 3) if first not in whole}:
            E = R[:, [k for k in range(3) if first + k not in released[end]]].T
            for row, pivot in _reduced(E):
                order = [pivot, *(k for k in range(3) if k != pivot and row[k])]
                terms = [(follower, first + k, float(row[k])) for k in order]
                terms += [(leader, first + k, -float(row[k])) for k in order]
                if first == 0:  # (theta × W) · row = theta · (W × row)
                    terms += [(leader, 3 + k, -float(c)) for k, c in enumerate(np.cross(W[end], row)) if c]
                model.equations.append(Equation(tuple(terms)))


def _reduced(E: Array) -> list[tuple[Array, int]]:
    """Return rows with the span of E, each with its pivot column: 1 in this row, 0 in all other rows."""
    rows: list[tuple[Array, int]] = []
    E = E.copy()
    for k in range(len(E)):
        free = np.ones(3, dtype=bool)
        free[[pivot for _, pivot in rows]] = False
        size = np.abs(E[k:]) * free
        i, pivot = (int(n) for n in np.unravel_index(int(np.argmax(size)), size.shape))
        E[[k, k + i]] = E[[k + i, k]]
        E[k] = E[k] / E[k, pivot]
        for j in range(len(E)):
            if j != k:
                E[j] = E[j] - E[j, pivot] * E[k]
        rows.append((E[k], pivot))
    E[np.abs(E) < 1e-15] = 0.0
    return [(E[k], pivot) for k, (_, pivot) in enumerate(rows)]
