"""Memory of the geometric stiffness of a body with many interfaces, and the decision whether to compute it.

Each unit load has a matrix over all modes: 12 loads of the frame, 6 distributed over the nodes, and 6 for each
interface (for kind "nodes", of the mean motion of its nodes). Forty interfaces and two thousand modes need 9 GB, which
is too much for a default. Fewer modes (interface reduction) or loads of chosen interfaces only make it small; loads at
the other interfaces then do not stiffen the body.
"""

import os
from collections.abc import Sequence

from cms.errors import BodyError
from cms.modes.families.interface_cost import PROPOSED, duration, interface_reduction_size, operations_per_second
from fe_models.body.fe_body import FEBody

__all__ = [
    "UNASKED", "Asked", "chosen_words", "left_out_words", "require_room_for_stiffness", "stiffness_bytes",
    "stiffness_words",
]  # fmt: skip

UNASKED = 2e9  #: size of the geometric stiffness [bytes] up to which it is computed by default
HELD = 4.0  #: peak memory during the computation, relative to its size
SPARSE = 10.0  #: time of an operation of a sparse product relative to a dense product
NAMED = 5  #: number of interfaces that a note names

Asked = bool | Sequence[str] | None  #: whether to compute it, or the interfaces whose loads it includes


def n_loads(body: FEBody, asked: Asked = None) -> int:
    """Return the number of unit loads."""
    return 18 + 6 * (len(body.interfaces) if asked is None or isinstance(asked, bool) else len(set(asked)))


def stiffness_bytes(body: FEBody, n_modes: int, asked: Asked = None) -> float:
    """Return the size of the geometric stiffness of a body with this number of modes [bytes]."""
    return 8.0 * n_loads(body, asked) * n_modes**2


def stiffness_seconds(body: FEBody, n_modes: int, asked: Asked = None) -> float:
    """Estimate its processor time [s]: Phiᵀ (S Phi) with a sparse S over the nodes for each load."""
    each = float(body.n_dof) * n_modes**2 + SPARSE * (2 * body.K.nnz / 9) * 3 * n_modes
    return n_loads(body, asked) * each / operations_per_second()


def left_out_words(body: FEBody, n_modes: int) -> str:
    """Return a note that the geometric stiffness was left out because it is large; "" if it is small."""
    size = stiffness_bytes(body, n_modes)
    if size <= UNASKED:
        return ""
    return (
        f"geometric stiffness left out: {n_loads(body)} unit loads over {n_modes} modes would be {size / 1e9:.2g} GB. "
        f"{remedies(body, n_modes)}; geometric_stiffness = true computes it anyway, false omits it "
        "without this note"
    )


def stiffness_words(body: FEBody, n_modes: int, asked: Asked) -> str:
    """Return a note about the cost of a requested geometric stiffness, before the work; "" if it is small."""
    size = stiffness_bytes(body, n_modes, asked)
    if size <= UNASKED:
        return ""
    time = duration(stiffness_seconds(body, n_modes, asked))
    return (
        f"geometric stiffness of {n_loads(body, asked)} unit loads over about {n_modes} modes: {size / 1e9:.2g} GB in "
        f"the file, {HELD * size / 1e9:.2g} GB while it is made, about {time} of processor time. "
        f"{remedies(body, n_modes)}"
    )


def chosen_words(body: FEBody, asked: Asked) -> str:
    """Return a note that names the interfaces whose loads do not stiffen the body; "" if all do."""
    if asked is None or isinstance(asked, bool):
        return ""
    others = [interface.name for interface in body.interfaces if interface.name not in asked]
    if not others:
        return ""
    more = f" and {len(others) - NAMED} more" if len(others) > NAMED else ""
    return (
        f"loads at interfaces {', '.join(others[:NAMED])}{more} do not stiffen the body: geometric_stiffness names "
        f"{', '.join(asked) if asked else 'none'}"
    )


def remedies(body: FEBody, n_modes: int) -> str:
    """Describe how to make the geometric stiffness small, with the lines to write."""
    few = interface_reduction_size(body, PROPOSED) + max(0, n_modes - len(body.b))
    reduced = ""
    if few < n_modes:
        reduced = (
            f"interface_modes = {PROPOSED} in [reduction] leaves about {few} modes and "
            f"{stiffness_bytes(body, few) / 1e9:.2g} GB; "
        )
    first = body.interfaces[0].name if body.interfaces else ""
    return (
        f"{reduced}geometric_stiffness = [{first!r}] has the loads of the frame and of the interfaces it names alone, "
        f"{stiffness_bytes(body, n_modes, [first]) / 1e9:.2g} GB and about "
        f"{duration(stiffness_seconds(body, n_modes, [first]))} for one".replace("'", '"')
    )


def require_room_for_stiffness(body: FEBody, n_modes: int, asked: Asked = None) -> None:
    """Raise `BodyError` if the geometric stiffness with this number of modes does not fit into the machine's memory."""
    size, memory = stiffness_bytes(body, n_modes, asked), machine_memory()
    if HELD * size > memory:
        raise BodyError(
            f"body {body.name!r}: geometric stiffness of {n_loads(body, asked)} unit loads over about "
            f"{n_modes} modes: {size / 1e9:.3g} GB, and {HELD * size / 1e9:.3g} GB while it is made; this machine has "
            f"{memory / 1e9:.3g} GB. {remedies(body, n_modes)}; geometric_stiffness = false leaves it out"
        )


def machine_memory() -> float:
    """Return the memory of this machine [bytes]; infinite if the system does not report it."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * float(os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return float("inf")
