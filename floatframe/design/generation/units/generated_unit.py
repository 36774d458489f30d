"""A system as an FMU of generated C for model exchange and co-simulation, without runtime dependencies."""

import hashlib
import math
import os
import platform
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from fe_models.foundation.paths import replace_file
from fe_models.foundation.presentation import presented
from fe_models.foundation.words import quoted
from floatframe.design.generation.generate import identifier, notes_of, require_free
from floatframe.design.generation.graph import SYMBOL, Scalar, reachable
from floatframe.design.generation.joint_forces import model_terms
from floatframe.design.generation.languages.c import c_files
from floatframe.design.generation.links import TreeTerms
from floatframe.design.generation.routines import Routine, routine_of
from floatframe.engine.tree.recursion.nodes import ROTATION
from floatframe.engine.tree.recursive import RelativeModel
from floatframe.errors import ModelError
from floatframe.files.cosimulation.archive import documentation, identifier_of, release, zipped
from floatframe.files.cosimulation.interface import Variable
from floatframe.files.cosimulation.model_description import Description, model_description
from floatframe.model.system import System

__all__ = ["GeneratedUnit", "compiled_library", "generate_fmu", "platform_folder"]


# compilation of C sources to a shared library by the C compiler of this machine
# -----------------------------------------


FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden")
#: folder of binaries in FMI 2.0 (depends only on the name) and FMI 3.0, by system and machine as Python names them
FOLDERS = {
    ("linux", "x86_64"): ("linux64", "x86_64-linux"),
    ("linux", "aarch64"): ("aarch64-linux", "aarch64-linux"),
    ("darwin", "x86_64"): ("darwin64", "x86_64-darwin"),
    ("darwin", "arm64"): ("darwin64", "aarch64-darwin"),
    ("win32", "AMD64"): ("win64", "x86_64-windows"),
}
SUFFIXES = {"linux": ".so", "darwin": ".dylib", "win32": ".dll"}


def platform_folder(fmi: int) -> str:
    """Return the folder of binaries of this machine in an FMU; `ModelError` if FMI has no name for the machine."""
    here = (sys.platform, platform.machine())
    if here not in FOLDERS:
        raise ModelError(f"generate: FMI has no name for binaries of this machine ({here[0]}, {here[1]})")
    return FOLDERS[here][0 if fmi == 2 else 1]


def compiled_library(sources: Mapping[str, bytes]) -> tuple[str, bytes]:
    """Return the suffix and content of a shared library made from C sources and headers, given by name.

    The compiler is given by the environment variable CC; default: `cc`.

    Raises
    ------
    ModelError
        If there is no compiler, or it fails.
    """
    command = shlex.split(os.environ.get("CC", "")) or ["cc"]
    program = shutil.which(command[0])
    if program is None:
        raise ModelError(
            f"generate: C compiler {command[0]!r} not found; install one (Debian, Ubuntu: apt install gcc; macOS: "
            "xcode-select --install; Windows: MinGW-w64), or name yours in the environment variable CC"
        )
    suffix = SUFFIXES[sys.platform]
    with TemporaryDirectory(prefix="floatframe_unit_") as folder:
        for name, text in sources.items():
            Path(folder, name).write_bytes(text)
        files = sorted(name for name in sources if name.endswith(".c"))
        words = [program, *command[1:], *FLAGS, *files, "-lm", "-o", f"unit{suffix}"]
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False, errors="replace")
        if done.returncode:
            lines = (done.stderr.strip() or done.stdout.strip() or "no message").splitlines()
            raise ModelError(f"generate: {' '.join([*command, *FLAGS])} failed: {' / '.join(lines[:3])}")
        return suffix, Path(folder, f"unit{suffix}").read_bytes()


# generated unit -------------------------------------------------------------------------------------------------------


VERSIONS = (2, 3)
WORDS = "Multibody system {}: equations of motion as generated C, without runtime dependencies."
STEP = "step"  #: name of the parameter of the unit
#: text of the documentation page
PARAGRAPHS = (
    "The sources are in the folder sources.",
    "Time is in seconds. In co-simulation, forces are constant over a communication step. The classical Runge-Kutta "
    f"method divides it into equal steps of at most the parameter {STEP}. States can be saved, restored and "
    "serialised.",
)
STABLE = 2.6  #: largest product of the step and the fastest frequency


