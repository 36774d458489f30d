"""The campaign: bad inputs, kills and random motions, each with an oracle (`python -m tests --campaign`)."""

from tests.campaign.campaign import main

__all__ = ["main"]
