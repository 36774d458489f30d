"""Writing of an FMU: model description, binaries that run Python, and all files that the unit needs."""

import hashlib
import io
import json
import re
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, distribution, version
from pathlib import Path
from typing import Any

import tomlkit

from fe_models.foundation.documents.document import Answer, Document, Paragraph, Section, TextTable
from fe_models.foundation.documents.html import html_page
from fe_models.foundation.extras import extra_module
from fe_models.foundation.paths import replace_file
from floatframe.errors import FloatframeError, ModelError
from floatframe.files.cosimulation.interface import Variable, content_of, interface, parameter_paths, read_unit
from floatframe.files.cosimulation.model_description import NEEDS, Description, model_description
from floatframe.files.cosimulation.unit import Unit, UnitState, sensor_names

__all__ = ["SETTINGS", "SYSTEM", "HostedUnit", "WrittenFmu", "slave_script", "words_of", "write_fmu"]


# a unit as the binary of an FMU calls it: variables by value reference, time in seconds, words for its log ------------


SYSTEM, SETTINGS = "system.toml", "unit.json"  #: files in the resources of an FMU


class HostedUnit:
    """The unit that runs the system in the resources of an FMU.

    Parameters
    ----------
    resources
        Folder with the system file, the modal files it names, and the settings `archive.write_fmu` left there.
    log
        Function called with the text of each warning.
    """

    def __init__(self, resources: str, log: Callable[[str], None]) -> None:
        self.path = Path(resources) / SYSTEM
        self.settings = json.loads((Path(resources) / SETTINGS).read_text(encoding="utf-8"))
        self.variables = tuple(Variable(**each) for each in self.settings["variables"])
        self.log = log
        self.t_start = 0.0  #: start time of the motion [s]
        self.values = {each.name: each.start for each in self.variables if each.causality in ("parameter", "input")}
        self.unit: Unit | None = None
        self.is_running = False

    @property
    def seconds(self) -> float:
        """Number of seconds in the time unit of the system."""
        return float(self.settings["seconds"])

    def variable(self, reference: int) -> Variable:
        """Return the variable with a value reference."""
        if not 0 <= reference < len(self.variables):
            raise ModelError(f"value reference {reference}: expected 0 to {len(self.variables) - 1}")
        return self.variables[reference]

    def set(self, references: Sequence[int], values: Sequence[float]) -> None:
        """Set inputs; parameters can be set until the initialisation has ended."""
        for reference, value in zip(references, values, strict=True):
            each = self.variable(reference)
            if each.causality not in ("parameter", "input"):
                raise ModelError(f"{each.name}: an {each.causality} cannot be set")
            if each.causality == "parameter" and self.is_running:
                raise ModelError(
                    f"{each.name}: a parameter is set before the initialisation ends; reset the unit first"
                )
            self.values[each.name] = float(value)
            if self.is_running and self.unit is not None:
                self.unit.set(each.name, value)
            elif not self.is_running:
                self.unit = None  # recreated with these values when requested

    def begun(self) -> Unit:
        """Return the unit, which has begun its motion or continues it."""
        if self.unit is None:
            changes = {v.path: self.values[v.name] for v in self.variables
                       if v.causality == "parameter" and self.values[v.name] != v.start}  # fmt: skip
            unit, _ = read_unit(
                self.path, changes=changes, inputs=self.settings["inputs"], outputs=self.settings["outputs"]
            )
            for each in self.variables:
                if each.causality == "input":
                    unit.set(each.name, self.values[each.name])
            unit.begin(self.t_start / self.seconds)
            self.unit = unit
        return self.unit

    def get(self, references: Sequence[int]) -> list[float]:
        """Return the values of variables."""
        wanted = [self.variable(reference) for reference in references]
        outputs = self.begun().values() if any(each.causality == "output" for each in wanted) else {}
        time = self.t_start if self.unit is None else self.unit.t * self.seconds
        known = self.values | outputs | {each.name: time for each in wanted if each.causality == "independent"}
        return [known[each.name] for each in wanted]

    def begin(self) -> None:
        """End the initialisation: close the joints and start the motion."""
        self.begun()
        self.is_running = True

    def step(self, t: float, size: float) -> None:
        """Take a communication step of size `size` from time t, both in seconds."""
        unit = self.begun()
        told = len(unit.notes)
        unit.step(t / self.seconds, size / self.seconds)
        for words in unit.notes[told:]:
            self.log(words)

    def state(self) -> UnitState:
        """Return the complete state of the unit."""
        return self.begun().state()

    def restore(self, state: UnitState) -> None:
        """Restore a state of this unit, or of another instance of the FMU with the same parameters."""
        unit = self.begun()
        unit.restore(state)
        self.is_running = True
        self.values |= unit.inputs

    def state_of_bytes(self, content: bytes) -> UnitState:
        """Return the state for serialised bytes."""
        return UnitState.from_bytes(content, self.begun().system)


