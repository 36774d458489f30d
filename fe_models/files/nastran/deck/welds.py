"""Welds of Nastran (CWELD with PWELD): a round bar between its piercing points on two shell patches."""

from dataclasses import dataclass, field

import numpy as np

from fe_models.assembly.constraints import weighted_motion
from fe_models.elements.beams.sections import round_properties
from fe_models.files.decks.deck import DeckSpring, as_triad, axes_along
from fe_models.files.decks.equations import Row
from fe_models.files.nastran.bulk_data.cards import Card
from fe_models.files.nastran.deck.layups import layers_of_card
from fe_models.files.nastran.deck.model import ALL, NastranModel
from fe_models.foundation.arrays import Array

__all__ = ["read_welds"]

#: number of corner grids of each shell card that a patch may contain
CORNERS = {"CTRIA3": 3, "CTRIAR": 3, "CQUAD4": 4, "CQUADR": 4}
INSIDE = 1e-6  #: largest distance of a piercing point outside its patch, in natural coordinates
CLOSE = 1e-12  #: change of natural coordinates at which an iteration ends
SAME_LENGTH = 1e-3  #: relative difference between the length of a spot weld and half of both thicknesses
LONGEST, SHORTEST = 5.0, 0.2  #: defaults of LDMAX and LDMIN


@dataclass(frozen=True)
class _Patch:
    """Flat or bilinear patch with three or four corners."""

    grids: tuple[int, ...]
    corners: Array  #: corner positions, (n, 3)

    def at(self, place: Array) -> tuple[Array, Array, Array]:
        """Return N, (n,), its derivatives in natural coordinates, (2, n), and the tangents, (2, 3)."""
        r, s = place
        if len(self.grids) == 3:
            N, dN = np.array([1 - r - s, r, s]), np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
        else:
            N = np.array([(1 - r) * (1 - s), (1 + r) * (1 - s), (1 + r) * (1 + s), (1 - r) * (1 + s)]) / 4
            dN = np.array([[s - 1, 1 - s, 1 + s, -1 - s], [r - 1, -1 - r, 1 + r, 1 - r]]) / 4
        return N, dN, dN @ self.corners

    def has(self, place: Array) -> bool:
        """Return whether a point, given in natural coordinates, is in the patch."""
        if len(self.grids) == 3:
            return bool(min(*place, 1 - place.sum()) > -INSIDE)
        return bool(np.abs(place).max() < 1 + INSIDE)

    def pierce(self, point: Array, along: Array) -> Array | None:
        """Return the natural coordinates at which a line pierces the patch, (2,); None if it does not."""
        place, t = np.full(2, 1 / 3) if len(self.grids) == 3 else np.zeros(2), 0.0
        for _ in range(30):
            N, _, tangents = self.at(place)
            J = np.column_stack([*tangents, -along])
            if abs(np.linalg.det(J)) <= 1e-9 * np.prod(np.linalg.norm(J, axis=0)):
                return None
            step = np.linalg.solve(J, point + t * along - N @ self.corners)
            place, t = place + step[:2], t + step[2]
            if np.abs(step[:2]).max() < CLOSE:
                return np.asarray(place) if self.has(place) else None
        return None

    def foot(self, point: Array) -> Array | None:
        """Return the natural coordinates of the normal projection of a point, (2,); None if it is not in the patch."""
        place: Array | None = np.full(2, 1 / 3) if len(self.grids) == 3 else np.zeros(2)
        for _ in range(100):
            assert place is not None
            before = place
            place = self.pierce(point, np.cross(*self.at(place)[2]))
            if place is None or np.abs(place - before).max() < 10 * CLOSE:
                return place
        return None

    def motion(self, place: Array, *, rotations: bool = True) -> Array:
        """Return the motion of a point of the patch due to translations of its corners, (6 or 3, 3 n).

        (1) u = Σ N_i u_i
        (2) theta by Kirchhoff's condition: with axes x, y in the patch and z normal to it, theta_x = w,y,
            theta_y = -w,x and theta_z = (v,x - u,y)/2
        """
        N, dN, tangents = self.at(place)
        translation = np.kron(N, np.eye(3))  # (1)
        if not rotations:
            return np.asarray(translation)
        x = tangents[0] / np.linalg.norm(tangents[0])
        z = np.cross(*tangents)
        z = z / np.linalg.norm(z)
        y = np.cross(z, x)
        by_x, by_y = np.linalg.solve(tangents @ np.column_stack([x, y]), dN)
        theta = np.kron(by_y, np.outer(x, z)) - np.kron(by_x, np.outer(y, z))  # (2)
        theta += np.kron(by_x, np.outer(z, y)) / 2 - np.kron(by_y, np.outer(z, x)) / 2
        return np.vstack([translation, theta])


