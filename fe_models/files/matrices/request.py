"""What is asked of a reader of matrices, and what a reader is."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from fe_models.errors import MatrixError
from fe_models.files.matrices.foreign_matrices import ROLES, ForeignMatrices
from fe_models.foundation.words import nearest, quoted

__all__ = ["MatrixFormat", "Request", "anything"]


@dataclass(frozen=True)
class Request:
    """What the caller says of a file."""

    role: str | None = None  #: K, M or D: what the only matrix of the file is; None: the file has to say it
    names: Mapping[str, str] = field(default_factory=dict)  #: role -> name of its matrix, in files that hold several

    def role_of(self, where: str, found: str | None, hint: str = "") -> str:
        """Return the role of the only matrix of a file: as the caller says, else as the file does.

        Raises
        ------
        MatrixError
            If nobody says it.
        """
        if (role := self.role or found) is not None:
            return role
        raise MatrixError(
            f"{where}: is this the stiffness, the mass or the damping? The file does not say it{hint}; name it: "
            f'matrices = {{K = "stiffness file", M = "mass file"}}'
        )

    def chosen(
        self, where: str, usual: Mapping[str, tuple[str, ...]], available: Mapping[str, object]
    ) -> dict[str, str]:
        """Return role -> name of its matrix in a file of named matrices: as the caller says, else the usual name.

        Parameters
        ----------
        usual
            Role -> names that its program gives it, in lower case, the first that is there is taken.
        available
            The names in the file.

        Raises
        ------
        MatrixError
            If the caller names one that is not there, or nothing is found.
        """
        found = {}
        lower = {name.lower(): name for name in available}
        for role in ROLES:
            if role in self.names:
                wanted = self.names[role].lower()
                if wanted in lower:
                    found[role] = lower[wanted]
            else:
                hits = [lower[name] for name in usual.get(role, ()) if name in lower]
                found |= {role: hits[0]} if hits else {}
        if not found:
            asked = [quoted(name) for name in self.names.values()]
            expected = asked or [name for several in usual.values() for name in several]
            raise MatrixError(
                f"{where}: expected a matrix named {' or '.join(expected)}"
                f"{nearest(next(iter(self.names.values()), ''), available)}; say which is which: "
                'names = {K = "...", M = "..."}'
            )
        return found


def anything(head: bytes) -> bool:
    """Whether a file may be of a format: always, where the suffix is enough."""
    return True


@dataclass(frozen=True)
class MatrixFormat:
    """One format of matrix files and its reader."""

    name: str  #: in messages: "Abaqus matrix"
    suffixes: tuple[str, ...]  #: in lower case
    read: Callable[[Path, Request], ForeignMatrices]  #: fills what this file knows
    is_it: Callable[[bytes], bool] = (
        anything  #: asked with the first `HEAD` bytes; of one suffix, the first that says yes
    )
