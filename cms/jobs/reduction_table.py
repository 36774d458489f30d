"""The table [reduction] of a job: the mode set, its options, and the body frame (docs/job_file.md)."""

import inspect
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, StringConstraints, field_validator, model_validator

from cms.errors import ModeSetError
from cms.linear_algebra.memory.size import memory_bytes
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.linear_algebra.solvers.registry import SOLVERS
from cms.modes.mode_sets import MODE_SETS
from cms.modes.mode_sets.axis_functions import AXIS_FUNCTIONS
from cms.modes.mode_sets.extra_columns import EXTRA_COLUMNS
from cms.modes.mode_sets.given_columns import OVER
from cms.reduction.basis.damping import (
    CUSTOMARY_STEPS,
    Damping,
    ModalDamping,
    PerModeDamping,
    RampDamping,
    RayleighDamping,
)
from cms.reduction.basis.strain_damping import StrainDamping, read_strain_damping
from fe_models.foundation.arrays import MOTION_COMPONENTS
from fe_models.foundation.tasks.task_map import WorkerError
from fe_models.foundation.tasks.workers import WORKERS_HELP, checked_workers
from fe_models.foundation.toml_file import Matrix3, Range, Table, Vector3, choice, existing_file, is_no_number
from fe_models.foundation.words import nearest, quoted

__all__ = [
    "FRAMES",
    "SET_OPTIONS",
    "DampingSection",
    "LoadSection",
    "NeighbourSection",
    "ReductionSection",
    "mode_set_options",
    "named_interfaces",
]


FRAMES = ("nodal", "tisserand", "buckens")
#: names of `cms.assessment.compare.mode_selection`, whose import would slow down every command
MEASURE_NAMES = ("frequency", "frf", "estimate")
SET_OPTIONS = (
    "n_modes", "cutoff", "verify", "free", "loads", "neighbours", "n_blocks", "shifts", "tolerance", "band",
    "load_cases", "damping_ratio", "n_rich", "functions", "n_axial", "n_bending", "n_torsion", "axis", "point",
    "poisson", "columns", "columns_over", "inputs", "outputs", "inertia_relief", "cutoff_factor",
    "workers", "static", "max_iterations",
)  # fmt: skip
#: keys that belong to some mode sets only
AUTO = "auto"  #: text in place of a number of modes: use the fewest modes that meet `error` over `band`
AUTO_OPTIONS = ("error", "band", "measure")  #: keys that belong to n_modes = "auto"

Name = Annotated[str, StringConstraints(min_length=1)]
Positive = Annotated[float, Field(gt=0)]
Rows = tuple[tuple[float, ...], ...]


def components(value: Any) -> tuple[str, ...]:
    """Return one component or a list of components of an interface."""
    return each_once(value, MOTION_COMPONENTS, "a list of components", "component")


def each_once(value: Any, choices: Collection[str], wanted: str, kind: str) -> tuple[str, ...]:
    """Return one of the choices, or a list of distinct choices."""
    words = [value] if isinstance(value, str) else value
    if not isinstance(words, list | tuple) or not words or len(set(map(str, words))) < len(words):
        raise ValueError(f"expected {wanted}, each once, of {', '.join(choices)}")
    for word in words:
        if word not in choices:
            raise ValueError(f"unknown {kind} {quoted(word)}{nearest(str(word), choices)}")
    return tuple(words)


def amount(value: Any) -> tuple[float, float, float]:
    """Return one non-negative number for all axes, or three."""
    values = [value] * 3 if not isinstance(value, list | tuple) else value
    if len(values) != 3 or any(is_no_number(x) or x < 0 for x in values):
        raise ValueError("expected one number, 0 or more, or three, [x, y, z]")
    return float(values[0]), float(values[1]), float(values[2])


def amount_or_matrix(value: Any) -> Rows:
    """Return one number or three as a single row, or six rows of six numbers."""
    if isinstance(value, list | tuple) and value and isinstance(value[0], list | tuple):
        if [len(row) for row in value if isinstance(row, list | tuple)] != [6] * 6 or len(value) != 6:
            raise ValueError("expected one number, three, or six rows of six numbers")
        if any(is_no_number(x) for row in value for x in row):
            raise ValueError("expected numbers in every row")
        return tuple(tuple(float(x) for x in row) for row in value)
    return (amount(value),)


