"""Roads: flat, profiles and grids, random ones of ISO 8608, obstacles, and what a disc feels of them."""
