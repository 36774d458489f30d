"""Complete decks as models: the tables of a job for what a deck contains, and the model that they describe."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fe_models.assembly.model import FEModel
from fe_models.errors import MeshError
from fe_models.files.decks.deck import Deck, LineSection, RodSection, ShellSection, SolidSection, Support
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.arrays import MOTION_COMPONENTS
from fe_models.foundation.words import nearest, quoted

__all__ = ["DeckOptions", "deck_tables", "model_of_deck", "read_deck"]

COLLINEAR = 1e-6


@dataclass(frozen=True)
class DeckOptions:
    """What the user adds to the content of a deck."""

    units: str  #: unit system of the numbers in the deck
    #: densities by material, for materials without density; key "" applies to all of these
    densities: Mapping[str, float] = field(default_factory=dict)
    leave_out: tuple[str, ...] = ()  #: ledger entries with mass or stiffness that the user omits intentionally
    mass: str | None = None  #: "consistent", "lumped" or "as the deck" for all elements; None: the default of jobs


def read_deck(
    path: str | Path,
    *,
    units: str,
    program: str | None = None,
    densities: Mapping[str, float] | None = None,
    leave_out: Iterable[str] = (),
    mass: str | None = None,
) -> FEModel:
    """Read a complete deck of Nastran, Abaqus, CalculiX or ANSYS as a model.

    Supports of the deck become interfaces of the free body, as `cms job` makes them.

    Parameters
    ----------
    path
        The file; its suffix names the program.
    units
        Unit system of the numbers in the deck, such as "mm-t-s".
    program
        "calculix" (the default) or "abaqus" for decks (.inp) that both read, but integrate differently.
    densities
        Densities by material, for materials without density; key "" applies to all of these.
    leave_out
        Cards or keywords with mass or stiffness that are omitted intentionally.
    mass
        "consistent", "lumped" or "as the deck" for all elements; None: solids as in the deck, others consistent.

    Raises
    ------
    FeModelsError
        If the file is missing or damaged, a density is missing, or the deck contains mass or stiffness that cannot be
        converted and is not left out.

    Examples
    --------
    >>> model = fe_models.read_deck("arm.bdf", units="mm-t-s")                      # doctest: +SKIP
    >>> body = fe_models.couple(fe_models.assemble(model))                          # doctest: +SKIP
    """
    options = DeckOptions(units, densities or {}, tuple(leave_out), mass)
    return model_of_deck(parse_deck(path, program=program), options)


def model_of_deck(deck: Deck, options: DeckOptions) -> FEModel:
    """Return the model that a deck describes.

    Raises
    ------
    FeModelsError
        As `deck_tables`; or if the tables do not fit together.
    """
    tables = deck_tables(deck, options)
    body = tables.pop("body")
    others = {key: body[key] for key in ("mass", "plane") if key in body}
    return FEModel.of(
        body["name"], deck.mesh, units=options.units, accept=tuple(body.get("accept", ())), lumped=deck.lumped,
        source=deck.path, **others, **tables,
    )  # fmt: skip


def deck_tables(deck: Deck, options: DeckOptions) -> dict[str, Any]:
    """Return the tables of a job for the content of a deck, with those of [body] that do not name a file.

    The ledger of the deck gets notes about the kind of mass, and about materials without mass.

    Raises
    ------
    MeshError
        If the deck is a plain mesh, contains mass or stiffness that cannot be converted and is not named to be left
        out, or a material lacks a constant, or a support or a section refers to nothing.
    """
    deck.ledger.require_whole(options.leave_out)
    if deck.is_plain_mesh:
        groups = dict.fromkeys(name for block in deck.mesh.blocks for name in block.groups)
        sets = ", ".join(map(quoted, deck.mesh.node_sets)) or "none"
        raise MeshError(
            f"deck {deck.path}: a plain mesh, without materials, sections and steps; write a job with [body] mesh = "
            f"{quoted(deck.path.name)} and tables [materials.NAME] and [interfaces.NAME]; its groups of elements are "
            f"{', '.join(map(quoted, groups)) or 'none'}, its sets of nodes {sets}"
        )
    if not (deck.solids or deck.shells or deck.lines or deck.rods or deck.springs):
        raise MeshError(f"deck {deck.path}: expected solids, shells, lines, rods or springs, got none")
    body: dict[str, Any] = {"name": deck.path.stem, "units": options.units}
    tables: dict[str, Any] = {"body": body, "materials": _materials(deck, options)}
    if options.mass is not None:
        body["mass"] = options.mass
        if deck.program == "abaqus":
            body["program"] = deck.program
    _note_mass(deck, options.mass)
    if deck.plane is not None:
        body["plane"] = ("yz", "zx", "xy")[deck.plane]
    tables |= _sections(deck) | _attached(deck)
    if _has_cells_without_table(deck):
        body["accept"] = ["left-out"]
    tables["interfaces"] = {support.name: _interface(deck, support) for support in deck.supports}
    tables["load_cases"] = {load.name: _load(load) for load in deck.loads}
    return tables


def _note_mass(deck: Deck, mass: str | None) -> None:
    """Note in the ledger which elements get another kind of mass than in the program of the deck."""
    for kind in ("lines", "shells", "rods"):
        count = len(getattr(deck, kind))
        lumps, is_lumped = kind in deck.lumped, mass == "lumped" or (mass == "as the deck" and kind in deck.lumped)
        if count and lumps != is_lumped:
            here, there = ("consistent", "lumps it") if lumps else ("lumped", "does not lump it")
            why = f'mass is {here} here, the deck {there}; --mass "as the deck" takes it so'
            deck.ledger.note(f"mass of {kind}", why, count=count)
    if any(solid.mass == "lumped" for solid in deck.solids) and mass == "consistent":
        deck.ledger.note("mass of solids", "mass is consistent here, the deck lumps it", count=len(deck.solids))


def sections_of(deck: Deck) -> list[SolidSection | ShellSection | LineSection | RodSection]:
    """Return the sections of all elements of a deck."""
    return [*deck.solids, *deck.shells, *deck.lines, *deck.rods]


def materials_in(section: SolidSection | ShellSection | LineSection | RodSection) -> tuple[str, ...]:
    """Return the names of the materials of a section."""
    return section.materials if isinstance(section, ShellSection) else (section.material,)


def _materials(deck: Deck, options: DeckOptions) -> dict[str, Any]:
    """Return the materials in use; the options supply missing densities.

    Nastran and ANSYS use zero for a missing density. The job does the same if the deck has other masses, such as point
    masses on light beams. If nothing has mass, the user must give the density.
    """
    used = dict.fromkeys(name for each in sections_of(deck) for name in materials_in(each))
    for name in options.densities:
        if name and name not in used:
            raise MeshError(f"--density {quoted(name)}: the deck has no such material in use{nearest(name, used)}")
    made: dict[str, Any] = {}
    without = []
    for name in used:
        material = deck.materials.get(name)
        if material is None:
            raise MeshError(
                f"deck {deck.path}: a section names the material {quoted(name)}{nearest(name, deck.materials)}"
            )
        density = material.density or options.densities.get(name, options.densities.get("")) or None
        if material.elasticity is None and (material.young is None or material.poisson is None):
            raise MeshError(f"deck {deck.path}: material {quoted(name)} has no elastic constants (linear)")
        if not density and deck.program in ("nastran", "ansys") and _has_mass(deck, used):
            density = 0.0
            why = f"material {name} has none: massless, as in {deck.program}; --density {name}=... sets it"
            deck.ledger.note("density", why)
        if density is None:
            without.append(name)
            continue
        if material.elasticity is not None:
            made[name] = {"elasticity": material.elasticity, "density": density}
        else:
            made[name] = {"young": material.young, "poisson": material.poisson, "density": density}
            made[name] |= {} if material.shear is None else {"shear": material.shear}
        made[name] |= {} if material.axes is None else {"axes": material.axes}
    if without:
        raise MeshError(
            f"deck {deck.path}: {len(without)} materials have no density: {', '.join(without)}; give it, as "
            f"--density {without[0]}=7.85e-9"
        )
    return made


def _has_mass(deck: Deck, used: Iterable[str]) -> bool:
    """Return whether anything except these materials gives the deck mass: points, other materials, or sections."""
    return (
        any(mass.mass for mass in deck.masses)
        or any(deck.materials[name].density for name in used if name in deck.materials)
        or any(shell.added_mass for shell in deck.shells)
        or any(line.added_mass for line in deck.lines)
    )


def _sections(deck: Deck) -> dict[str, Any]:
    """Return the tables of solids, shells and lines."""
    tables: dict[str, dict[str, Any]] = {"solids": {}, "shells": {}, "sections": {}, "rods": {}}
    for solid in deck.solids:
        table = {"cells": solid.group, "material": solid.material}
        if (solid.integration, solid.mass) != ("full", "consistent"):
            table |= {"integration": solid.integration, "mass": solid.mass}
        tables["solids"][_free(tables["solids"], solid.group)] = table
    for shell in deck.shells:
        row: dict[str, Any] = {"cells": shell.group}
        if shell.layers:
            keys = ("thickness", "angle", "material")
            row["layers"] = [{key: getattr(layer, key) for key in keys} for layer in shell.layers]
            row["direction"] = shell.direction
        elif shell.stiffness:
            row |= {"thickness": shell.thickness, "stiffness": [list(values) for values in shell.stiffness]}
            row |= {"shear_stiffness": [list(values) for values in shell.shear_stiffness]}
            row["direction"] = shell.direction
        else:
            row |= {"material": shell.material, "thickness": shell.thickness}
        row |= {"offset": shell.offset} if shell.offset else {}
        row |= {key: value for key in ("bending_ratio", "shear_ratio") if (value := getattr(shell, key)) != 1.0}
        row |= {"added_mass": shell.added_mass} if shell.added_mass else {}
        tables["shells"][_free(tables["shells"], shell.group)] = row
    for line in deck.lines:
        given: dict[str, Any] = {"lines": line.group, "material": line.material, **line.shape}
        given |= {"orientation": list(line.orientation)} if line.orientation is not None else {}
        given |= {"offset": list(line.offset)} if any(line.offset) else {}
        given |= {} if line.shear else {"shear": False}
        given |= {} if line.rotary_inertia else {"rotary_inertia": False}
        given |= {"added_mass": line.added_mass} if line.added_mass else {}
        tables["sections"][_free(tables["sections"], line.group)] = given
    for rod in deck.rods:
        row = {"lines": rod.group, "material": rod.material, "area": rod.area}
        tables["rods"][_free(tables["rods"], rod.group)] = row
    return tables


def _attached(deck: Deck) -> dict[str, Any]:
    """Return the tables of masses, springs, links, couplings and equations."""
    tables: dict[str, dict[str, Any]] = {"masses": {}, "springs": {}, "links": {}, "couplings": {}, "equations": {}}
    for k, mass in enumerate(deck.masses, start=1):
        row: dict[str, Any] = {"node": mass.nodes, "mass": mass.mass}
        if np.any(mass.inertia):
            row["inertia"] = [list(axis) for axis in mass.inertia]
        if any(mass.offset):
            row["offset"] = list(mass.offset)
        tables["masses"][f"mass_{k}"] = row
    for k, spring in enumerate(deck.springs, start=1):
        row = {"nodes": list(spring.nodes), "stiffness": list(spring.stiffness)}
        row |= {"damping": list(spring.damping)} if spring.damping else {}
        row |= {"triad": [list(axis) for axis in spring.triad]} if spring.triad else {}
        row |= {"point": list(spring.point)} if spring.point else {}
        tables["springs"][f"spring_{k}"] = row
    for link in deck.rigid:
        row = {"node": link.node, "followers": link.followers}
        if link.components != tuple(range(6)):
            row["components"] = [MOTION_COMPONENTS[c] for c in link.components]
        tables["links"][link.name] = row
    for coupling in deck.couplings:
        row = {"node": coupling.node, "members": dict(coupling.members)}
        if coupling.components != tuple(range(6)):
            row["components"] = [MOTION_COMPONENTS[c] for c in coupling.components]
        tables["couplings"][coupling.name] = row
    for k, equation in enumerate(deck.equations, start=1):
        tables["equations"][f"equation_{k}"] = {
            "terms": [[node, MOTION_COMPONENTS[c], a] for node, c, a in equation.terms]
        }
    return tables


def _interface(deck: Deck, support: Support) -> dict[str, Any]:
    """Return the interface of a support: rigid if all motions are fixed, otherwise of kind "nodes"."""
    nodes = deck.mesh.node_sets[support.nodes]
    points = deck.mesh.nodes[nodes]
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    is_spread = len(nodes) >= 3 and spread[1] > COLLINEAR * spread[0]
    turns = np.isin(nodes, _nodes_with_rotations(deck))
    all_held = set(support.components) >= set(range(6)) if turns.any() else set(support.components) >= {0, 1, 2}
    is_rigid = all_held and (turns.any() or is_spread) and not support.is_boundary
    made: dict[str, Any] = {"kind": "rigid" if is_rigid else "nodes", "nodes": support.nodes}
    return made | ({} if support.axes is None else {"triad": support.axes})


def _nodes_with_rotations(deck: Deck) -> Any:
    """Return the indices of nodes of shells and lines, and of leaders of rigid groups."""
    groups = {each.group for each in sections_of(deck) if not isinstance(each, SolidSection | RodSection)}
    found = [
        block.nodes[block.groups[group]].ravel() for block in deck.mesh.blocks for group in groups & set(block.groups)
    ]
    found += [deck.mesh.node_sets[link.node] for link in deck.rigid]
    return np.unique(np.concatenate([np.zeros(0, np.int64), *found]))


def _has_cells_without_table(deck: Deck) -> bool:
    """Return whether cells of the deck were omitted on options."""
    groups = {each.group for each in sections_of(deck)}
    faces = {load.faces for load in deck.loads}
    for block in deck.mesh.blocks:
        if faces & set(block.groups):
            continue
        inside = np.zeros(len(block.nodes), dtype=bool)
        for group in groups & set(block.groups):
            inside[block.groups[group]] = True
        if not inside.all():
            return True
    return False


def _load(load: Any) -> dict[str, Any]:
    if load.forces is not None:
        return {"kind": "force", "each": {group: list(force) for group, force in load.forces.items()}}
    if load.faces is not None:
        return {"kind": "pressure", "faces": load.faces, "pressure": load.pressure}
    return {"kind": "gravity", "acceleration": list(load.acceleration)}


def _free(taken: Iterable[str], name: str) -> str:
    made, k = name, 1
    while made in taken:
        k += 1
        made = f"{name}_{k}"
    return made
