"""Systems, bodies and helpers that several tests share: motion view."""

from dataclasses import replace

import numpy as np
from scipy.spatial import ConvexHull

from floatframe import GROUND, FlexibleBody, Gravity, Marker, RevoluteJoint, RigidBody, SpringDamper, System
from floatframe.model.shapes import Road, Wheel
from tests.synthetic import synthetic_reduced_body

SIZE = 4.0  #: of the bodies [m]


def swinging(**options):
    rng = np.random.default_rng(3)
    reduced = synthetic_reduced_body(n_nodes=60, units="m-kg-s")
    stress = rng.normal(size=(60, 6, reduced.n_q)) * 1e9
    reduced = replace(reduced, surface=ConvexHull(reduced.nodes).simplices, stress=stress, **options)
    arm = FlexibleBody("arm", reduced, omega_B=(0.3, 2.0, 1.0), q=1e-2 * np.ones(reduced.n_q))
    end = reduced.interfaces[0]
    inertia = np.diag([0.1, 0.2, 0.1])
    wheel = RigidBody("wheel", 3.0, inertia, position=(0, 0, 4.0), omega_B=(0, 20.0, 0), shapes=[Wheel(0.5, 0.2)])
    hinge = RevoluteJoint("hinge", GROUND, Marker("arm", end.name), axis=(0, 1, 0))
    stay = SpringDamper("stay", Marker("arm", reduced.interfaces[1].name), Marker("wheel"), 400.0, 2.0)
    return System([arm, wheel], [hinge], [Gravity((0, 0, -9.81)), stay], scene=[Road([(-3, 0, -3), (3, 0, -3)], 2.0)])
