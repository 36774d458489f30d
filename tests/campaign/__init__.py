"""The campaign: a thousand bad inputs and a hundred kills, each with an oracle (`python -m tests --campaign`)."""

from tests.campaign.campaign import main

__all__ = ["main"]
