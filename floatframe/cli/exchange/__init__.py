"""Commands that exchange systems with other programs."""
