"""The fatigue file: what `floatframe fatigue` reads (docs/fatigue.md)."""

import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from fe_models.foundation.toml_file import (
    Range,
    Table,
    choice,
    describe,
    existing_file,
    kind_field,
    read_toml,
    validated,
)
from fe_models.foundation.words import nearest, quoted
from floatframe.durability.fatigue.criteria import CRITERIA, TENSORS
from floatframe.durability.fatigue.history_damage import RESIDUES
from floatframe.durability.fatigue.mean_stress import MEAN_STRESS
from floatframe.durability.fatigue.sn_curve import BELOW, normal_quantile
from floatframe.durability.fatigue.spectral.spectral_methods import SPECTRAL_METHODS
from floatframe.errors import FatigueError
from floatframe.files.system_file.keys import tuple_of_list

__all__ = [
    "FACTOR_METHODS",
    "PLACES",
    "STRESS_UNITS",
    "FactorMethod",
    "FatigueFile",
    "read_fatigue",
    "reliability_factor",
    "roughness_factor",
    "size_factor",
    "technological_size_factor",
]


# factors on the amplitudes of S-N curves by published formulas: roughness, size, scatter ------------------------------
# S-N curves are measured on small polished specimens; a part is rough and large. Each formula comes from a guideline or
# textbook, and inputs outside its range are refused. The formulas hold for the fatigue limit; applied to the whole
# curve, they are conservative at few cycles.


#: a_R and smallest tensile strength [MPa] in the roughness factor, by group of materials (FKM guideline)
ROUGHNESS = {
    "steel": (0.22, 400.0), "cast-steel": (0.20, 400.0), "nodular-iron": (0.16, 400.0),
    "malleable-iron": (0.12, 350.0), "grey-iron": (0.06, 100.0), "wrought-aluminium": (0.22, 133.0),
    "cast-aluminium": (0.20, 133.0),
}  # fmt: skip
#: diameter d_N [mm] of the standardised strength, and a_d, by group of steels (FKM guideline)
TECHNOLOGY = {
    "structural-steel": (40.0, 0.15), "quenched-steel": (16.0, 0.3), "normalised-steel": (16.0, 0.1),
    "case-hardened-steel": (11.0, 0.5), "nitrided-steel": (100.0, 0.2), "cast-steel": (100.0, 0.15),
}  # fmt: skip
SMALLEST_TESTED = 7.5  #: diameter below which the technological factor is that of test specimens [mm]
LARGEST_DIAMETER = 250.0  #: largest diameter of the technological factor [mm]; larger diameters have the same factor
ROUGHEST = 500.0  #: largest plausible Rz [um]; larger values probably have another unit
DEVIATION = 0.08  #: standard deviation of fatigue limits, relative to their mean
Number = float | str | None


def roughness_factor(tensile_strength: float, roughness: float, group: str = "steel") -> float:
    """Return K_R = 1 - a_R lg Rz lg(2 R_m / R_m,N,min), at most 1, for normal stress (FKM guideline, FKM (2012)).

    Parameters
    ----------
    tensile_strength
        R_m [MPa].
    roughness
        R_z [um]: up to 1 if polished, about 10 if ground, up to 100 if machined, 200 if rolled or cast.
    group
        One of `ROUGHNESS`.

    Raises
    ------
    FatigueError
        If the group is unknown, or a number is out of range.
    """
    a_R, least = of_group("roughness factor", group, ROUGHNESS)
    if not 0 <= roughness <= ROUGHEST:
        raise FatigueError(
            f"roughness factor: Rz: expected 0 to {ROUGHEST:g} micrometres, got {roughness:g}; give it in micrometres"
        )
    if not least / 2 <= tensile_strength <= 3000:
        raise FatigueError(
            f"roughness factor: tensile strength: expected {least / 2:g} to 3000 MPa of {group}, got "
            f"{tensile_strength:g}; check its unit"
        )
    return 1.0 if roughness <= 1 else 1 - a_R * math.log10(roughness) * math.log10(2 * tensile_strength / least)


