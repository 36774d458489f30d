"""Roads: flat, profiles and grids, random roads of ISO 8608, obstacles, and their envelopes for a disc."""
