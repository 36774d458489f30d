"""The formats of bodies that another program has reduced."""

from fe_models.foundation.formats import FileFormat

__all__ = ["FORMATS"]

FORMATS: tuple[FileFormat, ...] = ()  #: one line a format; `cms formats` and docs/formats.md list them
