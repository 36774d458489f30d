"""How large the geometric stiffness of a body with many interfaces would be, and whether it is made.

A matrix over all modes belongs to each unit load: 12 of the frame, 6 spread over the nodes, and 6 of each interface; an
interface of kind "nodes" has these 6 too, of the mean motion of its nodes, however many nodes it has. With forty
interfaces and two thousand modes that is 9 GB, which nobody asked for.
"""

import os

from cms.errors import BodyError
from cms.second_order.unit_states import has_geometric_stiffness
from fe_models.body.fe_body import FEBody

__all__ = ["UNASKED", "left_out_words", "makes_stiffness", "require_room_for_stiffness", "stiffness_bytes"]

UNASKED = 2e9  #: bytes of geometric stiffness up to which it is made without being asked for
HELD = 4.0  #: times its size: what is held at once while it is made


def stiffness_bytes(body: FEBody, n_modes: int) -> float:
    """Return the size of the geometric stiffness of a body over so many modes [bytes]."""
    return 8.0 * (18 + 6 * len(body.interfaces)) * n_modes**2


def makes_stiffness(asked: bool | None, body: FEBody, n_modes: int) -> bool:
    """Return whether the geometric stiffness is made: as asked, else where the elements know it and it is not large."""
    if asked is not None:
        return asked
    return has_geometric_stiffness(body) and not left_out_words(body, n_modes)


def left_out_words(body: FEBody, n_modes: int) -> str:
    """Say that the geometric stiffness was not made, as nobody asked for one so large; nothing where it is small."""
    size = stiffness_bytes(body, n_modes)
    if size <= UNASKED:
        return ""
    return (
        f"geometric stiffness left out: {18 + 6 * len(body.interfaces)} unit loads over {n_modes} modes would be "
        f"{size / 1e9:.2g} GB. Fewer modes bring it back (interface_modes in [reduction]); geometric_stiffness = true "
        "makes it all the same, false leaves it out without this note"
    )


def require_room_for_stiffness(body: FEBody, n_modes: int) -> None:
    """Raise `BodyError` if the geometric stiffness over so many modes does not fit into the memory of this machine."""
    size, memory = stiffness_bytes(body, n_modes), machine_memory()
    if HELD * size > memory:
        raise BodyError(
            f"body {body.name!r}: geometric stiffness of {18 + 6 * len(body.interfaces)} unit loads over about "
            f"{n_modes} modes: {size / 1e9:.3g} GB, and {HELD * size / 1e9:.3g} GB while it is made; this machine has "
            f"{memory / 1e9:.3g} GB. Take fewer modes (interface_modes = 20 in [reduction] for interfaces of kind "
            "nodes), or leave it out (geometric_stiffness = false)"
        )


def machine_memory() -> float:
    """Return the memory of this machine [bytes]; without bound where the system does not tell."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * float(os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return float("inf")
