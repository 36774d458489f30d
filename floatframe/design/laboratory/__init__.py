"""The reference laboratory: one mechanism with many descriptions of its flexible body, each against a reference."""
