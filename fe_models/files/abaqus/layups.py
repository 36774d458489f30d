"""Layered shells, and shells of one orthotropic material, which count as one layer."""

from dataclasses import replace

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.abaqus.blocks import DeckBlock
from fe_models.files.abaqus.draft import Draft
from fe_models.files.abaqus.materials import numbers
from fe_models.files.decks.deck import DeckLayer, ShellSection
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.words import is_number, nearest, quoted

__all__ = ["layers_of_block", "layups_in_axes"]

#: tolerance within which axes count as parallel (difference of components), and normals of a shell (1 - |cosine|)
PARALLEL = 1e-6
#: cosine between a shell normal and the layup direction, above which y replaces x as direction, or the layup is refused
STEEP = 0.9


def layers_of_block(here: str, block: DeckBlock) -> tuple[DeckLayer, ...]:
    """Return the layers of *SHELL SECTION, COMPOSITE: thickness, number of points, material, orientation or angle."""
    layers = []
    for line in block.lines:
        words = [word.strip().strip('"') for word in line.split(",")] + [""] * 4
        if not words[2]:
            raise MeshError(f"{here}, COMPOSITE: expected thickness, number of points, material; got {line[:60]!r}")
        layers.append(DeckLayer(words[2], numbers(words[0])[0], orientation=words[3]))
    if not layers:
        raise MeshError(f"{here}, COMPOSITE: expected a line for each layer, got none")
    return tuple(layers + layers[::-1] if "SYMMETRIC" in block.parameters else layers)


def layups_in_axes(draft: Draft) -> None:
    """Compute the layer angles of each shell from one reference direction.

    (1) layers of isotropic materials have no direction: the basic x axis is used, or y if x is normal to the shell
    (2) for other materials, the direction is axis 1 of the orientation of the first such layer; a layer with a number
        instead of an orientation is at this angle from the orientation of the section
    (3) layers with their own orientations are at angles about their common axis 3, which must be normal to a flat shell
    """
    shells, draft.shells[:] = list(draft.shells), []
    for shell in shells:
        layers = shell.layers or (DeckLayer(shell.material, shell.thickness),)
        general = [layer for layer in layers if _is_directed(draft, layer.material)]
        if shell.layers and not general:
            draft.shells += _without_direction(draft, shell)
        elif general:
            found = _directed(draft, shell, layers)
            if isinstance(found, str):
                count = len(_numbers_of(draft, shell.group))
                draft.ledger.refuse("*ELASTIC", f"shells of an orthotropic material: {found}", count=count)
            else:
                draft.shells.append(found)
        else:
            draft.shells.append(shell)


def _is_directed(draft: Draft, name: str) -> bool:
    """Return whether a material is not isotropic."""
    material = next((each for key, each in draft.materials.items() if key.upper() == name.upper()), None)
    return material is not None and (material.shear is not None or material.elasticity is not None)


def _numbers_of(draft: Draft, group: str) -> IntArray:
    """Return the element numbers in a group."""
    members = draft.cell_groups.get(group)
    return draft.mesh.element_sets[group.upper()] if members is None else members


def _normals(draft: Draft, group: str) -> tuple[IntArray, Array]:
    """Return numbers and unit normals of the cells in a group, from their corners."""
    members = _numbers_of(draft, group)
    found, normals = [np.zeros(0, np.int64)], [np.zeros((0, 3))]
    for _, kind, table in draft.mesh.elements:
        mine = table[np.isin(table[:, 0], members)]
        if len(mine):
            n = 3 if kind.startswith("triangle") else 4
            X = draft.mesh.coordinates[draft.mesh.rows_of(mine[:, 1 : n + 1].ravel())].reshape(len(mine), n, 3)
            across = np.cross(X[:, 2] - X[:, 0], X[:, n - 1] - X[:, 1])
            lengths = np.linalg.norm(across, axis=1)
            found.append(mine[:, 0])
            normals.append(across / np.where(lengths > 0, lengths, 1.0)[:, None])
    return np.concatenate(found), np.concatenate(normals)


def _without_direction(draft: Draft, shell: ShellSection) -> list[ShellSection]:
    """Step (1): convert layers of isotropic materials, which need no direction."""
    elements, normals = _normals(draft, shell.group)
    is_steep = np.abs(normals[:, 0]) > STEEP
    made = []
    for along, mine in (((1.0, 0.0, 0.0), ~is_steep), ((0.0, 1.0, 0.0), is_steep)):
        if mine.any():
            group = (
                shell.group
                if mine.all()
                else draft.cell_group(f"{shell.group}_along_{'yx'[int(along[0])]}", elements[mine])
            )
            made.append(replace(shell, group=group, direction=along))
    return made


def _directed(draft: Draft, shell: ShellSection, layers: tuple[DeckLayer, ...]) -> ShellSection | str:
    """Steps (2) and (3): convert layers with a direction; return a text with the reason if this is impossible."""
    axes: list[Array] = []
    angles: list[float] = []
    for layer in layers:
        is_angle = is_number(layer.orientation)
        word = shell.orientation if is_angle or not layer.orientation else layer.orientation
        if not word:
            if _is_directed(draft, layer.material):
                return "no ORIENTATION says where its axes lie"
            axes.append(np.zeros((3, 3)))
        else:
            key = word.upper()
            if key not in draft.orientations:
                raise MeshError(
                    f"{draft.where}: a shell section names the orientation {quoted(word)}"
                    f"{nearest(key, draft.orientations)}"
                )
            found = draft.orientations[key]
            if found is None:
                return "axes that vary in space, or are not given by points"
            draft.used_orientations.add(key)
            axes.append(found)
        angles.append(float(layer.orientation) if is_angle else 0.0)
    first = next(each for each in axes if each.any())
    normals = _normals(draft, shell.group)[1]
    for k, each in enumerate(axes):
        if not each.any() or np.allclose(each[0], first[0], atol=PARALLEL):
            continue
        signs = normals @ first[2]
        is_flat = bool(len(signs)) and bool((np.abs(np.abs(signs) - 1) < PARALLEL).all()) and bool(np.ptp(signs) < 1)
        if not is_flat or not np.allclose(each[2], first[2], atol=PARALLEL):
            return "layers with different orientations on a shell that is not flat across their common axis 3"
        angle = np.arctan2(each[0] @ first[1], each[0] @ first[0])
        angles[k] += float(np.rad2deg(angle)) * float(np.sign(signs[0]))  # about the normal of the shell
    if (np.abs(normals @ first[0]) > STEEP).any():
        return "axis 1 of its orientation is across the shell"
    laid = tuple(replace(layer, angle=angle, orientation="") for layer, angle in zip(layers, angles, strict=True))
    x, y, z = (float(v) for v in first[0])
    return replace(shell, layers=laid, direction=(x, y, z))
