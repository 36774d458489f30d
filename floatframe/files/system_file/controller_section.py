"""Tables of the system file for sampled controllers: [controllers.NAME]."""

import sys
from collections.abc import Callable
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from pydantic import Field, model_validator

from fe_models.foundation.toml_file import Names, Table
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError
from floatframe.files.system_file.keys import Positive
from floatframe.model.controller import Controller
from floatframe.model.elements.registry import searched

__all__ = ["ControllerSection"]

Matrix = list[list[float]]


class ControllerSection(Table):
    """[controllers.NAME]: a sampled controller, a state space or a Python function."""

    period: Positive = Field(description="the time between two calls, a whole multiple of the step h of a run")
    inputs: Names = Field(description='measured values, such as "tip.x", "hub.angle" or "hub.angle.rate"')
    outputs: Names = Field(description='forces, such as "motor": motors of joint forces, factors of others')
    A: Matrix | None = Field(None, description="rows of numbers, z_next = A z + B x for the memory z and the inputs x")
    B: Matrix | None = Field(None, description="rows of numbers, with A")
    C: Matrix | None = Field(None, description="rows of numbers, the outputs are u = C z + D x")
    D: Matrix | None = Field(None, description="rows of numbers; default: zero")
    function: str | None = Field(
        None, description='instead of matrices "MODULE:FUNCTION", a Python function in MODULE.py beside the file'
    )
    state: list[float] | None = Field(None, description="numbers, the memory at the start; of matrices default: zero")

    @model_validator(mode="after")
    def _is_one_kind(self) -> "ControllerSection":
        given = [key for key in "ABCD" if getattr(self, key) is not None]
        if self.function is not None:
            if given:
                raise ValueError(f"expected either matrices or a function, got function and {', '.join(given)}")
            module, colon, function = self.function.partition(":")
            if not (module and colon and function):
                raise ValueError(f'function: expected "MODULE:FUNCTION", such as "laws:pid", got {self.function!r}')
            return self
        if not given:
            raise ValueError("expected matrices A, B, C, D, or a function")
        if given != ["D"] and not {"A", "B", "C"} <= set(given):
            missing = [key for key in "ABC" if key not in given]
            raise ValueError(f"{', '.join(missing)}: missing; expected A, B, C together, or D alone")
        for key in given:
            if len({len(row) for row in getattr(self, key)}) != 1:
                raise ValueError(f"{key}: expected rows of the same length")
        return self

    def controller(self, name: str, folder: Path) -> Controller:
        """Return the controller of the table.

        Parameters
        ----------
        name
            Name of the table.
        folder
            Folder of the system file, where the module of a function is searched first.

        Raises
        ------
        ModelError
            If sizes do not fit, or there is no such function.
        """
        state = None if self.state is None else np.array(self.state)
        if self.function is not None:
            function = function_at(f"controller {name!r}", self.function, folder)
            return Controller(name, self.period, self.inputs, self.outputs, function, state)
        n_x, n_u = len(self.inputs), len(self.outputs)
        D = np.zeros((n_u, n_x)) if self.D is None else np.array(self.D)
        parts = {"A": (self.A, (0, 0)), "B": (self.B, (0, n_x)), "C": (self.C, (n_u, 0))}
        matrices = {key: np.zeros(none) if given is None else np.array(given) for key, (given, none) in parts.items()}
        n_z = len(matrices["A"])
        wanted = {"A": (n_z, n_z), "B": (n_z, n_x), "C": (n_u, n_z), "D": (n_u, n_x)}
        for key, matrix in (matrices | {"D": D}).items():
            if matrix.shape != wanted[key]:
                rows, columns = wanted[key]
                raise ModelError(
                    f"controller {name!r}: {key}: expected {rows} rows of {columns} numbers ({n_z} of memory, {n_x} "
                    f"inputs, {n_u} outputs), got {' x '.join(map(str, matrix.shape))}"
                )
        model = SimpleNamespace(**matrices, D=D, dt=self.period)
        return Controller.of_state_space(name, model, inputs=self.inputs, outputs=self.outputs, state=state)

    def module_file(self, folder: Path) -> Path | None:
        """Return the file of the module of the function, if it is beside the system file."""
        if self.function is None:
            return None
        path = folder / f"{self.function.partition(':')[0].replace('.', '/')}.py"
        return path if path.is_file() else None


def function_at(where: str, place: str, folder: Path) -> Callable[..., Any]:
    """Return the function "module:function"; the module is a file in the folder, else one on Python's path."""
    module_name, _, name = place.partition(":")
    path = folder / f"{module_name.replace('.', '/')}.py"
    try:
        with searched(folder):
            module = module_of_file(path) if path.is_file() else import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name != module_name.partition(".")[0]:
            raise ModelError(f"{where}: function: module {module_name} cannot be imported: {error}") from error
        raise ModelError(
            f"{where}: function: there is no module {quoted(module_name)}; expected the file {path}, or a package that "
            "is installed"
        ) from None
    except Exception as error:
        raise ModelError(
            f"{where}: function: module {module_name} cannot be imported: {type(error).__name__}: {error}"
        ) from error
    function = getattr(module, name, None)
    if not callable(function):
        choices = [key for key, value in vars(module).items() if callable(value) and not key.startswith("_")]
        raise ModelError(f"{where}: function: {module_name} has no function {quoted(name)}{nearest(name, choices)}")
    found: Callable[..., Any] = function
    return found


def module_of_file(path: Path) -> Any:
    """Return the module in a file, under a name of its own: files of one name in two folders are two modules."""
    name = f"floatframe_controllers_{abs(hash(path.resolve()))}_{path.stem}"
    spec = spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and pickle look a module up by its name
    spec.loader.exec_module(module)
    return module