def count_or_auto(value: Any) -> Any:
    """Return a number of modes, or "auto"."""
    if value != AUTO and (isinstance(value, bool) or not isinstance(value, int) or value < 0):
        raise ValueError('expected a whole number, 0 or more, of vibration modes, or "auto"')
    return value


def shift_list(value: Any) -> tuple[float, ...]:
    """Return one expansion frequency, or a list of them."""
    values = value if isinstance(value, list | tuple) else [value]
    if not values or any(is_no_number(x) or x < 0 for x in values):
        raise ValueError("expected a list of frequencies, 0 or more, in Hz")
    return tuple(float(x) for x in values)


def places(value: Any) -> tuple[str, ...]:
    """Return one name or a list of names of interfaces, each with or without a component."""
    words = [value] if isinstance(value, str) else value
    if not isinstance(words, list | tuple) or not words or any(not isinstance(w, str) or not w for w in words):
        raise ValueError('expected a list of interfaces, or with a component, such as "big_end uz"')
    return tuple(words)


def extras(value: Any) -> tuple[str, ...]:
    """Return one kind of extra columns, or a list of kinds."""
    return each_once(value, EXTRA_COLUMNS, "a list", "extra columns")


def workers_key(value: Any) -> int | str:
    """Return a number of processes, or the text that names a Dask cluster."""
    if isinstance(value, bool) or not isinstance(value, int | str):
        raise ValueError(f"expected {WORKERS_HELP}")
    try:
        return checked_workers(value)
    except WorkerError as error:
        raise ValueError(str(error).partition(": ")[2]) from None


WorkersKey = Annotated[int | str, BeforeValidator(workers_key, json_schema_input_type=Any)]
Components = Annotated[tuple[str, ...], BeforeValidator(components, json_schema_input_type=Any)]
Amount = Annotated[tuple[float, float, float], BeforeValidator(amount, json_schema_input_type=Any)]
AmountOrMatrix = Annotated[Rows, BeforeValidator(amount_or_matrix, json_schema_input_type=Any)]
CountOrAuto = Annotated[int | str, BeforeValidator(count_or_auto, json_schema_input_type=Any)]
Count = Annotated[int, Field(ge=0)]
Shifts = Annotated[tuple[float, ...], BeforeValidator(shift_list, json_schema_input_type=Any)]
Places = Annotated[tuple[str, ...], BeforeValidator(places, json_schema_input_type=Any)]


def memory_size(value: Any) -> Any:
    """Return a checked memory size with its unit."""
    if not isinstance(value, str):
        raise ValueError('expected a number with a unit, text, such as "8GB"')
    memory_bytes(value)
    return value


Memory = Annotated[str, BeforeValidator(memory_size, json_schema_input_type=Any)]
Extras = Annotated[tuple[str, ...], BeforeValidator(extras, json_schema_input_type=Any)]


class LoadSection(Table):
    """[reduction.loads.NAME]: mass and stiffness of the neighbours at one interface."""

    mass: AmountOrMatrix | None = Field(None, description="a number, 0 or more, or six rows of six")
    inertia: Amount | None = Field(None, description="a number, 0 or more, or three, [x, y, z]")
    stiffness: AmountOrMatrix | None = Field(None, description="a number, 0 or more, or three, or six rows of six")
    rotational_stiffness: Amount | None = Field(None, description="a number, 0 or more, or three, [x, y, z]")

    @model_validator(mode="after")
    def _once(self) -> "LoadSection":
        for matrix, rest in (("mass", "inertia"), ("stiffness", "rotational_stiffness")):
            given = getattr(self, matrix)
            if given is not None and len(given) == 6 and getattr(self, rest) is not None:
                raise ValueError(f"{matrix} as six rows holds the {rest} too; remove {rest}")
        if self.mass is not None and len(self.mass) == 1 and len(set(self.mass[0])) > 1:
            raise ValueError("mass: expected one number, or six rows of six numbers")
        parts = [row for part in (self.mass, self.stiffness) if part for row in part]
        parts += [part for part in (self.inertia, self.rotational_stiffness) if part]
        if not any(x for row in parts for x in row):
            raise ValueError("expected a mass, inertia, stiffness or rotational_stiffness above 0")
        return self


