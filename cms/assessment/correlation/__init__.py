"""Test and model: measured modes compared with those of a model, and the updated model."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
