"""Code for one system: its recursive equations with its numbers, zeros and ones gone, common terms shared."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.paths import replace_files
from fe_models.foundation.words import quoted
from floatframe.errors import ModelError
from floatframe.generation.graph import Operations
from floatframe.generation.languages.c import c_files
from floatframe.generation.languages.casadi import casadi_files
from floatframe.generation.languages.matlab import matlab_files
from floatframe.generation.languages.python import python_files
from floatframe.generation.links import tree_terms
from floatframe.generation.routines import ROUTINES, Routine, routine_of
from floatframe.relative.recursive import relative_model
from floatframe.system import System

__all__ = ["LANGUAGES", "GeneratedCode", "generate"]

LANGUAGES: dict[str, Callable[[Routine, Sequence[str]], dict[str, str]]] = {
    "c": c_files,
    "python": python_files,
    "casadi": casadi_files,
    "matlab": matlab_files,
}


@dataclass(frozen=True, eq=False)
class GeneratedCode:
    """The text of a routine, and what it costs."""

    name: str  #: of the function
    what: str
    language: str
    files: dict[str, str]  #: name of the file -> text
    inputs: dict[str, int]  #: name -> length, in the order of the arguments
    outputs: dict[str, tuple[int, ...]]  #: name -> shape, in their order
    operations: Operations  #: of a call
    general: tuple[int, int]  #: additions and multiplications of the same recursion with all zeros and ones
    parameter_names: tuple[str, ...]  #: of the input `parameters`, in its order
    parameter_values: Array  #: that they have in the system [kg, kg m, kg m², m/s²]

    def write(self, directory: str | Path) -> tuple[Path, ...]:
        """Write the files into a directory, which is made if there is none; return their paths."""
        folder = Path(directory)
        folder.mkdir(parents=True, exist_ok=True)
        replace_files({folder / name: text.encode() for name, text in self.files.items()})
        return tuple(folder / name for name in self.files)


def identifier(text: str) -> str:
    """Return a text as a name in any language."""
    name = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_").lower()
    return name if name and name[0].isalpha() else f"f_{name}".rstrip("_")


def generate(
    system: System, *, what: str = "inverse", language: str = "c", parameters: Sequence[str] = (),
    name: str | None = None,
) -> GeneratedCode:  # fmt: skip
    """Return code for the equations of motion of one system, in the coordinates of `relative_model(system)`.

    Parameters
    ----------
    system
        A tree of rigid and flexible bodies; of forces, gravity counts.
    what
        "inverse" (forces of a motion), "residual" (those less given forces), "mass" (matrix), "forward"
        (accelerations), "kinematics" (places and velocities of all bodies), "jacobian" (derivatives of the forces of a
        motion), "sensitivity" (their derivatives by parameters).
    language
        "c", "python", "casadi" or "matlab".
    parameters
        Numbers that stay symbols, an input of their own: "link1/m", a body ("link1": its ten inertial parameters),
        "gravity", or patterns ("*/m"). All others are numbers in the code.
    name
        Of the function; None: that of the system and what is generated.

    Raises
    ------
    ModelError
        If there is no such routine, language or parameter, the system is no tree, or the name is none.
    """
    for role, value, choices in (("what", what, ROUTINES), ("language", language, LANGUAGES)):
        if value not in choices:
            raise ModelError(f"generate: {role}: expected one of {', '.join(choices)}, got {quoted(value)}")
    if isinstance(parameters, str):
        raise ModelError(f"generate: parameters: expected a list of names, got the text {quoted(parameters)}")
    function = identifier(f"{system.name}_{what}") if name is None else name
    if function != re.sub(r"\W", "", function, flags=re.ASCII) or not function[:1].isalpha():
        raise ModelError(f"generate: name: expected letters, digits and underscores, got {quoted(function)}")
    model = relative_model(system)
    tree = tree_terms(model.expansion, ("*",) if what == "sensitivity" and not parameters else parameters)
    routine = routine_of(tree, what, function)
    notes = notes_of(system.name, routine, model.names, model.rate_names, tree.parameter_names, tree.parameter_values)
    files = LANGUAGES[language](routine, notes)
    inputs = {each: n for each, n, _ in routine.inputs}
    outputs = {output.name: output.values.shape for output in routine.outputs}
    return GeneratedCode(
        function, what, language, files, inputs, outputs, routine.operations, routine.asked, tree.parameter_names,
        np.array(tree.parameter_values),
    )  # fmt: skip


def notes_of(
    system: str, routine: Routine, names: Sequence[str], rate_names: Sequence[str], parameters: Sequence[str],
    values: Sequence[float],
) -> list[str]:  # fmt: skip
    """Return what stands at the head of the code."""
    count = routine.operations
    notes = [
        f"{routine.meaning} of {quoted(system)}, generated by floatframe.", "",
        f"{count.additions} additions, {count.multiplications} multiplications, {count.divisions} divisions, "
        f"{count.functions} sines and cosines.", "",
    ]  # fmt: skip
    if routine.has_series:
        notes += ["Elastic rotations of markers: to rounding up to 4 rad, meaningless beyond 5 rad.", ""]
    notes += [f"{name}, {n}: {meaning}" for name, n, meaning in routine.inputs]
    notes += [f"{out.name}, {' x '.join(map(str, out.values.shape))}: {out.meaning}" for out in routine.outputs]
    notes += ["", "z: " + ", ".join(names), "rates: " + ", ".join(rate_names)]
    if parameters:
        notes += ["parameters, with their values in the system:"]
        notes += [f"  {k}: {name} = {value!r}" for k, (name, value) in enumerate(zip(parameters, values, strict=True))]
    return notes