def technological_size_factor(diameter: float, group: str) -> float:
    """Return K_d = F(d)/F(d_N) for d > d_N, else 1; F(d) = 1 - 0.7686 a_d lg(d/7.5 mm) (FKM (2012)).

    It applies to strengths that a standard gives for semi-finished products up to the diameter d_N; a strength measured
    on the part needs no such factor.

    Parameters
    ----------
    diameter
        Effective diameter of the semi-finished product [mm]; above 250 mm the factor is that of 250 mm.
    group
        One of `TECHNOLOGY`.

    Raises
    ------
    FatigueError
        If the group is unknown, or the diameter is not above 0.
    """
    standard, a_d = of_group("technological size factor", group, TECHNOLOGY)
    if not 0 < diameter < 1e5:
        raise FatigueError(f"technological size factor: diameter: expected a number above 0 [mm], got {diameter:g}")

    def strength(d: float) -> float:
        return 1 - 0.7686 * a_d * math.log10(max(d, SMALLEST_TESTED) / SMALLEST_TESTED)

    return 1.0 if diameter <= standard else strength(min(diameter, LARGEST_DIAMETER)) / strength(standard)


def size_factor(diameter: float) -> float:
    """Return k_b of round bars in bending or torsion: (d/7.62)^-0.107 up to 51 mm, 1.51 d^-0.157 beyond.

    Eq. 6-20 of Budynas & Nisbett (2011). For bars under tension the factor is 1. It contains the effect of the stress
    gradient, which must not be included a second time.

    Parameters
    ----------
    diameter
        Diameter of a round bar in rotating bending, 2.79 to 254 mm.

    Raises
    ------
    FatigueError
        If the diameter is out of range.
    """
    if not 2.79 <= diameter <= 254:
        raise FatigueError(f"size factor: diameter: expected 2.79 to 254 mm, got {diameter:g}")
    return (diameter / 7.62) ** -0.107 if diameter <= 51 else 1.51 * diameter**-0.157


def reliability_factor(survival: float) -> float:
    """Return k_e = 1 - 0.08 z, because fatigue limits scatter by 8 % of their mean (Budynas & Nisbett (2011)).

    Parameters
    ----------
    survival
        Probability of survival, 0.5 to below 1; z is its quantile.

    Raises
    ------
    FatigueError
        If it is out of range.
    """
    if not 0.5 <= survival <= 1 - 1e-9:
        raise FatigueError(f"reliability factor: survival: expected 0.5 to below 1, got {survival:g}")
    return 1 - DEVIATION * normal_quantile(survival)


def of_group(what: str, group: str, known: Mapping[str, tuple[float, float]]) -> tuple[float, float]:
    """Return the parameters of a group of materials."""
    if group not in known:
        raise FatigueError(f"{what}: unknown group {quoted(group)}{nearest(group, known)}")
    return known[group]


@dataclass(frozen=True)
class FactorMethod:
    """A formula of the fatigue file."""

    description: str
    needs: tuple[str, ...]  #: required keys in addition to the method
    needs_strength: bool
    value: Callable[[Mapping[str, Number], float], float]  #: function of these keys and the tensile strength [MPa]


#: formulas by their names
FACTOR_METHODS: dict[str, FactorMethod] = {
    "fkm-roughness": FactorMethod(
        "K_R = 1 - a_R lg Rz lg(2 Rm/Rm,min)", ("roughness", "group"), True,
        lambda given, R_m: roughness_factor(R_m, number(given, "roughness"), word(given, "group")),
    ),
    "fkm-size": FactorMethod(
        "K_d = F(d)/F(d_N)", ("diameter", "group"), False,
        lambda given, _: technological_size_factor(number(given, "diameter"), word(given, "group")),
    ),
    "shigley-size": FactorMethod(
        "k_b of round bars in bending and torsion", ("diameter",), False,
        lambda given, _: size_factor(number(given, "diameter")),
    ),
    "shigley-reliability": FactorMethod(
        "k_e = 1 - 0.08 z", ("survival",), False, lambda given, _: reliability_factor(number(given, "survival")),
    ),
}  # fmt: skip


