"""The model description of a unit: modelDescription.xml of FMI 2.0 and FMI 3.0, from one list of variables."""

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from fe_models.foundation.units import Units
from floatframe.cosimulation.interface import Variable
from floatframe.cosimulation.unit_words import base_unit

__all__ = ["NEEDS", "Description", "model_description"]

#: what an FMU needs where it runs
NEEDS = (
    "Needs Python with floatframe where it runs: the program that loads it must be Python itself (FMPy), or find the "
    "library of a Python in which floatframe is installed (Linux: LD_PRELOAD=libpython3.x.so; Windows: python3x.dll on "
    "PATH, PYTHONHOME set)."
)
CATEGORIES = {"logAll": "all messages", "logStatusWarning": "warnings", "logStatusError": "errors"}


@dataclass(frozen=True)
class Description:
    """What a model description says besides the variables."""

    name: str  #: of the model
    identifier: str  #: of its binaries, a name in C
    token: str  #: guid, instantiation token
    tool: str
    units: Units
    stop_time: float  #: [s], in the time unit of the system
    step: float


def model_description(about: Description, variables: Sequence[Variable], fmi: int) -> bytes:
    """Return modelDescription.xml of version 2 or 3; the value reference of a variable is its place."""
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": "2.0" if fmi == 2 else "3.0",
            "modelName": about.name,
            "guid" if fmi == 2 else "instantiationToken": about.token,
            "description": f"Flexible multibody system {about.name}. {NEEDS}",
            "generationTool": about.tool,
            "variableNamingConvention": "flat",
        },
    )
    state = "FMUstate" if fmi == 2 else "FMUState"
    SubElement(
        root,
        "CoSimulation",
        {
            "modelIdentifier": about.identifier,
            "needsExecutionTool": "true",
            "canHandleVariableCommunicationStepSize": "true",
            f"canGetAndSet{state}": "true",
            f"canSerialize{state}": "true",
        },
    )
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


def add_units(root: Element, units: Units, variables: Sequence[Variable]) -> None:
    """Add the units of the variables, with their factors to SI where FMI can hold them."""
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
    """Return the attributes of a variable that both versions have."""
    variability = "continuous"
    if each.causality == "parameter":
        variability = "fixed"
    found = {"name": each.name, "causality": each.causality, "variability": variability}
    if each.words:
        found["description"] = each.words
    return found


def feeding(variables: Sequence[Variable]) -> list[int]:
    """Return the places of the inputs that outputs with feedthrough follow at once: forces, not drives."""
    return [k for k, each in enumerate(variables) if each.causality == "input" and not each.is_drive]


def add_variables_2(root: Element, variables: Sequence[Variable]) -> None:
    """Add variables and structure in the form of FMI 2.0."""
    listed, forces = SubElement(root, "ModelVariables"), feeding(variables)
    for k, each in enumerate(variables):
        scalar = SubElement(listed, "ScalarVariable", attributes(each) | {"valueReference": str(k)})
        real = SubElement(scalar, "Real", {"unit": each.unit} if each.unit else {})
        if each.causality in ("parameter", "input"):
            real.set("start", repr(each.start))
    structure = SubElement(root, "ModelStructure")
    outputs = [(k, each) for k, each in enumerate(variables) if each.causality == "output"]
    if not outputs:
        return
    for part in ("Outputs", "InitialUnknowns"):
        unknowns = SubElement(structure, part)
        for k, each in outputs:
            unknown = SubElement(unknowns, "Unknown", {"index": str(k + 1)})
            if part == "Outputs":
                unknown.set("dependencies", " ".join(str(f + 1) for f in forces) if each.feeds_through else "")


def add_variables_3(root: Element, variables: Sequence[Variable]) -> None:
    """Add variables and structure in the form of FMI 3.0."""
    listed, forces = SubElement(root, "ModelVariables"), feeding(variables)
    for k, each in enumerate(variables):
        real = SubElement(listed, "Float64", attributes(each) | {"valueReference": str(k)})
        if each.unit:
            real.set("unit", each.unit)
        if each.causality in ("parameter", "input"):
            real.set("start", repr(each.start))
    structure = SubElement(root, "ModelStructure")
    outputs = [(k, each) for k, each in enumerate(variables) if each.causality == "output"]
    for k, each in outputs:
        found = {"valueReference": str(k)}
        found["dependencies"] = " ".join(str(f) for f in forces) if each.feeds_through else ""
        SubElement(structure, "Output", found)
    for k, _ in outputs:
        SubElement(structure, "InitialUnknown", {"valueReference": str(k)})
