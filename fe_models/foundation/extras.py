"""Optional libraries: imported only when used; a missing one is reported with the extra that installs it."""

from importlib import import_module
from types import ModuleType

from fe_models.foundation.errors import CmsError, FeModelsError

__all__ = ["MissingExtraError", "extra_module"]


class MissingExtraError(FeModelsError, CmsError, ImportError):
    """A library of an optional extra is not installed."""


def extra_module(name: str, *, extra: str, purpose: str) -> ModuleType:
    """Import a module of an optional library.

    Parameters
    ----------
    name
        Dotted name of the module.
    extra
        Extra of this project that installs the library.
    purpose
        Purpose of the library, with which the message begins, such as "OP2 files".

    Raises
    ------
    MissingExtraError
        If the library is not installed or does not load. The message contains the command that installs it.
    """
    try:
        return import_module(name)
    except (ImportError, OSError) as error:  # OSError: a shared library that the package needs is missing
        missing = isinstance(error, ModuleNotFoundError) and name.startswith(f"{error.name}")
        reason = "which is not installed" if missing else f"which does not load ({error})"
        raise MissingExtraError(
            f'{purpose}: needs {name.partition(".")[0]}, {reason}; pip install "floatframe[{extra}]"'
        ) from error