def number(given: Mapping[str, Number], key: str) -> float:
    """Return a number that the method needs."""
    value = given[key]
    assert isinstance(value, float)
    return value


def word(given: Mapping[str, Number], key: str) -> str:
    """Return a word that the method needs."""
    return str(given[key])


# the fatigue file: what `floatframe fatigue` reads (docs/fatigue.md) --------------------------------------------------


#: stress units of S-N curves -> [Pa]
STRESS_UNITS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "N/mm^2": 1e6, "GPa": 1e9, "psi": 6894.757293168361,
                "ksi": 6894757.293168361}  # fmt: skip

#: which places are assessed, by name
PLACES = {
    "all": "nodes of the surface and stress points of elements",
    "nodes": "nodes of the surface, whose stress is averaged over elements",
    "points": "stress points, each in one element",
}

Positive = Annotated[float, Field(gt=0)]
Share = Annotated[float, Field(ge=0, lt=1)]
InputFile = Annotated[Path, BeforeValidator(existing_file())]
Numbers = Annotated[tuple[float, ...], BeforeValidator(tuple_of_list)]


class CurveSection(Table):
    """[material.sn]: a knee and slopes, or a table."""

    amplitude: Positive | None = Field(None, description="a number above 0, amplitude (half the range) at the knee")
    range: Positive | None = Field(None, description="a number above 0, range at the knee, in place of amplitude")
    cycles: Positive | Numbers | None = Field(None, description="cycles at the knee, or those of the table")
    slope: Annotated[float, Field(ge=1)] | None = Field(None, description="a number of 1 or more, k in N ~ S^-k")
    second_slope: Annotated[float, Field(ge=1)] | None = Field(None, description="a number, k below the knee")
    amplitudes: Numbers | None = Field(None, description="a list of numbers, amplitudes of the table")
    ranges: Numbers | None = Field(None, description="a list of numbers, ranges of the table, in place of amplitudes")
    below: choice("way below the last point", lambda: tuple(BELOW)) = Field(  # type: ignore[valid-type]
        "elementary", description=f"one of {', '.join(BELOW)}"
    )
    stress_ratio: Annotated[float, Field(ge=-1, lt=1)] = Field(-1.0, description="R of the tests, -1 to below 1")
    least_cycles: Positive = Field(1000.0, description="a number above 0, first cycles of a curve by slope")
    survival: Annotated[float, Field(gt=0, lt=1)] = Field(0.5, description="survival of the curve, between 0 and 1")
    log_deviation: Annotated[float, Field(ge=0)] | None = Field(
        None, description="a number, standard deviation of log10 N"
    )

    @model_validator(mode="after")
    def _one_way(self) -> "CurveSection":
        by_slope = {"amplitude": self.amplitude, "range": self.range, "slope": self.slope}
        given = [name for name, value in by_slope.items() if value is not None]
        tables = [name for name in ("amplitudes", "ranges") if getattr(self, name) is not None]
        if self.cycles is None:
            raise ValueError("cycles: missing; expected the cycles of the knee or the table")
        if tables:
            if given or self.second_slope is not None or not isinstance(self.cycles, tuple):
                raise ValueError(f"expected a table (cycles and {tables[0]}, lists) or a knee (a number of cycles and "
                                 "amplitude or range and slope), got parts of both")  # fmt: skip
            if len(tables) == 2:
                raise ValueError("expected amplitudes or ranges, got both")
            return self
        if isinstance(self.cycles, tuple) or self.slope is None or (self.amplitude is None) == (self.range is None):
            raise ValueError("expected cycles, slope, and either amplitude or range; or a table: cycles and amplitudes")
        return self


