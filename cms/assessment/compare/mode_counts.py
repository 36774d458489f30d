"""Numbers of vibration modes as text: "0:30", "0:30:5", "0,2,5,10"."""

import re

from cms.errors import CompareError
from fe_models.foundation.words import quoted

__all__ = ["mode_counts"]

MOST_COUNTS = 500  #: largest number of mode counts in one comparison; a longer list is probably a typing error


def mode_counts(text: str) -> tuple[int, ...]:
    """Return the mode counts in a range or a list, ascending.

    >>> mode_counts("0:4"), mode_counts("0:10:5"), mode_counts("3,1,8:10")
    ((0, 1, 2, 3, 4), (0, 5, 10), (1, 3, 8, 9, 10))

    Parameters
    ----------
    text
        Parts separated by commas; each is a number, a:b (both ends included) or a:b:step.

    Raises
    ------
    CompareError
        If a part is not of this form, runs downwards, or names too many numbers.
    """
    counts: set[int] = set()
    for part in text.split(","):
        words = part.strip()
        where = f"modes: {quoted(text)}: {quoted(words)}"
        if not re.fullmatch(r"\d+(:\d+){0,2}", words):
            raise CompareError(
                f"{where} is not a number of modes; expected whole numbers, 0 or more, as 0:30 "
                "(from:to), 0:30:5 (from:to:step) or 0,2,5 (a list)"
            )
        numbers = [int(word) if len(word) < 10 else 10**9 for word in words.split(":")]
        first, last = numbers[0], numbers[1] if len(numbers) > 1 else numbers[0]
        step = numbers[2] if len(numbers) > 2 else 1
        if last < first:
            raise CompareError(f"{where} runs from {first} down to {last}; expected {last}:{first}")
        if step < 1:
            raise CompareError(f"{where} has step {step}; expected 1 or more")
        if (last - first) // step >= MOST_COUNTS:
            raise CompareError(f"{where} names more than {MOST_COUNTS} numbers; take a larger step")
        counts.update(range(first, last + 1, step))
    return tuple(sorted(counts))
