"""Test and model: measured modes compared with those of a model, and the updated model."""

from fe_models.door import open_door

open_door(__name__)
