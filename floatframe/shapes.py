"""Shapes of bodies, wheels, grounds, rails and elements in pictures and films."""

from fe_models.door import open_door

open_door(__name__)
