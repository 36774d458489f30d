"""The file of a laboratory study (TOML): the mechanism, the job of its flexible body, the cases, the reference."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from cms.assessment.compare.mode_counts import mode_counts
from fe_models.foundation.stages import Stages
from fe_models.foundation.toml_file import PathBeside, Table, kind_field, read_toml, validated
from floatframe.design.laboratory.cases import Case, grid
from floatframe.design.laboratory.exact_beam import ExactBeam
from floatframe.design.laboratory.full_model import MOST_DOFS, FullModel
from floatframe.design.laboratory.laboratory import CaseResult, LaboratoryResult, Reference, study
from floatframe.errors import ModelError
from floatframe.files.signals.read_signals import read_signals
from floatframe.files.system_file.keys import tuple_of_list
from floatframe.files.system_file.read_system import read_system
from floatframe.files.system_file.run_section import required_run

__all__ = ["LaboratoryFile", "read_laboratory", "run_laboratory"]


def counts(value: Any) -> Any:
    """Return numbers of modes from a list, a number, or text such as "2:12:2"."""
    if isinstance(value, str):
        try:
            return mode_counts(value)
        except Exception as error:
            raise ValueError(str(error)) from error
    return (value,) if isinstance(value, int) else tuple_of_list(value)


Words = Annotated[tuple[str, ...], BeforeValidator(tuple_of_list), Field(min_length=1)]


class VaryTable(Table):
    """[vary]: parameters whose combinations are the cases."""

    mode_sets: Words = Field(("craig-bampton",), description="a list of names of mode sets")
    n_modes: Annotated[tuple[int, ...], BeforeValidator(counts), Field(min_length=1)] = Field(
        (10,), description='a list of numbers of modes, or words such as "2:12:2"'
    )
    frames: Words = Field(("tisserand",), description='a list of "tisserand", "buckens", "nodal:INTERFACE"')
    stiffening: Annotated[tuple[bool, ...], BeforeValidator(tuple_of_list), Field(min_length=1)] = Field(
        (True,), description="a list of true and false"
    )
    parts: Annotated[tuple[int, ...], BeforeValidator(tuple_of_list), Field(min_length=1)] = Field(
        (1,), description="a list of whole numbers from 1"
    )


class ReferenceTable(Table):
    """[reference]: the full model, exact beams, a finer case, or a table of columns from another source."""

    kind: Literal["case", "full-model", "exact-beam", "file"] | None = Field(
        None, description='"case", "full-model", "exact-beam" or "file"'
    )
    most_dofs: int = Field(MOST_DOFS, ge=1, description="a whole number from 1, of a full model")
    elements: int = Field(32, ge=1, description="a whole number from 1, of exact beams")
    file: PathBeside | None = Field(None, description="the path of a table of time and sensor columns (.csv, .mat)")
    mode_set: str = Field("craig-bampton", description="the name of a mode set")
    n_modes: int = Field(10, ge=0, description="a whole number from 0")
    frame: str = Field("tisserand", description='"tisserand", "buckens" or "nodal:INTERFACE"')
    stiffening: bool = Field(True, description="true or false: whether loads and spin stiffen the bodies")
    parts: int = Field(1, ge=1, description="a whole number from 1")

    @model_validator(mode="after")
    def _one(self) -> "ReferenceTable":
        given = self.model_fields_set - {"kind"}
        kind = self.kind or ("file" if self.file is not None else "case")
        own = {"file": {"file"}, "full-model": {"most_dofs"}, "exact-beam": {"elements"}}.get(kind)
        if kind == "file" and self.file is None:
            raise ValueError('kind = "file": expected file = the path of a table')
        others = given - own if own is not None else given & {"file", "most_dofs", "elements"}
        if others:
            raise ValueError(f'kind = "{kind}": expected no {", ".join(sorted(others))}')
        return self

    @property
    def asked(self) -> Case | FullModel | ExactBeam | None:
        """The reference to compute; None if it is read from a file."""
        if self.kind == "full-model":
            return FullModel(self.most_dofs)
        if self.kind == "exact-beam":
            return ExactBeam(self.elements)
        if self.file is not None:
            return None
        return Case(self.mode_set, self.n_modes, self.frame, self.stiffening, self.parts)


class LaboratoryFile(Table):
    """The content of a laboratory file."""

    kind: str = kind_field("laboratory")
    system: PathBeside = Field(description="the path of a system file with [run] and sensors")
    body: str = Field(description="the name of its flexible body")
    job: PathBeside = Field(description="the path of the job that reduces this body")
    sensors: Annotated[tuple[str, ...], BeforeValidator(tuple_of_list)] | None = Field(
        None, description="a list of names of sensors; default: all"
    )
    cut: str = Field("rigid", description='"rigid" or "distributing", the interfaces at the cuts of parts')
    vary: VaryTable = Field(description="a table [vary]")
    reference: ReferenceTable = Field(description="a table [reference]")


def read_laboratory(path: str | Path) -> LaboratoryFile:
    """Read and check a laboratory file; `ModelError` lists every problem."""
    path = Path(path)
    return validated(LaboratoryFile, read_toml(path, ModelError), path, ModelError, context=path.parent)


def run_laboratory(
    asked: LaboratoryFile, stages: Stages | None = None, *, on_case: Callable[[CaseResult], None] | None = None
) -> LaboratoryResult:
    """Run all cases of a file.

    Raises
    ------
    FloatframeError, CmsError, FeModelsError
        If the system, the job or the reference cannot be read or run.
    """
    system, given = read_system(asked.system)
    run = required_run(given, asked.system)
    table = asked.reference
    reference: Case | FullModel | ExactBeam | Reference | None = table.asked
    if reference is None:
        assert table.file is not None
        signals = read_signals(table.file, uneven=True)
        columns = {name: signals.values[:, k] for k, name in enumerate(signals.names)}
        reference = Reference(str(table.file), signals.time, columns)
    return study(
        system,
        asked.body,
        asked.job,
        grid(**asked.vary.model_dump()),
        integrator=run.integrator,
        t_end=run.t_end,
        h=run.h,
        reference=reference,
        sensors=asked.sensors,
        cut=asked.cut,
        watch=run.watch,
        stages=stages,
        on_case=on_case,
    )
