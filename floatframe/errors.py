"""Errors of this package: one root, leaves that are also the built-in kind a caller would expect."""

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
    """Root of every error that `floatframe` raises on purpose."""


class ModelError(FloatframeError, ValueError):
    """A body, marker, joint, force or system is not what it claims to be."""


class SystemFileError(FloatframeError, ValueError):
    """A system file is not valid; the text names the key, the value and the choices."""


class ResultsError(FloatframeError, ValueError):
    """A file is not a readable results file, or cannot be written."""


class SignalError(FloatframeError, ValueError):
    """A file of signals, or what was asked of a signal, is not valid; the text names file, line and channel."""


class FatigueError(FloatframeError, ValueError):
    """An S-N curve, a load block or a fatigue file is not valid, or stresses lie beyond what they are known for."""


class UrdfError(FloatframeError, ValueError):
    """A description of a robot is not valid, or cannot be written; the text names file, line, link or joint."""


class ConvergenceError(FloatframeError, RuntimeError):
    """Newton's method failed; what was computed before is kept.

    Attributes
    ----------
    t, h
        Time at the beginning of the failed step and its size [s].
    residual
        Size of the last correction relative to what would have been accepted.
    trajectory
        The motion up to the last good step, or None if there was none.
    """

    def __init__(self, message: str, *, t: float, h: float, residual: float, trajectory: Any = None) -> None:
        super().__init__(message)
        self.t = t
        self.h = h
        self.residual = residual
        self.trajectory = trajectory


class CosimulationError(FloatframeError, RuntimeError):
    """A unit of another program failed, or the units did not agree; what was computed before is kept.

    Attributes
    ----------
    t
        Time at the beginning of the failed macro-step [s], None before the first.
    trajectory
        The motion up to there, or None if there was none.
    """

    def __init__(self, message: str, *, t: float | None = None, trajectory: Any = None) -> None:
        super().__init__(message)
        self.t = t
        self.trajectory = trajectory
