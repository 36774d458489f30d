"""Routines as CasADi functions: a Python file that creates one."""

from collections.abc import Sequence

from floatframe.design.generation.languages.lines import lines_of
from floatframe.design.generation.languages.python import docstring
from floatframe.design.generation.routines import Output, Routine

__all__ = ["casadi_files", "rows_of"]


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
