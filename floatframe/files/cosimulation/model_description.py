"""The model description of a unit, modelDescription.xml of FMI 2.0 and 3.0, from one list of variables."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from fe_models.foundation.units import Units
from floatframe.files.cosimulation.interface import Variable

__all__ = ["NEEDS", "BaseUnit", "Description", "base_unit", "model_description"]


# units of variables for FMI: the symbols of a unit system as factors and exponents of SI base units -------------------


EXPONENTS = {"": 1, "²": 2, "³": 3}


class BaseUnit(NamedTuple):
    """A unit in SI base units: factor · kg^kg m^m s^s rad^rad."""

    factor: float
    kg: int = 0
    m: int = 0
    s: int = 0
    rad: int = 0


def base_unit(units: Units, words: str) -> BaseUnit | None:
    """Return a unit such as "mm/s²" or "N mm" in SI base units; None if there is none, or FMI cannot express it.

    words: symbols of the system, separated by spaces, with ² or ³ for powers; divisors follow "/".
    """
    force = BaseUnit(units.to_si(mass=1, length=1, time=-2), 1, 1, -2)
    symbols = {
        units.length_symbol: BaseUnit(units.length, m=1),
        units.mass_symbol: BaseUnit(units.mass, kg=1),
        units.time_symbol: BaseUnit(units.time, s=1),
        units.force_symbol: force,
        units.stress_symbol: BaseUnit(units.to_si(mass=1, length=-1, time=-2), 1, -1, -2),
        "rad": BaseUnit(1.0, rad=1),
        "s": BaseUnit(1.0, s=1),
        "1": BaseUnit(1.0),
    }
    if words in symbols:
        return symbols[words]
    result = BaseUnit(1.0)
    for place, part in enumerate(words.split("/")):
        for symbol in part.split():
            name, exponent = re.fullmatch(r"(.*?)([²³]?)", symbol).groups()  # type: ignore[union-attr]
            if name not in symbols:
                return None
            k = EXPONENTS[exponent] * (1 if place == 0 else -1)
            each = symbols[name]
            powers = (old + k * new for old, new in zip(result[1:], each[1:], strict=True))
            result = BaseUnit(result.factor * each.factor**k, *powers)
    return result


# model description ----------------------------------------------------------------------------------------------------


#: note on the requirements of an FMU where it runs
NEEDS = (
    "Needs Python with floatframe where it runs: the program that loads it must be Python itself (FMPy), or find the "
    "library of a Python in which floatframe is installed (Linux: LD_PRELOAD=libpython3.x.so; Windows: python3x.dll on "
    "PATH, PYTHONHOME set)."
)
CATEGORIES = {"logAll": "all messages", "logStatusWarning": "warnings", "logStatusError": "errors"}


@dataclass(frozen=True)
class Description:
    """Data of a model description in addition to the variables."""

    name: str  #: name of the model
    identifier: str  #: name of the binaries, a C identifier
    token: str  #: identification of the FMU: guid, or instantiation token
    tool: str
    units: Units
    stop_time: float  #: default stop time [s]
    step: float  #: recommended step size [s]
    words: str  #: description of the model
    is_hosted: bool = True  #: whether the FMU needs another program where it runs
    has_derivatives: bool = False  #: whether the importing program can integrate it (model exchange)
    sources: tuple[str, ...] = ()  #: C source files, which FMI 2.0 lists here


def model_description(about: Description, variables: Sequence[Variable], fmi: int) -> bytes:
    """Return modelDescription.xml of version 2 or 3; the value reference of a variable is its index."""
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": "2.0" if fmi == 2 else "3.0",
            "modelName": about.name,
            "guid" if fmi == 2 else "instantiationToken": about.token,
            "description": about.words,
            "generationTool": about.tool,
            "variableNamingConvention": "flat",
        },
    )
    if fmi == 2 and about.has_derivatives:
        root.set("numberOfEventIndicators", "0")
    for kind in ("ModelExchange", "CoSimulation") if about.has_derivatives else ("CoSimulation",):
        add_interface(root, kind, about, fmi)
    add_units(root, about.units, variables)
    categories = SubElement(root, "LogCategories")
    for name, words in CATEGORIES.items():
        SubElement(categories, "Category", {"name": name, "description": words})
    SubElement(
        root,
        "DefaultExperiment",
        {"startTime": "0.0", "stopTime": repr(about.stop_time), "stepSize": repr(about.step)},
    )
    (add_variables_2 if fmi == 2 else add_variables_3)(root, variables)
    indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="utf-8") + b"\n"


def add_interface(root: Element, kind: str, about: Description, fmi: int) -> None:
    """Add the capabilities of a unit in one kind of interface."""
    state = "FMUstate" if fmi == 2 else "FMUState"
    can = {"modelIdentifier": about.identifier}
    if about.is_hosted:
        can["needsExecutionTool"] = "true"
    if kind == "CoSimulation":
        can["canHandleVariableCommunicationStepSize"] = "true"
    element = SubElement(root, kind, can | {f"canGetAndSet{state}": "true", f"canSerialize{state}": "true"})
    if about.sources and fmi == 2:
        files = SubElement(element, "SourceFiles")
        for name in about.sources:
            SubElement(files, "File", {"name": name})


def add_units(root: Element, units: Units, variables: Sequence[Variable]) -> None:
    """Add the units of the variables, with factors to SI if FMI can express them."""
    symbols = sorted({each.unit for each in variables if each.unit})
    if not symbols:
        return
    definitions = SubElement(root, "UnitDefinitions")
    for symbol in symbols:
        unit = SubElement(definitions, "Unit", {"name": symbol})
        found = base_unit(units, symbol)
        if found is not None:
            powers = {name: str(k) for name, k in zip(("kg", "m", "s", "rad"), found[1:], strict=True) if k}
            SubElement(unit, "BaseUnit", powers | ({"factor": repr(found.factor)} if found.factor != 1.0 else {}))


def attributes(each: Variable) -> dict[str, str]:
    """Return the attributes of a variable that both versions share."""
    variability = "continuous"
    if each.causality == "parameter":
        variability = "tunable" if each.is_tunable else "fixed"
    found = {"name": each.name, "causality": each.causality, "variability": variability}
    if each.is_state:
        found["initial"] = "exact"
    if each.words:
        found["description"] = each.words
    return found


def known_places(variables: Sequence[Variable], each: Variable) -> list[int]:
    """Return the indices of states and inputs with direct feedthrough to an output or derivative.

    For outputs with feedthrough but without a list of their own, these are all force inputs, but no drive inputs.
    """
    if each.depends_on is not None:
        return [k for k, other in enumerate(variables) if other.name in each.depends_on]
    if not each.feeds_through:
        return []
    return [k for k, other in enumerate(variables) if other.causality == "input" and not other.is_drive]


def has_start(each: Variable) -> bool:
    """Whether a variable has a start value that can be given."""
    return each.is_state or each.causality in ("parameter", "input")


def structure_of(variables: Sequence[Variable]) -> tuple[list[int], list[int], list[int]]:
    """Return indices of outputs, of derivatives in the order of their states, and of initial unknowns."""
    outputs = [k for k, each in enumerate(variables) if each.causality == "output"]
    places = {each.derivative_of: k for k, each in enumerate(variables) if each.derivative_of}
    derivatives = [places[each.name] for each in variables if each.is_state]
    return outputs, derivatives, [k for k in outputs if not variables[k].is_state] + derivatives


def add_variables_2(root: Element, variables: Sequence[Variable]) -> None:
    """Add variables and model structure of FMI 2.0, in which indices count from 1."""
    listed = SubElement(root, "ModelVariables")
    places = {each.name: k + 1 for k, each in enumerate(variables)}
    for k, each in enumerate(variables):
        scalar = SubElement(listed, "ScalarVariable", attributes(each) | {"valueReference": str(k)})
        real = SubElement(scalar, "Real", {"unit": each.unit} if each.unit else {})
        if has_start(each):
            real.set("start", repr(each.start))
        if each.derivative_of:
            real.set("derivative", str(places[each.derivative_of]))
    structure = SubElement(root, "ModelStructure")
    for part, unknowns in zip(("Outputs", "Derivatives", "InitialUnknowns"), structure_of(variables), strict=True):
        if not unknowns:
            continue
        listed = SubElement(structure, part)
        for k in unknowns:
            unknown = SubElement(listed, "Unknown", {"index": str(k + 1)})
            if part != "InitialUnknowns":
                unknown.set("dependencies", " ".join(str(f + 1) for f in known_places(variables, variables[k])))


def add_variables_3(root: Element, variables: Sequence[Variable]) -> None:
    """Add variables and model structure of FMI 3.0."""
    listed = SubElement(root, "ModelVariables")
    places = {each.name: k for k, each in enumerate(variables)}
    for k, each in enumerate(variables):
        real = SubElement(listed, "Float64", attributes(each) | {"valueReference": str(k)})
        if each.unit:
            real.set("unit", each.unit)
        if has_start(each):
            real.set("start", repr(each.start))
        if each.derivative_of:
            real.set("derivative", str(places[each.derivative_of]))
    structure = SubElement(root, "ModelStructure")
    outputs, derivatives, initial = structure_of(variables)
    for part, unknowns in (("Output", outputs), ("ContinuousStateDerivative", derivatives)):
        for k in unknowns:
            found = {"valueReference": str(k)}
            found["dependencies"] = " ".join(str(f) for f in known_places(variables, variables[k]))
            SubElement(structure, part, found)
    for k in initial:
        SubElement(structure, "InitialUnknown", {"valueReference": str(k)})
