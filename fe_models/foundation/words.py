"""Texts for messages: lists of choices, and the choice that was probably meant."""

import re
from collections.abc import Callable, Iterable
from difflib import get_close_matches
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fe_models.foundation.arrays import Array

__all__ = ["damage", "did_you_mean", "is_number", "nearest", "node_list", "number_list", "quoted", "shortened"]

LONGEST = 80  #: largest number of characters of a name or value in a message
MOST_MEANT = 3  #: largest number of names that may have been meant
WORD_GAP = re.compile(r"[-_ .]")  #: between the words of a name
MOST_CHOICES = 40  #: largest number of names in a message


def nearest(name: str, choices: Iterable[str]) -> str:
    """Return the end of a message about an unknown name: '; did you mean X? Choices: A, B, C'."""
    names = sorted(str(choice) for choice in choices)
    if not names:
        return "; there are no choices"
    hint = did_you_mean(name, names) or ";"
    shown = [shortened(choice) for choice in names[:MOST_CHOICES]]
    more = f" and {len(names) - MOST_CHOICES} more" if len(names) > MOST_CHOICES else ""
    return f"{hint} choices: {', '.join(shown)}{more}"


def did_you_mean(name: str, choices: Iterable[str]) -> str:
    """Return "; did you mean 'X' or 'Y'?" for an unknown name, or "" if no choice is similar.

    First come the choices that contain the name as a word (force: point-force, user-force), then the most similar one,
    then those that begin with the name.
    """
    # the cost of a comparison grows with the square of the length
    short = [choice for choice in sorted(map(str, choices)) if len(choice) <= 2 * LONGEST]
    asked = str(name)[: 2 * LONGEST]
    found = [choice for choice in short if asked and asked.lower() in WORD_GAP.split(choice.lower())]
    found = found or get_close_matches(asked, short, n=1)
    found = found or [choice for choice in short if len(asked) > 2 and choice.lower().startswith(asked.lower())]
    found = get_close_matches(asked, found, n=MOST_MEANT, cutoff=0.0)
    *others, last = [quoted(choice) for choice in found] or [""]
    return f"; did you mean {', '.join(others)}{' or ' if others else ''}{last}?" if last else ""


def shortened(text: str, longest: int = LONGEST) -> str:
    """Return a text, cut to the given number of characters."""
    return text if len(text) <= longest else f"{text[: longest - 3]}..."


def node_list(nodes: Iterable[int], positions: "Array", called: Callable[[int], str] = str) -> str:
    """Return 'node 3 at (0, 1, 2.5), node 7 at (…)' for a message; `called` returns the user's name of a node."""
    return ", ".join(f"node {called(n)} at ({number_list(positions[n])})" for n in nodes)


def number_list(values: Iterable[float], scale: float | None = None) -> str:
    """Return '0, 1, 2.5'; numbers within rounding of the scale (default: the largest of them) become 0."""
    numbers = list(values)
    scale = max(map(abs, numbers), default=0.0) if scale is None else scale
    return ", ".join(f"{0 if abs(value) <= 1e-12 * scale else value:.6g}" for value in numbers)


def is_number(word: str) -> bool:
    """Return whether a word is a number."""
    try:
        float(word)
    except ValueError:
        return False
    return True


def quoted(value: object) -> str:
    """Return a value of the user for a message: text in quotes, its first line, at most 80 characters."""
    try:
        text, *more = repr(value).splitlines() or [""]
    except (RecursionError, ValueError):  # nested too deeply, or an integer with thousands of digits
        return f"<{type(value).__name__}>"
    text = f"{text} ..." if more else text
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 4]}...{text[-1]}"


def damage(error: BaseException) -> str:
    """Return the end of a message about a file that could not be read: the probable cause, and the reader's error."""
    lines = str(error).strip().splitlines()
    said = f": {lines[0][:200]}" if lines else ""
    return f"it is damaged or of another kind ({type(error).__name__}{said})"