@dataclass
class _Shells:
    """Shells of the deck as patches, by number, property and corner."""

    patches: dict[int, _Patch] = field(default_factory=dict)
    cards: dict[int, Card] = field(default_factory=dict)
    by_property: dict[int, list[int]] = field(default_factory=dict)
    at_corner: dict[tuple[int, int], list[int]] = field(default_factory=dict)  #: shells by property and corner grid

    def beside(self, number: int) -> list[int]:
        """Return a shell, and the other shells of its property with a common corner."""
        pid = _property(self.cards[number])
        around = [each for grid in self.patches[number].grids for each in self.at_corner[pid, grid]]
        return list(dict.fromkeys([number, *around]))


def _property(card: Card) -> int:
    return card.integer(2, card.integer(1))


def _shells_of(model: NastranModel) -> _Shells:
    shells = _Shells()
    for card in model.of(*CORNERS):
        number, pid = card.integer(1), _property(card)
        grids = tuple(card.integer(3 + k) for k in range(CORNERS[card.name]))
        shells.patches[number] = _Patch(grids, np.array([model.point(card, grid) for grid in grids]))
        shells.cards[number] = card
        shells.by_property.setdefault(pid, []).append(number)
        for grid in grids:
            shells.at_corner.setdefault((pid, grid), []).append(number)
    return shells


def read_welds(model: NastranModel) -> None:
    """Convert each CWELD to a massless round bar between two points that follow patches.

    (1) The ends are GA and GB, or the projections of GS onto both patches. Without a patch B, GS is end B.
    (2) GRIDID and ELEMID: an end has the motion of its patch at this point (`_Patch.motion`).
    (3) ELPAT and PARTPAT: four points around an end follow the shells on which they lie, projected along the axis of
        the weld; the end has their mean motion. The points are the corners of a square with the area pi D²/4 of the
        weld.
    (4) ALIGN: the ends are grid points.
    (5) A uniform bar is equivalent to a spring at its middle with the stiffnesses EA/L, 12 EI/(L³ (1 + Phi)), GJ/L and
        EI/L, where Phi = 12 EI/(G A_s L²).
    """
    cards = model.of("CWELD")
    shells = _shells_of(model) if cards else _Shells()
    for card in cards:
        why = _weld(model, shells, card)
        if why:
            model.ledger.refuse("CWELD", why)


def _weld(model: NastranModel, shells: _Shells, card: Card) -> str:
    """Add a weld; return a text with the reason if it cannot be converted."""
    known = model.property_of(card, "PWELD")
    if known is None:
        return f"names PWELD {card.text(2)}, which is not defined"
    material, D = model.materials.get(known.text(2)), known.real(3)
    if material is None or not isinstance(material.young, float):
        return f"material {known.text(2)} is not known here, or not isotropic"
    if not D > 0:
        return f"PWELD {known.text(1)}: D must be above zero"
    kind = card.text(4).upper()
    if kind == "ALIGN":
        numbers = [card.integer(5), card.integer(6)]
        ends = np.array([model.point(card, number) for number in numbers])
        thickness = 0.0
    elif kind in ("ELEMID", "ELPAT", "PARTPAT", "GRIDID"):
        made = _patched_ends(model, shells, card, kind, D)
        if isinstance(made, str):
            return made
        numbers, ends, thickness = made
    else:
        return f"{kind or 'blank'}: expected PARTPAT, ELPAT, ELEMID, GRIDID or ALIGN"
    L = float(np.linalg.norm(ends[1] - ends[0]))
    why = _length_why(known, L, D, thickness)
    if why:
        return why
    E, G = material.young, model.shear_modulus(known.text(2))
    assert isinstance(material.poisson, float)
    bar = round_properties(D / 2, 0.0, material.poisson)
    bend = E * bar.Iy
    across = 12 * bend / (L**3 * (1 + 12 * bend / (G * bar.A_sy * L**2)))  # (5)
    stiffness = (E * bar.A / L, across, across, G * bar.J / L, bend / L, bend / L)
    names = [model.group(card, [number]) for number in numbers]
    triad = as_triad(axes_along(ends[1] - ends[0]))
    model.springs.append(DeckSpring((names[0], names[1]), stiffness, triad=triad))
    why = "a massless round bar between points that follow both patches, by the formulas of the documentation"
    model.ledger.note("CWELD", why)
    return ""


