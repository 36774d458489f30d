"""Mode sets: reduction bases as data, one function each, by name in `MODE_SETS` (THEORY §3)."""

from collections.abc import Callable

from cms.mode_set import ModeSet
from cms.mode_sets.craig_bampton import craig_bampton, guyan

__all__ = ["MODE_SETS", "craig_bampton", "guyan"]

MODE_SETS: dict[str, Callable[..., ModeSet]] = {"craig-bampton": craig_bampton, "guyan": guyan}
