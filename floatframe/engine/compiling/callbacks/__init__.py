"""Users' functions as C functions that the kernels call by their address."""

from floatframe.engine.compiling.callbacks.user_forces import Callback, callback_of, cost_words, raise_errors_of

__all__ = ["Callback", "callback_of", "cost_words", "raise_errors_of"]
