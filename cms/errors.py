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
    """The body and the options do not allow this mode set."""


class FactorizationError(CmsError, RuntimeError):
    """A sparse matrix could not be factorised because it is singular or indefinite."""


class FactorRoomError(CmsError, RuntimeError):
    """Memory or disk space does not suffice for a factor; the matrix may be regular."""


class ForeignBodyError(CmsError, ValueError):
    """A body reduced by another program is ambiguous, or lacks data that a reduced body needs."""


class CompareError(CmsError, ValueError):
    """The requested comparison of mode sets is impossible."""


class EigenError(CmsError, RuntimeError):
    """Vibration modes did not converge to the tolerance, or their number contradicts the inertia of the matrix."""


class JobError(CmsError, ValueError):
    """The job file is invalid; the message names the key, the value and the choices."""


class MemoryBudgetError(CmsError, ValueError):
    """The reduction does not fit into the given memory, or the memory size is invalid; the message names remedies."""


class ExportError(CmsError, ValueError):
    """The reduced body cannot be written in the format of the other program."""


class RecoveryError(CmsError, ValueError):
    """The requested recovery rows cannot be computed or written."""
