"""What every mode set with vibration modes asks first: how many of them, and is that possible."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from cms.errors import ModeSetError
from cms.families.families import Families
from cms.solvers.eigen import EigenResult
from fe_models.body.fe_body import FEBody

__all__ = ["checked_modes", "families_of", "require_interfaces"]


class Finder(Protocol):
    """A method of `Families` that finds vibration modes."""

    def __call__(self, *, n_modes: int | None, cutoff: float | None, verify: bool) -> EigenResult: ...


@contextmanager
def families_of(body: FEBody, families: Families | None) -> Iterator[Families]:
    """Give the shared families of the body, or new ones that end with this block.

    Raises
    ------
    ModeSetError
        If the shared families are those of another body.
    """
    if families is None:
        with Families(body) as own:
            yield own
        return
    if families.body is not body:
        raise ModeSetError(
            f"families: made for body {families.body.name!r}, but the mode set is asked of another one, {body.name!r}; "
            "make Families of the very body"
        )
    yield families


def require_interfaces(name: str, body: FEBody) -> None:
    """Refuse a body without interfaces in a set that is made of interface modes."""
    if len(body.b) == 0:
        raise ModeSetError(f"{name}: body {body.name!r} has no interface; give it at least one, or take free modes")


def checked_modes(
    name: str,
    kind: str,
    find: Finder,
    body: FEBody,
    *,
    n_modes: int | None,
    cutoff: float | None,
    verify: bool,
) -> EigenResult:
    """Find the modes a set asks for.

    Parameters
    ----------
    name
        The set, for messages.
    kind
        The modes, for messages, such as "fixed-interface".
    find
        Finds modes by count or cutoff.

    Raises
    ------
    ModeSetError
        If not exactly one of `n_modes` and `cutoff` is given, there are fewer dofs than modes, or no mode lies below
        the cutoff.
    """
    if (n_modes is None) == (cutoff is None):
        raise ModeSetError(f"{name}: expected either n_modes or cutoff, got n_modes = {n_modes}, cutoff = {cutoff}")
    if n_modes is not None and n_modes < 0:
        raise ModeSetError(f"{name}: n_modes = {n_modes}; expected 0 or more")
    if cutoff is not None and not cutoff > 0:
        raise ModeSetError(f"{name}: cutoff = {cutoff}; expected a frequency above 0")
    n_i = body.n_dof - len(body.b)
    if n_modes is not None and n_modes >= n_i:
        raise ModeSetError(
            f"{name}: n_modes = {n_modes}, but body {body.name!r} has {n_i} interior dofs; choose 0 <= n_modes < {n_i}"
        )
    modes = find(n_modes=n_modes, cutoff=cutoff, verify=verify)
    if cutoff is not None and not len(modes.frequencies):
        first = find(n_modes=1, cutoff=None, verify=False).frequencies[0]
        in_hertz = f"{cutoff / body.units.time:g} Hz, {first / body.units.time:.6g} Hz"
        raise ModeSetError(
            f"{name}: cutoff = {cutoff:g} lies below the first {kind} mode of body {body.name!r}, at {first:.6g} "
            f"({in_hertz}); choose a higher cutoff, or n_modes = 0"
        )
    return modes
