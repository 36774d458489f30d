"""Example systems, each as a function that returns a `System`: rigid by default, flexible with reduced bodies."""

from floatframe.components.mechanisms.beam_benchmarks import (
    buckling_beam,
    loaded_cantilever,
    misaligned_four_bar,
    unbalanced_shaft,
)
from floatframe.components.mechanisms.iftomm import (
    andrews_mechanism,
    bricard_mechanism,
    flyball_governor,
    n_four_bar,
    point_pendulum,
)
from floatframe.components.mechanisms.linkages import (
    chain,
    double_pendulum,
    four_bar,
    pendulum,
    slider_crank,
    telescopic_slider_crank,
)
from floatframe.components.mechanisms.spinning import (
    rotating_blade,
    satellite,
    spin_up_beam,
    spinning_shaft,
    spinning_top,
)

__all__ = [
    "andrews_mechanism",
    "bricard_mechanism",
    "buckling_beam",
    "chain",
    "double_pendulum",
    "flyball_governor",
    "four_bar",
    "loaded_cantilever",
    "misaligned_four_bar",
    "n_four_bar",
    "pendulum",
    "point_pendulum",
    "rotating_blade",
    "satellite",
    "slider_crank",
    "spin_up_beam",
    "spinning_shaft",
    "spinning_top",
    "telescopic_slider_crank",
    "unbalanced_shaft",
]