def _length_why(known: Card, L: float, D: float, thickness: float) -> str:
    """Return why the length of a weld is ambiguous; empty if it is not.

    Older versions of Nastran scale the stiffness of a weld that is shorter than LDMIN D or longer than LDMAX D; newer
    ones do not. The length of a spot weld is half of the sum of both thicknesses. Some versions move its ends to this
    length, others scale its stiffness.
    """
    if not L > 0:
        return "has no length between its ends"
    kind = known.text(8).upper()
    if kind == "SPOT" and thickness:
        if abs(L - thickness) > SAME_LENGTH * L:
            return f"SPOT: its length {L:g} is not half of both thicknesses, {thickness:g}: versions of Nastran differ"
        return ""
    if kind not in ("", "SPOT"):
        return f"PWELD {known.text(1)}: TYPE = {kind}: expected SPOT or a blank field"
    low, high = known.real(9, SHORTEST), known.real(10, LONGEST)
    if not low <= L / D <= high:
        return (
            f"its length is {L / D:.3g} D, not between LDMIN = {low:g} and LDMAX = {high:g}: versions of Nastran differ"
        )
    return ""


def _patched_ends(
    model: NastranModel, shells: _Shells, card: Card, kind: str, D: float
) -> tuple[list[int], Array, float] | str:
    """Return nodes and positions of both ends, and half of the sum of both thicknesses (0 if there is no patch B)."""
    given = [card.integer(k, 0) for k in (5, 6)]
    start = _place(model, card)
    if start is None and not all(given):
        return "has neither GS nor GA and GB"
    patches: list[tuple[_Patch, Array, list[int]]] = []
    points = [model.point(card, number) if number else start for number in given]
    fields = (range(9, 17), range(17, 25)) if kind == "GRIDID" else (range(9, 10), range(10, 11))
    thickness = 0.0
    for end in (0, 1):
        words = [card.text(k) for k in fields[end]]
        if end == 1 and not any(words) and kind in ("GRIDID", "ELEMID"):
            break
        point = points[end]
        assert point is not None
        found = _patch_at(model, shells, card, kind, words, end, point)
        if isinstance(found, str):
            return found
        patches.append(found)
        thickness += _thickness(model, shells, found[2]) / 2
    feet = [patch.at(place)[0] @ patch.corners for patch, place, _ in patches]
    ends = [model.point(card, given[k]) if given[k] else foot for k, foot in enumerate(feet)]
    if len(patches) == 1:  # to a point
        if not card.integer(3, 0):
            return "without a patch B, which needs GS"
        ends, given[1], thickness = [*ends, model.point(card, card.integer(3))], card.integer(3), 0.0
    along = ends[1] - ends[0]
    if not np.linalg.norm(along) > 0:
        return "has no length between its ends"
    for k, (patch, place, around) in enumerate(patches):
        number = given[k] or model.new_point(ends[k])
        given[k] = number
        if kind in ("GRIDID", "ELEMID"):
            motion, grids = _arm(ends[k] - feet[k]) @ patch.motion(place), list(patch.grids)  # (2)
        else:
            made = _mean_of_four(shells, around, ends[k], along, D)
            if made is None:
                return f"reaches over the edge of its patch {'AB'[k]} (D = {D:g})"
            motion, grids = made  # (3)
        if number in grids:
            return f"G{'AB'[k]} = {number} is a grid point of its own patch; expected a point of its own, or ALIGN"
        for c in ALL:
            row: Row = {(number, c): 1.0}
            for j, grid in enumerate(grids):
                row |= {(grid, i): -float(motion[c, 3 * j + i]) for i in range(3) if motion[c, 3 * j + i]}
            model.plain_rows.append(row)
    return given, np.array(ends), thickness


def _arm(r: Array) -> Array:
    """Return the (6, 6) motion of a point at r due to the motion of another point."""
    T = np.eye(6)
    T[:3, 3:] = [[0, r[2], -r[1]], [-r[2], 0, r[0]], [r[1], -r[0], 0]]
    return T


def _place(model: NastranModel, card: Card) -> Array | None:
    """Return the position of a weld: GS, otherwise GA, otherwise XS, YS, ZS in basic axes."""
    for k in (3, 5):
        if card.integer(k, 0):
            return model.point(card, card.integer(k))
    if card.text(4).upper() in ("ELPAT", "PARTPAT") and any(card.text(k) for k in (17, 18, 19)):
        return np.array([card.real(k, 0.0) for k in (17, 18, 19)])
    return None


