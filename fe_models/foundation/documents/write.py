"""Documents in files: a page, a PDF, or JSON, by the ending."""

import json
from collections.abc import Callable

from fe_models.foundation.documents.document import Document, document_record
from fe_models.foundation.documents.html import html_page
from fe_models.foundation.documents.pdf import pdf_pages

__all__ = ["DOCUMENTS", "document_content"]

#: functions by the ending of the file that return its bytes
DOCUMENTS: dict[str, Callable[[Document], bytes]] = {
    ".html": lambda document: html_page(document).encode(),
    ".pdf": pdf_pages,
    ".json": lambda document: (json.dumps(document_record(document), indent=1) + "\n").encode(),
}


def document_content(document: Document, suffix: str) -> bytes:
    """Return the bytes of a file with an ending of `DOCUMENTS`."""
    return DOCUMENTS[suffix.lower()](document)
