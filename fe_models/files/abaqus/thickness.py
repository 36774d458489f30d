"""Shells whose thickness is given at nodes: each element gets its mean thickness."""

from dataclasses import replace

import numpy as np

from fe_models.files.abaqus.blocks import DeckBlock
from fe_models.files.abaqus.draft import Draft
from fe_models.files.abaqus.materials import numbers
from fe_models.foundation.arrays import Array

__all__ = ["read_nodal_thickness", "sections_by_thickness"]

MOST = 500  #: largest number of different thicknesses in one section; each becomes a table of the job
DIGITS = 9  #: digits to which mean thicknesses must agree for elements to share a section
#: integral of each node's shape function over the element, as part of its area (parallelograms and triangles)
_SHARES: dict[str, tuple[float, ...]] = {
    "triangle": (1 / 3,) * 3,
    "quad": (1 / 4,) * 4,
    "triangle6": (0.0,) * 3 + (1 / 3,) * 3,
    "quad8": (-1 / 12,) * 4 + (1 / 3,) * 4,
    "quad9": (1 / 36,) * 4 + (1 / 9,) * 4 + (4 / 9,),
}


def read_nodal_thickness(here: str, block: DeckBlock, draft: Draft) -> None:
    """Read nodal thicknesses; a later value replaces an earlier one."""
    for line in block.lines:
        word, *sizes = line.rstrip(", ").split(",")
        thickness = numbers(sizes[0])[0]
        draft.nodal_thickness |= dict.fromkeys(draft.nodes_of(here, word).tolist(), thickness)


def sections_by_thickness(draft: Draft) -> None:
    """Replace each shell section with nodal thicknesses by one section for each mean thickness.

    (1) the mean of an element is the integral of the thickness that its shape functions interpolate, divided by its
        area
    (2) nodes without a thickness have that of the section
    """
    if not draft.nodal_thickness:
        if draft.nodal_shells:
            draft.ledger.refuse("*SHELL SECTION, NODAL THICKNESS", "no node has a thickness (*NODAL THICKNESS)")
        return
    at_node = np.full(len(draft.mesh.node_numbers), np.nan)
    rows = draft.mesh.rows_of(np.array(list(draft.nodal_thickness), dtype=np.int64))
    at_node[rows[rows >= 0]] = np.array(list(draft.nodal_thickness.values()))[rows >= 0]
    shells, draft.shells[:] = list(draft.shells), []
    for shell in shells:
        if shell.layers:
            why = "shells of layers, whose thickness varies"
            draft.ledger.refuse("*NODAL THICKNESS", why, count=len(_mean_thickness(draft, shell.group, at_node)[0]))
            continue
        base = np.nan if shell.group in draft.nodal_shells else shell.thickness
        elements, means, is_varied = _mean_thickness(draft, shell.group, np.where(np.isnan(at_node), base, at_node))
        is_known = bool(np.isfinite(means).all() and means.min() > 0)
        shares = np.round(means / means.max(), DIGITS) if is_known else np.zeros(0)
        found, of_element = np.unique(shares, return_inverse=True)
        if not is_known or len(found) > MOST:
            why = f"elements without a thickness, or of more than {MOST} different ones"
            draft.ledger.refuse("*NODAL THICKNESS", why, count=len(elements))
            continue
        if is_varied.any():
            why = "the thickness varies inside elements: each has its mean (its mass is kept, its bending is not quite)"
            draft.ledger.note("*NODAL THICKNESS", why, count=int(is_varied.sum()))
        for k in range(len(found)):
            mine = of_element == k
            group = shell.group if len(found) == 1 else draft.cell_group(f"{shell.group}_{k + 1}", elements[mine])
            thickness = float(means[mine][0])
            offset = shell.offset / shell.thickness * thickness
            draft.shells.append(replace(shell, group=group, thickness=thickness, offset=offset))
    if not shells:
        draft.ledger.refuse("*NODAL THICKNESS", "only shells have it here")


def _mean_thickness(draft: Draft, group: str, at_node: Array) -> tuple[Array, Array, Array]:
    """Return element numbers of a group, mean thickness of each, and whether it varies within the element."""
    members = draft.cell_groups.get(group)
    if members is None:
        members = draft.mesh.element_sets[group.upper()]
    numbers_, means, varied = [], [], []
    for _, kind, table in draft.mesh.elements:
        mine = table[np.isin(table[:, 0], members)]
        if kind in _SHARES and len(mine):
            thickness = at_node[draft.mesh.rows_of(mine[:, 1:].ravel())].reshape(len(mine), -1)
            numbers_.append(mine[:, 0])
            means.append(thickness @ np.array(_SHARES[kind]))
            varied.append(np.ptp(thickness, axis=1) > 1e-9 * thickness.max(axis=1))
    return np.concatenate(numbers_), np.concatenate(means), np.concatenate(varied)