@presented
@dataclass(frozen=True)
class GeneratedUnit:
    """The result of `generate_fmu`."""

    path: Path
    variables: tuple[Variable, ...]
    platform: str  #: folder of the binary, such as linux64


def generate_fmu(
    system: System, path: str | Path, *, fmi: int = 2, step: float = 1e-3, parameters: Sequence[str] = (),
    stop_time: float = 1.0,
) -> GeneratedUnit:  # fmt: skip
    """Write the equations of motion of one system as an FMU of compiled C, for model exchange and co-simulation.

    The states are the positions z and rates of `relative_model(system)`, which begin at the placed system. The inputs
    are forces along the rates, and the derivatives come from generated forward dynamics. In co-simulation, inputs are
    held constant, and the classical Runge-Kutta method takes equal steps of at most `step`, a parameter of the unit.

    Parameters
    ----------
    system
        As for `generate`: a tree with gravity and linear joint forces.
    path
        The FMU. It also contains its sources, so that it can be compiled on other machines.
    fmi
        Version of FMI, 2 or 3.
    step
        Longest step in co-simulation [s].
    parameters
        Parameters that can be set in the unit, as for `generate`: "link1/m", "link1", "gravity", patterns.
    stop_time
        Default end of a simulation [s].

    Raises
    ------
    ModelError
        If the system is not such a tree, a coordinate is prescribed, the system has events or FMUs, a value is invalid,
        there is no C compiler, or the file cannot be written.
    """
    if fmi not in VERSIONS:
        raise ModelError(f"generate_fmu: fmi: expected one of {', '.join(map(str, VERSIONS))}, got {fmi!r}")
    for role, value in (("step", step), ("stop_time", stop_time)):
        if not (0.0 < value < math.inf):
            raise ModelError(f"generate_fmu: {role}: expected a time above 0, got {value!r}")
    target = Path(path)
    if target.suffix.lower() != ".fmu" or target.is_dir() or not target.parent.is_dir():
        raise ModelError(f"generate_fmu: {target}: expected a file name that ends in .fmu, in a folder that exists")
    folder = platform_folder(fmi)
    model, tree = model_terms(system, parameters)
    require_free(model)
    for kind, named in (("event", system.events), ("unit", system.fmus)):
        if named:
            raise ModelError(
                f"generate_fmu: expected bodies, joints, gravity and linear joint forces, got {kind} "
                f"{quoted(named[0].name)}, which the unit cannot represent; remove it"
            )
    routine = routine_of(tree, "forward", identifier(f"{system.name}_forward"))
    require_stable(model, tree, step / system.units.time)
    variables = unit_variables(model, tree, routine, step)
    notes = notes_of(system, routine, model, tree)
    sources = {name: text.encode() for name, text in c_files(routine, notes).items()}
    for name in ("unit.h", "unit.c", f"fmi{fmi}.c"):
        sources[name] = files("floatframe.design.generation.units").joinpath("data", name).read_bytes()
    described = repr([variables, fmi, step, stop_time]).encode()
    token = hashlib.sha256(described + b"".join(name.encode() + text for name, text in sorted(sources.items())))
    name = identifier_of(system.name)
    about = Description(
        system.name, name, f"{{{token.hexdigest()[:32]}}}", f"floatframe {release()}", system.units, stop_time, step,
        WORDS.format(system.name), is_hosted=False, has_derivatives=True,
        sources=tuple(sorted(each for each in sources if each.endswith(".c"))),
    )  # fmt: skip
    sources["model.h"] = model_header(tree, routine, variables, about).encode()
    suffix, library = compiled_library(sources)
    archive = {f"sources/{each}": text for each, text in sources.items()}
    if fmi == 3:
        archive["sources/buildDescription.xml"] = build_description(about)
    archive["modelDescription.xml"] = model_description(about, variables, fmi)
    archive[f"binaries/{folder}/{name}{suffix}"] = library
    archive["documentation/index.html"] = documentation(about, variables, PARAGRAPHS)
    try:
        replace_file(target, zipped(archive))
    except OSError as error:
        raise ModelError(f"generate_fmu: {target}: cannot be written: {error.strerror}") from error
    return GeneratedUnit(target, variables, folder)


