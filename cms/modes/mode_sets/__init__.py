"""Mode sets: reduction bases as data, one function for each, listed by name in `MODE_SETS` (docs/theory.md §3)."""

from collections.abc import Callable

from cms.errors import ModeSetError
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets.assumed import assumed_modes
from cms.modes.mode_sets.balanced import balanced_truncation
from cms.modes.mode_sets.classical import (
    attachment,
    benfield_hruda,
    craig_bampton,
    craig_bampton_ir,
    guyan,
    unrestrained_attachment,
)
from cms.modes.mode_sets.free_interface import craig_chang, dual_craig_bampton, herting, macneal, normal_modes, rubin
from cms.modes.mode_sets.given_columns import user_basis
from cms.modes.mode_sets.h2_optimal import h2_optimal
from cms.modes.mode_sets.krylov import krylov
from cms.modes.mode_sets.multilevel import multilevel
from fe_models.door import Registry

__all__ = [
    "MODE_SETS",
    "assumed_modes",
    "attachment",
    "balanced_truncation",
    "benfield_hruda",
    "craig_bampton",
    "craig_bampton_ir",
    "craig_chang",
    "dual_craig_bampton",
    "guyan",
    "h2_optimal",
    "herting",
    "krylov",
    "macneal",
    "multilevel",
    "normal_modes",
    "rubin",
    "unrestrained_attachment",
    "user_basis",
]

#: mode sets by name: those of this project, and those of other packages by entry points (docs/extending.md)
MODE_SETS: Registry[Callable[..., ModeSet]] = Registry("cms.mode_sets", {
    "guyan": guyan,
    "craig-bampton": craig_bampton,
    "craig-bampton-ir": craig_bampton_ir,
    "multilevel": multilevel,
    "herting": herting,
    "benfield-hruda": benfield_hruda,
    "rubin": rubin,
    "macneal": macneal,
    "craig-chang": craig_chang,
    "dual-craig-bampton": dual_craig_bampton,
    "attachment": attachment,
    "unrestrained-attachment": unrestrained_attachment,
    "normal": normal_modes,
    "krylov": krylov,
    "balanced-truncation": balanced_truncation,
    "h2-optimal": h2_optimal,
    "assumed-modes": assumed_modes,
    "user-basis": user_basis,
}, ModeSetError)  # fmt: skip

#: mode sets with one column for each boundary dof
INTERFACE_SETS = (
    "craig-bampton", "craig-bampton-ir", "guyan", "herting", "benfield-hruda", "rubin", "macneal", "craig-chang",
    "dual-craig-bampton", "attachment", "unrestrained-attachment", "multilevel",
)  # fmt: skip
