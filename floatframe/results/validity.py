"""Notes on the validity of a run: bodies beyond the linear range, inaccurate steps, numerical energy changes."""

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.errors import ModelError

__all__ = ["ValidityNote", "notes_from_json", "notes_to_json"]

OF_FRAMES = ("rotation", "load", "speed", "inertia")  #: kinds of notes about the linear frame of a body
#: notes on functions of time that are faster than the steps, or jump within them
OF_LAWS = ("frequency", "knots", "law")
#: kinds of notes on bushings and bearings that rotate beyond the validity of small angles
OF_ANGLES = ("angles", "tilt")
OF_ENERGY = ("energy", "damping")  #: kinds of notes about energy that the steps add or remove
KINDS = (*OF_FRAMES, "steps", "left out", *OF_ENERGY, *OF_LAWS, *OF_ANGLES)


@presented
@dataclass(frozen=True)
@checked_fields(ModelError)
class ValidityNote:
    """A note on the validity of a run: a limit that was exceeded, and the remedy.

    There is one note per body and kind for the linear frame of a body ("rotation", "load", "speed" or "inertia", fields
    of `cms.body.linear_range.Limits`); one for the steps of the run ("steps": their estimated error relative to the
    motion); one for each body whose modes left out too much of its strain energy ("left out"); one for energy that
    the steps add ("energy") and one for energy that they remove ("damping"), relative to
    the energy in motion. These name the body most affected. There is one note for each supply, load, drive or user law
    that the steps do not resolve ("frequency", "knots" of a table, "law"), and for each bushing and bearing with large
    angles ("angles", "tilt": the difference between interpretations of the angles). These notes name a place in
    the system instead of a body.

    Parameters
    ----------
    body
        Name of the body, or the place in the system.
    kind
        One of `KINDS`.
    limit
        The limit that was exceeded.
    largest
        Largest value so far; rotation in rad, otherwise a ratio.
    t_first
        Time at which the limit was first exceeded [s].
    t_largest
        Time of the largest value [s].
    is_stiffened
        Whether the body has geometric stiffness in this run.
    has_matrices
        Whether the reduced body has geometric stiffness.
    in_mean_axes
        The same rotation relative to mean axes, if the body has another frame; -1: unknown.
    advice
        Remedy, for notes about steps or energy; problem and remedy, for functions of time.
    """

    body: str
    kind: str
    limit: float
    largest: float
    t_first: float
    t_largest: float
    is_stiffened: bool = False
    has_matrices: bool = False
    in_mean_axes: float = -1.0
    advice: str = ""

    @classmethod
    def of_law(cls, kind: str, words: str, t: float) -> "ValidityNote":
        """Return the note for a sentence "where: problem; remedy" about a function of time."""
        where, _, rest = words.partition(": ")
        return cls(where, kind, 0.0, 0.0, t, t, advice=rest)

    def with_value(self, value: float, t: float) -> "ValidityNote":
        """Return the note after a value at time t; it changes if the value is the largest so far."""
        return replace(self, largest=value, t_largest=t) if value > self.largest else self

    @property
    def key(self) -> tuple[str, ...]:
        """Identification of the note; a run has one note for each key."""
        return (self.body, self.kind, self.advice) if self.kind in OF_LAWS else (self.body, self.kind)

    @property
    def is_of_a_frame(self) -> bool:
        """Whether the note concerns the linear frame of a body, which shorter steps do not improve."""
        return self.kind in OF_FRAMES

    @property
    def what(self) -> str:
        """Return the problem as text."""
        if self.kind == "steps":
            return (
                f"the error of the steps is about {100 * self.largest:.2g} % of the motion (limit "
                f"{100 * self.limit:g} %), estimated by repeating some of them as half steps"
            )
        if self.kind == "left out":
            return (
                f"its modes left out about {100 * self.largest:.2g} % of its strain energy (limit {100 * self.limit:g} "
                "%), estimated from the shapes that they lack"
            )
        if self.kind == "energy":
            return (
                f"{100 * self.largest:.2g} % of the energy in the motion comes from the steps, not from forces (limit "
                f"{100 * self.limit:g} %)"
            )
        if self.kind == "damping":
            return (
                f"numerical damping by the steps has removed {100 * self.largest:.2g} % of the energy in the motion "
                f"(limit {100 * self.limit:g} %)"
            )
        if self.kind == "angles":
            return (
                f"it rotates so far about several axes that its angles, the components of the rotation vector, differ "
                f"from Cardan angles by {100 * self.largest:.2g} % (limit {100 * self.limit:g} %)"
            )
        if self.kind == "tilt":
            return (
                "its shaft tilts so far that the sine of the tilt, on which the moment depends, is "
                f"{100 * self.largest:.2g} % below the angle (limit {100 * self.limit:g} %)"
            )
        if self.kind == "rotation":
            return f"an interface rotates by {self.largest:.3g} rad relative to the body frame (limit {self.limit:g})"
        if self.kind == "inertia":
            return (
                f"it rotates with {self.largest:.3g} of its lowest frequency as held (limit {self.limit:g}), while "
                f"inertia terms are omitted: the relative error of its deformation is of the order of "
                f"{self.largest**2:.1g}"
            )
        if self.kind == "speed":
            return f"it rotates with {self.largest:.3g} of its lowest frequency as held (limit {self.limit:g})"
        if self.is_stiffened:
            return f"its loads reach {self.largest:.3g} of its buckling loads (limit {self.limit:g})"
        change = f"{100 * self.largest:.3g} % (limit {100 * self.limit:g} %)"
        if self.has_matrices:
            return f"its loads change its stiffness by {change}"
        return f"its loads change its stiffness by about {change}, estimated from the rotation of its interfaces"

    @property
    def action(self) -> str:
        """Return the remedy as text."""
        if not self.is_of_a_frame:
            return self.advice
        if self.kind == "inertia":
            return "import it with its full mass matrix, nodal masses, or mesh and density (cms import)"
        if self.kind == "rotation" and 0 <= self.in_mean_axes < self.largest:
            frame = 'take mean axes (cms frame --to tisserand, [body] frame = "tisserand")'
            if self.in_mean_axes <= self.limit:
                return f"{frame}; relative to them it rotates by {self.in_mean_axes:.3g} rad, within the limit"
            return (
                f"{frame}; relative to them it rotates by {self.in_mean_axes:.3g} rad, still above the limit: "
                f"also {self.next_action}"
            )
        return self.next_action

    @property
    def next_action(self) -> str:
        """Return the remedy as text, for the case that another frame does not help enough."""
        if self.is_stiffened:
            more = "reduce it with more modes, or " if self.kind == "speed" else ""
            return f"{more}split it into parts (cms split, [body] part)"
        if self.has_matrices:
            return "switch its stiffening on"
        return "reduce it with geometric stiffness, or split it into parts (cms split)"

    @property
    def words(self) -> str:
        """Return the note as one sentence in the units of the system."""
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
    """Return notes as JSON text."""
    return json.dumps([asdict(note) for note in notes])


def notes_from_json(text: str) -> tuple[ValidityNote, ...]:
    """Return the notes in a JSON text.

    Raises
    ------
    ValueError
        If it is not text from `notes_to_json`.
    """
    kinds: dict[str, Any] = {part.name: part.type for part in fields(ValidityNote)}
    try:
        notes = json.loads(text)
        for note in notes:
            note.setdefault("in_mean_axes", -1.0)  # missing in older files
            note.setdefault("advice", "")
            if set(note) != set(kinds) or note["kind"] not in KINDS:
                raise ValueError
            if any(not isinstance(value, float | int if kinds[name] is float else kinds[name])
                   for name, value in note.items()):  # fmt: skip
                raise ValueError
        return tuple(ValidityNote(**note) for note in notes)
    except (TypeError, ValueError, RecursionError):
        raise ValueError("expected the notes of a run as JSON text") from None
