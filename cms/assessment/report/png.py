"""Picture for a page, drawn into a temporary file, or omitted with a warning."""

import logging
import tempfile
from collections.abc import Callable
from pathlib import Path

from cms.assessment.rendering import RenderError

__all__ = ["png_of"]

log = logging.getLogger(__name__)


def png_of(draw: Callable[[Path], object], what: str) -> bytes | None:
    """Return the PNG bytes that a drawing function writes to a path; None, with a warning, if it fails.

    Parameters
    ----------
    what
        Name of the report part without picture, for the warning.
    """
    with tempfile.TemporaryDirectory(prefix="picture-") as folder:
        path = Path(folder) / "picture.png"
        try:
            draw(path)
        except RenderError as error:
            log.warning("%s goes without its picture: %s", what, error)
            return None
        return path.read_bytes()
