"""Errors of this package: one root class, and leaves that also derive from `ValueError` or `RuntimeError`."""

from typing import Any

from fe_models.foundation.errors import ReportedError

__all__ = [
    "ConvergenceError",
    "CosimulationError",
    "FatigueError",
    "FloatframeError",
    "ModelError",
    "ResultsError",
    "SignalError",
    "SystemFileError",
    "UrdfError",
]


class FloatframeError(ReportedError):
    """Root of every intentional error of `floatframe`."""


class ModelError(FloatframeError, ValueError):
    """A body, marker, joint, force or system is invalid."""


class SystemFileError(FloatframeError, ValueError):
    """The system file is invalid; the message names the key, the value and the choices."""


class ResultsError(FloatframeError, ValueError):
    """The file is not a readable results file, or cannot be written."""


class SignalError(FloatframeError, ValueError):
    """A file of signals, or a request about a signal, is invalid; the message names file, line and channel."""


class FatigueError(FloatframeError, ValueError):
    """An S-N curve, a load block or a fatigue file is invalid, or stresses are outside their range of validity."""


class UrdfError(FloatframeError, ValueError):
    """The description of a robot is invalid, or cannot be written; the message names file, line, link or joint."""


class ConvergenceError(FloatframeError, RuntimeError):
    """Newton's method failed; the results computed before are kept.

    Attributes
    ----------
    t, h
        Time at the start of the failed step, and its size [s].
    residual
        Size of the last correction relative to the accepted size.
    trajectory
        The motion up to the last successful step, or None if there was none.
    """

    def __init__(self, message: str, *, t: float, h: float, residual: float, trajectory: Any = None) -> None:
        super().__init__(message)
        self.t = t
        self.h = h
        self.residual = residual
        self.trajectory = trajectory


class CosimulationError(FloatframeError, RuntimeError):
    """A unit of another program failed, or the units did not agree; the results computed before are kept.

    Attributes
    ----------
    t
        Time at the start of the failed macro-step [s]; None before the first step.
    trajectory
        The motion up to that time, or None if there was none.
    """

    def __init__(self, message: str, *, t: float | None = None, trajectory: Any = None) -> None:
        super().__init__(message)
        self.t = t
        self.trajectory = trajectory
