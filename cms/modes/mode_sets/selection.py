"""Checks common to all mode sets with vibration modes: how many modes are wanted, and whether that is possible."""

from typing import Protocol

from cms.errors import ModeSetError
from cms.linear_algebra.solvers.eigen import EigenResult
from cms.linear_algebra.solvers.mode_count import ModeCount
from fe_models.body.fe_body import FEBody

__all__ = ["checked_modes", "require_interfaces"]


class Finder(Protocol):
    """A method of `Families` that computes vibration modes."""

    def __call__(self, n_modes: ModeCount) -> EigenResult: ...


def require_interfaces(name: str, body: FEBody) -> None:
    """Raise `ModeSetError` if the body has no interface but the set consists of interface modes."""
    if len(body.b) == 0:
        raise ModeSetError(f"{name}: body {body.name!r} has no interface; give it at least one, or take free modes")


def checked_modes(
    name: str,
    kind: str,
    find: Finder,
    body: FEBody,
    wanted: ModeCount,
) -> EigenResult:
    """Compute the modes that a set requests.

    Parameters
    ----------
    name
        Name of the set, for messages.
    kind
        Kind of modes, for messages, such as "fixed-interface".
    find
        Computes modes by number or cutoff.
    wanted
        Number of modes, or cutoff.

    Raises
    ------
    ModeSetError
        If there are fewer dofs than modes, or no mode lies below the cutoff.
    """
    n_i, cutoff = body.n_dof - len(body.b), wanted.cutoff
    is_fixed = kind == "fixed-interface"
    if wanted.n is not None and wanted.n > (n_i if is_fixed else body.n_dof):
        raise ModeSetError(
            f"{name}: n_modes = {wanted.n}, but body {body.name!r} has {n_i} interior dofs"
            + (f"; choose 0 <= n_modes <= {n_i}" if is_fixed else f" and {body.n_dof} in all; choose fewer")
        )
    modes = find(wanted)
    if cutoff is not None and not len(modes.frequencies) and (n_i or not is_fixed):
        first = find(ModeCount(1)).frequencies[0]
        in_hertz = f"{cutoff / body.units.time:g} Hz, {first / body.units.time:.6g} Hz"
        raise ModeSetError(
            f"{name}: cutoff = {cutoff:g} lies below the first {kind} mode of body {body.name!r}, at {first:.6g} "
            f"({in_hertz}); choose a higher cutoff, or n_modes = 0"
        )
    return modes