class MaterialSection(Table):
    """[material]: strengths and the S-N curve, in one stress unit."""

    name: str = Field("", description="the name of the material, for reports")
    stress_unit: choice("stress unit", lambda: tuple(STRESS_UNITS)) = Field(  # type: ignore[valid-type]
        description=f"the unit of all stresses of the material, one of {', '.join(STRESS_UNITS)}"
    )
    tensile_strength: Positive | None = Field(None, description="a number above 0")
    yield_strength: Positive | None = Field(None, description="a number above 0")
    fatigue_strength_coefficient: Positive | None = Field(None, description="a number above 0, sigma_f'")
    walker_exponent: Annotated[float, Field(ge=0, le=1)] | None = Field(None, description="a number from 0 to 1")
    mean_stress_sensitivity: Annotated[float, Field(ge=0, le=1)] | None = Field(
        None, description="a number from 0 to 1, M"
    )
    sn: CurveSection = Field(description="the table [material.sn]")


class FactorSection(Table):
    """A factor by a formula, in place of a number."""

    method: choice("formula", lambda: tuple(FACTOR_METHODS)) = Field(  # type: ignore[valid-type]
        description=f"one of {', '.join(FACTOR_METHODS)}"
    )
    roughness: Annotated[float, Field(ge=0)] | None = Field(None, description="a number, Rz [micrometres]")
    diameter: Positive | None = Field(None, description="a number above 0 [mm]")
    group: str | None = Field(None, description="a group of materials")
    survival: Annotated[float, Field(gt=0, lt=1)] | None = Field(None, description="a number from 0.5 to below 1")

    @model_validator(mode="after")
    def _needs(self) -> "FactorSection":
        needs = FACTOR_METHODS[self.method].needs
        for key in ("roughness", "diameter", "group", "survival"):
            if (getattr(self, key) is None) == (key in needs):
                word = "is missing" if key in needs else "has no meaning here; remove it"
                raise ValueError(f'method "{self.method}" needs {" and ".join(needs)}: {key} {word}')
        return self

    def value(self, tensile_strength: float) -> float:
        """Return the factor for a tensile strength [MPa]."""
        given = {key: getattr(self, key) for key in ("roughness", "diameter", "group", "survival")}
        return FACTOR_METHODS[self.method].value(given, tensile_strength)

    @property
    def description(self) -> str:
        """The formula and its inputs as text."""
        method = FACTOR_METHODS[self.method]
        return f"{method.description}, " + ", ".join(f"{key} {getattr(self, key)}" for key in method.needs)


def factor(value: Any) -> Any:
    """Return a factor as a number, or as the table of its formula."""
    if isinstance(value, dict):
        try:
            return FactorSection.model_validate(value)
        except ValidationError as problem:
            details = problem.errors(include_url=False)
            raise ValueError("; ".join(describe(FactorSection, detail) for detail in details)) from None
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf:
        raise ValueError("expected a number above 0, or a table with method and the keys of its formula")
    return float(value)


Factor = Annotated[float | FactorSection, BeforeValidator(factor)]


class PlacesSection(MaterialSection):
    """[materials.NAME]: a material and the places made of it."""

    sets: list[str] = Field([], description="a list of names of sets of nodes or elements")
    elements: list[int | str] = Field([], description="a list of numbers of elements")
    nodes: list[int | str] = Field([], description="a list of numbers of nodes")
    points: list[str] = Field([], description="a list of names of stress points, or of beginnings of names")
    factors: dict[str, Factor] = Field({}, description="numbers or formulas by name, in addition to [factors]")

    @model_validator(mode="after")
    def _places(self) -> "PlacesSection":
        if not (self.sets or self.elements or self.nodes or self.points):
            raise ValueError("expected the places of the material: sets, elements, nodes or points")
        return self


