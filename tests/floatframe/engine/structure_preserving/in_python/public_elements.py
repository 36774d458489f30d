"""Public elements over a step: their law in the middle of it, and the correction of their work.

Formulas: `floatframe.engine.structure_preserving.kernels.connections.public_elements`.
"""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.callbacks.law_functions import called_law
from floatframe.engine.compiling.coordinate_elements import LEAST_SIZE
from floatframe.engine.kernels.model import Model
from floatframe.engine.structure_preserving.system import multiplier_rows, state_rows
from floatframe.model.joints.rows import POSITION, VELOCITY
from floatframe.model.rotations import cross, dot, rotated, rotation_exp
from tests.floatframe.engine.structure_preserving.in_python.constraints import Loads, Pair, Span
from tests.floatframe.engine.structure_preserving.in_python.coordinates import add_pair
from tests.floatframe.engine.structure_preserving.in_python.markers import Load, MarkerStep
from tests.floatframe.engine.structure_preserving.in_python.rotation import cayley

WAY = 1 / 64  #: fraction of the step over which the gradient of the potential is taken
#: coefficients of sixth-order differences at -3 to 3
FIRST = (-1 / 60, 9 / 60, -45 / 60, 0.0, 45 / 60, -9 / 60, 1 / 60)
LEAST = 1e-6  #: motion relative to the length of the law, below which it counts as zero
BALANCED = 1e-9  #: sum of wrenches relative to the sum of their norms, below which they balance
STEP = 1e-5  #: relative step of differences for derivatives, by the sizes of the inputs


Place = tuple[Array, Array]  #: position and axes of a marker


class Motion:
    """The markers of an element over a step, and the inputs of its law."""

    def __init__(self, model: Model, c: int, markers: list[MarkerStep], span: Span, *, is_middle: bool) -> None:
        self.model, self.c, self.i, self.span = model, c, int(model.connections.item[c]), span
        self.first, self.head = int(model.connections.a[c]), model.laws.head[self.i]
        self.length = float(model.laws.length[self.i])
        self.markers = markers
        self.ends = [(m.x_0, axes(m, 0)) for m in markers], [(m.x_1, axes(m, 1)) for m in markers]
        self.dr = [m.dx for m in markers]
        self.turn = [way_turned(m, is_middle=is_middle) for m in markers]
        self.r = [0.5 * (m.x_0 + m.x_1) if is_middle else m.x_0 for m in markers]
        begin = [A for _, A in self.ends[0]]
        self.A = [half_turned(*each) for each in zip(begin, self.turn, strict=True)] if is_middle else begin

    def acts(self, part: str, m: int) -> bool:
        """Whether the law has a force, or a moment, on marker m."""
        return bool(getattr(self.model.markers, part)[self.first + m] >= 0)

    @property
    def between_points(self) -> bool:
        """Whether the element acts only by forces."""
        return not any(self.acts("moment", m) for m in range(len(self.markers)))

    @property
    def whole(self) -> int:
        """The first marker with all kinds of loads of the element; -1 for none."""
        parts = [part for part in ("force", "moment") if any(self.acts(part, m) for m in range(len(self.markers)))]
        found = [m for m in range(len(self.markers)) if all(self.acts(part, m) for part in parts)]
        return found[0] if found else -1

    @property
    def is_apart(self) -> bool:
        """Whether all markers are on bodies, so that the wrenches may balance."""
        return len(self.markers) > 1 and self.whole >= 0 and all(m.step is not None for m in self.markers)

    def along(self, s: Array | float) -> list[Place]:
        """Return positions and axes of the markers after a fraction s of the step from the middle."""
        return [
            (r + s * dr, rotation_exp(s * turn) @ A)
            for r, dr, turn, A in zip(self.r, self.dr, self.turn, self.A, strict=True)
        ]

    def inputs(self, t: float, places: list[Place], z: Array, lam: Array) -> Array:
        """Return the inputs of the law, (..., n_in)."""
        h, parts = self.span.h, [np.array([t])]
        for (r, A), dr, turn in zip(places, self.dr, self.turn, strict=True):
            parts += [r, A.reshape(*A.shape[:-2], 9), dr / h, turn / h]
        parts += [z, lam]
        shape = np.broadcast_shapes(*(part.shape[:-1] for part in parts))
        return np.concatenate([np.broadcast_to(part, (*shape, part.shape[-1])) for part in parts], axis=-1)

    def law(self, t: float, places: list[Place], z: Array, lam: Array) -> Array:
        """Return the results of the law, with derivatives along imaginary parts."""
        laws, i = self.model.laws, self.i
        inputs = self.inputs(t, places, z, lam)
        flat = inputs.reshape(-1, inputs.shape[-1])
        data = laws.data[laws.data0[i] : laws.data0[i + 1]]
        n, _, n_z, n_lam, n_seen = (int(each) for each in self.head[:5])

        def at(x: Array) -> Array:
            return called_law(int(laws.address[i]), tuple(map(int, self.head)), data, x, 6 * n + n_z + n_lam + n_seen)

        values = at(np.real(flat))
        if np.iscomplexobj(flat):
            size = np.abs(np.imag(flat) / self.sizes(np.real(flat))).max(axis=1, initial=0.0)
            moved = np.flatnonzero(size > 0)
            way = STEP * np.imag(flat[moved]) / size[moved, None]
            change = at(np.real(flat[moved]) + way) - at(np.real(flat[moved]) - way)
            values = values.astype(complex)
            values[moved] += 1j * change * (0.5 * size[moved] / STEP)[:, None]
        return values.reshape(*inputs.shape[:-1], -1)

    def sizes(self, inputs: Array) -> Array:
        """Return sizes of the inputs, (n, n_in), for differences; derivatives by time are not used."""
        laws, i = self.model.laws, self.i
        n, _, n_z, n_lam, _, n_data = (int(each) for each in self.head[:6])
        known = laws.data[laws.data0[i] + n_data : laws.data0[i + 1]]
        marker = np.repeat([known[0], 1.0, known[1], known[2]], [3, 9, 3, 3])
        own, here = known[len(known) - n_z - n_lam :], np.abs(inputs[:, inputs.shape[1] - n_z - n_lam :])
        unknowns = np.where(own > 0.0, own, np.maximum(here, LEAST_SIZE))
        places = np.concatenate([[1.0], *[marker] * n])
        return np.hstack([np.broadcast_to(places, (len(inputs), len(places))), unknowns])

    def wrenches(self, outputs: Array) -> Array:
        """Return the wrenches among the results of the law, (..., n, 6)."""
        n = len(self.markers)
        return outputs[..., : 6 * n].reshape(*outputs.shape[:-1], n, 6)


