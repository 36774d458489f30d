"""A unit as the binary of an FMU calls it: variables by value reference, time in seconds, words for its log."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

from floatframe.errors import FloatframeError, ModelError
from floatframe.files.cosimulation.interface import Variable, read_unit
from floatframe.files.cosimulation.unit import Unit, UnitState

__all__ = ["SETTINGS", "SYSTEM", "HostedUnit", "words_of"]

SYSTEM, SETTINGS = "system.toml", "unit.json"  #: files in the resources of an FMU


class HostedUnit:
    """The unit in the resources of an FMU.

    Parameters
    ----------
    resources
        Folder with the system file, the modal files it names, and the settings `archive.write_fmu` left there.
    log
        Takes words of a warning.
    """

    def __init__(self, resources: str, log: Callable[[str], None]) -> None:
        self.path = Path(resources) / SYSTEM
        self.settings = json.loads((Path(resources) / SETTINGS).read_text(encoding="utf-8"))
        self.variables = tuple(Variable(**each) for each in self.settings["variables"])
        self.log = log
        self.t_start = 0.0  #: [s]
        self.values = {each.name: each.start for each in self.variables if each.causality in ("parameter", "input")}
        self.unit: Unit | None = None
        self.is_running = False

    @property
    def seconds(self) -> float:
        """Seconds in a unit of time of the system."""
        return float(self.settings["seconds"])

    def variable(self, reference: int) -> Variable:
        """Return a variable by its value reference."""
        if not 0 <= reference < len(self.variables):
            raise ModelError(f"value reference {reference}: expected 0 to {len(self.variables) - 1}")
        return self.variables[reference]

    def set(self, references: Sequence[int], values: Sequence[float]) -> None:
        """Set inputs, and parameters before the initialisation has ended."""
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
                self.unit = None  # made anew with these values when it is asked for

    def begun(self) -> Unit:
        """Return the unit, at its beginning or later."""
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
        """End the initialisation: joints are closed, the motion begins."""
        self.begun()
        self.is_running = True

    def step(self, t: float, size: float) -> None:
        """Take a communication step of a size from a time, both in seconds."""
        unit = self.begun()
        told = len(unit.notes)
        unit.step(t / self.seconds, size / self.seconds)
        for words in unit.notes[told:]:
            self.log(words)

    def state(self) -> UnitState:
        """Return all the unit remembers."""
        return self.begun().state()

    def restore(self, state: UnitState) -> None:
        """Go to a state of this unit, or of another one of this FMU with the same parameters."""
        unit = self.begun()
        unit.restore(state)
        self.is_running = True
        self.values |= unit.inputs

    def state_of_bytes(self, content: bytes) -> UnitState:
        """Return a state that was serialised."""
        return UnitState.from_bytes(content, self.begun().system)


def words_of(error: BaseException) -> str:
    """Return an error in one line: its own words where it is meant for users, else with its kind."""
    return str(error) if isinstance(error, FloatframeError) else f"{type(error).__name__}: {error}"
