"""Reading of tyre property files (.tir) for the Magic Formula 5.2 and 6.1."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

import numpy as np

from floatframe.components.wheels.coefficients import COEFFICIENTS, LEFT_OUT, NEEDED, NEEDED_COMBINED, ONLY_52, ONLY_61
from floatframe.errors import ModelError

__all__ = ["TyreProperties", "read_tyre_file", "shipped_tyre"]

LARGEST = 1_000_000  #: largest size of a file in bytes; real files have about ten thousand
VERSIONS = {"5.2": 52, "6.1": 61}
FIT_TYPES = {"6": 52, "21": 52, "52": 52, "61": 61, "62": 61}  #: version of the formula for each FITTYP
#: version for each PROPERTY_FILE_FORMAT, if FITTYP is missing
FORMATS = {"PAC2002": 52, "MF_05": 52, "MF05": 52, "MF61": 61}
LENGTHS = {"METER": 1.0, "METRE": 1.0, "M": 1.0, "MM": 1e-3, "MILLIMETER": 1e-3, "CM": 1e-2, "CENTIMETER": 1e-2}
LENGTHS |= {"INCH": 0.0254, "IN": 0.0254, "FOOT": 0.3048, "FT": 0.3048, "KM": 1e3, "KILOMETER": 1e3}
FORCES = {"NEWTON": 1.0, "N": 1.0, "KILONEWTON": 1e3, "KNEWTON": 1e3, "KN": 1e3, "DYNE": 1e-5}
FORCES |= {"POUND_FORCE": 4.4482216152605, "LBF": 4.4482216152605, "KILOGRAM_FORCE": 9.80665, "KGF": 9.80665}
TIMES = {"SECOND": 1.0, "SEC": 1.0, "S": 1.0, "MILLISECOND": 1e-3, "MS": 1e-3}
PRESSURES = {"PASCAL": 1.0, "PA": 1.0, "KPA": 1e3, "KILOPASCAL": 1e3, "BAR": 1e5, "MPA": 1e6, "PSI": 6894.757293168361}
ANGLES = ("RADIAN", "RADIANS", "RAD")

LINE = re.compile(r"^(\w+)\s*=\s*(.*)$")


@dataclass(frozen=True, eq=False)
class TyreProperties:
    """The content of a tyre property file, in SI units."""

    version: int  #: version of the formula, 52 or 61
    coefficients: Mapping[str, float]  #: values of all `coefficients.COEFFICIENTS`
    radius: float  #: unloaded radius, UNLOADED_RADIUS [m]
    load: float  #: nominal load, FNOMIN [N]
    stiffness: float  #: vertical stiffness, VERTICAL_STIFFNESS [N/m]
    damping: float  #: vertical damping, VERTICAL_DAMPING [N s/m]
    speed: float  #: speed of the measurement, LONGVL [m/s]
    low_speed: float | None  #: low-speed limit, VXLOW [m/s]
    width: float | None  #: width of the tyre, WIDTH [m]
    side: str  #: side of the tyre, TYRESIDE: "left", "right" or "symmetric"
    is_combined: bool | None  #: whether slip is combined, from USE_MODE; None if it does not state this
    pressure: float | None  #: inflation pressure, INFLPRES [Pa]
    nominal_pressure: float | None  #: nominal pressure, NOMPRES [Pa]
    ranges: Mapping[str, tuple[float, float]]  #: ranges of kappa, alpha, gamma, load and pressure in SI units
    #: carcass stiffnesses, LONGITUDINAL_STIFFNESS and LATERAL_STIFFNESS [N/m]
    carcass: tuple[float | None, float | None]
    source: str = "tyre"  #: name of the tyre in messages
    notes: tuple[str, ...] = field(default=())  #: defaults taken for missing coefficients, and effects neglected

    @property
    def cornering_stiffness(self) -> float:
        """K_y of the upright tyre at the nominal load and pressure, in signs of the file [N/rad]."""
        p = self.coefficients
        return p["PKY1"] * self.load * np.sin(p["PKY4"] * np.arctan(1.0 / p["PKY2"]))


def read_tyre_file(path: str | Path, *, version: str | None = None) -> TyreProperties:
    """Read a .tir file.

    Parameters
    ----------
    path
        The file.
    version
        "5.2" or "6.1", if the file states no version or an unknown one.

    Raises
    ------
    ModelError
        If it is not a property file; if units, version or needed coefficients are missing; or if values are not
        numbers.
    """
    path = Path(path)
    try:
        if path.stat().st_size > LARGEST:
            raise ModelError(
                f"tyre file {path}: it has {path.stat().st_size} bytes; a property file has some ten thousand"
            )
        content = path.read_bytes()
    except OSError as error:
        raise ModelError(f"tyre file {path}: cannot be read: {error.strerror or error}") from None
    if b"\0" in content:
        raise ModelError(
            f"tyre file {path}: it contains binary data; expected the text of a property file, [SECTION] and KEY = "
            "value"
        )
    return tyre_from_text(content.decode("utf-8", errors="replace"), f"tyre file {path}", version=version)


def shipped_tyre(name: str) -> Path:
    """Return the property file of a shipped tyre, whose coefficients are fictitious."""
    found = {path.stem: path for path in sorted((Path(__file__).parent / "data").glob("*.tir"))}
    if name not in found:
        raise ModelError(f"tyre: expected one of {', '.join(found)}, which are shipped, got {name!r}")
    return found[name]


def tyre_from_text(text: str, where: str, *, version: str | None = None) -> TyreProperties:
    """Return the tyre for the text of a property file; messages begin with `where`."""
    words = entries(text, where)
    if not words:
        raise ModelError(f"{where}: no line KEY = value; expected the text of a tyre property file")
    length, force, time, pressure = factors(words, where)
    kind = formula_version(words, where, version)
    numbers = {key: number for key, (line, value) in words.items() if (number := numeric(value)) is not None}
    for key in (*COEFFICIENTS, *LEFT_OUT, "FNOMIN", "UNLOADED_RADIUS", "VERTICAL_STIFFNESS"):
        if key in words and words[key][1] and key not in numbers:
            raise ModelError(f"{where}, line {words[key][0]}: {key}: expected a number, got {words[key][1]!r}")

    def scaled(key: str, factor: float) -> float | None:
        return None if key not in numbers else numbers[key] * factor

    mode = int(abs(numbers["USE_MODE"])) % 10 if "USE_MODE" in numbers else None
    is_combined = None if mode is None or mode < 3 else mode > 3
    needed = ["UNLOADED_RADIUS", "FNOMIN", "VERTICAL_STIFFNESS", *NEEDED]
    needed += NEEDED_COMBINED if is_combined else []
    missing = [key for key in needed if key not in numbers]
    if missing:
        raise ModelError(
            f"{where}: missing {', '.join(missing)}, which version {kind / 10:g} needs"
            + (" for combined slip (USE_MODE; 3 is for pure slip)" if set(missing) <= set(NEEDED_COMBINED) else "")
        )
    for key in ("UNLOADED_RADIUS", "FNOMIN", "VERTICAL_STIFFNESS"):
        if numbers[key] <= 0:
            raise ModelError(f"{where}, line {words[key][0]}: {key}: expected a number above 0, got {numbers[key]:g}")
    for key in ("NOMPRES", "INFLPRES", "LONGVL"):
        if key in numbers and numbers[key] <= 0:
            raise ModelError(f"{where}, line {words[key][0]}: {key}: expected a number above 0, got {numbers[key]:g}")
    ranges = {}
    for name, low, high, factor in (
        ("kappa", "KPUMIN", "KPUMAX", 1.0),
        ("alpha", "ALPMIN", "ALPMAX", 1.0),
        ("gamma", "CAMMIN", "CAMMAX", 1.0),
        ("load", "FZMIN", "FZMAX", force),
        ("pressure", "PRESMIN", "PRESMAX", pressure),
    ):
        if low in numbers and high in numbers:
            if not numbers[low] < numbers[high]:
                raise ModelError(f"{where}: {low} = {numbers[low]:g} is not below {high} = {numbers[high]:g}")
            ranges[name] = numbers[low] * factor, numbers[high] * factor
    side = words.get("TYRESIDE", (0, "LEFT"))[1].lower()
    if side not in ("left", "right", "symmetric"):
        raise ModelError(f"{where}: TYRESIDE: expected 'LEFT', 'RIGHT' or 'SYMMETRIC', got {side!r}")
    return TyreProperties(
        version=kind,
        coefficients=MappingProxyType(chosen(numbers, kind)),
        radius=numbers["UNLOADED_RADIUS"] * length,
        load=numbers["FNOMIN"] * force,
        stiffness=numbers["VERTICAL_STIFFNESS"] * force / length,
        damping=numbers.get("VERTICAL_DAMPING", 0.0) * force * time / length,
        speed=numbers.get("LONGVL", 16.7 * time / length) * length / time,
        low_speed=scaled("VXLOW", length / time),
        width=scaled("WIDTH", length),
        side=side,
        is_combined=is_combined,
        pressure=scaled("INFLPRES", pressure),
        nominal_pressure=scaled("NOMPRES", pressure),
        ranges=MappingProxyType(ranges),
        carcass=(scaled("LONGITUDINAL_STIFFNESS", force / length), scaled("LATERAL_STIFFNESS", force / length)),
        source=where,
        notes=tuple(notes_of(words, numbers, kind)),
    )


def entries(text: str, where: str) -> dict[str, tuple[int, str]]:
    """Return line number and value of each key; shape tables and comments are skipped."""
    found: dict[str, tuple[int, str]] = {}
    section = ""
    for k, raw in enumerate(text.splitlines(), start=1):
        line = raw.split("$")[0].split("!")[0].strip()
        if not line or line.startswith("{"):
            continue
        if line.startswith("["):
            section = line.strip("[]").strip().upper()
            continue
        match = LINE.match(line)
        if match is None:
            if section == "SHAPE" or (section.startswith("DEFLECTION") and numeric(line.split()[0]) is not None):
                continue
            raise ModelError(
                f"{where}, line {k}: expected KEY = value, [SECTION] or a comment ($ or !), got {line[:60]!r}"
            )
        key, value = match[1].upper(), match[2].strip().strip("'\"").strip()
        if key in found and found[key][1] != value:
            raise ModelError(f"{where}, line {k}: {key} = {value} contradicts {found[key][1]} in line {found[key][0]}")
        found[key] = k, value
    return found


def numeric(word: str) -> float | None:
    """Return the number in a word, with an exponent E or D; None if it is not a number."""
    try:
        value = float(word.replace("D", "E").replace("d", "e"))
    except ValueError:
        return None
    return value if np.isfinite(value) else None


def factors(words: dict[str, tuple[int, str]], where: str) -> tuple[float, float, float, float]:
    """Return the SI values of the units of length, force, time and pressure; `ModelError` if missing or unknown."""
    found = []
    for key, known in (("LENGTH", LENGTHS), ("FORCE", FORCES), ("TIME", TIMES)):
        if key not in words:
            raise ModelError(f"{where}: [UNITS]: missing {key}; expected one of {', '.join(sorted(known)).lower()}")
        if (unit := words[key][1].upper()) not in known:
            raise ModelError(
                f"{where}, line {words[key][0]}: {key}: expected one of "
                f"{', '.join(sorted(known)).lower()}, got {unit.lower()!r}"
            )
        found.append(known[unit])
    angle = words.get("ANGLE", (0, "missing"))
    if angle[1].upper() not in ANGLES:
        raise ModelError(
            f"{where}: [UNITS]: ANGLE: expected 'radians', got {angle[1]!r}: slopes and ranges of the formula "
            "are per radian"
        )
    if "PRESSURE" in words:
        if (unit := words["PRESSURE"][1].upper()) not in PRESSURES:
            raise ModelError(
                f"{where}: [UNITS]: PRESSURE: expected one of {', '.join(PRESSURES).lower()}, got {unit.lower()!r}"
            )
        pressure = PRESSURES[unit]
    elif found[:2] == [1.0, 1.0]:
        pressure = 1.0
    elif "NOMPRES" in words or "INFLPRES" in words:
        raise ModelError(
            f"{where}: [UNITS]: lengths and forces are not in metres and newtons, and pressures have no unit; "
            f"add PRESSURE = one of {', '.join(PRESSURES).lower()}"
        )
    else:
        pressure = 1.0
    return found[0], found[1], found[2], pressure


def formula_version(words: dict[str, tuple[int, str]], where: str, version: str | None) -> int:
    """Return the version, 52 or 61."""
    if version is not None:
        if version not in VERSIONS:
            raise ModelError(f"{where}: version: expected one of {', '.join(VERSIONS)}, got {version!r}")
        return VERSIONS[version]
    fit = words.get("FITTYP", (0, ""))[1].split(".")[0]
    if fit in FIT_TYPES:
        return FIT_TYPES[fit]
    file_format = words.get("PROPERTY_FILE_FORMAT", (0, ""))[1].upper()
    if not fit and file_format in FORMATS:
        return FORMATS[file_format]
    said = f"FITTYP = {fit}" if fit else f"PROPERTY_FILE_FORMAT = {file_format or 'missing'}"
    raise ModelError(
        f"{where}: version of the formula: {said} is unknown (FITTYP {', '.join(FIT_TYPES)}; "
        f'PROPERTY_FILE_FORMAT {", ".join(FORMATS)}); if it is 5.2 or 6.1, give version = "5.2" or "6.1"'
    )


def chosen(numbers: dict[str, float], kind: int) -> dict[str, float]:
    """Return all coefficients, with defaults for those that neither the file nor this version of the formula has.

    Relaxation lengths by p_T belong to version 5.2; they are also used if a file of version 6.1 has them.
    """
    others = ONLY_61 if kind == 52 else {key for key in ONLY_52 if not key.startswith("PT")}
    return {key: default if key in others else numbers.get(key, default) for key, default in COEFFICIENTS.items()}


def notes_of(words: dict[str, tuple[int, str]], numbers: dict[str, float], kind: int) -> list[str]:
    """Return notes on coefficients that the file does not have, and on neglected ones."""
    notes = []
    others = ONLY_61 if kind == 52 else ONLY_52
    absent = [key for key in COEFFICIENTS if key not in numbers and key not in others]
    if absent:
        notes.append(f"not in the file, taken as 0 (factors as 1): {', '.join(absent)}")
    unused = sorted(
        key for key in numbers if numbers[key] and key in COEFFICIENTS and chosen(numbers, kind)[key] != numbers[key]
    )
    if unused:
        notes.append(f"not of version {kind / 10:g}, unused: {', '.join(unused)}")
    reasons: dict[str, list[str]] = {}
    for key, reason in LEFT_OUT.items():
        if numbers.get(key, 0.0) != 0.0:
            reasons.setdefault(reason, []).append(key)
    notes += [f"left out: {reason} ({', '.join(keys)})" for reason, keys in reasons.items()]
    if words.get("FITTYP", (0, ""))[1].startswith("62"):
        notes.append("version 6.2 is read as 6.1")
    return notes