class NeighbourSection(Table):
    """[[reduction.neighbours]]: a neighbouring body, whose mass and stiffness are condensed to shared interfaces."""

    job: Annotated[Path, BeforeValidator(existing_file("job file"))] = Field(
        description="the path of the neighbour's job file, relative to this one"
    )
    interfaces: dict[str, str] = Field(description='a table {"our interface" = "its interface"}')

    @field_validator("interfaces")
    @classmethod
    def _some(cls, value: dict[str, str]) -> dict[str, str]:
        if not value:
            raise ValueError('expected at least one pair, {"our interface" = "its interface"}')
        return value


def held_dofs(value: Any) -> tuple[tuple[int | str, int | str], ...]:
    """Return six pairs of node and component."""
    pairs = value if isinstance(value, list | tuple) else ()
    if len(pairs) != 6 or not all(isinstance(p, list | tuple) and len(p) == 2 and is_dof(*p) for p in pairs):
        raise ValueError(
            "expected six pairs [node, component 0-5], nodes counted from 0, or [number of a node, ux to rz]"
        )
    return tuple((node, component) for node, component in pairs)


def is_dof(node: Any, component: Any) -> bool:
    """Return whether the pair is a node index with a component 0 to 5, or a node number with a component name."""
    if component in MOTION_COMPONENTS:
        return (type(node) is int and node >= 0) or isinstance(node, str)
    return type(node) is int and type(component) is int and node >= 0 and 0 <= component <= 5


HeldDofs = Annotated[tuple[tuple[int | str, int | str], ...], BeforeValidator(held_dofs, json_schema_input_type=Any)]


