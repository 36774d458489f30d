"""The formats that a reduced body is written in."""

from fe_models.foundation.formats import FileFormat

__all__ = ["FORMATS"]

FORMATS: tuple[FileFormat, ...] = ()  #: one line a format; `cms formats` and docs/formats.md list them
