"""The campaign: bad inputs, kills, random motions and bodies, each with an oracle (`python -m tests --campaign`)."""

from tests.campaign.campaign import main

__all__ = ["main"]
