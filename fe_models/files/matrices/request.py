"""Request to a reader of matrices."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from fe_models.errors import MatrixError
from fe_models.files.matrices.foreign_matrices import ROLES
from fe_models.foundation.words import nearest, quoted

__all__ = ["Request"]


@dataclass(frozen=True)
class Request:
    """Information from the caller about a file."""

    role: str | None = None  #: role (K, M or D) of the only matrix in the file; None: the file must contain the role
    #: name of the matrix for each role, for files with several matrices
    names: Mapping[str, str] = field(default_factory=dict)

    def role_of(self, where: str, found: str | None, hint: str = "") -> str:
        """Return the role of the only matrix in a file, as given by the caller or in the file.

        Raises
        ------
        MatrixError
            If neither the caller nor the file states it.
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
        """Return the matrix name for each role in a file of named matrices: as given, otherwise the usual name.

        Parameters
        ----------
        usual
            Names that the program uses for each role, in lower case; the first one that exists is used.
        available
            Names in the file.

        Raises
        ------
        MatrixError
            If the caller requests a missing name, or nothing is found.
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