def axes(marker: MarkerStep, end: int) -> Array:
    """Return the axes of a marker at one end of the step, (..., 3, 3)."""
    return np.stack([marker.ends(e)[end] for e in np.eye(3)], axis=-1)


def way_turned(marker: MarkerStep, *, is_middle: bool) -> Array:
    """Return c, the Cayley vector of the rotation of a marker.

    At one configuration the rotation from its increments.
    """
    if not is_middle or marker.step is None:
        return marker.turning()
    Q = axes(marker, 1) @ np.swapaxes(axes(marker, 0), -1, -2)
    trace = Q[..., 0, 0] + Q[..., 1, 1] + Q[..., 2, 2]
    both = np.stack([Q[..., 2, 1] - Q[..., 1, 2], Q[..., 0, 2] - Q[..., 2, 0], Q[..., 1, 0] - Q[..., 0, 1]], axis=-1)
    return np.asarray(2 * both / (1 + trace)[..., None])


def half_turned(A: Array, c: Array) -> Array:
    """Return axes turned by half of the rotation with the Cayley vector c."""
    half: Array = c / (1 + np.sqrt(1 + 0.25 * dot(c, c)))[..., None]
    return cayley(half) @ A


def states_at(model: Model, c: int, span: Span, dz: Array, part: float) -> Array:
    """Return the states of element c after a part of their changes, (..., n_z)."""
    return np.asarray(span.w[list(state_rows(model, c))] + part * dz)


