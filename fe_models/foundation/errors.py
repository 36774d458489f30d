"""The root of all errors, and those that every package may raise.

Each package has a root of its own below it: `FeModelsError`, `CmsError`, `FloatframeError`. Leaves are also the
built-in kind that a caller would expect. What is raised on the ground about bodies and units has both roots, of
`fe_models`, where it is raised, and of `cms`, whose callers catch it.
"""

from typing import Any

__all__ = ["BodyError", "CmsError", "FeModelsError", "ModalFileError", "ReportedError", "StorageError", "UnitsError"]


class ReportedError(Exception):
    """Root of every error that is raised on purpose; its text is meant for the user."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies have the same text and attributes, whatever arguments the error was made with."""
        return remade, (type(self), self.args, self.__dict__)


def remade(kind: type[ReportedError], arguments: tuple[Any, ...], attributes: dict[str, Any]) -> ReportedError:
    """Return an error of a kind as it was."""
    error = kind.__new__(kind, *arguments)
    error.__dict__.update(attributes)
    return error


class FeModelsError(ReportedError):
    """Root of every error that `fe_models` raises on purpose."""


class CmsError(ReportedError):
    """Root of every error that `cms` raises on purpose."""


class BodyError(FeModelsError, CmsError, ValueError):
    """A finite element body, coupling or interface is not what it claims to be."""


class UnitsError(FeModelsError, CmsError, ValueError):
    """An unknown unit system, or units that do not fit together."""


class StorageError(FeModelsError, CmsError, RuntimeError):
    """Arrays that should go to disk find no room there."""


class ModalFileError(CmsError, ValueError):
    """A file is not a readable modal file."""
