"""Values of a TOML file changed by key path, such as "bodies.rod.mass" or "bodies.rod.position.0"."""

import copy
from collections.abc import Mapping
from typing import Any

from fe_models.foundation.words import nearest, quoted

__all__ = ["changed"]


def changed(
    content: Mapping[str, Any], changes: Mapping[str, Any], where: str, error: type[Exception]
) -> dict[str, Any]:
    """Return the content of a file with other values at some key paths.

    The table that holds a key must be in the file; the key itself may be a new one. Names with dots are found, too:
    the longest key that fits is taken.

    Raises
    ------
    error
        If a table or an index on the way is not there.
    """
    result = copy.deepcopy(dict(content))
    for path, value in changes.items():
        here: Any = result
        left = path
        while True:
            key, rest = first_key(here, left)
            if rest is None:
                break
            if key is None:
                choices = list(here) if isinstance(here, dict) else [str(k) for k in range(len(here))]
                name = left.split(".")[0]
                raise error(f"{where}: the key path {path!r}: there is no {quoted(name)}{nearest(name, choices)}")
            here, left = here[key], rest
            if not isinstance(here, dict | list):
                raise error(f"{where}: the key path {path!r} goes on after a value: {here!r}")
        if isinstance(here, list):
            if not left.isdigit() or int(left) >= len(here):
                raise error(f"{where}: the key path {path!r}: expected an index of 0 to {len(here) - 1}, got {left!r}")
            here[int(left)] = value
        else:
            here[left] = value
    return result


def first_key(here: dict[str, Any] | list[Any], path: str) -> tuple[Any, str | None]:
    """Return the key with which a path goes on and what is left; (None, path) if none fits, (None, None) at its end."""
    if isinstance(here, list):
        key, _, rest = path.partition(".")
        if not rest:
            return None, None
        return (int(key), rest) if key.isdigit() and int(key) < len(here) else (None, path)
    fitting = [key for key in here if path == key or path.startswith(key + ".")]
    if any(path == key for key in fitting) or (not fitting and "." not in path):
        return None, None
    if not fitting:
        return None, path
    key = max(fitting, key=len)
    return key, path[len(key) + 1 :]