class ReductionSection(Table):
    """[reduction]: the mode set, its options, and the body frame."""

    set: choice("mode set", lambda: tuple(MODE_SETS)) = Field(  # type: ignore[valid-type]
        "craig-bampton", description="the name of a mode set"
    )
    n_modes: CountOrAuto | None = Field(None, description='a whole number, 0 or more, of vibration modes, or "auto"')
    error: Annotated[float, Field(gt=0, lt=1)] | None = Field(
        None, description='a number between 0 and 1, the error that n_modes = "auto" meets'
    )
    band: Range | None = Field(None, description="two frequencies in Hz, [from, to]")
    measure: choice("measure", lambda: MEASURE_NAMES) | None = Field(  # type: ignore[valid-type]
        None, description=f"one of {', '.join(MEASURE_NAMES)}"
    )
    cutoff: Positive | None = Field(None, description="a number above 0, the highest frequency of the modes [Hz]")
    verify: bool | None = Field(None, description="true or false: prove that no mode was missed")
    free: dict[str, Components] | None = Field(
        None, description='a table of interfaces and their free components, {pin = ["rz"]}'
    )
    loads: dict[str, LoadSection] | None = Field(None, description="tables [reduction.loads.INTERFACE]")
    neighbours: list[NeighbourSection] | None = Field(None, description="tables [[reduction.neighbours]]")
    n_blocks: Annotated[int, Field(ge=1)] | None = Field(
        None, description="a whole number, 1 or more, of Krylov blocks at every shift"
    )
    shifts: Shifts | None = Field(None, description="a list of frequencies, 0 or more, in Hz")
    tolerance: Annotated[float, Field(gt=0, lt=1)] | None = Field(None, description="a number between 0 and 1")
    inertia_relief: bool | None = Field(None, description="true or false: whether multilevel has inertia-relief modes")
    cutoff_factor: Annotated[float, Field(ge=1.2, le=100)] | None = Field(
        None, description="a number, 1.2 to 100: substructures keep modes up to so many times the cutoff"
    )
    workers: WorkersKey | None = Field(None, description=f"where subtrees are eliminated: {WORKERS_HELP}")
    load_cases: bool | None = Field(None, description="true or false: whether load cases are among the Krylov loads")
    damping_ratio: Annotated[float, Field(ge=0)] | None = Field(
        None, description="a number, 0 or more, of critical damping, for balancing and h2-optimal"
    )
    n_rich: Annotated[int, Field(ge=1)] | None = Field(
        None, description="a whole number, 1 or more, of free modes from which directions are chosen"
    )
    inputs: Places | None = Field(None, description='a list of interfaces, or with a component, such as "big_end uz"')
    outputs: Places | None = Field(None, description='a list of interfaces, or with a component, such as "big_end uz"')
    static: bool | None = Field(
        None, description="true or false: whether h2-optimal has the static responses to interface loads"
    )
    max_iterations: Annotated[int, Field(ge=1)] | None = Field(
        None, description="a whole number, 1 or more, of iterations of h2-optimal"
    )
    functions: choice("functions", lambda: tuple(AXIS_FUNCTIONS)) | None = Field(  # type: ignore[valid-type]
        None, description=f"one of {', '.join(AXIS_FUNCTIONS)}"
    )
    n_axial: Count | None = Field(None, description="a whole number, 0 or more, of functions along the axis")
    n_bending: Count | None = Field(None, description="a whole number, 0 or more, of functions for each direction")
    n_torsion: Count | None = Field(None, description="a whole number, 0 or more, of functions of torsion")
    axis: Vector3 | None = Field(None, description="the direction of the axis, [x, y, z]")
    point: Vector3 | None = Field(None, description="a point on the axis, [x, y, z]")
    poisson: Annotated[float, Field(gt=-1, le=0.5)] | None = Field(
        None, description="a number between -1 and 0.5, Poisson's ratio"
    )
    columns: Annotated[Path, BeforeValidator(existing_file())] | None = Field(
        None, description="the path of a .npy or .npz file of columns, relative to the job"
    )
    columns_over: choice("dofs", lambda: OVER) | None = Field(  # type: ignore[valid-type]
        None, description='"coupled" or "mesh": which dofs the rows of the columns are'
    )
    beyond: Count | None = Field(
        None,
        description="a whole number, 0 or more, of vibration modes beyond the cutoff, of which the bodies of a family "
        "take those that others have; cms family chooses it",
    )
    extra: Extras | None = Field(None, description=f"a list of extra columns, of {', '.join(EXTRA_COLUMNS)}")
    interface_modes: Count | None = Field(
        None, description="a whole number, 0 or more, of modes of each all-node interface"
    )
    interface_cutoff: Positive | None = Field(
        None, description="a number above 0, the highest frequency of interface modes [Hz]"
    )
    interfaces_together: bool | None = Field(None, description="true or false: one problem for all all-node interfaces")
    solver: choice("solver", lambda: tuple(SOLVERS)) | None = Field(  # type: ignore[valid-type]
        None,
        description=f"solver of the factorisation, one of {', '.join(SOLVERS)}; default: the fastest that is installed",
    )
    memory: Memory | None = Field(None, description='the most memory the process may take, such as "8GB"')
    frame: choice("frame", lambda: FRAMES) = Field(  # type: ignore[valid-type]
        "tisserand", description=f"one of {', '.join(FRAMES)}"
    )
    at: Name | None = Field(None, description="the name of an interface, which carries a nodal frame")
    dofs: HeldDofs | None = Field(None, description="six pairs [node, component], which a nodal frame holds")
    origin: Vector3 | None = Field(None, description="the origin of the body frame in mesh coordinates, [x, y, z]")
    axes: Matrix3 | None = Field(None, description="the axes of the body frame, [x axis, y axis, z axis]")
    stress: bool | None = Field(None, description="true or false: whether to keep the stress of the modes")
    geometric_stiffness: bool | list[Name] | None = Field(
        None,
        description="true or false: whether to add the geometric stiffness; a list: with the loads of these interfaces "
        "and of the frame alone; default: where the elements are known",
    )
    spread_loads: bool | None = Field(
        None, description="true or false: whether the geometric stiffness can be carried to a Buckens frame"
    )
    quadratic_modes: bool | None = Field(
        None, description="true or false: whether to add the displacement of second order of the kept nodes"
    )
    error_estimates: bool | None = Field(
        None,
        description="true or false: whether to estimate the errors of frequencies, shapes and static responses; "
        "default: where the set has a factorisation, and no memory is given",
    )

    @model_validator(mode="after")
    def _options_of_the_set(self) -> "ReductionSection":
        allowed = mode_set_options(self.set)
        of_auto = self._options_of_auto()
        for key in SET_OPTIONS:
            if getattr(self, key) is not None and key not in allowed and key not in of_auto:
                raise ValueError(f"mode set {self.set!r} has no option {key}{nearest(key, allowed)}")
        if {"n_modes", "cutoff"} <= set(allowed) and (self.n_modes is None) == (self.cutoff is None):
            given = "neither" if self.n_modes is None else "both"
            raise ValueError(f"expected either n_modes (how many) or cutoff (up to which frequency in Hz), got {given}")
        if "loads" in allowed and not self.loads and not self.neighbours:
            raise ValueError(
                f"mode set {self.set!r} needs the mass or stiffness of the neighbours at the interfaces: give tables "
                "[reduction.loads.INTERFACE] or [[reduction.neighbours]]"
            )
        if self.set == "normal" and self.n_modes == 0:
            raise ValueError("mode set 'normal' with n_modes = 0 holds only rigid-body motion; choose n_modes >= 1")
        if "columns" in allowed and self.columns is None:
            raise ValueError(f"mode set {self.set!r} needs columns: the path of a .npy or .npz file")
        if self.interface_modes is not None and self.interface_cutoff is not None:
            raise ValueError("expected either interface_modes or interface_cutoff, got both")
        if self.interfaces_together is not None and not self.reduces_interfaces:
            raise ValueError("interfaces_together belongs to interface_modes or interface_cutoff; got neither")
        if self.at is not None and self.frame != "nodal":
            raise ValueError(f'at = "{self.at}" belongs to frame = "nodal"; got frame = "{self.frame}"')
        if self.dofs is not None and (self.frame != "nodal" or self.at is not None):
            got = f'at = "{self.at}"' if self.at is not None else f'frame = "{self.frame}"'
            raise ValueError(f'dofs belong to frame = "nodal" without at; got {got}')
        if self.spread_loads and self.geometric_stiffness is False:
            raise ValueError("spread_loads = true belongs to the geometric stiffness; got geometric_stiffness = false")
        return self

    @property
    def reduces_interfaces(self) -> bool:
        """Whether interfaces of kind "nodes" keep fewer modes than dofs."""
        return self.interface_modes is not None or self.interface_cutoff is not None

    def _options_of_auto(self) -> tuple[str, ...]:
        """Raise `ValueError` if a key for n_modes = "auto" is missing or superfluous; return the keys."""
        if self.n_modes == AUTO:
            for key in ("error", "band"):
                if getattr(self, key) is None:
                    raise ValueError(f'n_modes = "auto" needs {key}: which error over which band is accepted?')
            return AUTO_OPTIONS
        for key in ("error", "measure"):
            if getattr(self, key) is not None:
                raise ValueError(f'{key} belongs to n_modes = "auto"; got n_modes = {self.n_modes}')
        return ()


