"""Routines in C: one function without dependencies but for the sines and cosines of <math.h>."""

from collections.abc import Sequence

from floatframe.generation.languages.lines import lines_of
from floatframe.generation.routines import Routine

__all__ = ["c_files"]


def c_files(routine: Routine, notes: Sequence[str]) -> dict[str, str]:
    """Return NAME.c and NAME.h: void NAME(inputs, outputs), arrays row by row."""
    lines = lines_of(routine, symbol=str)
    arguments = [f"const double *restrict {name}" for name, _, _ in routine.inputs]
    arguments += [f"double *restrict {output.name}" for output in routine.outputs]
    head = f"void {routine.name}(\n    " + ",\n    ".join(arguments) + ")"
    comment = "/*\n" + "".join(f" * {note}".rstrip() + "\n" for note in notes) + " */\n"
    comment = comment.replace("*/", "* /").removesuffix("* /\n") + "*/\n"
    guard = f"{routine.name.upper()}_H"
    header = f"{comment}#ifndef {guard}\n#define {guard}\n\n{head};\n\n#endif\n"
    body = [f"    const double {name} = {text};" for name, text in lines.named]
    for output, results in zip(routine.outputs, lines.results, strict=True):
        body += [f"    {output.name}[{k}] = {text};" for k, text in enumerate(results)]
    source = f'{comment}#include <math.h>\n\n#include "{routine.name}.h"\n\n{head}\n{{\n' + "\n".join(body) + "\n}\n"
    return {f"{routine.name}.c": source, f"{routine.name}.h": header}
