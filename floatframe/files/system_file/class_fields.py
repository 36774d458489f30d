"""Fields of a class, or arguments of a function, with their types, defaults and meanings."""

import inspect
import re
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache
from linecache import getlines
from typing import Any, get_type_hints

__all__ = ["ClassField", "class_fields", "summary_of"]


@dataclass(frozen=True, eq=False)
class ClassField:
    """A field of a dataclass, or an argument of a function."""

    name: str
    hint: Any  #: its type
    default: Any  #: `MISSING` if it has none
    meaning: str  #: "" if the class does not state it

    @property
    def is_required(self) -> bool:
        """Whether it has no default."""
        return self.default is MISSING


@cache
def class_fields(kind: Any) -> dict[str, ClassField]:
    """Return the fields that a dataclass is made of, or the arguments of a function, by name."""
    if is_dataclass(kind):
        defaults = {
            each.name: each.default if each.default_factory is MISSING else each.default_factory()
            for each in fields(kind)
            if each.init
        }
    else:
        given = inspect.signature(kind).parameters.items()
        defaults = {name: MISSING if each.default is each.empty else each.default for name, each in given}
    hints, meanings = get_type_hints(kind), meanings_of(kind)
    return {name: ClassField(name, hints[name], default, meanings.get(name, "")) for name, default in defaults.items()}


def summary_of(kind: Any) -> str:
    """Return the first paragraph of a docstring."""
    return (inspect.getdoc(kind) or "").partition("\n\n")[0]


def meanings_of(kind: Any) -> dict[str, str]:
    """Return the descriptions of the fields of a class: from its docstring, and from comments that begin with `#:`."""
    _, _, listed = (inspect.getdoc(kind) or "").partition("Parameters\n----------\n")
    found = re.findall(r"^(\w.*)\n((?: +.*\n?)+)", listed.partition("\n\n")[0] + "\n", re.MULTILINE)
    named = {name: text for names, text in found for name in names.split(", ")}
    commented = r"((?:^    #: .*\n)*)^    (\w+): [^#\n]*(?:#: (.*))?$"
    for before, name, after in re.findall(commented, source_of(kind), re.MULTILINE):
        named.setdefault(name, before.replace("#:", "") + after)
    return {name: " ".join(text.split()).removesuffix(".") for name, text in named.items()}


def source_of(kind: Any) -> str:
    """Return the source of a class, "" if there is none; `inspect.getsource` parses the whole module for each class."""
    try:
        if isinstance(kind, type) and "." not in kind.__qualname__:
            text = "".join(getlines(inspect.getsourcefile(kind) or ""))
            if found := re.search(rf"^class {kind.__name__}\b.*\n(?:[ \t)].*\n|\n)*", text, re.MULTILINE):
                return found[0]
        return inspect.getsource(kind)
    except (OSError, TypeError):
        return ""
