"""Random decks beside an assembler: some seeds agree, and what the assembler does otherwise is seen."""

import numpy as np
import pytest

from tests.campaign.deck_bodies import body_case, random_deck, wrong_deck
from tests.campaign.verdict import ACCEPTED


@pytest.mark.parametrize("seed", [*range(8), 404, 587])  # the last two: dampers between linked components
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
