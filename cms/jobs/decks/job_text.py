"""A complete deck as a job file: every table written out, with a header that lists unconverted data."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fe_models.files.decks.deck import Deck
from fe_models.files.model_of_deck import DeckOptions, deck_tables
from fe_models.foundation.arrays import MOTION_COMPONENTS

__all__ = ["job_tables", "job_text", "toml_text"]

N_MODES = 10


def job_tables(deck: Deck, options: DeckOptions, deck_path: str) -> dict[str, Any]:
    """Return the tables of a job for a deck, with a mode set: Craig-Bampton if there are interfaces, else normal modes.

    Parameters
    ----------
    deck
        The deck.
    options
        Units, densities, and entries to leave out.
    deck_path
        Path of the deck relative to the job file.

    Raises
    ------
    MeshError
        As `fe_models.files.model_of_deck.deck_tables`.
    """
    tables = deck_tables(deck, options)
    name, *others = tables["body"].items()
    tables["body"] = dict((name, ("deck", deck_path), *others))
    tables["reduction"] = {"set": "craig-bampton" if tables["interfaces"] else "normal", "n_modes": N_MODES}
    return {key: value for key, value in tables.items() if value}


def job_text(deck: Deck, options: DeckOptions, deck_path: str) -> str:
    """Return the text of a complete job, with the parameters of `job_tables`."""
    tables = job_tables(deck, options, deck_path)
    head = [f"# Written by cms job from {deck_path}, read as a deck of {deck.program}."]
    if deck.ledger.entries:
        head.append("# Not taken over from the deck (count, name: consequence):")
        left = {name.upper().lstrip("*") for name in options.leave_out}
        for entry in deck.ledger.entries.values():
            mark = "LEFT OUT ON REQUEST: " if entry.is_body and entry.name.upper().lstrip("*") in left else ""
            head.append(f"#   {entry.count} {entry.name}: {mark}{entry.consequence}")
    for support in deck.supports:
        held = " ".join(MOTION_COMPONENTS[c] for c in support.components)
        if support.is_boundary:
            head.append(f"# The deck keeps {held} of {support.name} as the boundary of a superelement.")
            continue
        along = "" if support.axes is None else " along its own axes"
        head.append(f"# The deck holds {held}{along} at the interface {support.name}; here the body is free.")
    return "\n".join(head) + "\n\n" + toml_text(tables)


def toml_text(tables: Mapping[str, Any]) -> str:
    """Return tables as TOML: [a.b] for tables of tables, one key per line, inner tables in braces."""
    lines: list[str] = []
    for name, table in tables.items():
        if all(isinstance(value, Mapping) for value in table.values()):
            for inner, rows in table.items():
                lines += [f"[{name}.{_key(inner)}]", *(f"{_key(k)} = {_value(v)}" for k, v in rows.items()), ""]
        else:
            lines += [f"[{name}]", *(f"{_key(k)} = {_value(v)}" for k, v in table.items()), ""]
    return "\n".join(lines)


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(each) for each in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str | Path):
        return json.dumps(str(value), ensure_ascii=False)
    return repr(int(value)) if isinstance(value, int | np.integer) else repr(float(value))
