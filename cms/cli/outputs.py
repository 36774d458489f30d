"""Output files of commands: suffixes are checked before the work, all files are written together at the end."""

import io
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cms.cli.console import output_path, say_written
from fe_models.foundation.documents import TABLE_SUFFIXES
from fe_models.foundation.extras import extra_module

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fe_models.foundation.documents.document import Document
    from fe_models.foundation.documents.table import Table

__all__ = ["DOCUMENTS", "PICTURES", "TABLES", "json_text", "output_file", "output_files", "write_outputs"]

TABLES = TABLE_SUFFIXES
PICTURES = (".png", ".svg", ".pdf")
DOCUMENTS = (".html", ".pdf")


def output_files(
    given: Sequence[Path] | None,
    default: Sequence[Path],
    endings: Sequence[str],
    error: type[Exception],
    *,
    overwrite_of: Iterable[Any] = (),
    needs_file: bool = False,
) -> list[Path]:
    """Return the output paths after a check, before any work, that they can be written and have known suffixes.

    Raises
    ------
    error
        If a path ends in something else, or cannot be written (`output_path`).
    MissingExtraError
        If the library that writes a PDF or Parquet is not installed.
    """
    inputs = tuple(overwrite_of)
    paths = [output_path(path, None, error, overwrite_of=inputs, needs_file=needs_file) for path in given or default]
    for path in paths:
        if path.suffix.lower() not in endings:
            raise error(f"--output {path}: expected a file name that ends in {', '.join(endings)}")
        if path.suffix.lower() == ".pdf" and ".html" in endings:
            extra_module("reportlab", extra="pdf", purpose="write a document as PDF")
        if path.suffix.lower() == ".parquet":
            from fe_models.foundation.documents.table import parquet_modules

            parquet_modules()
    return paths


def output_file(
    given: Path | None, default: Path, endings: Sequence[str], error: type[Exception], **options: Any
) -> Path:
    """Return the only output path, as in `output_files`."""
    return output_files(None if given is None else [given], [default], endings, error, **options)[0]


def json_text(record: Any) -> str:
    """Return a record as JSON for a file or the terminal."""
    return json.dumps(record, indent=2) + "\n"


def write_outputs(
    paths: Iterable[Path],
    *,
    table: Callable[[], "Table"] | None = None,
    record: Any = None,
    document: Callable[[], "Document"] | None = None,
    figure: Callable[[], "Figure | Sequence[Figure]"] | None = None,
    dpi: int = 130,
    others: Mapping[str, Callable[[Path], bytes | Mapping[Path, bytes]]] | None = None,
    is_quiet: bool = False,
) -> None:
    """Write a result in the forms given by the suffixes; all files are complete, or none is written.

    Parameters
    ----------
    paths
        Paths of `output_files`.
    table
        Returns the table, for `TABLES`.
    record
        Result in plain types, for .json, with the table under "table"; None: the table alone is written.
    document
        Returns the document, for `DOCUMENTS`.
    figure
        Returns the figure, for `PICTURES`, or the pages: one .pdf, or rod.png, rod-2.png, rod-3.png.
    dpi
        Resolution of a .png.
    others
        Functions, by suffix, that return the bytes of a path or of several paths; these files are written first.
    is_quiet
        Whether the names of the files are not printed.
    """
    from fe_models.foundation.paths import replace_files

    contents: dict[Path, bytes] = {}
    document = None if document is None else cache(document)  # the page and the PDF show the same pictures
    for path in paths:
        ending = path.suffix.lower()
        if others and ending in others:
            made = others[ending](path)
            contents |= {path: made} if isinstance(made, bytes) else made
        elif ending == ".json" and record is not None:
            contents[path] = json_text(record if table is None else {**record, "table": table().record()}).encode()
        elif ending in DOCUMENTS and document is not None:
            from fe_models.foundation.documents.write import document_content

            contents[path] = document_content(document(), ending)
        elif ending in TABLES and table is not None:
            contents[path] = table().content(ending, str(path))
        else:
            assert figure is not None  # the suffixes have been checked
            drawn = figure()
            contents |= picture_files(path, drawn if isinstance(drawn, Sequence) else [drawn], dpi)
    replace_files(contents)
    if not is_quiet:
        for path, content in contents.items():
            say_written(path, len(content))


def picture_files(path: Path, pages: "Sequence[Figure]", dpi: int) -> dict[Path, bytes]:
    """Return the contents of one .pdf with all pages, or of a picture for each page: rod.png, rod-2.png, ..."""
    ending = path.suffix.lower()
    if ending == ".pdf":
        from matplotlib.backends.backend_pdf import PdfPages

        whole = io.BytesIO()
        with PdfPages(whole) as document:
            for page in pages:
                document.savefig(page)
        return {path: whole.getvalue()}
    contents = {}
    for number, page in enumerate(pages, start=1):
        picture = io.BytesIO()
        page.savefig(picture, format=ending[1:], dpi=dpi)
        contents[path if number == 1 else path.with_stem(f"{path.stem}-{number}")] = picture.getvalue()
    return contents
