"""A body, or in its place the families of the body, which many mode sets share: one factorisation serves them all."""

from collections.abc import Iterator
from contextlib import contextmanager

from cms.families.families import Families
from fe_models.body.fe_body import FEBody

__all__ = ["body_of", "families_of"]


@contextmanager
def families_of(body: FEBody | Families) -> Iterator[Families]:
    """Give the families that are shared, or new ones of the body, which end with this block."""
    if isinstance(body, Families):
        yield body
        return
    with Families(body) as own:
        yield own


def body_of(body: FEBody | Families) -> FEBody:
    """Return the body itself, where its families may be given in its place."""
    return body.body if isinstance(body, Families) else body
