"""A body, or in its place its `Families`, which several mode sets share to use one factorisation."""

from collections.abc import Iterator
from contextlib import contextmanager

from cms.modes.families.families import Families
from fe_models.body.fe_body import FEBody

__all__ = ["body_of", "families_of"]


@contextmanager
def families_of(body: FEBody | Families) -> Iterator[Families]:
    """Yield the shared families, or new families of the body that are closed at the end of the block."""
    if isinstance(body, Families):
        yield body
        return
    with Families(body) as own:
        yield own


def body_of(body: FEBody | Families) -> FEBody:
    """Return the body, from the body itself or from its families."""
    return body.body if isinstance(body, Families) else body
