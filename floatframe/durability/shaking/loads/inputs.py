"""Inputs by name, and checks before they are applied."""

from fe_models.foundation.words import nearest, quoted
from floatframe.durability.shaking.structure.model import DIRECTIONS, ShakenModel
from floatframe.errors import ModelError

__all__ = ["band_notes", "input_index", "require_damped"]

LEAST_DAMPING = 1e-9  #: damping ratio below which a mode counts as undamped
MARGIN = 1.5  #: modes up to this multiple of the upper band frequency affect the response in the band


def input_index(model: ShakenModel, name: str, where: str) -> int:
    """Return the index of an input by its name such as "base:x" or "load case a"; with one base, "x" is enough.

    Raises
    ------
    ModelError
        If there is none; the message suggests the nearest name.
    """
    short = {f"{model.bases[0].name}:{entry}": entry for entry in DIRECTIONS} if len(model.bases) == 1 else {}
    for k, full in enumerate(model.inputs):
        if name in (full, short.get(full)):
            return k
    choices = [*short.values(), *model.inputs]
    raise ModelError(f"{where}: no base direction or force {quoted(name)}{nearest(name, choices)}")


def require_damped(model: ShakenModel, first: float, last: float, where: str) -> None:
    """Raise `ModelError` if a mode in a band has no damping, because its response would be infinite."""
    f, zeta = model.frequencies, model.damping_ratios
    bare = [k for k in range(len(f) - model.n_residual) if first <= f[k] <= last and zeta[k] < LEAST_DAMPING]
    if bare:
        k = bare[0]
        raise ModelError(
            f"{where}: mode {k + 1} at {f[k]:.6g} Hz lies in the band {first:g} to {last:g} Hz and has no damping "
            f"({len(bare)} such modes): its response there is infinite. Give damping by ratio, Q, table or band"
        )


def band_notes(model: ShakenModel, last: float, where: str) -> list[str]:
    """Return notes on the part of the response that the modes do not contain, for a band up to `last` [Hz]."""
    f = model.frequencies[: len(model.frequencies) - model.n_residual]
    if not len(f) or last * MARGIN <= f[-1]:
        return []
    relation = "below" if f[-1] < last else "near"
    return [
        f"{where}: the band ends at {last:g} Hz, the last mode with the bases held is at {f[-1]:.4g} Hz, {relation} "
        "its end; "
        f"modes between there and {MARGIN * last:.4g} Hz contribute only their static part; "
        "reduce the "
        "body with more modes"
    ]
