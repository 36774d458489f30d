"""Notes of a run about itself: bodies beyond the range of their linear frame, steps that err, energy from nothing."""

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from typing import Any

__all__ = ["ValidityNote", "notes_from_json", "notes_to_json"]

OF_FRAMES = ("rotation", "load", "speed", "inertia")  #: kinds of notes about the linear frame of a body
OF_LAWS = ("frequency", "knots", "law")  #: about what acts over time: faster than the steps, or jumping inside them
OF_ANGLES = ("angles", "tilt")  #: about bushings and bearings that turn further than small angles allow
KINDS = (*OF_FRAMES, "steps", "energy", *OF_LAWS, *OF_ANGLES)


@dataclass(frozen=True)
class ValidityNote:
    """What a run says about itself: a limit that is passed, and what to do.

    One per body and kind where a body has left the range of its linear frame ("rotation", "load", "speed" or
    "inertia", the field of `cms.reduced_body.linear_range.Limits`); one for the steps of the run ("steps": their
    estimated error over the way of the motion) and one for its energy ("energy": what the steps have added, over what
    moves about), with the body that is most concerned. One for each supply, load, drive or law of a user that the steps
    do not follow ("frequency", "knots" of a table, "law"), with where it stands in the system in place of a body; so
    for each bushing and bearing whose angles are no small ones ("angles", "tilt": what another reading changes).
    """

    body: str
    kind: str  #: one of `KINDS`
    limit: float
    largest: float  #: so far; rotation in rad, else a ratio
    t_first: float  #: when the limit was passed [s]
    t_largest: float  #: [s]
    is_stiffened: bool = False
    has_matrices: bool = False  #: whether the reduced body holds geometric stiffness
    in_mean_axes: float = -1.0  #: the same rotation against mean axes, where the body has another frame; -1: not known
    advice: str = ""  #: what to do about steps or energy; of what acts over time: what is the matter, and what to do

    @classmethod
    def of_law(cls, kind: str, words: str, t: float) -> "ValidityNote":
        """Return the note of a sentence "where: what; what to do" about something that acts over time."""
        where, _, rest = words.partition(": ")
        return cls(where, kind, 0.0, 0.0, t, t, advice=rest)

    @property
    def key(self) -> tuple[str, ...]:
        """What a run has one note of."""
        return (self.body, self.kind, self.advice) if self.kind in OF_LAWS else (self.body, self.kind)

    @property
    def is_of_a_frame(self) -> bool:
        """Whether it is about the linear frame of a body, which shorter steps do not change."""
        return self.kind in OF_FRAMES

    @property
    def what(self) -> str:
        """Say what is too large."""
        if self.kind == "steps":
            return (
                f"the steps put it off by about {100 * self.largest:.2g} % of the motion (limit {100 * self.limit:g} "
                "%), as some of them taken again in halves tell"
            )
        if self.kind == "energy":
            return (
                f"{100 * self.largest:.2g} % of the energy in the motion comes from the steps, not from forces (limit "
                f"{100 * self.limit:g} %)"
            )
        if self.kind == "angles":
            return (
                f"it turns about several axes so far that its angles, the components of the rotation vector, are "
                f"{100 * self.largest:.2g} % off Cardan angles (limit {100 * self.limit:g} %)"
            )
        if self.kind == "tilt":
            return (
                f"its shaft tilts so far that the sine, by which its moment goes, is {100 * self.largest:.2g} % below "
                f"the angle (limit {100 * self.limit:g} %)"
            )
        if self.kind == "rotation":
            return f"an interface turns by {self.largest:.3g} rad against the body frame (limit {self.limit:g})"
        if self.kind == "inertia":
            return (
                f"it turns with {self.largest:.3g} of its lowest frequency as held (limit {self.limit:g}), while "
                f"inertia terms are left out: by the order of {self.largest**2:.1g} of its size its "
                "deformation is not known"
            )
        if self.kind == "speed":
            return f"it turns with {self.largest:.3g} of its lowest frequency as held (limit {self.limit:g})"
        if self.is_stiffened:
            return f"its loads reach {self.largest:.3g} of those that buckle it (limit {self.limit:g})"
        change = f"{100 * self.largest:.3g} % (limit {100 * self.limit:g} %)"
        if self.has_matrices:
            return f"its loads change its stiffness by {change}"
        return f"its loads change its stiffness by about {change}, estimated from the rotation of its interfaces"

    @property
    def action(self) -> str:
        """Say what to do."""
        if not self.is_of_a_frame:
            return self.advice
        if self.kind == "inertia":
            return "import it with its full mass matrix, nodal masses, or mesh and density beside (cms import)"
        if self.kind == "rotation" and 0 <= self.in_mean_axes < self.largest:
            frame = 'take mean axes (cms frame --to tisserand, [body] frame = "tisserand")'
            if self.in_mean_axes <= self.limit:
                return f"{frame}: there it turns by {self.in_mean_axes:.3g} rad, within the limit"
            return f"{frame}: there it turns by {self.in_mean_axes:.3g} rad; then {self.next_action}"
        return self.next_action

    @property
    def next_action(self) -> str:
        """Say what to do where another frame does not help, or not enough."""
        if self.is_stiffened:
            more = "reduce it with more modes, or " if self.kind == "speed" else ""
            return f"{more}split it into parts (cms split, [body] part)"
        if self.has_matrices:
            return "switch its stiffening on"
        return "reduce it with geometric stiffness, or split it into parts (cms split)"

    @property
    def words(self) -> str:
        """Say it in one sentence, in the units of the system."""
        if self.kind in OF_LAWS:
            return f"{self.body}: {self.advice}"
        if self.kind in OF_ANGLES:
            return f"{self.body}, t = {self.t_first:.6g}: {self.what}; {self.action}"
        if not self.is_of_a_frame:
            return f"body {self.body!r}, t = {self.t_first:.6g}: {self.what}; {self.action}"
        return (
            f"body {self.body!r} left the range of its {'stiffened' if self.is_stiffened else 'linear'} frame at t = "
            f"{self.t_first:.6g}: {self.what}; {self.action}"
        )


def notes_to_json(notes: Iterable[ValidityNote]) -> str:
    """Return notes as text."""
    return json.dumps([asdict(note) for note in notes])


def notes_from_json(text: str) -> tuple[ValidityNote, ...]:
    """Return the notes of a text.

    Raises
    ------
    ValueError
        If it is not one of `notes_to_json`.
    """
    kinds: dict[str, Any] = {part.name: part.type for part in fields(ValidityNote)}
    try:
        notes = json.loads(text)
        for note in notes:
            note.setdefault("in_mean_axes", -1.0)  # of older files
            note.setdefault("advice", "")
            if set(note) != set(kinds) or note["kind"] not in KINDS:
                raise ValueError
            if any(not isinstance(value, float | int if kinds[name] is float else kinds[name])
                   for name, value in note.items()):  # fmt: skip
                raise ValueError
        return tuple(ValidityNote(**note) for note in notes)
    except (TypeError, ValueError, RecursionError):
        raise ValueError("expected the notes of a run as JSON text") from None
