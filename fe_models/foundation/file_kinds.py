"""Kinds of files, with the command that runs each and the class that describes its tables."""

from typing import NamedTuple

__all__ = ["KINDS", "Kind"]


class Kind(NamedTuple):
    """A kind of file."""

    command: str  #: that runs it
    model: str  #: class that describes its tables, as "module:class"
    is_parametric: bool = False  #: whether it may have parameters, base files and repeated tables


KINDS = {
    "job": Kind("cms reduce", "cms.jobs.job:Job", is_parametric=True),
    "correlation": Kind("cms correlate", "cms.jobs.studies.correlation_file:CorrelationFile"),
    "recovery": Kind("cms recovery", "cms.jobs.tables.recovery_section:RecoveryFile"),
    "system": Kind("floatframe run", "floatframe.files.system_file.read_system:SystemFile", is_parametric=True),
    "sweep": Kind("floatframe sweep", "floatframe.design.studies.study_file:StudyFile"),
    "optimization": Kind("floatframe optimize", "floatframe.design.optimization.design_file:DesignFile"),
    "laboratory": Kind("floatframe study", "floatframe.design.laboratory.laboratory_file:LaboratoryFile"),
    "shake": Kind("floatframe shake", "floatframe.durability.shaking.shake_file:ShakeFile"),
    "fatigue": Kind("floatframe fatigue", "floatframe.durability.fatigue.fatigue_file:FatigueFile"),
}