def _patch_at(
    model: NastranModel, shells: _Shells, card: Card, kind: str, words: list[str], end: int, point: Array
) -> tuple[_Patch, Array, list[int]] | str:
    """Return the patch at a point, the projection of the point, and the shells around it; or a text with the reason."""
    side = "AB"[end]
    if kind == "GRIDID":
        letters = card.text(7).upper()
        shape = letters[end] if end < len(letters) else ""
        numbers = [int(word) for word in words if word]
        if len(numbers) != {"Q": 4, "T": 3}.get(shape):
            return f"SPTYP = {letters or '(blank)'}: patch {side} needs {shape or 'Q or T'} with its corners alone"
        patch = _Patch(tuple(numbers), np.array([model.point(card, number) for number in numbers]))
        place = patch.foot(point)
        return (patch, place, []) if place is not None else f"has no normal projection on its patch {side}"
    word = words[0]
    if not word.isdigit():
        return f"patch {side}: expected a number, got {word or '(blank)'!r}"
    if kind == "PARTPAT":
        candidates = shells.by_property.get(int(word), [])
        middles = np.array([shells.patches[n].corners.mean(axis=0) for n in candidates]).reshape(-1, 3)
        candidates = [candidates[k] for k in np.argsort(np.linalg.norm(middles - point, axis=1), kind="stable")]
    elif int(word) in shells.patches:
        candidates = [int(word)] if kind == "ELEMID" else shells.beside(int(word))
    else:
        candidates = []
    if not candidates:
        return f"patch {side}: {'property' if kind == 'PARTPAT' else 'shell'} {word} has no {', '.join(CORNERS)}"
    best: tuple[float, _Patch, Array, int] | None = None
    for number in candidates:
        patch = shells.patches[number]
        size = float(np.linalg.norm(np.ptp(patch.corners, axis=0)))
        if best is not None and np.linalg.norm(patch.corners.mean(axis=0) - point) - size > best[0]:
            continue
        place = patch.foot(point)
        if place is None:
            continue
        distance = float(np.linalg.norm(patch.at(place)[0] @ patch.corners - point))
        if best is None or distance < best[0] - INSIDE * size:
            best = (distance, patch, place, number)
    if best is None:
        return f"has no normal projection on its patch {side}"
    return best[1], best[2], shells.beside(best[3])


def _mean_of_four(
    shells: _Shells, around: list[int], end: Array, along: Array, D: float
) -> tuple[Array, list[int]] | None:
    """Step (3) of `read_welds`: return the motion of an end due to grid translations, (6, 3 n), and the points."""
    _, y, z = axes_along(along)
    half = np.sqrt(np.pi) * D / 4
    points, parts = [], []
    for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
        start = end + half * (a * y + b * z)
        hits = [(shells.patches[n], shells.patches[n].pierce(start, along)) for n in around]
        inside = [(patch, place) for patch, place in hits if place is not None]
        if not inside:
            return None
        patch, place = min(inside, key=lambda each: _gap(each[0], each[1], start))
        points.append(patch.at(place)[0] @ patch.corners)
        parts.append((patch, patch.motion(place, rotations=False)))
    grids = list(dict.fromkeys(grid for patch, _ in parts for grid in patch.grids))
    T = np.zeros((12, 3 * len(grids)))
    for k, (patch, motion) in enumerate(parts):
        columns = np.concatenate([3 * grids.index(grid) + np.arange(3) for grid in patch.grids])
        T[3 * k : 3 * k + 3, columns] = motion
    weights = np.tile([1.0, 1.0, 1.0, 0.0, 0.0, 0.0], (4, 1))
    A = weighted_motion(np.array(points), weights, end).reshape(6, 4, 6)[:, :, :3].reshape(6, 12)
    return A @ T, grids


def _gap(patch: _Patch, place: Array, point: Array) -> float:
    return float(np.linalg.norm(patch.at(place)[0] @ patch.corners - point))


def _thickness(model: NastranModel, shells: _Shells, around: list[int]) -> float:
    """Return the thickness of the first of these shells; 0 if there is none."""
    if not around:
        return 0.0
    known = model.property_of(shells.cards[around[0]], "PSHELL", "PCOMP", "PCOMPG")
    if known is None:
        return 0.0
    if known.name == "PSHELL":
        return known.real(3, 0.0)
    layers = layers_of_card(known)
    return 0.0 if isinstance(layers, str) else sum(layer.thickness for layer in layers)
