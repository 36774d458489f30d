"""Kinds of files, with the command that runs each and the class that describes its tables."""

from importlib import import_module
from typing import Any, NamedTuple

__all__ = ["KINDS", "FileKind"]


class FileKind(NamedTuple):
    """A kind of file."""

    command: str  #: command that runs files of this kind
    model: str  #: class that describes its tables, as "module:class"
    is_parametric: bool = False  #: whether it may have parameters, base files and repeated tables

    def table_class(self) -> Any:
        """Return the class that describes its tables."""
        module, _, name = self.model.partition(":")
        return getattr(import_module(module), name)


KINDS = {
    "job": FileKind("cms reduce", "cms.jobs.job:Job", is_parametric=True),
    "correlation": FileKind("cms correlate", "cms.jobs.studies.correlation_file:CorrelationFile"),
    "recovery": FileKind("cms recovery", "cms.jobs.tables.recovery_section:RecoveryFile"),
    "system": FileKind("floatframe run", "floatframe.files.system_file.read_system:SystemFile", is_parametric=True),
    "sweep": FileKind("floatframe sweep", "floatframe.design.studies.study_file:StudyFile"),
    "optimization": FileKind("floatframe optimize", "floatframe.design.optimization.design_file:DesignFile"),
    "laboratory": FileKind("floatframe compare", "floatframe.design.laboratory.laboratory_file:LaboratoryFile"),
    "shake": FileKind("floatframe shake", "floatframe.durability.shaking.shake_file:ShakeFile"),
    "fatigue": FileKind("floatframe fatigue", "floatframe.durability.fatigue.fatigue_file:FatigueFile"),
}
