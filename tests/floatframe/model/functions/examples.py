"""Systems, bodies and helpers that several tests share: expressions."""

EXPRESSIONS = [  # also used with their gradients in test_user_forces
    "2 * x - y / 3 + 4",
    "-x ** 2 + y ^ 3 - (-z)",
    "sin(x) * cos(y) - tan(x / 3) + asin(x / 9) + acos(y / 9) + atan(z)",
    "sinh(x / 2) + cosh(y) * tanh(z) - exp(-x) + log(x + 2) + sqrt(y + 5)",
    "atan2(x, y) + abs(z) * sign(y) + min(x, y) - max(z, 2 * x)",
    "pi * x if x < y else 3 * y ** 2",
    "(1 if x >= z else 0) * x + (2 if x > 5 else 3) * y + (x <= z) * y",
    "x ** y",
    "k * x",
]
