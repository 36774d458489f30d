"""Height and slopes of a road under a wheel, from the data of the road, for real and complex numbers."""

from numba.extending import register_jitable

__all__ = ["CENTRE", "CUBIC", "FLAT", "GRID", "GRIP", "HEADER", "road_grip", "road_height"]

FLAT, GRID = 0, 1  #: kinds of roads
#: z is the envelope, the lowest point of a disc whose centre is above the place; 0: z is the ground itself
CENTRE = 1.0
CUBIC = 1.0  #: between the knots; 0: linear
#: kind, n_x, n_y, interpolation, reference, grip; then x, y, and z, z_x, z_y, z_xy of (n_x, n_y)
HEADER = 6
GRIP = 5  #: index in the header of the beginning of the grip: n, x (n), factors (n); 0: factor 1 everywhere


@register_jitable(error_model="numpy")
def interval(data, at, n, x):
    """Return k with knot[k] <= x < knot[k + 1], of n >= 2 knots at data[at:]; outside, the nearest interval."""
    low, high = 0, n - 1
    while high - low > 1:
        middle = (low + high) // 2
        if data[at + middle] <= x.real:
            low = middle
        else:
            high = middle
    return low


@register_jitable(error_model="numpy")
def held(x, low, high):
    """Return x clamped to a range."""
    if x.real < low:
        return 0.0 * x + low
    if x.real > high:
        return 0.0 * x + high
    return x


@register_jitable(error_model="numpy")
def hermite(s, h, z_0, z_1, d_0, d_1):
    """Return value and derivative of the cubic with values z and derivatives d at the ends of an interval of length h.

    s in [0, 1]: z = (1 + 2s)(1 - s)² z_0 + s(1 - s)² h d_0 + s²(3 - 2s) z_1 - s²(1 - s) h d_1.
    """
    r = 1.0 - s
    value = (1.0 + 2.0 * s) * r * r * z_0 + s * r * r * h * d_0 + s * s * (3.0 - 2.0 * s) * z_1 - s * s * r * h * d_1
    slope = 6.0 * s * r * (z_1 - z_0) / h + r * (1.0 - 3.0 * s) * d_0 + s * (3.0 * s - 2.0) * d_1
    return value, slope


@register_jitable(error_model="numpy")
def road_height(data, at, x, y):
    """Return z, dz/dx, dz/dy of a road at (x, y), and the distance of x from its nearer end (negative outside).

    Beyond its knots, a road is level at the height of its edge. A flat road has no end: the distance is 1e30.
    """
    zero = 0.0 * (x + y)
    if data[at] == FLAT:
        return zero, zero, zero, 1e30 + zero
    n_x, n_y = int(data[at + 1]), int(data[at + 2])
    x_at = at + HEADER
    y_at = x_at + n_x
    z_at = y_at + n_y
    size = n_x * n_y
    x_low, x_high = data[x_at], data[x_at + n_x - 1]
    left = x - x_low if x.real - x_low < x_high - x.real else x_high - x
    i = interval(data, x_at, n_x, x)
    h = data[x_at + i + 1] - data[x_at + i]
    s = (held(x, x_low, x_high) - data[x_at + i]) / h
    inside_x = 1.0 if x_low <= x.real <= x_high else 0.0
    k = z_at + i * n_y
    if n_y == 1:
        if data[at + 3] == CUBIC:
            z, z_x = hermite(s, h, data[k], data[k + 1], data[k + size], data[k + size + 1])
        else:
            z_x = zero + (data[k + 1] - data[k]) / h
            z = data[k] + s * (data[k + 1] - data[k])
        return z, inside_x * z_x, zero, left
    y_low, y_high = data[y_at], data[y_at + n_y - 1]
    j = interval(data, y_at, n_y, y)
    b = data[y_at + j + 1] - data[y_at + j]
    r = (held(y, y_low, y_high) - data[y_at + j]) / b
    inside_y = 1.0 if y_low <= y.real <= y_high else 0.0
    k += j
    if data[at + 3] == CUBIC:
        low, low_y = k, k + 2 * size
        z_0, x_0 = hermite(s, h, data[low], data[low + n_y], data[low + size], data[low + n_y + size])
        z_1, x_1 = hermite(s, h, data[low + 1], data[low + n_y + 1], data[low + size + 1], data[low + n_y + size + 1])
        d_0, c_0 = hermite(s, h, data[low_y], data[low_y + n_y], data[low_y + size], data[low_y + n_y + size])
        d_1, c_1 = hermite(
            s, h, data[low_y + 1], data[low_y + n_y + 1], data[low_y + size + 1], data[low_y + n_y + size + 1]
        )
        z, z_y = hermite(r, b, z_0, z_1, d_0, d_1)
        z_x, _ = hermite(r, b, x_0, x_1, c_0, c_1)
    else:
        z_0 = data[k] + s * (data[k + n_y] - data[k])
        z_1 = data[k + 1] + s * (data[k + n_y + 1] - data[k + 1])
        z = z_0 + r * (z_1 - z_0)
        z_y = (z_1 - z_0) / b
        z_x = ((1.0 - r) * (data[k + n_y] - data[k]) + r * (data[k + n_y + 1] - data[k + 1])) / h
    return z, inside_x * z_x, inside_y * z_y, left


@register_jitable(error_model="numpy")
def road_grip(data, at, x):
    """Return the friction factor at x, linear between the knots and constant beyond them."""
    one = 1.0 + 0.0 * x
    if data[at + GRIP] == 0.0:
        return one
    first = at + int(data[at + GRIP])
    n = int(data[first])
    k = interval(data, first + 1, n, x)
    low, high = data[first + 1 + k], data[first + 2 + k]
    s = (held(x, low, high) - low) / (high - low)
    return data[first + 1 + n + k] * (1.0 - s) + data[first + 2 + n + k] * s
