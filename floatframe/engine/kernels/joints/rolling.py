"""A thin disc of radius R that rolls on a plane without slip.

N is the normal of the plane, fixed in A; n is the axis of the disc, fixed in B; d = r_B - r_A. With c = N·n and
s = sqrt(1 - c²), the point of the rim nearest to the plane is at rho = -R u, u = (N - c n)/s, from the centre. There

    RIM_HEIGHT   N · (d + rho) = N · d - R s = 0
    ROLL t       t · V = 0,  V = v_B + omega_B × rho - v_A - omega_A × (d + rho),  t fixed in A: a velocity constraint
    RIM x        x · (N_w - rho × F) = 0,  x in ground axes: the force on B acts at the rim

Formulas as in held_rows.py and wrench_rows.py. A velocity constraint also depends on positions, see `roll_by_place`.

Described in `floatframe.model.joints.rolling_disc`.
"""

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.joints.held_rows import A_TO_B, dot_rates, of_a, of_b, rates_of
from floatframe.engine.kernels.joints.relative_motion import direction, distance, put_pair, relative_velocity
from floatframe.engine.kernels.vector import add, cross, dot, norm, put, put_sum, scaled, sub, vector
from floatframe.model.joints.rows.kinds import FORCE, MOMENT_B

__all__ = [
    "height_rates",
    "height_value",
    "rim_derivatives",
    "rim_value",
    "roll_by_place",
    "roll_rates",
    "roll_value",
]


@inner
def rim(rows, markers, k, a, b):
    """Return N, n, c, s and the vector rho to the lowest rim point, ground axes."""
    N, n = direction(markers, a, rows.z[k]), direction(markers, b, rows.y[k])
    c = dot(N, n)
    u = sub(N, scaled(c, n))
    s = norm(u)
    return N, n, c, s, scaled(-rows.c[k] / s, u)


@inner
def rim_velocity(markers, a, b, rho):
    """Return V, the velocity of the rim at the contact relative to A."""
    of_b = cross(vector(markers.omega[b]), rho)
    of_a = cross(vector(markers.omega[a]), add(distance(markers, a, b), rho))
    return sub(add(relative_velocity(markers, a, b), of_b), of_a)


@inner
def height_value(model, work, k, a, b):
    """Return the value of RIM_HEIGHT, whose change by the tilt is d(-R s) = R c/s dc."""
    rows, markers = model.rows, work.markers
    N, n, c, s, _ = rim(rows, markers, k, a, b)
    R, d = rows.c[k], distance(markers, a, b)
    f = R * c / s
    return dot(N, d) - R * s, N, cross(N, add(d, scaled(f, n))), cross(n, scaled(f, N))


@inner
def height_rates(model, work, k, a, b):
    """Return the rates of RIM_HEIGHT."""
    rows, markers = model.rows, work.markers
    _, _, _, s, _ = rim(rows, markers, k, a, b)
    N = rates_of(of_a(rows.z[k]), markers, a, b)
    c, c_dot, c_ddot = dot_rates(N, rates_of(of_b(rows.y[k]), markers, a, b))
    _, _, along = dot_rates(N, rates_of(A_TO_B, markers, a, b))
    s_ddot = -(c_dot * c_dot + c * c_ddot) / s - c * c * c_dot * c_dot / (s * s * s)
    return 0.0, along - rows.c[k] * s_ddot


@inner
def roll_value(model, work, k, a, b):
    """Return the value of ROLL, t · V, which is linear in the velocities."""
    rows, markers = model.rows, work.markers
    _, _, _, _, rho = rim(rows, markers, k, a, b)
    t = direction(markers, a, rows.x[k])
    return (
        dot(t, rim_velocity(markers, a, b, rho)),
        t,
        cross(t, add(distance(markers, a, b), rho)),
        cross(rho, t),
    )


@inner
def roll_rates(model, work, k, a, b):
    """Return the rates of ROLL: rho_dot = -R u_dot, u_dot = (N_dot - c_dot n - c n_dot)/s + u c c_dot/s²."""
    rows, markers = model.rows, work.markers
    N, n, c, s, rho = rim(rows, markers, k, a, b)
    omega_a, omega_b, R = vector(markers.omega[a]), vector(markers.omega[b]), rows.c[k]
    N_dot, n_dot = cross(omega_a, N), cross(omega_b, n)
    c_dot = dot(N_dot, n) + dot(N, n_dot)
    turning = sub(sub(N_dot, scaled(c_dot, n)), scaled(c, n_dot))
    rho_dot = add(scaled(-R / s, turning), scaled(c * c_dot / (s * s), rho))
    t, v = direction(markers, a, rows.x[k]), relative_velocity(markers, a, b)
    V_dot = sub(cross(omega_b, rho_dot), cross(omega_a, add(v, rho_dot)))
    return 0.0, dot(cross(omega_a, t), rim_velocity(markers, a, b, rho)) + dot(t, V_dot)


@inner
def roll_by_place(model, work, k, a, b, by):
    """Write the derivatives of a ROLL row by the marker positions."""
    rows, markers = model.rows, work.markers
    N, n, c, s, rho = rim(rows, markers, k, a, b)
    omega_a, omega_b = vector(markers.omega[a]), vector(markers.omega[b])
    t = direction(markers, a, rows.x[k])
    put_pair(by, 0, cross(t, omega_a))  # t·(-omega_A × dd) = -dd·(t × omega_A)
    put(by.a, 3, cross(t, rim_velocity(markers, a, b, rho)))
    g = cross(t, sub(omega_b, omega_a))  # t·(omega × drho) = drho·(t × omega)
    add_by_rim(by, rows.c[k], g, N, n, c, s)


@inner
def rim_value(model, work, k, a, b, w):
    """Return the value of RIM: x · (N_w - rho × F), x in ground axes."""
    rows = model.rows
    _, _, _, _, rho = rim(rows, work.markers, k, a, b)
    return dot(vector(rows.x[k]), sub(vector(w[MOMENT_B:]), cross(rho, vector(w))))


@inner
def rim_derivatives(model, work, k, a, b, w, c_k, by, V):
    """Write the derivatives of RIM: x · (dN_w - rho × dF - drho × F)."""
    rows = model.rows
    N, n, c, s, rho = rim(rows, work.markers, k, a, b)
    x = vector(rows.x[k])
    put(V, MOMENT_B, x)
    put(V, FORCE, cross(rho, x))
    add_by_rim(by, rows.c[k], scaled(c_k, cross(x, vector(w))), N, n, c, s)


@inner
def add_by_rim(by, R, g, N, n, c, s):
    """Add the derivatives of g · rho to a row of P.

    rho = -R u,  du = (dN - dc n - c dn)/s + u c dc/s²,  dc = dN·n + N·dn, dN = dphi_A × N, ... so that
    g·du = A·dN + B·dn with m = (u c/s - n)·g/s:  A = g/s + m n,  B = m N - c g/s.
    """
    u = scaled(1 / s, sub(N, scaled(c, n)))
    m = (dot(u, g) * c / s - dot(n, g)) / s
    A, B = add(scaled(1 / s, g), scaled(m, n)), sub(scaled(m, N), scaled(c / s, g))
    put_sum(by.a, 3, scaled(-R, cross(N, A)))
    put_sum(by.b, 3, scaled(-R, cross(n, B)))
