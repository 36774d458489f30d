"""Length unit in the text of a CAD file; gmsh converts the unit without reporting it.

A STEP file states it in the LENGTH_UNIT entities to which the contexts of its shapes refer, either with SI_UNIT(prefix,
.METRE.), or with CONVERSION_BASED_UNIT(name, factor), whose factor is a measure in another unit. An IGES file states it
in fields 14 and 15 of the global section. A BREP file has no unit.
"""

import re
from pathlib import Path

from fe_models.errors import MeshError
from fe_models.foundation.formats import Format, by_suffix

__all__ = ["CAD_FORMATS", "GEOMETRIES", "length_unit"]

_TRIED = "Gmsh 4.15, OpenCASCADE 7.8"
GEOMETRIES = (
    Format(
        "STEP", "CAD programs", "geometry", (".step", ".stp"), tried=_TRIED,
        lost="names of faces, assemblies' structure", extra="mesh",
    ),
    Format(
        "IGES", "CAD programs", "geometry", (".iges", ".igs"), tried=_TRIED, lost="names, bodies with cavities",
        extra="mesh",
    ),
    Format(
        "BREP", "OpenCASCADE, FreeCAD", "geometry", (".brep",), tried=_TRIED, lost="it has no unit, names, colours",
        extra="mesh",
    ),
)  # fmt: skip
CAD_FORMATS = by_suffix(GEOMETRIES)  #: format of each suffix

PREFIXES = {
    "$": 1.0, ".MILLI.": 1e-3, ".CENTI.": 1e-2, ".DECI.": 1e-1, ".MICRO.": 1e-6, ".NANO.": 1e-9, ".KILO.": 1e3,
}  # fmt: skip
NAMES = {1.0: "m", 1e-3: "mm", 1e-2: "cm", 1e-6: "µm", 1e3: "km", 0.0254: "inch", 0.3048: "foot"}
IGES_UNITS = {
    1: 0.0254, 2: 1e-3, 4: 0.3048, 5: 1609.344, 6: 1.0, 7: 1e3, 8: 2.54e-5, 9: 1e-6, 10: 1e-2, 11: 2.54e-8,
}  # fmt: skip
IGES_NAMES = {"IN": 0.0254, "INCH": 0.0254, "MM": 1e-3, "FT": 0.3048, "M": 1.0, "CM": 1e-2, "KM": 1e3}

ENTITY = re.compile(rb"#(\d+)\s*=\s*([^;]*);")
PREFIX = re.compile(r"SI_UNIT\s*\(\s*(\$|\.\w+\.)\s*,\s*\.METRE\.\s*\)")
CONVERTED = re.compile(r"CONVERSION_BASED_UNIT\s*\(\s*'([^']*)'\s*,\s*#(\d+)\s*\)")
MEASURE = re.compile(r"(?:LENGTH_MEASURE|POSITIVE_LENGTH_MEASURE)\s*\(\s*([-+.\dEe]+)\s*\)\s*,\s*#(\d+)")
CONTEXT = re.compile(rb"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(([^)]*)\)\s*\)")


def length_unit(path: Path, content: bytes) -> tuple[str, float] | None:
    """Return name and size in metres of the length unit of a CAD file; None for BREP, which has no unit.

    Raises
    ------
    MeshError
        If a STEP or IGES file states no length unit, an unknown one, or several.
    """
    kind = CAD_FORMATS[path.suffix.lower()].name
    if kind == "BREP":
        return None
    metres = _step_units(path, content) if kind == "STEP" else {_iges_unit(path, content)}
    if len(metres) != 1:
        found = ", ".join(_name(size) for size in sorted(metres)) or "none"
        raise MeshError(
            f"geometry {path}: expected one length unit, got {found}; export it again with one unit for all parts"
        )
    size = metres.pop()
    return _name(size), size


def _name(metres: float) -> str:
    return next((name for size, name in NAMES.items() if abs(size / metres - 1) < 1e-6), f"{metres:g} m")


def _step_units(path: Path, content: bytes) -> set[float]:
    """Return the sizes of the length units in the contexts of the shapes [m]."""
    if b"ISO-10303-21" not in content[:4096]:
        raise MeshError(
            f"geometry {path}: expected a STEP file (ISO-10303-21 in its first line), got {content[:24]!r}; "
            "is the suffix right?"
        )
    entities = (found for found in ENTITY.finditer(content) if b"UNIT" in found[2].upper())  # not all at once
    text = {int(found[1]): found[2].decode("latin-1") for found in entities}
    assigned = {int(n) for group in CONTEXT.findall(content) for n in re.findall(rb"#(\d+)", group)}
    units = {number for number in assigned if "LENGTH_UNIT" in text.get(number, "")}
    return {_step_unit(path, text, number) for number in units}


def _step_unit(path: Path, text: dict[int, str], number: int, depth: int = 0) -> float:
    """Return the size of one length unit [m]: an SI unit, or a multiple of another unit."""
    body = text.get(number, "")
    if (found := PREFIX.search(body)) and found[1] in PREFIXES:
        return PREFIXES[found[1]]
    if depth < 3 and (converted := CONVERTED.search(body)):
        measure = MEASURE.search(text.get(int(converted[2]), ""))
        if measure:
            try:
                factor = float(measure[1])
            except ValueError:
                factor = 0.0
            if 0 < factor < 1e9:
                return factor * _step_unit(path, text, int(measure[2]), depth + 1)
    raise MeshError(
        f"geometry {path}: entity #{number}: this length unit is not known: {' '.join(body.split())[:100]!r}; "
        "export it again in mm, m or inch"
    )


def _iges_unit(path: Path, content: bytes) -> float:
    """Return the size of the unit in the global section of an IGES file [m]."""
    lines = content[:200_000].decode("latin-1").splitlines()
    text = "".join(line[:72] for line in lines if line[72:73] == "G")
    if not text:
        raise MeshError(
            f"geometry {path}: expected an IGES file with a global section (letter G in column 73), got "
            f"{content[:24]!r}; is the suffix right?"
        )
    fields = _iges_fields(text)
    flag, name = (fields[k].strip() if len(fields) > k else "" for k in (13, 14))
    number = int(flag) if flag.isdigit() else 1 if not flag else 0  # the standard's default is the inch
    size = IGES_NAMES.get(name.upper()) if number == 3 else IGES_UNITS.get(number)
    if size is None:
        raise MeshError(
            f"geometry {path}: global section: the length unit {flag!r} ({name!r}) is not known; export it again in "
            "mm, m or inch"
        )
    return size


def _iges_fields(text: str) -> list[str]:
    """Return the first fields of the global section; texts are counted (3HABC), and may hold the delimiters."""
    fields: list[str] = []
    at, delimiter, end = 0, ",", ";"
    while at < len(text) and len(fields) < 16:
        counted = re.compile(r"\s*(\d+)H").match(text, at)
        if counted:
            begin = counted.end()
            value = text[begin : begin + int(counted[1])]
            at = begin + len(value)
        else:
            stop = min((k for k in (text.find(delimiter, at), text.find(end, at)) if k >= 0), default=len(text))
            value, at = text[at:stop], stop
        fields.append(value)
        if len(fields) == 1 and counted and value:
            delimiter = value
        if text[at : at + 1] == end:
            break
        at += 1
    return fields
