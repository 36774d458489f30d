"""Errors of this package: one root, leaves that are also the built-in kind a caller would expect."""

from fe_models.foundation.errors import BodyError, CmsError, ModalFileError, UnitsError

__all__ = [
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
    """A mode set cannot be made from this body with these options."""


class FactorizationError(CmsError, RuntimeError):
    """A sparse matrix could not be factorised: singular or indefinite."""


class FactorRoomError(CmsError, RuntimeError):
    """Memory or disk have no room for a factor; this says nothing about the matrix."""


class ForeignBodyError(CmsError, ValueError):
    """A body that another program has reduced cannot be read truthfully, or lacks what a reduced body needs."""


class CompareError(CmsError, ValueError):
    """A comparison of mode sets cannot be made as it was asked for."""


class EigenError(CmsError, RuntimeError):
    """Vibration modes could not be found to the tolerance, or their number does not agree with the inertia."""


class JobError(CmsError, ValueError):
    """A job file is not valid; the text names the key, the value and the choices."""


class MemoryBudgetError(CmsError, ValueError):
    """A reduction does not fit into the memory it may take, or that is no size; the text says what would help."""


class ExportError(CmsError, ValueError):
    """A reduced body cannot be written in the format of another program."""


class RecoveryError(CmsError, ValueError):
    """Recovery rows cannot be made as they were asked for, or written."""
