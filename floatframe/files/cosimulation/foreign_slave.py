"""A unit of another program run by FMPy: checked before the run, with its errors as messages."""

import math
import shutil
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from ctypes import byref
from functools import cache
from pathlib import Path
from typing import Any

from fe_models.foundation.extras import extra_module
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import CosimulationError, ModelError
from floatframe.simulation.foreign_units import ForeignUnit

__all__ = ["ForeignSlave", "callbacks"]

REAL = ("Real", "Float64")
VERSIONS = ("2.0", "3.0")
DISCARD, ERROR, FATAL = 2, 3, 4  #: FMI status codes of failed calls

words_of_call: list[str] = []  #: log messages of units since the last call of an FMI function


class ForeignSlave:
    """An instance of an FMU of version 2 or 3; call `close` at the end.

    Parameters
    ----------
    unit
        The unit and its connections.
    seconds
        Number of seconds in the time unit of the caller.

    Raises
    ------
    ModelError
        If there is no such file, it is not an FMU for co-simulation on this machine, or a variable does not exist or
        has another type or causality.
    CosimulationError
        If it fails to begin.
    """

    def __init__(self, unit: ForeignUnit, seconds: float) -> None:
        self.unit, self.seconds, self.where = unit, seconds, f"fmus.{unit.name}"
        self.fmpy = extra_module("fmpy", extra="fmi", purpose="units of other programs")
        path = Path(unit.file)
        if not path.is_file():
            raise ModelError(f"{self.where}: file: no such file: {path}")
        try:
            self.description = self.fmpy.read_model_description(str(path))
        except Exception as error:  # any error that a damaged archive causes in zipfile, lxml or FMPy
            raise ModelError(
                f"{self.where}: {path}: expected an FMU of version 2.0 or 3.0; {one_line(error)}"
            ) from error
        self.require_usable(path)
        self.references = {v.name: v for v in self.description.modelVariables}
        for part, causality in (("inputs", "input"), ("outputs", "output"), ("parameters", "parameter")):
            for name in getattr(unit, part):
                self.require_variable(part, name, causality)
        self.folder = Path(tempfile.mkdtemp(prefix="floatframe-fmu-"))
        self.instance: Any = None
        self.worst = 0  #: status of its most severe failure: 3 error, 4 fatal

    @property
    def is_fmi_2(self) -> bool:
        """Whether the FMU has version 2; otherwise it has version 3."""
        return bool(self.description.fmiVersion == "2.0")

    def require_usable(self, path: Path) -> None:
        """Raise `ModelError` unless version, kind and platform of the FMU are supported here."""
        about = self.description
        if about.fmiVersion not in VERSIONS:
            raise ModelError(f"{self.where}: {path}: FMI {about.fmiVersion}, expected {' or '.join(VERSIONS)}")
        if about.coSimulation is None:
            raise ModelError(f"{self.where}: {path}: it is for model exchange only, expected an FMU for co-simulation")
        platforms = self.fmpy.supported_platforms(str(path))
        if self.fmpy.platform not in platforms and self.fmpy.platform_tuple not in platforms:
            has = ", ".join(platforms) or "none"
            raise ModelError(f"{self.where}: {path}: no binary for {self.fmpy.platform}; it has those for {has}")

    def require_variable(self, part: str, name: str, causality: str) -> None:
        """Raise `ModelError` unless a variable exists, is real, and has the given causality."""
        choices = [v.name for v in self.description.modelVariables if v.causality == causality]
        found = self.references.get(name)
        if found is None:
            raise ModelError(f"{self.where}: {part}: the FMU has no {causality} {quoted(name)}{nearest(name, choices)}")
        if found.causality != causality:
            raise ModelError(f"{self.where}: {part}: {name} is of causality {found.causality}, expected {causality}")
        if found.type not in REAL or getattr(found, "dimensions", None):
            raise ModelError(f"{self.where}: {part}: {name} is of type {found.type}, expected a single real number")

    @property
    def can_go_back(self) -> bool:
        """Whether the FMU can save and restore its state."""
        about = self.description.coSimulation
        return bool(getattr(about, "canGetAndSetFMUstate", False) or getattr(about, "canGetAndSetFMUState", False))

    def feeds_through(self, output: str) -> list[str]:
        """Return the connected inputs that have direct feedthrough to an output.

        All of them if the FMU does not declare it.
        """
        for unknown in self.description.outputs:
            if unknown.variable.name == output and unknown.dependencies is not None:
                return [v.name for v in unknown.dependencies if v.name in self.unit.inputs]
        return list(self.unit.inputs)

    def call(self, what: str, function: Any, *values: Any, **named: Any) -> Any:
        """Call a function of the FMU; `CosimulationError` with its log messages if the call fails."""
        words_of_call.clear()
        try:
            return function(*values, **named)
        except Exception as error:  # FMICallException, or the error of a library that cannot be loaded
            self.worst = max(self.worst, getattr(error, "status", None) or ERROR)
            words = "; ".join([one_line(error), *words_of_call])
            raise CosimulationError(f"{self.where}: {what} failed: {words}") from error

    def begin(self, t: float, inputs: Mapping[str, float]) -> None:
        """Instantiate the FMU, set parameters and inputs, and initialise it at t."""
        fmpy = self.fmpy
        self.call("its extraction", fmpy.extract, self.unit.file, unzipdir=str(self.folder))
        self.instance = self.call("its instantiation", self.instantiated)
        seconds = t * self.seconds
        if self.is_fmi_2:
            self.call("its set-up", self.instance.setupExperiment, startTime=seconds)
        self.set(self.unit.parameters)
        start = () if self.is_fmi_2 else (None, seconds)
        self.call("its initialisation", self.instance.enterInitializationMode, *start)
        self.set(inputs)
        self.call("its initialisation", self.instance.exitInitializationMode)

    def instantiated(self) -> Any:
        """Return an instance of the FMU that logs to `words_of_call`."""
        if not self.is_fmi_2:
            simulation = extra_module("fmpy.simulation", extra="fmi", purpose="units of other programs")
            return simulation.instantiate_fmu(
                str(self.folder), self.description, "CoSimulation", debug_logging=True, logger=note
            )
        fmi2 = extra_module("fmpy.fmi2", extra="fmi", purpose="units of other programs")
        about = self.description
        instance = fmi2.FMU2Slave(
            guid=about.guid, unzipDirectory=str(self.folder), modelIdentifier=about.coSimulation.modelIdentifier,
            instanceName=None,
        )  # fmt: skip
        instance.instantiate(callbacks=callbacks(), loggingOn=True)
        return instance

    def set(self, values: Mapping[str, float]) -> None:
        """Set variables of the FMU."""
        if values:
            function = self.instance.setReal if self.is_fmi_2 else self.instance.setFloat64
            references = [self.references[name].valueReference for name in values]
            self.call("setting its inputs", function, references, [float(x) for x in values.values()])

    def outputs(self) -> dict[str, float]:
        """Return the connected outputs; `CosimulationError` if one is not finite."""
        names = list(self.unit.outputs)
        if not names:
            return {}
        function = self.instance.getReal if self.is_fmi_2 else self.instance.getFloat64
        references = [self.references[name].valueReference for name in names]
        values = self.call("reading its outputs", function, references)
        for name, value in zip(names, values, strict=True):
            if not math.isfinite(value):
                raise CosimulationError(f"{self.where}: its output {name} is {value}, expected a finite number")
        return dict(zip(names, map(float, values), strict=True))

    def step(self, t: float, size: float) -> None:
        """Take a step of size `size` from t."""
        result = self.call(
            f"its step from t = {t:.9g}", self.instance.doStep, currentCommunicationPoint=t * self.seconds,
            communicationStepSize=size * self.seconds,
        )  # fmt: skip
        if not self.is_fmi_2 and result is not None and bool(result[1]):
            raise CosimulationError(f"{self.where}: it requested the end of the run in its step from t = {t:.9g}")

    def state(self) -> Any:
        """Return the state of the FMU; `free` releases it."""
        return self.call("keeping its state", self.instance.getFMUstate if self.is_fmi_2 else self.instance.getFMUState)

    def restore(self, state: Any) -> None:
        """Restore a state."""
        function = self.instance.setFMUstate if self.is_fmi_2 else self.instance.setFMUState
        self.call("going back to a state", function, state)

    def free(self, state: Any) -> None:
        """Release a state."""
        function = self.instance.freeFMUstate if self.is_fmi_2 else self.instance.freeFMUState
        self.call("letting go of a state", function, state)

    def close(self) -> None:
        """Terminate the FMU and remove its extracted files.

        After an error it is only freed; after a fatal error it is not called any more.
        """
        if self.instance is not None:
            ways = [self.instance.terminate] if self.worst < DISCARD else []
            ways += [self.instance.freeInstance] if self.worst < FATAL else []
            for function in ways:
                try:
                    function()
                except Exception:  # the run has ended; failures in it have been reported
                    continue
        self.instance = None
        shutil.rmtree(self.folder, ignore_errors=True)


