"""Tables and documents: what commands and results write for people and for other programs."""
