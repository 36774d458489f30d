"""Shells of Nastran whose stiffness is not that of one isotropic plate.

Layers (PCOMP with MAT8), given stiffness (PSHELL with MAT2 or MID4), and plane strain (PLPLANE, PSHELL with MID2 = -1).
"""

from dataclasses import replace

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.decks.deck import DeckLayer, DeckMaterial, ShellSection
from fe_models.files.nastran.bulk_data.cards import Card
from fe_models.files.nastran.deck.model import ALONG, NastranModel
from fe_models.foundation.arrays import Array

__all__ = [
    "layered_shells",
    "layers_of_card",
    "needs_matrices",
    "orthotropic_shells",
    "plane_strain_shells",
    "sheet_material",
    "stiffness_shells",
]

#: field number of THETA or MCID; that of ZOFFS follows
ANGLE_FIELD = {"CTRIA3": 6, "CTRIAR": 6, "CTRIA6": 9, "CQUAD4": 7, "CQUADR": 7, "CQUAD8": 15}
MOST_DIRECTIONS = 200  #: largest number of directions for one property; each becomes a table of the job
DIGITS = 6  #: digits to which directions must agree


def sheet_material(model: NastranModel, card: Card) -> None:
    """Read MAT8: E1, E2, NU12, G12, G1Z, G2Z, RHO; constants that a sheet does not have are assumed.

    E_3 = E_2 and nu_13 = nu_23 = 0 have no effect in shells.
    """
    E_1, E_2, nu, G = (card.real(k) for k in (2, 3, 4, 5))
    across = [card.real(k, 0.0) for k in (6, 7)]
    if not all(across):
        model.ledger.note("MAT8", "no transverse shear modulus (G1Z, G2Z), rigid there: here that of the plane, G12")
    shear = (G, across[0] or G, across[1] or G)
    density = card.real(8, 0.0) * model.wtmass
    name = card.text(1)
    model.materials[name] = DeckMaterial(name, (E_1, E_2, E_2), (nu, 0.0, 0.0), density or None, shear)


def layers_of_card(card: Card) -> tuple[DeckLayer, ...] | str:
    """Return the layers of PCOMP or PCOMPG, bottom to top, or a text with the reason if this is impossible."""
    kind = card.text(8).upper()
    if card.name == "PCOMPG":  # a number and four fields for each ply, in lines of eight
        first, step = 10, 8
    else:
        first, step = 9, 4
    if kind not in ("", "SYM"):
        return f"LAM = {kind}: only layers as they lie, or SYM"
    layers: list[DeckLayer] = []
    material, thickness = "", 0.0
    for k in range(first, len(card.fields) + 1, step):
        if not any(card.text(k + j) for j in range(4)):
            continue
        material = card.text(k) or material
        thickness = card.real(k + 1, thickness)
        if not material or not thickness > 0:
            return "a layer without material or thickness"
        layers.append(DeckLayer(material, thickness, card.real(k + 2, 0.0)))
    if not layers:
        return "no layers"
    return tuple(layers + layers[::-1] if kind == "SYM" else layers)


def layered_shells(model: NastranModel, known: Card, cards: list[Card]) -> None:
    """Convert shells of one PCOMP: a section for each offset and layup direction.

    The direction is the side from G1 to G2 rotated by THETA about the normal, or axis x of the system MCID. Z0 is the
    height of the bottom of the layers above the grid points; ZOFFS is added to it.
    """
    pid = known.text(1)
    layers = layers_of_card(known)
    if isinstance(layers, str):
        model.ledger.refuse(known.name, f"property {pid}: {layers}", count=len(cards))
        return
    layers = tuple(replace(layer, material=_layer_material(model, layer.material)) for layer in layers)
    thickness = sum(layer.thickness for layer in layers)
    bottom = known.real(2, -thickness / 2)
    section = ShellSection("", "", thickness, bottom + thickness / 2, known.real(3, 0.0) * model.wtmass, layers=layers)
    _laid_shells(model, known, cards, section)


def _layer_material(model: NastranModel, name: str) -> str:
    """Return the material of a layer; a MAT1 with its own G becomes a sheet material with this transverse modulus."""
    if name not in model.shear_moduli:
        return name
    material, G, made = model.materials[name], model.shear_moduli[name], f"{name}_sheet"
    E, nu = material.young, material.poisson
    assert isinstance(E, float)
    assert isinstance(nu, float)
    shear = (E / (2 * (1 + nu)), G, G)
    model.materials[made] = DeckMaterial(made, (E, E, E), (nu, 0.0, 0.0), material.density, shear)
    return made


def orthotropic_shells(model: NastranModel, known: Card, cards: list[Card], section: ShellSection) -> None:
    """Convert shells of a PSHELL with MAT8: one layer of its material, oriented as for PCOMP."""
    layers = (DeckLayer(section.material, section.thickness),)
    _laid_shells(model, known, cards, replace(section, material="", layers=layers))


