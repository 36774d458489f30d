"""Origin of a body: its provenance in groups, and whether its files are unchanged."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cms.reduction.basis.damping import provenance_for_readers
from fe_models.foundation.paths import file_digest

__all__ = ["GROUPS", "SourceFile", "origin_groups", "source_files"]

#: title -> first words of provenance keys; a key belongs to the first title with matching words
GROUPS: Mapping[str, tuple[str, ...]] = {
    "versions": ("version ",),
    "reduction": ("mode set", "full dofs", "damping", "frame", "job"),
    "model": ("",),
}


@dataclass(frozen=True)
class SourceFile:
    """Source file of a body, and its current state."""

    path: str
    digest: str  #: recorded digest, sha256
    state: str  #: "unchanged", "CHANGED since", "not found"


def origin_groups(provenance: Mapping[str, str]) -> dict[str, dict[str, str]]:
    """Return texts by title and key; digests of files are only in the list of files."""
    groups: dict[str, dict[str, str]] = {title: {} for title in GROUPS}
    for key, words in provenance_for_readers(provenance).items():
        title = next(title for title, starts in GROUPS.items() if key.startswith(starts))
        groups[title][key] = words
    return {title: rows for title, rows in reversed(groups.items()) if rows}


def source_files(provenance: Mapping[str, str], folder: Path) -> tuple[SourceFile, ...]:
    """Return the files with a recorded digest; they are searched for at the recorded path, then in a folder.

    The provenance records a file as "NAME" with "NAME sha256", or as "file PATH" with its digest.
    """
    pairs = [(provenance[key.removesuffix(" sha256")], value) for key, value in provenance.items()
             if key.endswith(" sha256") and key.removesuffix(" sha256") in provenance]  # fmt: skip
    pairs += [(key.removeprefix("file "), value) for key, value in provenance.items() if key.startswith("file ")]
    found = []
    for path, digest in dict(pairs).items():
        places = [place for place in (Path(path), folder / Path(path).name) if place.is_file()]
        same = any(file_digest(place) == digest for place in places)
        state = "not found" if not places else "unchanged" if same else "CHANGED since"
        found.append(SourceFile(path, digest, state))
    return tuple(found)
