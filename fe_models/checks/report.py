"""Base class of all mesh reports: findings, and whether the mesh is usable."""

from abc import ABC, abstractmethod
from collections.abc import Container, Iterable
from dataclasses import dataclass

from fe_models.errors import MeshError
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import checked_fields

__all__ = ["Finding", "Report"]


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class Finding:
    """Error or warning about a mesh.

    Parameters
    ----------
    kind
        "inverted", "degenerate", "parts", "overlap", "transition", "units"; others only warn.
    is_error
        Whether the mesh is unusable; otherwise the finding is a warning.
    text
        Fault, place, and remedy.
    """

    kind: str
    is_error: bool
    text: str


class Report(ABC):
    """Numbers of a mesh, and findings."""

    source: str  #: file of the mesh, or a description of how it was made
    findings: tuple[Finding, ...]

    @property
    def errors(self) -> tuple[Finding, ...]:
        """Findings that make the mesh unusable."""
        return tuple(finding for finding in self.findings if finding.is_error)

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """Findings that do not make the mesh unusable."""
        return tuple(finding for finding in self.findings if not finding.is_error)

    def raise_for_errors(self, *, accept: Iterable[str] = ()) -> None:
        """Raise `MeshError` with all errors except those of the accepted kinds."""
        accepted = set(accept)
        errors = [finding.text for finding in self.errors if finding.kind not in accepted]
        if errors:
            raise MeshError(f"mesh {self.source}: " + "; ".join(errors))

    @property
    def title(self) -> str:
        """Title of the table."""
        return "Mesh"

    @abstractmethod
    def numbers(self) -> list[tuple[str, str]]:
        """Return label and value of each number, as text."""

    def rows(self, *, omit: Container[str] = ()) -> list[tuple[str, str]]:
        """Return label and text of each number and each finding, for a table, without findings of the kinds `omit`."""
        findings = [finding for finding in self.findings if finding.kind not in omit]
        return self.numbers() + [("error" if f.is_error else "warning", f.text) for f in findings]

    def lines(self) -> list[str]:
        """Return the rows as lines of text."""
        width = max(len(label) for label, _ in self.rows())
        return [f"{label:<{width}}  {value}" for label, value in self.rows()]
