"""Decks of a folder that make a body: `python -m tests.external.nastran FOLDER` gives the count of docs/measured.md.

A deck makes a body if `cms job` writes its job and the coupled body is assembled. Materials without density get
7800 kg/m³ where nothing else has mass, and odd units are accepted. Every other deck is printed with the reason.
"""

import sys
import tempfile
from pathlib import Path

from cms.jobs.body_of_job import coupled_body, uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import DECK_FORMATS, parse_deck
from fe_models.foundation.errors import ReportedError
from fe_models.foundation.stages import Stages


def make_body(path: Path, folder: Path) -> None:
    """Make the body of a deck by way of its job, which is written into a folder."""
    deck = parse_deck(path)
    try:
        text = job_text(deck, DeckOptions("m-kg-s", {}), str(path.resolve()))
    except ReportedError as error:
        if "density" not in str(error):
            raise
        text = job_text(deck, DeckOptions("m-kg-s", {"": 7800.0}), str(path.resolve()))
    job = folder / f"{path.stem}.toml"
    job.write_text(text.replace("[body]", '[body]\naccept = ["units", "parts"]', 1))
    made = read_job(job)
    coupled_body(made, uncoupled_body(made, Stages()))


def main(folder: Path) -> None:
    """Print the decks that make no body, and the count."""
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in DECK_FORMATS)
    n_made = 0
    with tempfile.TemporaryDirectory() as jobs:
        for path in paths:
            try:
                make_body(path, Path(jobs))
                n_made += 1
            except ReportedError as error:
                print(f"{path.name}: {' '.join(str(error).split())[:400]}")
    print(f"{n_made} of {len(paths)} decks make a body")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
