"""Code for one system: its recursive equations with its numbers, without zeros and ones, and with shared terms."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.paths import replace_files
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import quoted
from floatframe.design.generation.graph import Operations
from floatframe.design.generation.joint_forces import model_terms
from floatframe.design.generation.languages.c import c_files
from floatframe.design.generation.languages.lines import lines_of, with_subscript
from floatframe.design.generation.languages.python import docstring, python_files
from floatframe.design.generation.links import TreeTerms
from floatframe.design.generation.routines import ROUTINES, Output, Routine, routine_of
from floatframe.engine.tree.recursive import RelativeModel
from floatframe.errors import ModelError
from floatframe.model.system import System

__all__ = ["LANGUAGES", "GeneratedCode", "casadi_files", "generate", "matlab_files", "rows_of"]


# routines as CasADi functions: a Python file that creates one ---------------------------------------------------------


def rows_of(output: Output, results: Sequence[str]) -> list[Sequence[str]]:
    """Return results as rows: a vector becomes a column; an array with more than two axes is stacked by rows."""
    width = output.values.shape[-1] if output.values.ndim > 1 else 1
    return [results[k : k + width] for k in range(0, len(results), width)]


def casadi_files(routine: Routine, notes: Sequence[str]) -> dict[str, str]:
    """Return NAME.py with the function NAME(), which returns the casadi.Function of that name."""
    lines = lines_of(routine, symbol=str)
    names = [name for name, _, _ in routine.inputs]
    body = [f'    {name} = casadi.SX.sym("{name}", {n})' for name, n, _ in routine.inputs]
    body += [f"    {name} = {text}" for name, text in lines.named]
    for output, results in zip(routine.outputs, lines.results, strict=True):
        rows = [f"        casadi.horzcat({', '.join(row)})," for row in rows_of(output, results)]
        body += [f"    {output.name} = casadi.vertcat(", *rows, "    )"]
    outs = [output.name for output in routine.outputs]
    lists = [f"[{', '.join(names)}]", f"[{', '.join(outs)}]"]
    lists += ["[" + ", ".join(f'"{name}"' for name in each) + "]" for each in (names, outs)]
    body.append(f'    return casadi.Function("{routine.name}", {", ".join(lists)})')
    text = docstring(notes, "") + "\nimport casadi\nfrom casadi import cos, sin  # noqa: F401\n"
    text += f"\n\ndef {routine.name}():\n" + docstring([f"{routine.meaning}."], "    ")
    return {f"{routine.name}.py": text + "\n".join(body) + "\n"}


# routines as MATLAB functions, which Octave reads as well -------------------------------------------------------------


def matlab_files(routine: Routine, notes: Sequence[str]) -> dict[str, str]:
    """Return NAME.m with the function NAME(inputs)."""
    lines = lines_of(routine, symbol=with_subscript)
    outs = ", ".join(output.name for output in routine.outputs)
    head = f"function [{outs}] = {routine.name}({', '.join(name for name, _, _ in routine.inputs)})\n"
    body = [f"  {name} = {text};" for name, text in lines.named]
    for output, results in zip(routine.outputs, lines.results, strict=True):
        rows = [f"    {', '.join(f'({text})' for text in row)};" for row in rows_of(output, results)]
        body += [f"  {output.name} = [", *rows, "  ];"]
    comment = "".join(f"% {note}".rstrip() + "\n" for note in notes)
    return {f"{routine.name}.m": head + comment + "\n".join(body) + "\nend\n"}


# generate -------------------------------------------------------------------------------------------------------------


LANGUAGES: dict[str, Callable[[Routine, Sequence[str]], dict[str, str]]] = {
    "c": c_files,
    "python": python_files,
    "casadi": casadi_files,
    "matlab": matlab_files,
}


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class GeneratedCode:
    """The text of a routine, and its number of operations.

    Parameters
    ----------
    name
        Name of the function.
    what
        The quantity that the routine computes.
    language
        Programming language of the routine.
    files
        Text by file name.
    inputs
        Length of each input by name, in the order of the arguments.
    outputs
        Shape of each output by name, in the order of the results.
    operations
        Operations of one call.
    general
        Additions and multiplications of the same recursion without simplification.
    parameter_names
        Names of the entries of the input `parameters`, in order.
    parameter_values
        Values of `parameters` in the system [kg, kg m, kg m², m/s²].
    """

    name: str
    what: str
    language: str
    files: dict[str, str]
    inputs: dict[str, int]
    outputs: dict[str, tuple[int, ...]]
    operations: Operations
    general: tuple[int, int]
    parameter_names: tuple[str, ...]
    parameter_values: Array

    def write(self, directory: str | Path) -> tuple[Path, ...]:
        """Write the files into a directory, which is created if it does not exist; return their paths."""
        folder = Path(directory)
        folder.mkdir(parents=True, exist_ok=True)
        replace_files({folder / name: text.encode() for name, text in self.files.items()})
        return tuple(folder / name for name in self.files)


def identifier(text: str) -> str:
    """Return a text as a valid name in all languages."""
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
        A tree of rigid and flexible bodies. The code contains gravity and the linear joint forces (stiffness, damping,
        preload; angles are counted without limit). All other forces are given as the input `force`.
    what
        "inverse" (forces for a motion), "residual" (these forces minus given forces), "mass" (mass matrix), "forward"
        (accelerations), "kinematics" (positions and velocities of all bodies), "jacobian" (derivatives of the forces by
        the motion), "sensitivity" (derivatives of the forces by parameters).
    language
        "c", "python", "casadi" or "matlab".
    parameters
        Parameters that remain symbols, as an input of the function: "link1/m", a body ("link1": its ten inertial
        parameters), "gravity", or patterns ("*/m"). All others are constants in the code.
    name
        Name of the function; None: made from the names of the system and the routine.

    Raises
    ------
    ModelError
        If the routine, language or parameter does not exist; the system is not a tree, or has other forces, couplers or
        elements; "forward" meets a prescribed coordinate; or the name is invalid.
    """
    for role, value, choices in (("what", what, ROUTINES), ("language", language, LANGUAGES)):
        if value not in choices:
            raise ModelError(f"generate: {role}: expected one of {', '.join(choices)}, got {quoted(value)}")
    if isinstance(parameters, str):
        raise ModelError(f"generate: parameters: expected a list of names, got the text {quoted(parameters)}")
    function = identifier(f"{system.name}_{what}") if name is None else name
    if function != re.sub(r"\W", "", function, flags=re.ASCII) or not function[:1].isalpha():
        raise ModelError(f"generate: name: expected letters, digits and underscores, got {quoted(function)}")
    model, tree = model_terms(system, ("*",) if what == "sensitivity" and not parameters else parameters)
    if what == "forward":
        require_free(model)
    routine = routine_of(tree, what, function)
    notes = notes_of(system, routine, model, tree)
    files = LANGUAGES[language](routine, notes)
    inputs = {each: n for each, n, _ in routine.inputs}
    outputs = {output.name: output.values.shape for output in routine.outputs}
    return GeneratedCode(
        function, what, language, files, inputs, outputs, routine.operations, routine.asked, tree.parameter_names,
        np.array(tree.parameter_values),
    )  # fmt: skip


