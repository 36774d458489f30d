"""What a reduced body can be asked from its modal file alone."""
