"""Errors of this package: one root class, and leaves that also derive from `ValueError` or `RuntimeError`."""

from fe_models.foundation.errors import ArgumentError, BodyError, CmsError, ModalFileError, UnitsError

__all__ = [
    "ArgumentError",
    "BodyError",
    "CmsError",
    "CompareError",
    "EigenError",
    "ExportError",
    "FactorRoomError",
    "FactorizationError",
    "ForeignBodyError",
    "JobError",
    "MemoryBudgetError",
    "ModalFileError",
    "ModeSetError",
    "RecoveryError",
    "UnitsError",
]


class ModeSetError(CmsError, ValueError):
    """The mode set cannot be made from this body with these options."""


class FactorizationError(CmsError, RuntimeError):
    """A sparse matrix could not be factorised because it is singular or indefinite."""


class FactorRoomError(CmsError, RuntimeError):
    """There is not enough memory or disk space for a factor; this says nothing about the matrix."""


class ForeignBodyError(CmsError, ValueError):
    """A body reduced by another program cannot be read without guessing, or lacks data that a reduced body needs."""


class CompareError(CmsError, ValueError):
    """The comparison of mode sets cannot be made as requested."""


class EigenError(CmsError, RuntimeError):
    """Vibration modes were not found to the tolerance, or their number contradicts the inertia of the matrix."""


class JobError(CmsError, ValueError):
    """The job file is invalid; the message names the key, the value and the choices."""


class MemoryBudgetError(CmsError, ValueError):
    """The reduction does not fit into the given memory, or the size is invalid; the message says what would help."""


class ExportError(CmsError, ValueError):
    """The reduced body cannot be written in the format of the other program."""


class RecoveryError(CmsError, ValueError):
    """Recovery rows cannot be made as requested, or cannot be written."""
