"""Systems, bodies and helpers that several tests share: generate command."""

PENDULUM = """
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
"""
