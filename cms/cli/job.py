"""`cms job`: a job file from a whole deck of a finite element program."""

import os
from dataclasses import dataclass
from pathlib import Path

from cms.cli.console import output_path, print_table, say
from cms.errors import JobError
from cms.jobs.decks.job_text import job_text
from fe_models.assembly.model import MASSES_OF_ALL
from fe_models.files.model_of_deck import DeckOptions
from fe_models.foundation.units import UNIT_SYSTEMS
from fe_models.foundation.words import nearest, quoted

__all__ = ["DeckRequest", "write_job"]


@dataclass(frozen=True)
class DeckRequest:
    """Arguments of the command `cms job`."""

    deck: Path
    output: Path | None
    units: str | None
    program: str | None
    densities: tuple[str, ...]
    leave_out: tuple[str, ...]
    mass: str | None = None


def write_job(request: DeckRequest) -> None:
    """Read the deck, print which cards are not converted, and write the job."""
    from fe_models.files.read_deck import parse_deck

    if request.units is None or request.units not in UNIT_SYSTEMS:
        what = "missing; a deck does not say its units" if request.units is None else f"unknown {quoted(request.units)}"
        raise JobError(f"--units: {what}{nearest(request.units or '', UNIT_SYSTEMS)}")
    if request.mass not in (None, *MASSES_OF_ALL):
        raise JobError(f"--mass: unknown {quoted(request.mass)}{nearest(request.mass, MASSES_OF_ALL)}")
    path = output_path(request.output, request.deck.with_suffix(".toml"), JobError, overwrite_of=[request.deck])
    deck = parse_deck(request.deck, program=request.program)
    asked = DeckOptions(request.units, densities_of(request.densities), request.leave_out, request.mass)
    relative = os.path.relpath(request.deck.resolve(), path.resolve().parent)
    try:
        text = job_text(deck, asked, Path(relative).as_posix())
    finally:  # the table also explains an error
        if rows := deck.ledger.rows():
            print_table("Not taken over from the deck", ("name", "count>", "consequence"), rows)
    path.write_text(text, encoding="utf-8")
    say(f"wrote {path}")


def densities_of(words: tuple[str, ...]) -> dict[str, float]:
    """Return the density of each material from NAME=NUMBER; a number alone applies to materials without density."""
    found = {}
    for word in words:
        name, _, number = word.rpartition("=")
        try:
            found[name] = float(number)
        except ValueError:
            found[name] = 0.0
        if not 0 < found[name] < float("inf"):
            raise JobError(f"--density {quoted(word)}: expected NAME=NUMBER or a number above 0, as steel=7.85e-9")
    return found
