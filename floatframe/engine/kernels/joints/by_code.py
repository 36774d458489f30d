"""One compiled function that calls another by a code: `if code == ...` written from a table."""

from collections.abc import Callable, Mapping
from typing import Any

from floatframe.engine.kernels.compiler.compilation import inner

__all__ = ["by_code"]


def by_code(name: str, functions: Mapping[int, Callable[..., Any]], arguments: str) -> Callable[..., Any]:
    """Return the inner function name(code, ...) that calls functions[code](...).

    All of them take the arguments named and return the same types; a code that is not in the table is not asked for.
    The name is its own among such functions: the symbols of two of one name and types differ by a number that counts
    what a process has compiled, and an entry from the cache may bring the number of one for the code of another.
    """
    different = list(dict.fromkeys(functions.values()))
    lines = [f"def {name}(code, {arguments}):"]
    for k, function in enumerate(different):
        codes = [code for code, each in functions.items() if each is function]
        if k < len(different) - 1:
            lines.append(f"    if {' or '.join(f'code == {code}' for code in codes)}:")
            lines.append(f"        return f_{k}({arguments})")
        else:
            lines.append(f"    return f_{k}({arguments})")
    names: dict[str, Any] = {f"f_{k}": function for k, function in enumerate(different)}
    exec("\n".join(lines), names)
    return inner(names[name])
