"""Documents in files: a page, a PDF or JSON, depending on the suffix."""

import json
import os
from collections.abc import Callable
from pathlib import Path

from fe_models.foundation.documents.document import Document, document_record
from fe_models.foundation.documents.html import html_page
from fe_models.foundation.documents.pdf import pdf_pages
from fe_models.foundation.errors import TableError
from fe_models.foundation.paths import replace_file
from fe_models.foundation.words import nearest, quoted

__all__ = ["DOCUMENTS", "document_content", "write_document"]

#: functions by the ending of the file that return its bytes
DOCUMENTS: dict[str, Callable[[Document], bytes]] = {
    ".html": lambda document: html_page(document).encode(),
    ".pdf": pdf_pages,
    ".json": lambda document: (json.dumps(document_record(document), indent=1) + "\n").encode(),
}


def document_content(document: Document, suffix: str) -> bytes:
    """Return the bytes of a file with a suffix of `DOCUMENTS`."""
    return DOCUMENTS[suffix.lower()](document)


def write_document(document: Document, path: str | os.PathLike[str]) -> Path:
    """Write a document in the format of the suffix, one of `DOCUMENTS`; the file is complete or not written.

    Parameters
    ----------
    document
        A report, such as `cms.assessment.report.comparison_document` makes.
    path
        Path of the file: .html, .pdf or .json.

    Raises
    ------
    TableError
        If the ending is unknown, or the file cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() not in DOCUMENTS:
        raise TableError(
            f"document {target}: unknown ending {quoted(target.suffix)}{nearest(target.suffix.lower(), DOCUMENTS)}"
        )
    try:
        replace_file(target, document_content(document, target.suffix))
    except OSError as error:
        raise TableError(f"document {target}: cannot be written: {error.strerror or error}") from error
    return target
