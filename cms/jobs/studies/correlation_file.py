"""The correlation file (TOML): test, model, pairing of points and modes, and the update."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, field_validator, model_validator

from cms.assessment.correlation.correlate import Correlation, DampingFit, Pairing, correlate_modes, fit_damping
from cms.assessment.correlation.errors import CorrelationError
from cms.assessment.correlation.measured import MeasuredModes
from cms.assessment.correlation.mode_table import read_mode_table
from cms.assessment.correlation.model_modes import modes_of_body, modes_of_file
from cms.assessment.correlation.points import TOLERANCE, Placement
from cms.assessment.correlation.universal_file import read_universal
from cms.assessment.correlation.update import MODES_BEYOND, Parameter, Update, update_model
from cms.body.modal_file.file import read
from cms.jobs.body_of_job import is_of_mesh, job_body, model_of_job
from cms.jobs.job import Job
from fe_models.assembly.assemble import assemble
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.parametric_file import read_parametric
from fe_models.foundation.presentation import presented
from fe_models.foundation.stages import Stages
from fe_models.foundation.toml_file import PathBeside, Table, Vector3, kind_field, read_toml, validated, value_of
from fe_models.foundation.units import Units, unit_system
from fe_models.meshes.mesh import Mesh, drop_unused_nodes

__all__ = ["CorrelationFile", "CorrelationResult", "correlate", "read_correlation"]

METRES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}
OF_MESH = ("body", "mesh_size")  #: tables of a job that affect its mesh
UNIVERSAL, TABLES = (".unv", ".uff", ".unv55", ".ufb"), (".csv", ".txt")


class ModelTable(Table):
    """[model]: the job of the full model, or a modal file."""

    job: PathBeside | None = Field(None, description="the path of a job file")
    body: PathBeside | None = Field(None, description="the path of a modal file")
    held: tuple[str, ...] = Field((), strict=False, description="a list of interfaces that the test holds; none: free")

    @model_validator(mode="after")
    def _one(self) -> "ModelTable":
        if (self.job is None) == (self.body is None):
            raise ValueError("expected either job or body")
        if self.body is not None and self.held:
            raise ValueError("held: needs the full model; give job instead of body")
        return self


class TestTable(Table):
    """[test]: the measured modes and where their points are."""

    __test__ = False  # not a class of tests for pytest
    file: PathBeside = Field(description="the path of a universal file (.unv, .uff) or a table (.csv)")
    length: str | None = Field(None, description=f"the unit of length of the file, one of {', '.join(METRES)}")
    modes: tuple[int, ...] | None = Field(
        None, strict=False, description="a list of modes to take, from 1; default: all"
    )
    match: str = Field("place", description='"place" (nearest node) or "number" (points are numbers of nodes)')
    tolerance: float = Field(TOLERANCE, gt=0, description="a share of the size of the model, above 0")
    origin: Vector3 = Field((0.0, 0.0, 0.0), description="the origin of the test in the mesh, [x, y, z]")
    axes: tuple[Vector3, ...] = Field(
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), strict=False,
        description="the axes of the test in the mesh, three unit vectors",
    )  # fmt: skip
    nodes: dict[str, int | str] = Field({}, description="a table {point = node} of points that are placed by hand")

    @field_validator("length")
    @classmethod
    def _known(cls, value: str | None) -> str | None:
        if value is not None and value not in METRES:
            raise ValueError(f"expected one of {', '.join(METRES)}")
        return value

    @field_validator("nodes")
    @classmethod
    def _numbers(cls, value: dict[str, int | str]) -> dict[str, int | str]:
        for key in value:
            if not key.isdecimal():
                raise ValueError(f"expected numbers of points as keys, got {key!r}")
        return value


class PairsTable(Table):
    """[pairs]: rules for pairing modes."""

    by_hand: tuple[tuple[int, int], ...] = Field(
        (), strict=False, description="pairs [measured, computed], from 1; 0 for no partner"
    )
    least_mac: float = Field(0.5, ge=0, le=1, description="a number from 0 to 1")
    window: float = Field(0.5, gt=0, description="a share of the measured frequency, above 0")


class ParameterTable(Table):
    """[update.parameters.NAME]: a number of the job."""

    path: str = Field(description='a key path of the job, such as "materials.steel.young"')
    spread: float = Field(0.1, gt=0, description="the standard deviation that is expected, as a share, above 0")
    least: float | None = Field(None, description="the least value")
    most: float | None = Field(None, description="the greatest value")


class UpdateTable(Table):
    """[update]: the parameters, and the accuracy of the measured frequencies."""

    frequency_spread: float = Field(0.005, gt=0, description="the standard deviation of a frequency, a share above 0")
    iterations: int = Field(20, ge=1, le=200, description="a whole number from 1 to 200")
    parameters: dict[str, ParameterTable] = Field(description="tables [update.parameters.NAME]", min_length=1)


class CorrelationFile(Table):
    """A complete correlation file."""

    kind: str = kind_field("correlation")
    model: ModelTable = Field(description="a table [model]")
    test: TestTable = Field(description="a table [test]")
    band: float | None = Field(
        None, gt=0, description="the highest computed frequency [Hz]; default 1.3 of the highest measured"
    )
    pairs: PairsTable = Field(default_factory=lambda: PairsTable.model_validate({}), description="a table [pairs]")
    update: UpdateTable | None = Field(None, description="a table [update]")


@presented
@dataclass(frozen=True, eq=False)
class CorrelationResult:
    """Results of a correlation."""

    correlation: Correlation  #: correlation with the model before the update
    update: Update | None
    damping: tuple[DampingFit, ...]  #: fits to the measured damping ratios; empty: the test has no damping ratios
    document: dict[str, Any] | None  #: the job with updated values; None: no update

    @property
    def last(self) -> Correlation:
        """Correlation with the updated model, or with the only one."""
        return self.correlation if self.update is None else self.update.after

    def as_dict(self) -> dict[str, Any]:
        """Return all results in plain types."""
        record: dict[str, Any] = {"correlation" if self.update is None else "before": self.correlation.as_dict()}
        if self.update is not None:
            record |= {"after": self.last.as_dict(), "update": self.update.as_dict()}
        record["damping"] = [
            {"kind": fit.kind, "values": fit.values.tolist(), "spread": fit.spread.tolist(), "misfit": fit.misfit}
            for fit in self.damping
        ]
        return record


def read_correlation(path: str | Path) -> CorrelationFile:
    """Read and check a correlation file; raise `CorrelationError` with a list of all problems."""
    path = Path(path)
    return validated(CorrelationFile, read_toml(path, CorrelationError), path, CorrelationError, context=path.parent)


def correlate(file: CorrelationFile | Path | str, stages: Stages | None = None) -> CorrelationResult:
    """Read test and model, compare them, and update the job if requested.

    Parameters
    ----------
    file
        A correlation file (docs/test_and_model.md), or one that has been read.
    stages
        Called with the name of each stage.

    Raises
    ------
    CmsError, FeModelsError
        If test or model cannot be read, or their points or modes do not fit.
    """
    asked = file if isinstance(file, CorrelationFile) else read_correlation(file)
    stages = stages or Stages()
    placement, pairing = placement_of(asked.test), Pairing(**asked.pairs.model_dump())
    if asked.model.body is not None:
        if asked.update is not None:
            raise CorrelationError("update: needs the full model; give job instead of body")
        reduced = read(asked.model.body)
        measured = measured_modes(asked.test, reduced.units.length)
        with stages("compare"):
            found = correlate_modes(measured, modes_of_file(reduced), placement=placement, pairing=pairing)
        return CorrelationResult(found, None, damping_of(measured, reduced.units), None)
    assert asked.model.job is not None
    path = asked.model.job
    content = read_parametric(path, CorrelationError)
    job = validated(Job, content, path, CorrelationError, context=path.parent)
    units = unit_system(job.body.units)
    measured = measured_modes(asked.test, units.length)
    if asked.update is None:
        with stages("full model"):
            body = job_body(named(job, path))
        top = asked.band or MODES_BEYOND * float(measured.frequencies.max())
        with stages("compare"):
            model = modes_of_body(body, top, held=asked.model.held)
            found = correlate_modes(measured, model, placement=placement, pairing=pairing)
        return CorrelationResult(found, None, damping_of(measured, units), None)
    parameters = tuple(parameter_of(name, table, content, path) for name, table in asked.update.parameters.items())
    with stages("update"):
        update = update_model(
            measured, body_maker(path, parameters), parameters, held=asked.model.held, placement=placement,
            pairing=pairing, frequency_spread=asked.update.frequency_spread, most_iterations=asked.update.iterations,
        )  # fmt: skip
    values = {p.path: float(v) for p, v in zip(parameters, update.values, strict=True)}
    document = read_parametric(path, CorrelationError, values)
    return CorrelationResult(update.before, update, damping_of(measured, units), document)


def body_maker(path: Path, parameters: tuple[Parameter, ...]) -> Callable[[Array], FEBody]:
    """Return a function from parameter values to the coupled body of the job; it caches the last bodies.

    A solid mesh is read and checked once, unless a parameter affects the mesh.
    """
    made: dict[bytes, FEBody] = {}
    meshes: list[Mesh] = []
    is_of_body = any(p.path.split(".")[0] in OF_MESH for p in parameters)

    def body_at(values: Array) -> FEBody:
        key = np.asarray(values, float).tobytes()
        if key not in made:
            if len(made) > 1:
                made.pop(next(iter(made)))
            given = {p.path: float(v) for p, v in zip(parameters, values, strict=True)}
            document = read_parametric(path, CorrelationError, given)
            job = named(validated(Job, document, path, CorrelationError, context=path.parent), path)
            if is_of_mesh(job) and not is_of_body and not meshes:
                model = model_of_job(job, Stages())
                assemble(model)  # checks the mesh
                meshes.append(drop_unused_nodes(model.mesh))
            made[key] = job_body(job, source=meshes[0] if meshes else None)
        return made[key]

    return body_at


def named(job: Job, path: Path) -> Job:
    """Return the job with a name."""
    return job if job.body.name else job.model_copy(update={"body": job.body.model_copy(update={"name": path.stem})})


def placement_of(test: TestTable) -> Placement:
    """Return the position of the test axes in the mesh."""
    by_hand = {int(point): node for point, node in test.nodes.items()}
    return Placement(test.origin, test.axes, by_hand, test.match, test.tolerance)


def measured_modes(test: TestTable, length: float) -> MeasuredModes:
    """Read the measured modes, with positions in the length unit of the model."""
    suffix, given = test.file.suffix.lower(), None if test.length is None else METRES[test.length]
    if not test.file.is_file():
        raise CorrelationError(f"test.file: {test.file}: no such file")
    if suffix not in (*UNIVERSAL, *TABLES):
        raise CorrelationError(f"test.file: {test.file}: expected {', '.join((*UNIVERSAL, *TABLES))}, got {suffix}")
    reader = read_universal if suffix in UNIVERSAL else read_mode_table
    measured = reader(test.file, length, given=given)
    if test.modes is None:
        return measured
    wrong = [k for k in test.modes if not 1 <= k <= measured.n_modes]
    if wrong or not test.modes:
        raise CorrelationError(f"test.modes: expected numbers from 1 to {measured.n_modes}, got {list(test.modes)}")
    return measured.chosen([k - 1 for k in test.modes])


def parameter_of(name: str, table: ParameterTable, content: dict[str, Any], path: Path) -> Parameter:
    """Return a parameter with its current value in the job."""
    where = f"update.parameters.{name}"
    value = value_of(content, table.path, str(path), CorrelationError)
    if isinstance(value, bool) or not isinstance(value, int | float) or not value:
        raise CorrelationError(f"{where}: {table.path}: expected a number of the job that is not 0, got {value!r}")
    at_least = -0.9 if table.least is None else table.least / value - 1
    at_most = 9.0 if table.most is None else table.most / value - 1
    least, most = min(at_least, at_most), max(at_least, at_most)
    if not least <= 0 <= most:
        raise CorrelationError(f"{where}: the value {value:g} lies outside least and most")
    return Parameter(name, table.path, float(value), table.spread, least, most)


def damping_of(measured: MeasuredModes, units: Units) -> tuple[DampingFit, ...]:
    """Return damping fits for a job in these units if at least two measured ratios are known."""
    is_known = measured.damping > 0 if measured.damping.size else np.zeros(0, bool)
    if is_known.sum() < 2:
        return ()
    return fit_damping(measured.frequencies[is_known], measured.damping[is_known], time=units.time)