def plane_strain_shells(model: NastranModel, known: Card, cards: list[Card]) -> None:
    """Convert membranes of PLPLANE, or of PSHELL with MID2 = -1, to a planar body in plane strain.

    The body is a slice of thickness T (1 if blank); for its material see `DeckMaterial.in_plane_strain`.
    """
    pid, is_plplane = known.text(1), known.name == "PLPLANE"
    name = known.text(2)
    made = f"{name}_plane_strain"
    sheet = model.materials[name].in_plane_strain(made) if name in model.materials else None
    why = ""
    if model.plane is None:
        why = "plane strain: only where the deck holds all points in a plane"
    elif sheet is None:
        why = f"plane strain: material {name} is not known here, or not isotropic (MAT1, MATHP)"
    elif not is_plplane and known.text(6):
        why = "MID2 = -1, plane strain, with MID3: a membrane has no transverse shear"
    elif is_plplane and known.integer(3, 0) < 0:
        why = f"CID = {known.text(3)}: axes of a body of revolution"
    elif is_plplane and np.abs(model.system(known, known.integer(3, 0), np.zeros(3))[model.plane, :2]).max() > ALONG:
        why = "CID: its x-y plane is not that of the deck"
    if why:
        model.ledger.refuse(known.name, f"property {pid}: {why}", count=len(cards))
        return
    assert sheet is not None
    assert model.plane is not None
    model.materials[made] = sheet
    T = known.real(5, 1.0) if is_plplane else known.real(3)
    added = 0.0 if is_plplane else known.real(8, 0.0) * model.wtmass
    offsets: dict[float, list[Card]] = {}
    for card in cards:
        offsets.setdefault(card.real(ANGLE_FIELD[card.name] + 1, 0.0), []).append(card)
    x, y, z = (float(v) for v in np.eye(3)[model.plane - 1])
    for offset, mine in offsets.items():
        group = f"pid_{pid}" if len(offsets) == 1 else f"pid_{pid}_offset_{offset:g}"
        for card in mine:
            model.elements[card.integer(1)] = (card.name, group)
        layers = (DeckLayer(made, T),)
        model.shells.append(ShellSection(group, "", T, offset, added, layers=layers, direction=(x, y, z)))
    why = f"plane strain: a slice of thickness {T:g}; stress across the plane, nu (sx + sy), is not in its results"
    model.ledger.note(known.name, why, count=len(cards))


def needs_matrices(model: NastranModel, known: Card) -> bool:
    """Return whether a PSHELL needs stiffness matrices: MAT2, MID4, or materials of different kinds."""
    if known.text(11):
        return True
    names = [known.text(2), known.text(4) or known.text(2), known.text(6) or known.text(2)]
    if {*names} & {card.text(1) for card in model.of("MAT2")}:
        return True
    used = [model.materials[name] for name in names if name in model.materials]
    has_mixed_axes = any(isinstance(each.young, tuple) for each in used) and len({*names}) > 1
    return len(used) == 3 and (has_mixed_axes or used[0].poisson != used[1].poisson)


def stiffness_shells(model: NastranModel, known: Card, cards: list[Card]) -> None:
    """Convert shells of a PSHELL with separate materials for membrane, bending, shear and coupling.

    (1) A = T G1, D = I G2 with I = (12I/T**3) T³/12, and H = TS G3 with TS = (TS/T) T
    (2) B = -T² G4, because Nastran's curvatures have the opposite sign: G4 = -(1/T²) ∫ G z dz (NASTRAN-95,
        mis/ta1cpd.f)
    (3) the mass is that of MID1, T RHO + NSM
    """
    pid, T = known.text(1), known.real(3)
    names = [known.text(2), known.text(4) or known.text(2), known.text(6), known.text(11)]
    G = [None if not name else _plane_matrix(model, name) for name in (*names[:2], names[3])]
    missing = [name for name, made in zip((*names[:2], names[3]), G, strict=True) if name and made is None]
    if missing:
        why = f"property {pid}: material {missing[0]} is not known here (MAT1, MAT2, MAT8)"
        model.ledger.refuse("PSHELL", why, count=len(cards))
        return
    G3 = _shear_matrix(model, names[2]) if names[2] else np.eye(2) * np.asarray(G[1])[2, 2]
    if G3 is None:
        why = f"property {pid}: MID3 = {names[2]} is not known here, or a MAT2 with G13, G23 or G33"
        model.ledger.refuse("PSHELL", why, count=len(cards))
        return
    A, D = T * np.asarray(G[0]), known.real(5, 1.0) * T**3 / 12 * np.asarray(G[1])  # (1)
    B = np.zeros((3, 3)) if G[2] is None else -(T**2) * np.asarray(G[2])  # (2)
    H = known.real(7, 5 / 6) * T * G3
    C = np.block([[A, B], [B, D]])
    if not _is_positive(C) or not _is_positive(H):
        why = f"property {pid}: its materials give a stiffness that is not positive definite"
        model.ledger.refuse("PSHELL", why, count=len(cards))
        return
    mass = _density(model, names[0]) * T + known.real(8, 0.0) * model.wtmass  # (3)
    why = f"property {pid}: stiffness by matrices, without rotary inertia; stress as in one layer of thickness T"
    model.ledger.note("PSHELL", why)
    section = ShellSection(
        "", "", T, 0.0, mass,
        stiffness=tuple(map(tuple, C.tolist())), shear_stiffness=tuple(map(tuple, H.tolist())),
    )  # fmt: skip
    _laid_shells(model, known, cards, section)


