"""Complete decks of Abaqus and CalculiX: supports, loads, and the model around the mesh."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.abaqus.assembly import flat_assembly
from fe_models.files.abaqus.blocks import DeckBlock, deck_blocks, refuse_unread
from fe_models.files.abaqus.couplings import equations_in_basic_axes, read_coupling
from fe_models.files.abaqus.draft import Draft
from fe_models.files.abaqus.elements import SOLID_RULES, faces_of, read_element
from fe_models.files.abaqus.keywords import HARMLESS, PARAMETERS, check_parameters
from fe_models.files.abaqus.layups import layups_in_axes
from fe_models.files.abaqus.materials import materials_in_axes, numbers, read_material
from fe_models.files.abaqus.mesh import deck_mesh, naming_note, raw_mesh_of
from fe_models.files.abaqus.sections import ellipses_in_numbers, read_section
from fe_models.files.abaqus.thickness import sections_by_thickness
from fe_models.files.decks.deck import Deck, DeckLayer, Load
from fe_models.files.decks.ledger import Ledger
from fe_models.foundation.arrays import IntArray
from fe_models.meshes.cells.raw_mesh import RawBlock

__all__ = ["read_abaqus_deck", "read_boundary", "read_load"]

# supports and loads ---------------------------------------------------------------------------------------------------


_NAMED = {
    "ENCASTRE": (0, 1, 2, 3, 4, 5),
    "PINNED": (0, 1, 2),
    "XSYMM": (0, 4, 5),
    "YSYMM": (1, 3, 5),
    "ZSYMM": (2, 3, 4),
    "XASYMM": (1, 2, 3),
    "YASYMM": (0, 2, 4),
    "ZASYMM": (0, 1, 5),
}  #: fixed components of each named support


def read_boundary(here: str, block: DeckBlock, draft: Draft) -> None:
    """Record which components of which nodes are fixed, and under which name."""
    for line in block.lines:
        words = [word.strip() for word in line.rstrip(", ").split(",")]
        nodes = draft.nodes_of(here, words[0])
        name = "" if words[0].lstrip("+").isdigit() else words[0].rpartition(".")[2]
        if len(words) > 1 and words[1].upper() in _NAMED:
            components = set(_NAMED[words[1].upper()])
        else:
            first = int(words[1])
            last = int(words[2]) if len(words) > 2 and words[2] else first
            components = {c - 1 for c in range(first, last + 1) if 1 <= c <= 6}
        if len(words) > 3 and float(words[3] or 0) != 0:
            draft.ledger.note(
                "*BOUNDARY", "prescribed displacements: the place is an interface, the motion is not taken"
            )
        known = draft.mesh.rows_of(nodes) >= 0
        if not known.all():
            draft.ledger.note("*BOUNDARY", "nodes that are not in the deck", count=int((~known).sum()))
        for node in nodes[known].tolist():
            if components:
                draft.held.setdefault(node, {}).setdefault(name, set()).update(components)


def read_load(here: str, block: DeckBlock, draft: Draft, step: str) -> None:
    """Read the loads of one block; loads that a load case cannot represent are added to the ledger."""
    if block.keyword == "CLOAD":
        _nodal(here, block, draft, step)
        return
    for line in block.lines:
        words = [word.strip() for word in line.rstrip(", ").split(",")]
        label = words[1].upper() if len(words) > 1 else ""
        name = f"{step}_load{len(draft.loads) + 1}"
        if label == "GRAV" and len(words) >= 6:
            g = np.array(numbers(",".join(words[3:6])))
            g = float(words[2]) * g / np.linalg.norm(g)
            draft.loads.append(Load(name, acceleration=(float(g[0]), float(g[1]), float(g[2]))))
            if words[0]:
                draft.ledger.note(f"*{block.keyword}, GRAV", "acts on the whole body, not on a set of elements")
        elif block.keyword == "DSLOAD" and label == "P":
            faces = _surface_faces(here, draft, words[0])
            _pressure(draft, name, faces, words)
        elif label.startswith("P") and label[1:].isdigit():
            faces = faces_of(draft, draft.elements_of(here, words[0]), int(label[1:]))
            _pressure(draft, name, faces, words)
        else:
            why = "no load case has this kind of load"
            draft.ledger.note(f"*{block.keyword}, {label}", why, line=block.line_number)


def _nodal(here: str, block: DeckBlock, draft: Draft, step: str) -> None:
    """Add nodal forces to the load of this step."""
    forces: dict[str, np.ndarray] = {}
    for line in block.lines:
        words = [word.strip() for word in line.rstrip(", ").split(",")]
        nodes = draft.nodes_of(here, words[0])
        nodes = nodes[draft.mesh.rows_of(nodes) >= 0]
        component = int(words[1]) - 1
        # components of a rotation node are rotations of its reference node
        if len(nodes) == 1 and int(nodes[0]) in draft.rotations:
            nodes, component = np.array([draft.rotations[int(nodes[0])]]), component + 3
        if not 0 <= component < 6 or not nodes.size:
            draft.ledger.note("*CLOAD", "at no node, or of no component 1 to 6", line=block.line_number)
            continue
        for pilot in [node for node in nodes.tolist() if node in draft.pilots]:
            if component == 0:
                moment = forces.setdefault(draft.node_group(here, [pilot]), np.zeros(6))
                moment[3:] += float(words[2]) * draft.pilots[pilot]
            else:
                draft.ledger.note("*CLOAD", "at no node, or of no component 1 to 6", line=block.line_number)
        nodes = np.setdiff1d(nodes, list(draft.pilots))
        turned = [node for node in nodes.tolist() if node in draft.transformed]
        for node in turned:
            force = forces.setdefault(draft.node_group(here, [node]), np.zeros(6))
            first = component - component % 3
            force[first : first + 3] += float(words[2]) * draft.transformed[node][component % 3]
        nodes = np.setdiff1d(nodes, turned)
        if not nodes.size:
            continue
        group = draft.node_group(here, nodes, words[0] if len(nodes) > 1 else "")
        forces.setdefault(group, np.zeros(6))[component] += float(words[2])
    if forces:
        name = f"{step}_load{len(draft.loads) + 1}"
        draft.loads.append(Load(name, forces={group: tuple(f.tolist()) for group, f in forces.items()}))


def _pressure(draft: Draft, name: str, faces: dict[str, IntArray], words: list[str]) -> None:
    if not faces:
        draft.ledger.note("*DLOAD", f"pressure on {words[0]} {words[1]}: no solid has such a face")
        return
    group = f"{name}_faces"
    draft.face_blocks += [RawBlock(kind, rows, {group: np.arange(len(rows))}) for kind, rows in faces.items()]
    draft.loads.append(Load(name, faces=group, pressure=float(words[2])))


def _surface_faces(here: str, draft: Draft, name: str) -> dict[str, IntArray]:
    """Return the faces of a surface, by kind."""
    block = draft.surfaces.get(name.upper())
    found: dict[str, list[IntArray]] = {}
    for line in block.lines if block is not None else []:
        word, _, face = (part.strip() for part in line.partition(","))
        if face[1:2].isdigit():
            for kind, rows in faces_of(draft, draft.elements_of(here, word), int(face[1])).items():
                found.setdefault(kind, []).append(rows)
    return {kind: np.concatenate(rows) for kind, rows in found.items()}


# whole deck -----------------------------------------------------------------------------------------------------------


_MESH = (
    "NODE", "ELEMENT", "NSET", "ELSET", "HEADING", "PREPRINT", "PART", "END PART", "ASSEMBLY", "END ASSEMBLY",
    "INSTANCE", "END INSTANCE", "INCLUDE", "SYSTEM",
)  # fmt: skip
_MATERIAL = ("MATERIAL", "ELASTIC", "DENSITY", "EXPANSION", "CONDUCTIVITY", "SPECIFIC HEAT", "DAMPING", "DEPVAR")
_SECTIONS = (
    "SOLID SECTION", "SHELL SECTION", "BEAM SECTION", "BEAM GENERAL SECTION", "MASS", "ROTARY INERTIA", "SPRING",
    "DASHPOT", "MEMBRANE SECTION", "NODAL THICKNESS", "ORIENTATION", "TRANSFORM", "NORMAL", "DISTRIBUTION",
    "DISTRIBUTION TABLE",
)  # fmt: skip
_COUPLINGS = ("EQUATION", "MPC", "RIGID BODY", "COUPLING", "KINEMATIC", "DISTRIBUTING", "DISTRIBUTING COUPLING", "TIE")
_LOADS = ("CLOAD", "DLOAD", "DSLOAD", "GRAVITY")
_SURFACES = ("SURFACE", "SURFACE INTERACTION", "SURFACE BEHAVIOR", "FRICTION")
_NONLINEAR = {
    "PLASTIC": "the material is plastic",
    "CYCLIC HARDENING": "the material is plastic",
    "HYPERELASTIC": "the material is hyperelastic",
    "HYPERFOAM": "the material is hyperelastic",
    "CREEP": "the material creeps",
    "USER MATERIAL": "the law of the material is not in the deck",
    "DEFORMATION PLASTICITY": "the material is plastic",
    "CONTACT PAIR": "contact is not linear; reduced bodies touch in the multibody program",
    "CONTACT": "contact is not linear; reduced bodies touch in the multibody program",
    "GAP": "a gap is not linear",
    "PRE-TENSION SECTION": "the cut by which a bolt is tightened",
    "CYCLIC SYMMETRY MODEL": "the deck is a sector; the body would be the sector alone",
    "SUBMODEL": "the deck is driven by another model",
    "MODEL CHANGE": "elements come and go between steps",
    "CHANGE MATERIAL": "a material changes between steps",
    "CHANGE SOLID SECTION": "a section changes between steps",
    "CONNECTOR SECTION": "a connector",
    "BUSHING": "a connector",
    "EMBEDDED ELEMENT": "elements embedded in others",
    "ADD": "mass that is not at nodes",
    "NONSTRUCTURAL MASS": "mass that is not at nodes",
    "FLUID SECTION": "fluid elements",
}  #: reason why each keyword cannot be converted: it has mass, stiffness or constraints
#: keyword without blanks, which can be left out in CalculiX -> keyword
_SQUEEZED = {name.replace(" ", ""): name for name in (*PARAMETERS, *HARMLESS, *_NONLINEAR)}
SAME_PLANE = 1e-9  #: differences in z of plane elements divided by the size of the deck, up to which they are rounding
_FIRST = ("ELEMENT", "TRANSFORM", "SURFACE")  #: keywords that are read first, wherever they are in the deck
_SILENT = ("STEP", "END STEP", "ENDSTEP", "NO ANALYSIS")


def read_abaqus_deck(path: Path, data: bytes, *, program: str = "calculix") -> Deck:
    """Return the content of a deck of Abaqus or CalculiX.

    Parameters
    ----------
    path, data
        File name and content.
    program
        "calculix" or "abaqus", the program whose elements these are; their rules for stiffness and mass differ.

    Raises
    ------
    MeshError
        If the deck is damaged. Content that cannot be converted is in the ledger.
    """
    where = f"deck {path}"
    if program not in SOLID_RULES:
        raise MeshError(f"{where}: unknown program {program!r}; expected one of {', '.join(SOLID_RULES)}")
    included: dict[str, str] = {}
    blocks = deck_blocks(where, data.decode("utf-8", "replace"), path, included)
    blocks = [replace(block, keyword=_SQUEEZED.get(block.keyword.replace(" ", ""), block.keyword)) for block in blocks]
    refuse_unread(where, blocks)
    flat = flat_assembly(where, blocks)
    blocks, notes = flat.blocks, flat.notes
    mesh = replace(deck_mesh(where, blocks), instances=flat.instances, instance_step=flat.step)
    draft = Draft(where, program, mesh, Ledger(where))
    for note in (*notes, *mesh.notes):
        if program == "abaqus" and " line" in note and "more numbers on their line" in note:
            continue  # nodes that orient beams
        word = note.split()[0]
        draft.ledger.note(
            f"*{word}" if word in ("NSET", "ELSET") else "*ELEMENT" if "elements" in note else "*PART", note
        )
    step, steps = 0, ""
    for block in sorted(blocks, key=lambda block: block.keyword not in _FIRST):
        here = f"{where}, {block.place}: *{block.keyword}"
        check_parameters(block, draft.ledger)
        try:
            if block.keyword == "STEP":
                step += 1
                steps = f"step{step}"
            elif block.keyword == "MATERIAL":
                draft.material = block.parameters.get("NAME", "")
                read_material(block, draft)
            else:
                _take(here, block, draft, steps)
        except (ValueError, IndexError) as error:
            if isinstance(error, MeshError):
                raise
            raise MeshError(f"{here}: cannot be understood ({error}); first line below: {block.lines[:1]}") from error
    is_plain = {block.keyword for block in blocks} <= {*_MESH, "SURFACE"}
    if is_plain:
        for note in naming_note(mesh):
            draft.ledger.note("*ELEMENT", note)
        draft.sectioned += [table[:, 0] for _, _, table in mesh.elements]
    deck = _finished(path, draft)
    return replace(deck, mesh=replace(deck.mesh, included=included), is_plain_mesh=is_plain)


def _take(here: str, block: DeckBlock, draft: Draft, step: str) -> None:
    """Call the reader of one block, or add the block to the ledger."""
    keyword = block.keyword
    if keyword == "ELEMENT":
        read_element(here, block, draft)
    elif keyword in _MATERIAL:
        read_material(block, draft)
    elif keyword in _SECTIONS:
        read_section(here, block, draft)
    elif keyword in _COUPLINGS:
        read_coupling(here, block, draft)
    elif keyword == "BOUNDARY":
        read_boundary(here, block, draft)
    elif keyword in _LOADS:
        read_load(here, block, draft, step)
    elif keyword == "SURFACE":
        draft.surfaces[block.parameters.get("NAME", "").upper()] = block
    elif keyword in _NONLINEAR:
        draft.ledger.refuse(f"*{keyword}", _NONLINEAR[keyword], line=block.line_number)
    elif keyword == "INITIAL CONDITIONS":
        draft.ledger.note(f"*{keyword}", "the body starts free of stress and at the temperature of its material")
    elif keyword == "MODAL DAMPING" or keyword == "GLOBAL DAMPING":
        why = "damping is left out: give the job a table [damping]"
        draft.ledger.note(f"*{keyword}", why, line=block.line_number)
    elif keyword in HARMLESS:
        draft.ledger.note(f"*{keyword}", "belongs to the analysis, not to the body", line=block.line_number)
    elif keyword not in _MESH and keyword not in _SILENT and keyword not in _SURFACES:
        draft.ledger.refuse(f"*{keyword}", "this keyword is not known here", line=block.line_number)


def _check_plane(draft: Draft) -> None:
    """Add plane elements to the ledger if there are elements in space, or if they are not in one plane normal to z."""
    if not draft.sheets:
        return
    if len(draft.shells) > len(draft.sheets) or draft.solids or draft.lines or draft.rods:
        draft.ledger.refuse("CPS, CPE", "plane elements beside elements in space", count=len(draft.sheets))
    points = draft.mesh.coordinates[
        draft.mesh.rows_of(np.unique(np.concatenate([table[:, 1:].ravel() for _, _, table in draft.mesh.elements])))
    ]
    if np.ptp(points[:, 2]) > SAME_PLANE * max(np.ptp(points, axis=0)):
        draft.ledger.refuse("CPS, CPE", "plane elements whose nodes do not lie in one plane across z")


def _strain_in_plane(draft: Draft) -> None:
    """Assign to plane strain elements a sheet material without strain normal to the plane."""
    for k, shell in enumerate(draft.shells):
        if shell.group not in draft.strained:
            continue
        name = f"{shell.material}_plane_strain"
        sheet = draft.materials[shell.material].in_plane_strain(name) if shell.material in draft.materials else None
        if sheet is None:
            draft.ledger.refuse("CPE", f"plane strain: material {shell.material} is not isotropic, or not there")
            continue
        draft.materials[name] = sheet
        draft.shells[k] = replace(shell, material="", layers=(DeckLayer(name, shell.thickness),))


def _finished(path: Path, draft: Draft) -> Deck:
    """Return the deck of a draft after all blocks have been read."""
    equations_in_basic_axes(draft)
    ellipses_in_numbers(draft)
    sections_by_thickness(draft)
    try:
        layups_in_axes(draft)
        materials_in_axes(draft)
    except ValueError as error:
        raise MeshError(f"{draft.where}: {error}") from error
    draft.close()
    _check_plane(draft)
    supports = tuple(draft.supports_of_groups())
    mesh = raw_mesh_of(draft.mesh, [])
    if draft.moved:
        points = mesh.nodes.copy()
        points[draft.mesh.rows_of(np.array(list(draft.moved)))] = list(draft.moved.values())
        mesh = replace(mesh, nodes=points)
    spelt = {name.upper(): name for name in draft.materials}
    for kind in (draft.solids, draft.shells, draft.lines, draft.rods):
        kind[:] = [replace(each, material=spelt.get(each.material.upper(), each.material)) for each in kind]  # type: ignore
    for k, shell in enumerate(draft.shells):
        layers = tuple(replace(each, material=spelt.get(each.material.upper(), each.material)) for each in shell.layers)
        draft.shells[k] = replace(shell, layers=layers, material="" if layers else shell.material)
    _strain_in_plane(draft)
    names = {**mesh.node_sets, **draft.node_groups}
    blocks = []
    for block in mesh.blocks:
        assert block.numbers is not None
        if (block.nodes < 0).all():  # of an unknown type, which the ledger has refused
            continue
        own = {name: np.flatnonzero(np.isin(block.numbers, members)) for name, members in draft.cell_groups.items()}
        blocks.append(
            replace(block, groups={**block.groups, **{name: rows for name, rows in own.items() if rows.size}})
        )
    blocks += draft.face_blocks
    return Deck(
        path,
        draft.program,
        replace(mesh, blocks=tuple(blocks), node_sets=names, notes=()),
        draft.ledger,
        draft.materials,
        tuple(draft.solids),
        tuple(draft.shells),
        tuple(draft.lines),
        tuple(draft.masses),
        tuple(draft.springs),
        tuple(draft.rigid),
        tuple(draft.couplings),
        tuple(draft.equations),
        supports,
        tuple(draft.loads),
        tuple(draft.rods),
        plane=2 if draft.sheets else None,
        lumped=frozenset(("rods",) if draft.program == "abaqus" else ()),
    )
