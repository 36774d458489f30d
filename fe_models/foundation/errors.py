"""The root of all errors, and the errors that every package may raise.

Each package has its own base class below this one: `FeModelsError`, `CmsError`, `FloatframeError`. Leaves also derive
from the built-in error that a caller would expect. Errors about bodies and units derive from the roots of both
`fe_models`, which raises them, and `cms`, whose callers catch them.
"""

from typing import Any

__all__ = [
    "ArgumentError",
    "BodyError",
    "CmsError",
    "FeModelsError",
    "ModalFileError",
    "ReportedError",
    "StorageError",
    "TableError",
    "UnitsError",
]


class ReportedError(Exception):
    """Root of every intentional error; its text is written for the user."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Make copies with the same text and attributes, for any arguments of the constructor."""
        return remade, (type(self), self.args, self.__dict__)


def remade(kind: type[ReportedError], arguments: tuple[Any, ...], attributes: dict[str, Any]) -> ReportedError:
    """Restore an error from its class, arguments and attributes."""
    error = kind.__new__(kind, *arguments)
    error.__dict__.update(attributes)
    return error


class FeModelsError(ReportedError):
    """Root of every intentional error of `fe_models`."""


class CmsError(ReportedError):
    """Root of every intentional error of `cms`."""


class ArgumentError(FeModelsError, CmsError, TypeError):
    """A public function received an argument of the wrong type."""


class BodyError(FeModelsError, CmsError, ValueError):
    """A finite element body, coupling or interface is invalid."""


class UnitsError(FeModelsError, CmsError, ValueError):
    """The unit system is unknown, or units are inconsistent."""


class StorageError(FeModelsError, CmsError, RuntimeError):
    """Disk space is insufficient for arrays that are stored on disk."""


class TableError(FeModelsError, CmsError, ValueError):
    """A table cannot be made, written or read."""


class ModalFileError(CmsError, ValueError):
    """The file is not a readable modal file."""