def require_free(model: RelativeModel) -> None:
    """Raise `ModelError` if a coordinate is prescribed, because forward dynamics does not support that."""
    if model.driven:
        raise ModelError(
            f"generate: coordinate {quoted(model.driven[0])} is prescribed by a function of time, which what = "
            '"forward" does not support; remove the motion of its joint, or take what = "residual"'
        )


def notes_of(system: System, routine: Routine, model: RelativeModel, tree: TreeTerms) -> list[str]:
    """Return the comment at the head of the code: meaning, operations, units, and the order of coordinates."""
    count, units = routine.operations, system.units
    notes = [
        f"{routine.meaning} of {quoted(system.name)}, generated by floatframe.", "",
        f"{count.additions} additions, {count.multiplications} multiplications, {count.divisions} divisions, "
        f"{count.functions} sines and cosines, {count.signs} changes of sign.", "",
    ]  # fmt: skip
    if routine.has_series:
        notes += ["Elastic rotations of markers: exact to rounding errors up to 4 rad, invalid beyond 5 rad.", ""]
    notes += [f"{name}, {n}: {meaning}" for name, n, meaning in routine.inputs]
    notes += [f"{out.name}, {' x '.join(map(str, out.values.shape))}: {out.meaning}" for out in routine.outputs]
    if units.name != "m-kg-s":
        symbols = units.length_symbol, units.mass_symbol, units.time_symbol, units.force_symbol
        words = ", ".join(f"{si} for {own}" for si, own in zip(("m", "kg", "s", "N"), symbols, strict=True))
        notes += [f"All in units of {units.name}: {words}."]
    if tree.springs:
        notes += ["The code includes springs and dampers of joints; angles of springs are counted without limit."]
    unit = {each.name: each.unit for each in model.expansion.tree.columns}
    force = {"rad": "N m", "m": "N"}
    notes += ["", "order of z"]
    notes += [f"  {k}: {name} [{unit.get(name, '1')}]" for k, name in enumerate(model.names)]
    notes += ["order of rates, of their rates, and of forces"]
    for k, name in enumerate(model.rate_names):
        words = f" [{unit[name]}/s], [{unit[name]}/s2], [{force[unit[name]]}]" if unit.get(name) in force else ""
        notes += [f"  {k}: {name}{words}"]
    if tree.parameter_names:
        values = zip(tree.parameter_names, tree.parameter_values, strict=True)
        notes += ["parameters, with their values in the system"]
        notes += [f"  {k}: {name} = {value!r}" for k, (name, value) in enumerate(values)]
    return notes