def element_load(
    model: Model, c: int, markers: list[MarkerStep], loads: list[Load | None], span: Span, dz: Array, lam: Array, *,
    is_middle: bool,
) -> tuple[Array, Array]:  # fmt: skip
    """Add the loads of element c.

    Return the work that it supplies and dissipates. dz: changes of states, (..., n_z).
    """
    motion = Motion(model, c, markers, span, is_middle=is_middle)
    z = states_at(model, c, span, dz, 0.5 if is_middle else 0.0)
    outputs = motion.law(span.t_force, motion.along(0.0), z, lam)
    wrenches = motion.wrenches(outputs)
    if is_middle:
        wrenches = wrenches + correction(motion, wrenches, z, lam)
    total = np.zeros(wrenches.shape[:-2], wrenches.dtype)
    for m, (marker, load) in enumerate(zip(markers, loads, strict=True)):
        F, M = wrenches[..., m, :3], wrenches[..., m, 3:]
        if model.markers.force[motion.first + m] >= 0:
            marker.add_force(load, F)
            total = total + dot(F, motion.dr[m])
        if model.markers.moment[motion.first + m] >= 0:
            add_axes_moment(marker, load, M)
            total = total + dot(M, motion.turn[m])
    return work_of_law(motion, outputs, total)


def work_of_law(motion: Motion, outputs: Array, on_bodies: Array) -> tuple[Array, Array]:
    """Return the supplied and dissipated work that a law declares, see kernels/connections/element_law.py."""
    laws, i, h = motion.model.laws, motion.i, motion.span.h
    n, _, n_z, n_lam = (int(each) for each in motion.head[:4])
    energy, given, lost = (int(each[i]) for each in (laws.energy, laws.given, laws.lost))
    seen = outputs[..., 6 * n + n_z + n_lam :]
    zero = np.zeros_like(on_bodies)
    W_given = h * seen[..., given] if given >= 0 else zero
    W_lost = h * seen[..., lost] if lost >= 0 else zero
    if energy >= 0 or (given >= 0 and lost >= 0):
        return W_given, W_lost
    if given < 0:
        return on_bodies + W_lost, W_lost
    return W_given, W_given - on_bodies


def add_axes_moment(marker: MarkerStep, load: Load | None, M: Array) -> None:
    """Add a moment with work M·c, c the Cayley vector of the rotation of the marker."""
    if marker.step is None or load is None:
        return
    load.torque += M
    if marker.Gamma is None:
        return
    E = 0.5 * (axes(marker, 0) + axes(marker, 1))
    S = E @ np.swapaxes(E, -1, -2)
    trace = S[..., 0, 0] + S[..., 1, 1] + S[..., 2, 2]
    inner = np.linalg.solve(0.5 * (trace[..., None, None] * np.eye(3) - S), M[..., None])[..., 0].astype(M.dtype)
    m = np.zeros_like(M)
    for j, e in enumerate(np.eye(3)):
        G = 0.5 * cross(inner, E[..., :, j])
        m = m + cross(marker.eps_mean(e), rotated(np.swapaxes(marker.step.R_m, -1, -2), G))
    marker.add_elastic(load, m)


def potential(motion: Motion, places: list[Place], z: Array, lam: Array) -> tuple[Array, Array]:
    """Return U for positions of the markers, and the wrenches there."""
    laws, rows = motion.model.laws, multiplier_rows(motion.model, motion.c)
    outputs = motion.law(motion.span.t_force, places, z, lam)
    n, _, n_z, n_lam = (int(each) for each in motion.head[:4])
    U = np.zeros(outputs.shape[:-1], outputs.dtype)
    if laws.energy[motion.i] >= 0:
        U = U + outputs[..., 6 * n + n_z + n_lam + int(laws.energy[motion.i])]
    for j, k in enumerate(rows):
        if motion.model.rows.holds[k] == POSITION:
            U = U - lam[..., j] * outputs[..., 6 * n + n_z + j]
    return U, motion.wrenches(outputs)


def has_potential(motion: Motion) -> bool:
    """Whether the law declares an energy or holds positions."""
    holds = motion.model.rows.holds[list(multiplier_rows(motion.model, motion.c))]
    return bool(motion.model.laws.energy[motion.i] >= 0 or (holds == POSITION).any())