def mode_set_options(name: str) -> tuple[str, ...]:
    """Return the options of a mode set that a job can set."""
    takes = set(signature := inspect.signature(MODE_SETS[name]).parameters)
    if "n_modes" in takes and signature["n_modes"].annotation == int | ModeCount:
        takes |= {"cutoff", "verify"}
    if "loads" in takes:
        takes |= {"neighbours"}
    return tuple(key for key in SET_OPTIONS if key in takes)


def named_interfaces(reduction: ReductionSection) -> Mapping[str, str]:
    """Return the interfaces of the body that the table names, by key path."""
    named = {} if reduction.at is None else {f'at = "{reduction.at}"': reduction.at}
    named |= {f"free.{name}": name for name in reduction.free or {}}
    named |= {f"loads.{name}": name for name in reduction.loads or {}}
    for neighbour in reduction.neighbours or []:
        named |= {f"neighbours.interfaces.{name}": name for name in neighbour.interfaces}
    if isinstance(reduction.geometric_stiffness, list):
        named |= {f'geometric_stiffness = ["{name}"]': name for name in reduction.geometric_stiffness}
    return named


# the table [damping] of a job: the damping of the modes (docs/job_file.md) --------------------------------------------


Ratio = Annotated[float, Field(ge=0, le=1)]
Coefficient = Annotated[float, Field(ge=0)]


