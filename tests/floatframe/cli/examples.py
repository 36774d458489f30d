"""Systems, bodies and helpers that several tests share: analyses, commands."""

PENDULUM = """
[system]
units = "m-kg-s"
gravity = [0, -9.81, 0]

[bodies.rod]
mass = 2.0
inertia = [[1e-4, 0, 0], [0, 0.166666666666666667, 0], [0, 0, 0.166666666666666667]]
center_of_mass = [0.5, 0, 0]

[joints.hinge]
type = "revolute"
body_a = "ground"
body_b = "rod"
marker_a = [0, 0, 0]
axis = [0, 0, 1]

[run]
t_end = 1.0
h = 1e-3
"""
RIGID = """
[system]
units = "m-kg-s"
gravity = [0, 0, -9.81]

[bodies.stick]
mass = 2.0
inertia = [[0.01, 0, 0], [0, 0.2, 0], [0, 0, 0.2]]
position = [0.5, 0, 0]

[joints.pin]
type = "revolute"
body_a = "ground"
body_b = "stick"
marker_b = [-0.5, 0, 0]
axis = [0, 1, 0]

[run]
t_end = 0.5
h = 1e-3
"""
FLEXIBLE = """
[system]
units = "mm-t-s"

[bodies.part]
file = "part.h5"
omega_B = [0, 0, 3]

[run]
t_end = 0.01
h = 1e-4
"""
