"""Routines in Python with NumPy, for one motion with plain numbers, or for many motions at once."""

from collections.abc import Sequence

from floatframe.design.generation.languages.lines import lines_of, needed_inputs
from floatframe.design.generation.routines import Routine

__all__ = ["docstring", "python_files"]

STACKED = '''

def stacked(values, shape, many):
    """Return results as an array of the given shape, followed by the axes of many motions."""
    if not many:
        return np.array(values, dtype=float).reshape(shape)
    out = np.empty((len(values), *many))
    for row, value in zip(out, values):
        row[...] = value
    return out.reshape(*shape, *many)
'''


def docstring(notes: Sequence[str], indent: str) -> str:
    """Return notes as a raw docstring."""
    text = "\n".join(f"{indent}{note}".rstrip() for note in notes).strip().replace('"""', "'''")
    return f'{indent}r"""{text}\n{indent}"""\n'


def python_files(routine: Routine, notes: Sequence[str]) -> dict[str, str]:
    """Return NAME.py with the function NAME(inputs), which returns its output, or a tuple of outputs.

    Each input is an array (n,), or (n, ...) for many motions at once; the results then have the same trailing axes.
    """
    lines, needed = lines_of(routine, symbol=str), needed_inputs(routine)
    names = [name for name, _, _ in routine.inputs]
    body = [f"    arrays = [np.asarray(each, dtype=float) for each in ({', '.join(names)},)]"]
    for k, (name, n, _) in enumerate(routine.inputs):
        body += [
            f"    if arrays[{k}].shape[:1] != ({n},):",
            f"        got = arrays[{k}].shape",
            f'        raise ValueError(f"{routine.name}: {name}: expected {n} numbers, got shape {{got}}")',
        ]
    body += [
        "    many = np.broadcast_shapes(*(each.shape[1:] for each in arrays))",
        "    sin, cos = (np.sin, np.cos) if many else (math.sin, math.cos)",
    ]
    for k, name in enumerate(names):
        if name in needed:
            body.append(f"    {name} = arrays[{k}] if many else arrays[{k}].tolist()")
    body += [f"    {name} = {text}" for name, text in lines.named]
    for output, results in zip(routine.outputs, lines.results, strict=True):
        body.append(f"    {output.name} = [")
        body += [f"        {text}," for text in results]
        body.append("    ]")
    stacked = [f"stacked({out.name}, {out.values.shape}, many)" for out in routine.outputs]
    body.append(f"    return {', '.join(stacked)}")
    text = docstring(notes, "") + "\nimport math\n\nimport numpy as np\n" + STACKED
    text += f"\n\ndef {routine.name}({', '.join(names)}):\n" + docstring([f"{routine.meaning}."], "    ")
    return {f"{routine.name}.py": text + "\n".join(body) + "\n"}