def correction(motion: Motion, wrenches: Array, z: Array, lam: Array) -> Array:
    """Return the wrenches with the work delta, (..., n, 6)."""
    if not has_potential(motion):
        return np.zeros_like(wrenches)
    slope: Array | float = 0.0
    for p, factor in enumerate(FIRST):
        if factor != 0.0:
            slope = slope + factor / WAY * potential(motion, motion.along((p - 3) * WAY), z, lam)[0]
    U_0, at_0 = potential(motion, motion.ends[0], z, lam)
    U_1, at_1 = potential(motion, motion.ends[1], z, lam)
    middle = motion.along(0.0)
    found = (wrenches, middle), (at_0, motion.ends[0]), (at_1, motion.ends[1])
    if motion.is_apart and all(is_balanced(each, [r for r, _ in places]) for each, places in found):
        ways = ways_of_points(motion) if motion.between_points else ways_against_each_other(motion)
    else:
        ways = [
            (dr * motion.acts("force", m), motion.length**2 * turn * motion.acts("moment", m))
            for m, (dr, turn) in enumerate(zip(motion.dr, motion.turn, strict=True))
        ]
    works = [dot(F, dr) + dot(M, turn) for (F, M), dr, turn in zip(ways, motion.dr, motion.turn, strict=True)]
    size = np.asarray(sum(works))
    share = np.asarray((slope - (U_1 - U_0)) / (size + (LEAST * motion.length) ** 2))
    scaled = [np.broadcast_arrays(share[..., None] * F, share[..., None] * M) for F, M in ways]
    parts = [np.concatenate(each, axis=-1) for each in scaled]
    return np.stack(np.broadcast_arrays(*parts), axis=-2)


def is_balanced(wrenches: Array, r: list[Array]) -> bool:
    """Whether wrenches at given positions balance."""
    F, M = np.real(wrenches[..., :3]), np.real(wrenches[..., 3:])
    arms = [np.real(each - r[0]) for each in r]
    moment = M.sum(axis=-2) + sum(np.cross(arm, F[..., m, :]) for m, arm in enumerate(arms))
    sizes = np.linalg.norm(F, axis=-1)
    of_moments = np.linalg.norm(M, axis=-1).sum(axis=-1)
    of_moments = of_moments + sum(np.linalg.norm(arm, axis=-1) * sizes[..., m] for m, arm in enumerate(arms))
    force, moment = np.linalg.norm(F.sum(axis=-2), axis=-1), np.linalg.norm(moment, axis=-1)
    return bool((force <= BALANCED * sizes.sum(axis=-1)).all() and (moment <= BALANCED * of_moments).all())


def ways_of_points(motion: Motion) -> list[tuple[Array, Array]]:
    """Return forces between points, as large as the changes of their distances, and no moments.

    Two points in one place have no line, and no forces on each other.
    """
    n, least = len(motion.markers), (LEAST * motion.length) ** 2
    F: list[Array] = [np.zeros(3) for _ in range(n)]
    for b in range(n):
        for a in range(b):
            if motion.acts("force", a) and motion.acts("force", b):
                d = motion.r[b] - motion.r[a]
                square = dot(d, d)
                is_apart = np.real(square) > least
                share = dot(d, motion.dr[b] - motion.dr[a]) * is_apart / np.where(is_apart, square, 1.0)
                along = share[..., None] * d
                F[a], F[b] = F[a] - along, F[b] + along
    return [(each, np.zeros(3)) for each in F]


def ways_against_each_other(motion: Motion) -> list[tuple[Array, Array]]:
    """Return forces rho_k and moments L² (c_k - c_r), and their opposite on marker r."""
    n, r = len(motion.markers), motion.whole
    parts: list[tuple[Array, Array]] = [(np.zeros(3), np.zeros(3)) for _ in range(n)]
    F_r, M_r = np.zeros(3), np.zeros(3)
    for k in range(n):
        if k == r:
            continue
        d = motion.r[k] - motion.r[r]
        F = motion.acts("force", k) * (motion.dr[k] - motion.dr[r] - cross(motion.turn[r], d))
        M = motion.acts("moment", k) * motion.length**2 * (motion.turn[k] - motion.turn[r])
        F_r, M_r = F_r - F, M_r - M - cross(d, F)
        parts[k] = F, M
    parts[r] = F_r, M_r
    return parts


def element_rates(model: Model, c: int, markers: list[MarkerStep], span: Span, dz: Array, lam: Array) -> Array:
    """Return the rates of the states of element c in the middle of the step, (..., n_z)."""
    motion = Motion(model, c, markers, span, is_middle=True)
    outputs = motion.law(0.5 * (span.t_0 + span.t_1), motion.along(0.0), states_at(model, c, span, dz, 0.5), lam)
    n, n_z = len(markers), int(motion.head[2])
    return outputs[..., 6 * n : 6 * n + n_z]


