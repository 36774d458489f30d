"""Observed order of an error that falls with the step size."""

import numpy as np


def slope(steps, errors):
    """Return the slope of log(error) over log(h) by least squares."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])