class CriterionSection(Table):
    """[criterion]: the stress that causes damage, and the effect of mean stress."""

    name: choice("criterion", lambda: tuple(CRITERIA)) = Field(  # type: ignore[valid-type]
        "signed-von-mises", description=f"one of {', '.join(CRITERIA)}"
    )
    tensor: choice("tensor", lambda: tuple(TENSORS)) = Field(  # type: ignore[valid-type]
        "full", description=f"one of {', '.join(TENSORS)}"
    )
    planes: Annotated[int, Field(ge=4, le=360)] = Field(18, description="a whole number, 4 to 360, angles over 180 deg")
    findley_k: Annotated[float, Field(ge=0, le=2)] = Field(0.3, description="a number from 0 to 2")
    mean_stress: choice("mean stress correction", lambda: tuple(MEAN_STRESS)) = Field(  # type: ignore[valid-type]
        "none", description=f"one of {', '.join(MEAN_STRESS)}"
    )
    credit_compression: bool = Field(False, description="true or false: whether a compressive mean increases the life")


class CountingSection(Table):
    """[counting]: rainflow or spectral."""

    residue: choice("residue", lambda: tuple(RESIDUES)) = Field(  # type: ignore[valid-type]
        "repeat", description=f"one of {', '.join(RESIDUES)}"
    )
    method: choice("spectral method", lambda: tuple(SPECTRAL_METHODS)) = Field(  # type: ignore[valid-type]
        "dirlik", description=f"one of {', '.join(SPECTRAL_METHODS)}"
    )
    negligible: Share = Field(1e-3, description="a share of the greatest damage, from 0 to below 1")
    extrapolate: bool = Field(False, description="true or false: whether stresses beyond the S-N curve are counted")


class MatchSection(Table):
    """match of a block: repeats with which the block has the pseudo-damage of a measured event."""

    measured: InputFile = Field(description="a file of measured signals")
    signal: str = Field(description="a signal of that file")
    sensor: str = Field(description="sensor.column of the system of the results")
    slope: Annotated[float, Field(ge=1)] = Field(description="a number of 1 or more, k of the pseudo-damage")


class BlockSection(Table):
    """[[blocks]]: a results file."""

    name: str = Field("", description="text; default: the name of the file")
    results: InputFile = Field(description="a results file, relative to this file")
    body: str = Field(description="the name of the body in the results")
    repeats: Positive = Field(1.0, description="a number above 0")
    scale: float = Field(1.0, description="a number other than 0, the factor on the loads")
    times: Range | None = Field(None, description="[from, to], part of the motion")
    gaps: bool = Field(False, description="true or false: whether long time steps are intended")
    match: MatchSection | None = Field(None, description="a table: measured, signal, sensor, slope")


class SpectrumSection(Table):
    """[[spectra]]: cross spectra of the modal coordinates."""

    name: str = Field("", description="text; default: the name of the file")
    file: InputFile | None = Field(None, description="an .npz file with frequencies, spectra, and duration, mean")
    shake: InputFile | None = Field(None, description="a shake file with a random test, in place of file")
    test: str | None = Field(None, description="the name of the random test of a shake file")
    duration: Positive | None = Field(None, description="a number above 0 [s]; default: that of the file")
    repeats: Positive = Field(1.0, description="a number above 0")
    scale: float = Field(1.0, description="a number other than 0, the factor on the loads")

    @model_validator(mode="after")
    def _one_source(self) -> "SpectrumSection":
        if (self.file is None) == (self.shake is None) or (self.shake is None) != (self.test is None):
            raise ValueError("expected either file, or shake and test")
        return self


class ProgrammeSection(Table):
    """[programme]: the service that one pass through all blocks represents."""

    amount: Positive = Field(1.0, description="a number above 0, such as kilometres")
    unit: str = Field("passes", description="text, such as km, flights, h")
    target: Positive | None = Field(None, description="a number above 0, the required life in that unit")