def require_stable(model: RelativeModel, tree: TreeTerms, step: float) -> None:
    """Raise `ModelError` if Runge-Kutta steps are too long for flexible bodies and springs of joints.

    `step` is in time units of the system. The method is stable up to 2.785 along the negative real axis and up to 2.83
    along the imaginary axis. Frequencies are those of small motions about the placed system.
    """
    if not tree.springs and all(link.modes is None for link in tree.links):
        return
    z, rest = model.positions()[0], np.zeros(model.n_rates)
    K, D, M = (each.copy() for each in model.derivatives(z, rest, rest))
    for spring in tree.springs:
        K[spring.rate, spring.rate] += spring.stiffness
        D[spring.rate, spring.rate] += spring.damping
    n = len(rest)
    matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, np.hstack([K, D]))]])
    fastest = float(np.abs(np.linalg.eigvals(matrix)).max())
    if step * fastest > STABLE:
        unit = model.expansion.system.units
        raise ModelError(
            f"generate_fmu: step: {step * unit.time:g} s is too long for the fastest mode, {fastest:.4g} rad/"
            f"{unit.time_symbol}; expected {0.9 * STABLE / fastest * unit.time:.2g} s or less, bodies with fewer "
            "modes (modes, with_modes), or softer springs and dampers of joints"
        )


def rotations(tree: TreeTerms) -> list[tuple[int, int]]:
    """Return the first position and first rate of each joint rotation with three rates."""
    return [(link.x0, link.v0) for link in tree.links if link.kind == ROTATION]


def slides(tree: TreeTerms) -> list[tuple[int, int]]:
    """Return position and rate of all positions whose derivative is their rate."""
    found = rotations(tree)
    x = set(range(len(tree.x))) - {x0 + k for x0, _ in found for k in range(4)}
    v = set(range(len(tree.v))) - {v0 + k for _, v0 in found for k in range(3)}
    return list(zip(sorted(x), sorted(v), strict=True))


def dotted(name: str) -> str:
    """Return the name of a coordinate in the notation of sensors."""
    return name.replace("/", ".")


def unit_variables(model: RelativeModel, tree: TreeTerms, routine: Routine, step: float) -> tuple[Variable, ...]:
    """Return the variables in the order of their value references (unit.h)."""
    units = model.expansion.system.units
    z, z_dot = model.positions()
    symbols = {"rad": "rad", "m": units.length_symbol}
    unit_of = {each.name: symbols[each.unit] for each in model.expansion.tree.columns}
    place = [unit_of.get(name, "") for name in model.names]  # none for modes and Euler parameters
    rate = [unit_of.get(name, "") for name in model.rate_names]
    forces = {"rad": f"{units.force_symbol} {units.length_symbol}", units.length_symbol: units.force_symbol}
    force = [forces.get(unit, "") for unit in rate]
    z_names = [f"{dotted(name)}.value" for name in model.names]
    v_names = [f"{dotted(name)}.rate" for name in model.rate_names]
    f_names = [f"{dotted(name)}.force" for name in model.rate_names]
    found = [Variable("time", "independent", "s", "time")]
    for name, start, unit, own in zip(z_names, z, place, model.names, strict=True):
        found.append(state(name, unit, f"position along {own}", float(start)))
    rates = {v0 + k: f"angular velocity, {own}" for _, v0 in rotations(tree) for k, own in enumerate("xyz")}
    for k, (name, start, unit, own) in enumerate(zip(v_names, z_dot, rate, model.rate_names, strict=True)):
        found.append(state(name, per(unit, units.time_symbol), rates.get(k, f"rate along {own}"), float(start)))
    for name, unit, own in zip(f_names, force, model.rate_names, strict=True):
        found.append(Variable(name, "input", unit, f"force along {own}, added to that of gravity"))
    for name, value in zip(tree.parameter_names, tree.parameter_values, strict=True):
        words = f"{name} of the system, in its units ({units.name})"
        found.append(Variable(name, "parameter", "", words, float(value), is_tunable=True))
    found.append(Variable(STEP, "parameter", "s", "longest step in co-simulation", step, is_tunable=True))
    of_place = dict(slides(tree))
    turns = {x0 + k: (x0, v0) for x0, v0 in rotations(tree) for k in range(4)}
    for k, (name, unit) in enumerate(zip(z_names, place, strict=True)):
        x0, v0 = turns.get(k, (0, 0))
        needs = (*z_names[x0 : x0 + 4], *v_names[v0 : v0 + 3]) if k in turns else (v_names[of_place[k]],)
        found.append(derivative(name, per(unit, "s"), needs))
    acceleration = routine.outputs[0].values
    whole = {x0: z_names[x0 : x0 + 4] for x0, _ in rotations(tree)}
    for k, (name, unit) in enumerate(zip(v_names, rate, strict=True)):
        wanted = needed(acceleration[k], {"z": z_names, "z_dot": v_names, "force": f_names}, whole)
        found.append(derivative(name, per(per(unit, units.time_symbol), "s"), wanted))
    return tuple(found)


