"""Write an acceptance as PDF, HTML or JSON, by the suffix of the file."""

import json
from pathlib import Path

from cms.assessment.quality.errors import QualityError
from cms.jobs.acceptance.acceptance import Acceptance
from cms.jobs.acceptance.document import document_of
from fe_models.foundation.documents.write import document_content
from fe_models.foundation.paths import replace_files

__all__ = ["SUFFIXES", "write_acceptance"]


SUFFIXES = (".pdf", ".html", ".json")


def write_acceptance(acceptance: Acceptance, *paths: str | Path) -> None:
    """Write one or several forms of an acceptance, all complete or none.

    Raises
    ------
    QualityError
        If a suffix is not .pdf, .html or .json, or a file cannot be written.
    MissingExtraError
        If a PDF is wanted and reportlab (extra `pdf`) is not installed.
    """
    targets = [Path(path) for path in paths]
    for target in targets:
        require_suffix(target)
    document = document_of(acceptance) if any(target.suffix.lower() != ".json" for target in targets) else None
    contents = {}
    for target in targets:
        if target.suffix.lower() == ".json" or document is None:
            contents[target] = (json.dumps(acceptance.as_dict(), indent=2) + "\n").encode()
        else:
            contents[target] = document_content(document, target.suffix)
    try:
        replace_files(contents)
    except OSError as error:
        raise QualityError(
            f"acceptance: cannot be written: {error.strerror or error}; check folder and space"
        ) from error


def require_suffix(path: Path) -> None:
    """Raise `QualityError` unless the suffix is one of `SUFFIXES`."""
    if path.suffix.lower() not in SUFFIXES:
        raise QualityError(
            f"{path}: an acceptance is written as {', '.join(SUFFIXES)}; got {path.suffix or 'no suffix'}"
        )
