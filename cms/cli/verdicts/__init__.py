"""Commands that give verdicts: check, compare, accept."""
