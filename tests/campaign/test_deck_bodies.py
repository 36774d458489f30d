"""Random decks beside an assembler: some seeds agree, and what the assembler does otherwise is seen."""

import numpy as np
import pytest

from tests.campaign import abaqus_bodies, ansys_bodies
from tests.campaign.deck_bodies import body_case, random_deck, wrong_deck
from tests.campaign.verdict import ACCEPTED


@pytest.mark.parametrize("seed", [*range(40), 404, 587])  # the last two: dampers between linked components
def test_the_body_of_a_random_deck_is_that_of_the_assembler(tmp_path, seed):
    verdict = body_case(seed, tmp_path)
    assert (verdict.kind, verdict.words) == (ACCEPTED, "compared")


def test_another_body_is_seen(tmp_path):
    deck = random_deck(3)
    deck.K[0, 0] *= 1.0001
    assert wrong_deck(deck, tmp_path).startswith("K differs")
    deck = random_deck(3)
    deck.M[3, 3] *= 1.0001
    assert wrong_deck(deck, tmp_path).startswith("the rigid mass differs")
    deck = next(random_deck(seed) for seed in range(20) if random_deck(seed).rows)
    deck.rows[0] = deck.rows[0] + np.eye(6 * deck.n)[0]
    assert wrong_deck(deck, tmp_path) == "the link is not kept"


@pytest.mark.parametrize("seed", range(40))  # 24: single components of a coupling, which an instance would turn
def test_the_body_of_a_random_abaqus_deck_is_that_of_the_assembler(tmp_path, seed):
    verdict = abaqus_bodies.body_case(seed, tmp_path)
    assert (verdict.kind, verdict.words) == (ACCEPTED, "compared")


def test_another_body_of_an_abaqus_deck_is_seen(tmp_path):
    for name in ("K", "D"):
        decks = (abaqus_bodies.random_deck(seed) for seed in range(40))
        deck = next(deck for deck in decks if getattr(deck, name).any())
        getattr(deck, name)[0, 0] += 1e-4 * np.abs(getattr(deck, name)).max()
        assert abaqus_bodies.wrong_deck(deck, tmp_path).startswith(f"{name} differs")
    deck = abaqus_bodies.random_deck(3)
    deck.pieces[0] = (deck.pieces[0][0] * 1.0001, *deck.pieces[0][1:])
    assert abaqus_bodies.wrong_deck(deck, tmp_path).startswith("the rigid mass differs")


@pytest.mark.parametrize("seed", range(30))
def test_the_body_of_a_random_ansys_deck_is_that_of_the_assembler(tmp_path, seed):
    verdict = ansys_bodies.body_case(seed, tmp_path)
    assert (verdict.kind, verdict.words) == (ACCEPTED, "compared")


def test_another_body_of_an_ansys_deck_is_seen(tmp_path):
    for name in ("K", "M"):
        deck = ansys_bodies.random_deck(2)
        getattr(deck, name)[3, 3] *= 1.0001
        assert ansys_bodies.wrong_deck(deck, tmp_path).startswith(f"{name} differs")


def test_single_components_of_a_coupling_in_a_turned_instance_are_refused(tmp_path):
    """Whether they are along axes of the part or of the assembly is not said; whole halves are the same in both."""
    deck = next(d for d in map(abaqus_bodies.random_deck, range(60)) if d.is_turned and "*KINEMATIC" in d.lines)
    at = deck.lines.index("*KINEMATIC")
    deck.lines[at + 1 : at + 3] = ["1, 1", "5, 5"]
    with pytest.raises(ValueError, match="a turned instance"):
        abaqus_bodies.wrong_deck(deck, tmp_path)
