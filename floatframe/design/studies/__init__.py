"""Parameter studies from a file."""
