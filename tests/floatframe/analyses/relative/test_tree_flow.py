"""Equilibria and steady rotations in relative coordinates: those of the absolute formulation, and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    ConvergenceError,
    Gravity,
    JointForce,
    Marker,
    ModelError,
    PointForce,
    RevoluteJoint,
    RigidBody,
    System,
    static_equilibrium,
    steady_rotation,
)
from floatframe.mechanisms import chain, satellite, spinning_top
from floatframe.relative.topology import tree_of
from tests.floatframe.analyses.relative.test_coordinate_basis import CASES
from tests.floatframe.elements_with_states import sprung_pendulum
from tests.floatframe.relative.mechanisms import MECHANISMS
