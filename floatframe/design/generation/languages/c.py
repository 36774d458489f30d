"""Routines in C: one function that depends only on <math.h>."""

from collections.abc import Sequence

from floatframe.design.generation.languages.lines import Lines, lines_of
from floatframe.design.generation.routines import Routine

__all__ = ["c_files"]

#: Sine and cosine of one angle. The angle is reduced by k quarter turns to r, |r| <= pi/4. Here pi/2 is the sum of two
#: numbers, the first with 33 bits, so that its product with k is exact. The polynomials in r² interpolate at Chebyshev
#: points with an error of 1.4e-17.
SINE_COSINE = """\
/* sine and cosine of x, to 2e-16; by the library if |x| is large */
static inline void {name}(double x, double *sine, double *cosine)
{{
    if (fabs(x) < 65536.0) {{
        const double turns = x * 0.6366197723675814;
        const int k = (int)(turns + (turns < 0.0 ? -0.5 : 0.5));
        const double n = (double)k;
        const double r = (x - n * 1.5707963267341256) - n * 6.077100506506192e-11;
        const double q = r * r, q2 = q * q;
        const double s = r + (r * q) * ((-0.16666666666666666 + q * 0.008333333333330948)
            + q2 * ((-0.00019841269836758395 + q * 2.755731610245899e-06)
            + q2 * (-2.505113182552765e-08 + q * 1.5918127891706008e-10)));
        const double c = (1.0 - 0.5 * q) + q2 * ((0.041666666666666664 - q * 0.0013888888888887398)
            + q2 * ((2.4801587298765574e-05 - q * 2.755731727167133e-07)
            + q2 * (2.0876146256219284e-09 - q * 1.1382631547716708e-11)));
        const double quarters[4] = {{s, c, -s, -c}};
        *sine = quarters[k & 3];
        *cosine = quarters[(k + 1) & 3];
    }} else {{
        *sine = sin(x);
        *cosine = cos(x);
    }}
}}

"""


def c_files(routine: Routine, notes: Sequence[str]) -> dict[str, str]:
    """Return NAME.c and NAME.h with void NAME(inputs, outputs); arrays are stored by rows."""
    lines = lines_of(routine, symbol=str)
    arguments = [f"const double *restrict {name}" for name, _, _ in routine.inputs]
    arguments += [f"double *restrict {output.name}" for output in routine.outputs]
    head = f"void {routine.name}(\n    " + ",\n    ".join(arguments) + ")"
    comment = "/*\n" + "".join(f" * {note}".rstrip() + "\n" for note in notes) + " */\n"
    comment = comment.replace("*/", "* /").removesuffix("* /\n") + "*/\n"
    guard = f"{routine.name.upper()}_H"
    sizes = [(name, n) for name, n, _ in routine.inputs]
    sizes += [(output.name, output.values.size) for output in routine.outputs]
    counts = "enum {\n" + ",\n".join(f"    {routine.name}_n_{name} = {n}" for name, n in sizes) + "\n};"
    declared = f"{counts}\n\n{use_of(routine.name, sizes)}\n{head};"
    header = f"{comment}#ifndef {guard}\n#define {guard}\n\n{declared}\n\n#endif\n"
    both = f"{routine.name}_sine_cosine"
    body = statements(lines, both)
    for output, results in zip(routine.outputs, lines.results, strict=True):
        body += [f"    {output.name}[{k}] = {text};" for k, text in enumerate(results)]
    own = SINE_COSINE.format(name=both) if lines.turns else ""
    source = f'{comment}#include <math.h>\n\n#include "{routine.name}.h"\n\n{own}{head}\n{{\n' + "\n".join(body)
    return {f"{routine.name}.c": source + "\n}\n", f"{routine.name}.h": header}


def use_of(name: str, sizes: Sequence[tuple[str, int]]) -> str:
    """Return a comment that shows how to call the function."""
    arrays = ", ".join(f"{each}[{name}_n_{each}]" for each, _ in sizes)
    call = f"{name}({', '.join(each for each, _ in sizes)});"
    lines = [f"double {arrays};", call, f"cc -O2 main.c {name}.c -lm"]
    return "/* matrices row by row; outputs last:\n" + "".join(f" *     {line}\n" for line in lines) + " */"


def statements(lines: Lines, both: str) -> list[str]:
    """Return named terms as statements; the sine and cosine of one angle are computed by one call."""
    turns = {name: turn for turn in lines.turns for name in turn[1:]}
    body, done = [], set()
    for name, text in lines.named:
        if name not in turns:
            body.append(f"    const double {name} = {text};")
        elif name not in done:
            angle, sine, cosine = turns[name]
            body += [f"    double {sine}, {cosine};", f"    {both}({angle}, &{sine}, &{cosine});"]
            done |= {sine, cosine}
    return body
