"""Comparison of mode sets: which one is good enough, with how few modes, and why."""

from fe_models.door import open_door

open_door(__name__)