def _is_positive(matrix: Array) -> bool:
    """Return whether a symmetric matrix is positive definite, independently of the units of its rows."""
    diagonal = matrix.diagonal()
    if not (diagonal > 0).all():
        return False
    return bool(np.linalg.eigvalsh(matrix / np.sqrt(np.outer(diagonal, diagonal)))[0] > 0)


def _sheet(model: NastranModel, name: str) -> Card | None:
    """Return the MAT2 card with this number."""
    return next((card for card in model.of("MAT2") if card.text(1) == name), None)


def _plane_matrix(model: NastranModel, name: str) -> Array | None:
    """Return the (3, 3) matrix from eps_x eps_y gamma_xy to stress of a material."""
    card = _sheet(model, name)
    if card is not None:
        G = np.zeros((3, 3))
        G[np.triu_indices(3)] = [card.real(k, 0.0) for k in range(2, 8)]
        return G + np.triu(G, 1).T
    material = model.materials.get(name)
    if material is None or material.young is None or material.poisson is None:
        return None
    E, nu = np.ravel(material.young), np.ravel(material.poisson)
    first, second = float(E[0]), float(E[min(1, len(E) - 1)])
    share = 1 - nu[0] ** 2 * second / first
    shear = first / (2 * (1 + nu[0])) if material.shear is None else material.shear[0]
    Q = np.array([[first, nu[0] * second, 0.0], [nu[0] * second, second, 0.0], [0.0, 0.0, shear * share]])
    return np.asarray(Q / share)


def _shear_matrix(model: NastranModel, name: str) -> Array | None:
    """Return the (2, 2) matrix from gamma_xz gamma_yz to stress of a material; MAT2: its G11, G12 and G22."""
    card = _sheet(model, name)
    if card is not None and any(card.real(k, 0.0) for k in (4, 6, 7)):
        return None
    if card is not None:
        return np.array([[card.real(2, 0.0), card.real(3, 0.0)], [card.real(3, 0.0), card.real(5, 0.0)]])
    material = model.materials.get(name)
    if material is not None and material.shear is not None:
        return np.diag(material.shear[1:])
    G = _plane_matrix(model, name)
    return None if G is None else np.asarray(np.eye(2) * model.shear_moduli.get(name, G[2, 2]))


def _density(model: NastranModel, name: str) -> float:
    """Return the density of a material, 0 if it has none."""
    card = _sheet(model, name)
    return model.materials[name].density or 0.0 if card is None else card.real(8, 0.0) * model.wtmass


def _laid_shells(model: NastranModel, known: Card, cards: list[Card], section: ShellSection) -> None:
    pid = known.text(1)
    groups: dict[tuple[float, tuple[float, ...]], list[Card]] = {}
    for card in cards:
        direction = _direction(model, card)
        key = tuple((np.round(direction / np.linalg.norm(direction), DIGITS) + 0.0).tolist())
        groups.setdefault((card.real(ANGLE_FIELD[card.name] + 1, 0.0), key), []).append(card)
    if len(groups) > MOST_DIRECTIONS:
        why = f"property {pid}: more than {MOST_DIRECTIONS} directions of angle 0; give them by MCID"
        model.ledger.refuse(known.name, why, count=len(cards))
        return
    for k, ((offset, _), mine) in enumerate(groups.items(), start=1):
        x, y, z = (float(v) for v in _direction(model, mine[0]))
        group = f"pid_{pid}" if len(groups) == 1 else f"pid_{pid}_{k}"
        for card in mine:
            model.elements[card.integer(1)] = (card.name, group)
        model.shells.append(replace(section, group=group, offset=section.offset + offset, direction=(x, y, z)))


def _direction(model: NastranModel, card: Card) -> Array:
    """Return the layup direction (angle 0) of an element, (3,), basic axes."""
    word = card.text(ANGLE_FIELD[card.name])
    corners = [
        model.point(card, card.integer(k)) for k in ((3, 4, 5) if card.name.startswith("CTRI") else (3, 4, 5, 6))
    ]
    if word.lstrip("+").isdigit():
        if int(word) == 0:
            return np.array([1.0, 0.0, 0.0])
        return np.asarray(model.system(card, int(word), np.mean(corners, axis=0))[:, 0])
    side = corners[1] - corners[0]
    normal = np.cross(corners[2] - corners[0], corners[-1] - corners[1])
    if not np.linalg.norm(normal) > 0:
        raise MeshError(f"{card.where} {card.text(1)}: its corners span no area")
    normal = normal / np.linalg.norm(normal)
    side = side - normal * (normal @ side)
    angle = np.deg2rad(card.real(ANGLE_FIELD[card.name], 0.0))
    return np.asarray(np.cos(angle) * side + np.sin(angle) * np.cross(normal, side))