def ratio_list(value: Any) -> tuple[float, ...]:
    """Return damping ratios, one for each mode."""
    if not isinstance(value, list | tuple) or not value or any(is_no_number(x) or not 0 <= x <= 1 for x in value):
        raise ValueError("expected a list of numbers, 0 to 1, one per mode; the last holds for all further modes")
    return tuple(float(x) for x in value)


def ramp_steps(value: Any) -> tuple[tuple[float, float], ...]:
    """Return steps (frequency in Hz, ratio below it); true selects the customary steps."""
    if value is True:
        return CUSTOMARY_STEPS
    pairs = value if isinstance(value, list | tuple) else ()
    is_pair = [
        isinstance(p, list | tuple)
        and len(p) == 2
        and not any(is_no_number(x) or x < 0 for x in p)
        and p[1] <= 1  # at most critical damping
        for p in pairs
    ]
    frequencies = [pair[0] for pair, good in zip(pairs, is_pair, strict=True) if good]
    if not pairs or not all(is_pair) or frequencies[0] <= 0 or sorted(set(frequencies)) != frequencies:
        raise ValueError("expected true, or pairs [frequency in Hz, ratio below it] by ascending frequency")
    return tuple((float(frequency), float(ratio)) for frequency, ratio in pairs)


class DampingSection(Table):
    """[damping]: ratios of the modes, Rayleigh damping, or that of a part of a body."""

    ratio: Ratio | None = Field(None, description="a number, 0 to 1, of critical damping (0.01 is 1 %)")
    ratios: Annotated[tuple[float, ...], BeforeValidator(ratio_list, json_schema_input_type=Any)] | None = Field(
        None, description="a list of numbers, 0 to 1, of critical damping, one per mode"
    )
    ramp: Annotated[tuple[tuple[float, float], ...], BeforeValidator(ramp_steps, json_schema_input_type=Any)] | None = (
        Field(None, description="pairs [frequency in Hz, ratio below it]; true: [[100, 0.01], [1000, 0.1]]")
    )
    above: Ratio | None = Field(
        None, description="a number, 0 to 1, the ratio above the last step of the ramp; default: 1, critical"
    )
    heavy: bool = Field(False, description="true or false: whether ratios above 0.2, other than above, are accepted")
    alpha: Coefficient | None = Field(None, description="a number, 0 or more, of D = alpha M + beta K")
    beta: Coefficient | None = Field(None, description="a number, 0 or more, of D = alpha M + beta K")
    file: Annotated[Path, BeforeValidator(existing_file())] | None = Field(
        None, description="the path of the damping of a part, which cms split writes, relative to the job"
    )

    @model_validator(mode="after")
    def _one_kind(self) -> "DampingSection":
        given = [key for key in ("ratio", "ratios", "ramp", "alpha", "beta", "file") if getattr(self, key) is not None]
        if len({"rayleigh" if key in ("alpha", "beta") else key for key in given}) != 1:
            got = " and ".join(given) or "none of them"
            raise ValueError(f"expected either ratio, ratios, ramp, alpha and beta, or file; got {got}")
        if self.above is not None and self.ramp is None:
            raise ValueError(f"above belongs to ramp; got {given[0]}")
        if self.file is None:
            try:
                _ = self.damping
            except ModeSetError as error:
                raise ValueError(str(error).removeprefix("damping: ")) from None
        return self

    @property
    def damping(self) -> Damping | StrainDamping:
        """Damping object that the table describes."""
        if self.file is not None:
            return read_strain_damping(self.file)
        if self.ratio is not None:
            return ModalDamping(self.ratio, heavy=self.heavy)
        if self.ratios is not None:
            return PerModeDamping(self.ratios, heavy=self.heavy)
        if self.ramp is not None:
            return RampDamping(self.ramp, 1.0 if self.above is None else self.above, heavy=self.heavy)
        return RayleighDamping(self.alpha or 0.0, self.beta or 0.0)