def words_of(error: BaseException) -> str:
    """Return an error as one line: its message if it is meant for users, otherwise with the type of the error."""
    return str(error) if isinstance(error, FloatframeError) else f"{type(error).__name__}: {error}"


# archive --------------------------------------------------------------------------------------------------------------


PACKAGES = {2: "pythonfmu", 3: "pythonfmu3"}  #: packages whose binaries and classes are copied into an FMU
VERSIONS = tuple(PACKAGES)
#: module name in the resources, different for each version, because a process imports each name only once
SCRIPT = "floatframe_unit_fmi{}"
#: text of the documentation page in an FMU
PARAGRAPHS = (
    "The first run compiles code, a minute or less, once for each installation. Its binary is that of {package}.",
    "Time is in seconds. Force inputs are constant over a communication step; a drive takes its value, rate and "
    "acceleration, and follows them without jumps. The motion is that of the system file alone if the communication "
    "step is a multiple of its step, {step!r} s, and inputs are constant. Parameters are set before the initialisation "
    "ends. States can be saved, restored and serialised.",
)
EPOCH = (1980, 1, 1, 0, 0, 0)  #: date of all files in an FMU, so that the same system gives the same bytes


@dataclass(frozen=True)
class WrittenFmu:
    """The FMU that was written."""

    path: Path
    variables: tuple[Variable, ...]
    platforms: tuple[str, ...]  #: folders of binaries in the FMU, such as linux64


def write_fmu(
    system: Path,
    path: Path,
    *,
    fmi: int = 2,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    parameters: Mapping[str, str] | None = None,
) -> WrittenFmu:
    """Write the FMU for co-simulation of a system file.

    Parameters
    ----------
    system
        The system file; it needs a table [run], whose method and step the unit takes.
    path
        The FMU.
    fmi
        Version, 2 or 3.
    inputs, outputs
        Names of inputs (`held_inputs.input_choices`) and of sensors or joint coordinates; None: those of the table
        [fmu], or without this table the tables [inputs.NAME], all constant forces and drives, and all sensors.
    parameters
        Key paths of the system file by name; None: those of the table [fmu], or without this table all numbers of
        bodies, forces, couplers and gravity.

    Raises
    ------
    FloatframeError
        If the system is impossible, or a name does not exist.
    MissingExtraError
        If PythonFMU, or PythonFMU3 for version 3, is not installed.
    """
    if fmi not in PACKAGES:
        raise ModelError(f"write_fmu: fmi: expected one of {', '.join(map(str, VERSIONS))}, got {fmi!r}")
    package = extra_module(PACKAGES[fmi], extra="fmi", purpose=f"an FMU of version {fmi}")
    content = content_of(system)
    told = content.get("fmu")
    named = told if isinstance(told, dict) else {}  # otherwise refused when the file is read
    unit, run = read_unit(
        system,
        inputs=named.get("inputs") if inputs is None else inputs,
        outputs=named.get("outputs") if outputs is None else outputs,
    )
    paths = parameter_paths(content, named.get("parameters") if parameters is None else parameters, str(system))
    unit.begin()
    variables = interface(unit, content, paths, str(system))
    seconds = unit.system.units.time
    files = resource_files(system, content)
    settings = {
        "inputs": [each.name for each in unit.held],
        "outputs": sensor_names(unit.system, unit.outputs),
        "seconds": seconds,
        "variables": [asdict(each) for each in variables],
    }
    files[SETTINGS] = json.dumps(settings, indent=1, ensure_ascii=False).encode()
    script = SCRIPT.format(fmi)
    files["slavemodule.txt"] = script.encode()
    files[f"{script}.py"] = slave_script(fmi).encode()
    token = hashlib.sha256(b"".join(name.encode() + files[name] for name in sorted(files)))
    about = Description(
        unit.system.name, identifier_of(unit.system.name), f"{{{token.hexdigest()[:32]}}}", f"floatframe {release()}",
        unit.system.units, run.t_end * seconds, run.h * seconds,
        f"Flexible multibody system {unit.system.name}. {NEEDS}",
    )  # fmt: skip
    package_folder = Path(str(package.__file__)).parent
    for each in sorted(package_folder.glob("*.py")):
        files[f"{package_folder.name}/{each.name}"] = each.read_bytes()
    binaries = binaries_of(package_folder, about.identifier)
    archive = {"modelDescription.xml": model_description(about, variables, fmi)} | binaries
    paragraphs = [words.format(package=package_folder.name, step=about.step) for words in PARAGRAPHS]
    archive |= {f"resources/{name}": data for name, data in files.items()}
    archive["documentation/index.html"] = documentation(about, variables, paragraphs)
    archive |= licences(package_folder.name)
    replace_file(path, zipped(archive))
    return WrittenFmu(path, variables, tuple(sorted({name.split("/")[1] for name in binaries})))


