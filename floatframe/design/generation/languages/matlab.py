"""Routines as MATLAB functions, which Octave reads as well."""

from collections.abc import Sequence

from floatframe.design.generation.languages.casadi import rows_of
from floatframe.design.generation.languages.lines import lines_of, with_subscript
from floatframe.design.generation.routines import Routine

__all__ = ["matlab_files"]


def matlab_files(routine: Routine, notes: Sequence[str]) -> dict[str, str]:
    """Return NAME.m with the function NAME(inputs)."""
    lines = lines_of(routine, symbol=lambda name: with_subscript(name, 1, "()"))
    outs = ", ".join(output.name for output in routine.outputs)
    head = f"function [{outs}] = {routine.name}({', '.join(name for name, _, _ in routine.inputs)})\n"
    body = [f"  {name} = {text};" for name, text in lines.named]
    for output, results in zip(routine.outputs, lines.results, strict=True):
        rows = [f"    {', '.join(f'({text})' for text in row)};" for row in rows_of(output, results)]
        body += [f"  {output.name} = [", *rows, "  ];"]
    comment = "".join(f"% {note}".rstrip() + "\n" for note in notes)
    return {f"{routine.name}.m": head + comment + "\n".join(body) + "\nend\n"}
