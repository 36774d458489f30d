"""Complete decks of Abaqus and CalculiX: the model around the mesh that `fe_models.files.abaqus` reads."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.abaqus import deck_mesh, naming_note, raw_mesh_of
from fe_models.files.abaqus_deck import DeckBlock, deck_blocks, refuse_unread
from fe_models.files.decks.abaqus.assembly import flat_assembly
from fe_models.files.decks.abaqus.couplings import equations_in_basic_axes, read_coupling
from fe_models.files.decks.abaqus.draft import Draft
from fe_models.files.decks.abaqus.elements import read_element
from fe_models.files.decks.abaqus.keywords import HARMLESS, PARAMETERS, check_parameters
from fe_models.files.decks.abaqus.layups import layups_in_axes
from fe_models.files.decks.abaqus.loads import read_boundary, read_load
from fe_models.files.decks.abaqus.materials import materials_in_axes, read_material
from fe_models.files.decks.abaqus.sections import ellipses_in_numbers, read_section
from fe_models.files.decks.abaqus.thickness import sections_by_thickness
from fe_models.files.decks.deck import Deck, DeckLayer
from fe_models.files.decks.ledger import Ledger

__all__ = ["PROGRAMS", "read_abaqus_deck"]

PROGRAMS = ("calculix", "abaqus")  #: programs whose rules for integration and mass may apply to a deck
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
#: keyword without blanks, which CalculiX lets one leave out -> keyword
_SQUEEZED = {name.replace(" ", ""): name for name in (*PARAMETERS, *HARMLESS, *_NONLINEAR)}
SAME_PLANE = 1e-9  #: differences in z of plane elements, over the size of the deck, up to which they are in one plane
_FIRST = ("ELEMENT", "TRANSFORM", "SURFACE")  #: keywords that are read before the others, which may precede them
_SILENT = ("STEP", "END STEP", "ENDSTEP", "NO ANALYSIS")


def read_abaqus_deck(path: Path, data: bytes, *, program: str = "calculix") -> Deck:
    """Return the content of a deck of Abaqus or CalculiX.

    Parameters
    ----------
    path, data
        File name and content.
    program
        "calculix" or "abaqus": whose elements these are, which integrate stiffness and mass by other points.

    Raises
    ------
    MeshError
        If the deck is damaged. What cannot be taken over is in the ledger.
    """
    where = f"deck {path}"
    if program not in PROGRAMS:
        raise MeshError(f"{where}: unknown program {program!r}; expected one of {', '.join(PROGRAMS)}")
    included: dict[str, str] = {}
    blocks = deck_blocks(where, data.decode("utf-8", "replace"), path.parent, included)
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
                read_material(here, block, draft)
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
        read_material(here, block, draft)
    elif keyword in _SECTIONS:
        read_section(here, block, draft)
    elif keyword in _COUPLINGS:
        read_coupling(here, block, draft)
    elif keyword == "BOUNDARY":
        read_boundary(here, block, draft, step)
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