def resource_files(system: Path, content: Mapping[str, Any]) -> dict[str, bytes]:
    """Return the system file with changed paths to modal files and signals, and all these files by name."""
    files: dict[str, bytes] = {}
    changed = json.loads(json.dumps(content))
    taken: dict[Path, str] = {}
    for kind in ("bodies", "signals"):
        for section in changed.get(kind, {}).values():
            if "file" in section:
                source = (system.parent / section["file"]).resolve()
                if source not in taken:
                    word = "body" if kind == "bodies" else "signal"
                    taken[source] = f"{word}_{len(taken) + 1}_{identifier_of(source.stem)}{source.suffix}"
                    files[taken[source]] = source.read_bytes()
                section["file"] = taken[source]
    for table in ("fmu", "fmus", "cosimulation"):
        changed.pop(table, None)
    changed.setdefault("system", {}).setdefault("name", system.stem)
    files[SYSTEM] = tomlkit.dumps(changed).encode()
    return files


def identifier_of(name: str) -> str:
    """Return a name as a valid C identifier."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return plain if plain[:1].isalpha() else f"unit_{plain}"


def binaries_of(package: Path, identifier: str) -> dict[str, bytes]:
    """Return the libraries of PythonFMU, named after the model, by their paths in an FMU."""
    folder = package / "resources" / "binaries"
    found = {
        f"binaries/{each.parent.name}/{identifier}{each.suffix}": each.read_bytes()
        for each in sorted(folder.rglob("*"))
        if each.suffix in (".so", ".dll", ".dylib")
    }
    if not found:
        raise ModelError(f"write_fmu: the installed {package.name} has no binaries in {folder}; install it again")
    return found


def release() -> str:
    """Return the version of this program."""
    try:
        return version("floatframe")
    except PackageNotFoundError:
        return "unknown"


def licences(package: str) -> dict[str, bytes]:
    """Return the licence texts of the binaries and classes that an FMU contains."""
    try:
        files = distribution(package).files or ()
    except PackageNotFoundError:
        return {}
    texts = [each for each in files if each.name.upper().startswith(("LICENSE", "LICENCE", "NOTICE"))]
    return {
        f"documentation/licenses/{package}-{each.name}.txt": each.locate().read_bytes()  # type: ignore[attr-defined]
        for each in texts
    }


def documentation(about: Description, variables: Sequence[Variable], paragraphs: Iterable[str]) -> bytes:
    """Return the documentation page of an FMU."""
    rows = [(v.name, v.causality, v.unit, v.words) for v in variables]
    sections = (
        Section("use", "How to use it", [Paragraph(words) for words in paragraphs]),
        Section("variables", "Variables", (TextTable(("variable", "kind", "unit", "what it is"), rows),)),
    )
    page = Document(
        about.name, about.words, Answer(f"{len(variables)} variables; times in seconds."), sections,
        kind="functional mock-up unit", footer=f"Written by {about.tool}.",
    )  # fmt: skip
    return html_page(page).encode()


def zipped(files: Mapping[str, bytes]) -> bytes:
    """Return the files as a zip file, whose bytes are the same for the same files."""
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files):
            info = zipfile.ZipInfo(name, EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(info, files[name])
    return data.getvalue()


# the script in the resources of an FMU that its binary loads: a class that hands every call on to a `HostedUnit` ------
# The binaries are those of PythonFMU (FMI 2.0) and PythonFMU3 (FMI 3.0). They find the class by its line in the script,
# call its methods, and handle states as the Python objects that it returns.


UNIT_SCRIPT = '''"""The unit of a floatframe system; written by floatframe, read by the binary of this FMU."""

import atexit
import ctypes
import functools
import os
import sys
from pathlib import Path

try:
    from floatframe.errors import ConvergenceError
    from floatframe.files.cosimulation.archive import HostedUnit, words_of
except ImportError as error:  # told by the instance: the binary does not survive an error of the script itself
    missing = (
        f"this FMU needs floatframe in the Python that hosts it ({{sys.executable}}, {{sys.version.split()[0]}}), "
        f"where it does not load: {{error}}; install it there: pip install floatframe"
    )
else:
    missing = ""

from {package}.{module} import {base}
from {package}.enums import {status}
{imports}
RELEASES = {{}}  # a function of each binary in this process, by the path of the binary


def release_python_at_exit(resources):
    """Let the binary release Python while Python still runs.

    The Linux binary releases it at the end of the process too, but from a static pointer that is destroyed by then: it
    writes into freed memory, which ends the process with "corrupted double-linked list" or not at all, by chance.
    """
    if sys.platform != "linux":
        return
    for path in Path(resources).parent.glob("binaries/*linux*/*.so"):
        if path not in RELEASES:
            try:
                binary = ctypes.CDLL(str(path), mode=os.RTLD_LAZY | os.RTLD_NOLOAD)
                RELEASES[path] = binary.finalizePythonInterpreter
            except (AttributeError, OSError):  # loaded from elsewhere, or another release of the binary
                continue
            atexit.register(RELEASES[path])


def told(method):
    """Let an error reach the log of the master as its words, and the binary survive it.

    The binary lets go of class, instance and messages when an error is raised, and once more when it frees the
    instance: without one more reference to each it would free them twice.
    """

    @functools.wraps(method)
    def call(self, *args):
        try:
            return method(self, *args)
        except Exception as error:
            for each in (type(self), self, self.log_queue):
                ctypes.pythonapi.Py_IncRef(ctypes.py_object(each))
            raise RuntimeError(words_of(error)) from None

    return call


class FloatframeSlave({base}):
    """Hands on every call."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        release_python_at_exit(self.resources)
        if missing:
            print(missing, file=sys.stderr)
            raise ImportError(missing)
        self.unit = HostedUnit(self.resources, lambda words: self.log(words, {status}.warning))

    @told
    def setup_experiment(self, start_time, *_):
        self.unit.t_start = start_time

    @told
    def exit_initialization_mode(self):
        self.unit.begin()

    @told
    def do_step(self, current_time, step_size):
        try:
            self.unit.step(current_time, step_size)
        except ConvergenceError as error:  # the unit is where it was: the master may try a smaller step
            self.log(words_of(error), {status}.error)
            return {failed}
        return {done}

    @told
    def get_{real}(self, vrs):
        return self.unit.get(vrs)

    @told
    def set_{real}(self, vrs, values):
        self.unit.set(vrs, values)

    @told
    def _get_fmu_state(self):
        return HeldState(self.unit, self.unit.state())

    @told
    def _set_fmu_state(self, state):
        self.unit.restore(state.of(self.unit))

    @staticmethod
    def _fmu_state_to_bytes(state):
        return state.content()

    @staticmethod
    def _fmu_state_from_bytes(content):
        return HeldState(None, content)


class HeldState:
    """A state, or the bytes of one that is yet to be read."""

    def __init__(self, unit, state):
        self.state = state

    def of(self, unit):
        return unit.state_of_bytes(self.state) if isinstance(self.state, bytes) else self.state

    def content(self):
        return self.state if isinstance(self.state, bytes) else self.state.to_bytes()
'''

WORDS = {
    2: {
        "package": "pythonfmu", "module": "fmi2slave", "base": "Fmi2Slave", "status": "Fmi2Status", "real": "real",
        "imports": "", "failed": "False", "done": "True",
    },
    3: {
        "package": "pythonfmu3", "module": "fmi3slave", "base": "Fmi3Slave", "status": "Fmi3Status",
        "real": "float64", "imports": "from pythonfmu3.fmi3slave import Fmi3StepResult\n",
        "failed": "Fmi3StepResult(status=Fmi3Status.discard)", "done": "Fmi3StepResult(status=Fmi3Status.ok)",
    },
}  # fmt: skip


def slave_script(fmi: int) -> str:
    """Return the Python script of the unit for FMI 2 or 3."""
    return UNIT_SCRIPT.format(**WORDS[fmi])