class OutputsSection(Table):
    """[outputs]: the places that are assessed, and the results that are shown."""

    worst: Annotated[int, Field(ge=1, le=10_000)] = Field(20, description="a whole number, 1 to 10000, nodes of tables")
    set: str | None = Field(None, description="a set of the mesh; only its nodes and points are assessed")
    places: choice("places", lambda: tuple(PLACES)) = Field(  # type: ignore[valid-type]
        "all", description=f"one of {', '.join(PLACES)}"
    )


class FatigueFile(Table):
    """A fatigue file."""

    kind: str = kind_field("fatigue")
    body: InputFile = Field(description="the path of a modal file, relative to this file")
    material: MaterialSection | None = Field(None, description="the table [material]")
    materials: dict[str, PlacesSection] = Field({}, description="tables [materials.NAME], for the places in them")
    factors: dict[str, Factor] = Field({}, description="numbers or formulas by name, on the amplitudes of the curves")
    survival: Annotated[float, Field(gt=0, lt=1)] | None = Field(None, description="a number from 0 to 1")
    criterion: CriterionSection = Field(
        default_factory=lambda: CriterionSection.model_validate({}), description="the table [criterion]"
    )
    counting: CountingSection = Field(
        default_factory=lambda: CountingSection.model_validate({}), description="the table [counting]"
    )
    blocks: list[BlockSection] = Field([], description="tables [[blocks]]")
    spectra: list[SpectrumSection] = Field([], description="tables [[spectra]]")
    programme: ProgrammeSection = Field(
        default_factory=lambda: ProgrammeSection.model_validate({}), description="the table [programme]"
    )
    outputs: OutputsSection = Field(
        default_factory=lambda: OutputsSection.model_validate({}), description="the table [outputs]"
    )

    @model_validator(mode="after")
    def _fits(self) -> "FatigueFile":
        if bool(self.blocks) == bool(self.spectra):
            raise ValueError("expected [[blocks]] or [[spectra]], " + ("got both" if self.blocks else "got neither"))
        if any(each.shake for each in self.spectra) and len(self.spectra) > 1:
            raise ValueError("[[spectra]]: expected a shake file alone, because it has coordinates of its own")
        if not self.all_materials:
            raise ValueError("material: missing; expected the table [material], or tables [materials.NAME]")
        need = MEAN_STRESS[self.criterion.mean_stress][1]
        for key, material in self.all_materials.items():
            if need and getattr(material, need) is None:
                raise ValueError(f'mean stress "{self.criterion.mean_stress}" needs {key}.{need}, which is missing')
            own = material.factors if isinstance(material, PlacesSection) else {}
            for name, each in {**self.factors, **own}.items():
                if not isinstance(each, FactorSection):
                    continue
                if FACTOR_METHODS[each.method].needs_strength and material.tensile_strength is None:
                    raise ValueError(f"factor {name}: {each.method} needs {key}.tensile_strength, which is missing")
                if each.survival is not None and self.survival is not None:
                    raise ValueError(f"factor {name} and survival count the scatter twice; take one of them")
            if self.survival is not None and material.sn.log_deviation is None:
                raise ValueError(f"survival: needs {key}.sn.log_deviation, the standard deviation of log10 N")
        return self

    @property
    def all_materials(self) -> dict[str, MaterialSection]:
        """The materials by their keys in the file, beginning with the material of all other places."""
        rest = {} if self.material is None else {"material": self.material}
        return {**rest, **{f"materials.{name}": each for name, each in self.materials.items()}}


def read_fatigue(path: str | os.PathLike[str]) -> FatigueFile:
    """Read and check a fatigue file.

    Parameters
    ----------
    path
        Name of the fatigue file (TOML).

    Raises
    ------
    FatigueError
        If the file is not valid; the message lists every problem, with key path, value, expected value and choices.
    """
    path = Path(path)
    return validated(FatigueFile, read_toml(path, FatigueError), path, FatigueError, context=path.parent)
