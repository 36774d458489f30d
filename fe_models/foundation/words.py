"""Words for messages: the choices there are, and the one that was probably meant."""

from collections.abc import Iterable
from difflib import get_close_matches

import numpy as np
from numpy.typing import NDArray

__all__ = ["nearest", "node_list"]


def nearest(name: str, choices: Iterable[str]) -> str:
    """Return the tail of a message about an unknown name: '; did you mean X? Choices: A, B, C'."""
    names = sorted(str(choice) for choice in choices)
    if not names:
        return "; there are no choices"
    close = get_close_matches(str(name), names, n=1)
    hint = f"; did you mean {close[0]!r}?" if close else ";"
    return f"{hint} choices: {', '.join(names)}"


def node_list(nodes: Iterable[int], positions: NDArray[np.float64]) -> str:
    """Return 'node 3 at (0, 1, 2.5), node 7 at (…)' for a message."""
    return ", ".join(f"node {n} at ({', '.join(f'{x:.6g}' for x in positions[n])})" for n in nodes)