def note(*values: Any) -> None:
    """Store a log message of a unit."""
    text = values[-1]
    words_of_call.append(one_line(text.decode("utf-8", "replace") if isinstance(text, bytes) else text))


@cache
def logger() -> Any:
    """Return a C function that calls `note`, shared by all units of version 2."""
    return extra_module("fmpy.fmi2", extra="fmi", purpose="units of other programs").fmi2CallbackLoggerTYPE(note)


def callbacks() -> Any:
    """Return the callback functions for a unit of version 2.

    FMPy formats messages in a C function that stores only the last logger and calls it for all units of the process.
    The logger of one unit would receive the messages of the others, and would be called after it has been freed.
    """
    fmpy = extra_module("fmpy", extra="fmi", purpose="units of other programs")
    fmi2 = extra_module("fmpy.fmi2", extra="fmi", purpose="units of other programs")
    made = fmi2.fmi2CallbackFunctions()
    made.logger = logger()
    made.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
    made.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
    with suppress(OSError):  # no such library for this machine: texts remain as the unit wrote them
        extra_module("fmpy.logging", extra="fmi", purpose="units of other programs").addLoggerProxy(byref(made))
    return made


def one_line(text: Any) -> str:
    """Return a text without line breaks, shortened to a readable length."""
    words = " ".join(str(text).split())
    return words if len(words) <= 400 else words[:397] + "..."