def element_values(model: Model, c: int, markers: list[MarkerStep], span: Span, dz: Array, lam: Array) -> list[Array]:
    """Return the held quantities of the multipliers of element c: positions at the end of the step, others midway."""
    motion = Motion(model, c, markers, span, is_middle=True)
    first, n_lam = 6 * len(markers) + int(motion.head[2]), int(motion.head[3])
    t_m, z_m, z_1 = (0.5 * (span.t_0 + span.t_1), *(states_at(model, c, span, dz, part) for part in (0.5, 1.0)))
    middle = motion.law(t_m, motion.along(0.0), z_m, lam)[..., first : first + n_lam]
    end = motion.law(span.t_1, motion.ends[1], z_1, lam)[..., first : first + n_lam]
    values = []
    for j, k in enumerate(multiplier_rows(model, c)):
        holds = model.rows.holds[k]
        factor = span.h if holds == VELOCITY else 1.0
        values.append(end[..., j] if holds == POSITION else factor * middle[..., j])
    return values


# A disc that rolls without slip over a step, formulas: kernels/held_rows.py ------- ---------------------


def leanings(model: Model, k: int, pair: Pair) -> tuple[Array, ...]:
    """Return means of N and n, and c and s at both ends."""
    (N_0, N_1), (n_0, n_1) = pair[0].ends(model.rows.z[k]), pair[1].ends(model.rows.y[k])
    c_0, c_1 = dot(N_0, n_0), dot(N_1, n_1)
    return 0.5 * (N_0 + N_1), 0.5 * (n_0 + n_1), c_0, c_1, np.sqrt(1 - c_0 * c_0), np.sqrt(1 - c_1 * c_1)


def height_value(model: Model, k: int, pair: Pair) -> Array:
    """Return the height of the rim above the plane at the end of the step."""
    N_1, n_1 = pair[0].ends(model.rows.z[k])[1], pair[1].ends(model.rows.y[k])[1]
    c = dot(N_1, n_1)
    return dot(N_1, pair[1].x_1 - pair[0].x_1) - model.rows.c[k] * np.sqrt(1 - c * c)


def add_height_reaction(model: Model, k: int, pair: Pair, loads: Loads, f: Array) -> None:
    """Add the loads of the height with multiplier f, (...,)."""
    (a, b), z = pair, model.rows.z[k]
    N, n, c_0, c_1, s_0, s_1 = leanings(model, k, pair)
    g = f * model.rows.c[k] * (c_0 + c_1) / (s_0 + s_1)
    add_pair(pair, loads, f[..., None] * N)
    a.add_direction(loads[0], z, f[..., None] * (b.x_mean - a.x_mean) + g[..., None] * n)
    b.add_direction(loads[1], model.rows.y[k], g[..., None] * N)


def rim(model: Model, k: int, pair: Pair) -> tuple[Array, Array]:
    """Return the direction t and rho in the middle of the step."""
    N, n, *_ = leanings(model, k, pair)
    n = n / np.sqrt(dot(n, n))[..., None]
    u = N - dot(N, n)[..., None] * n
    t_0, t_1 = pair[0].ends(model.rows.x[k])
    return 0.5 * (t_0 + t_1), -model.rows.c[k] * u / np.sqrt(dot(u, u))[..., None]


def roll_value(model: Model, k: int, pair: Pair) -> Array:
    """Return the displacement of the rim along t over the step."""
    (a, b), (t, rho) = pair, rim(model, k, pair)
    d = b.x_mean - a.x_mean
    return dot(t, b.dx - a.dx + cross(b.turning(), rho) - cross(a.turning(), d + rho))


def add_roll_reaction(model: Model, k: int, pair: Pair, loads: Loads, f: Array) -> None:
    """Add the loads of a force f, (...,), along t at the rim."""
    (a, b), (t, rho) = pair, rim(model, k, pair)
    F = f[..., None] * t
    add_pair(pair, loads, F)
    b.add_moment(loads[1], cross(rho, F))
    a.add_moment(loads[0], -cross(b.x_mean - a.x_mean + rho, F))