def state(name: str, unit: str, words: str, start: float) -> Variable:
    """Return a state, which is an output that depends on itself."""
    return Variable(name, "output", unit, words, start, is_state=True, depends_on=(name,))


def derivative(name: str, unit: str, needs: Sequence[str]) -> Variable:
    """Return the derivative of a state."""
    return Variable(f"der({name})", "local", unit, f"derivative of {name}", derivative_of=name, depends_on=tuple(needs))


def needed(term: Scalar, names: dict[str, list[str]], whole: dict[int, list[str]]) -> list[str]:
    """Return the names of the symbols in a term; Euler parameters appear as all four, because they are normalised."""
    found: dict[str, None] = {}
    for each in reachable([term]):
        stem, _, k = each.name[:-1].partition("[") if each.kind == SYMBOL else ("", "", "")
        if stem in names:
            own = names[stem][int(k)]
            four = next((group for group in whole.values() if own in group), [own])
            found |= dict.fromkeys(four)
    return list(found)


def per(unit: str, time: str) -> str:
    """Return the unit of a rate."""
    if "/" not in unit:
        return f"{unit or '1'}/{time}"
    above, below = unit.split("/")
    return f"{above}/{below}²" if below == time else f"{above}/{below} {time}"


def model_header(tree: TreeTerms, routine: Routine, variables: Sequence[Variable], about: Description) -> str:
    """Return model.h: sizes, initial values and the call of the generated function."""
    pairs = {"turns": rotations(tree), "slides": slides(tree)}
    n_values = 1 + len(tree.x) + 2 * len(tree.v) + len(tree.parameters) + 1
    tables = []
    for name, rows in pairs.items():
        text = ", ".join(f"{{{x0}, {v0}}}" for x0, v0 in rows) or "{0, 0}"
        tables.append(f"static const int {name}[][2] = {{{text}}}; /* first position, first rate */")
    starts = ",\n    ".join(f"{each.start!r}" for each in variables[:n_values])
    arguments = ", ".join({"force": "f", "parameters": "p", "z": "z", "z_dot": "v"}[each[0]] for each in routine.inputs)
    return f"""/* Sizes and numbers of one system for unit.c, generated by floatframe. */
#ifndef MODEL_H
#define MODEL_H

#include "{routine.name}.h"

#define TOKEN "{about.token}"
#define SECONDS {float(about.units.time)!r} /* of a unit of time of the system */
#define ACCELERATIONS(z, v, f, p, a) {routine.name}({arguments}, a)

enum {{
    N_Z = {len(tree.x)},
    N_V = {len(tree.v)},
    N_P = {len(tree.parameters)},
    N_TURNS = {len(pairs["turns"])},
    N_SLIDES = {len(pairs["slides"])}
}};

#ifdef UNIT_C
{chr(10).join(tables)}

static const double start_values[] = {{ /* by value reference */
    {starts}
}};
#endif

#endif
"""


def build_description(about: Description) -> bytes:
    """Return sources/buildDescription.xml of FMI 3.0."""
    root = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    one = SubElement(root, "BuildConfiguration", {"modelIdentifier": about.identifier})
    group = SubElement(one, "SourceFileSet", {"language": "C99"})
    for name in about.sources:
        SubElement(group, "SourceFile", {"name": name})
    indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="utf-8") + b"\n"
