"""Commands that judge: check, compare, accept."""
