"""Bodies of decks of Nastran, and the assembler that stands beside them: bars with released ends and offsets."""

import numpy as np

from cms.jobs.body_of_job import coupled_body, uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages

E, NU, RHO = 2e11, 0.3, 7800.0
G = E / 2 / (1 + NU)
A, I1, I2, J = 2e-3, 3e-6, 1e-6, 2e-6
MATERIAL = "MAT1,1,2.+11,,.3,7800.\n"
SECTION = "PBAR,1,1,2.-3,3.-6,1.-6,2.-6\n"


def body_of(tmp_path, text, head="BEGIN BULK\n", *, is_coupled=False, **options):
    path = tmp_path / "model.bdf"
    path.write_text(f"{head}{text}\nENDDATA\n")
    deck = parse_deck(path)
    job = job_text(deck, DeckOptions("m-kg-s", {}, **options), path.name)
    path.with_suffix(".toml").write_text(job.replace("[body]", '[body]\naccept = ["parts"]'))
    made = read_job(path.with_suffix(".toml"))
    body = uncoupled_body(made, Stages())
    return coupled_body(made, body) if is_coupled else body, deck


def dofs_of(body, points):
    """Return the dofs of the six components of the nodes at these points, (6 n,)."""
    found = []
    for point in points:
        here = np.flatnonzero(np.linalg.norm(body.nodes - point, axis=1) < 1e-9)
        node = next(k for k in here if (body.dofs[:, 0] == k).sum() == 6)  # not the released end, which follows
        found += [int(np.flatnonzero((body.dofs == (node, c)).all(axis=1))[0]) for c in range(6)]
    return found


def bar_stiffness(length, area=A, i1=I1, i2=I2, j=J):
    """Return K of an Euler-Bernoulli bar in its own axes, (12, 12); i1 bends in the x-y plane."""
    K = np.zeros((12, 12))
    for pair, k in (((0, 6), E * area / length), ((3, 9), G * j / length)):
        K[np.ix_(pair, pair)] += k * np.array([[1, -1], [-1, 1]])
    a = length
    for dofs, sign, inertia in (((1, 5, 7, 11), 1, i1), ((2, 4, 8, 10), -1, i2)):
        s = sign
        K[np.ix_(dofs, dofs)] += E * inertia / a**3 * np.array(
            [[12, s * 6 * a, -12, s * 6 * a], [s * 6 * a, 4 * a * a, -s * 6 * a, 2 * a * a],
             [-12, -s * 6 * a, 12, -s * 6 * a], [s * 6 * a, 2 * a * a, -s * 6 * a, 4 * a * a]]
        )  # fmt: skip
    return K


def axes_of(x, v):
    x = x / np.linalg.norm(x)
    y = v - (v @ x) * x
    y = y / np.linalg.norm(y)
    return np.array([x, y, np.cross(x, y)])  # rows


def arm(r):
    """Return the motion of a point at r from a node by that of the node, (6, 6)."""
    T = np.eye(6)
    T[:3, 3:] = [[0, r[2], -r[1]], [-r[2], 0, r[0]], [r[1], -r[0], 0]]
    return T


def released(K, dofs):
    """Return K with released dofs condensed out, zero in their rows."""
    keep = [k for k in range(len(K)) if k not in dofs]
    out = np.zeros_like(K)
    out[np.ix_(keep, keep)] = K[np.ix_(keep, keep)] - K[np.ix_(keep, dofs)] @ np.linalg.solve(
        K[np.ix_(dofs, dofs)], K[np.ix_(dofs, keep)]
    )
    return out


GA, GB, V = np.array([0.1, 0.2, 0.3]), np.array([1.3, 0.9, 0.2]), np.array([0.2, 0.3, 1.0])
GRIDS = "".join(f"GRID,{k},,{','.join(map(str, p))}\n" for k, p in ((1, GA), (2, GB)))
ORIENTED = "CBAR,1,1,1,2," + ",".join(map(str, V))


def expected_bar(w_a=(0, 0, 0), w_b=(0, 0, 0), pins=()):
    """Return K of the bar at its grid points, (12, 12), basic axes."""
    w = np.array([w_a, w_b], dtype=float)
    R = axes_of(GB + w[1] - GA - w[0], V)
    T = np.kron(np.eye(4), R)
    K = bar_stiffness(np.linalg.norm(GB + w[1] - GA - w[0]))
    K = T.T @ (released(K, list(pins)) if pins else K) @ T
    arms = np.zeros((12, 12))
    arms[:6, :6], arms[6:, 6:] = arm(w[0]), arm(w[1])
    return arms.T @ K @ arms


def condensed(body, points):
    b = dofs_of(body, points)
    K = body.K.toarray()
    i = [k for k in range(len(K)) if k not in b]
    return K[np.ix_(b, b)] - K[np.ix_(b, i)] @ np.linalg.pinv(K[np.ix_(i, i)]) @ K[np.ix_(i, b)]


def tip_flexibility(body):
    """Return the motions of GB by loads there, (6, 6), along the axes of the bar; GA is held."""
    T = np.kron(np.eye(2), axes_of(GB - GA, V))
    return T @ np.linalg.inv(condensed(body, (GA, GB))[6:, 6:]) @ T.T


def added_matrices(tmp_path, text, further, points):
    """Return what further cards add to K and M of a deck, by the six components of the nodes at points."""
    parts = []
    for name, whole in (("with", text + further), ("without", text)):
        folder = tmp_path / name
        folder.mkdir(parents=True)
        body, _ = body_of(folder, whole, is_coupled=True)
        at = dofs_of(body, points)
        parts.append([matrix.toarray()[np.ix_(at, at)] for matrix in (body.K, body.M)])
    return [ours - theirs for ours, theirs in zip(*parts, strict=True)]


def arc_directions(phi, turn):
    """Return outward, along and across directions of an arc at an angle from its start, rows.

    turn: columns outward and along at the start, and across.
    """
    c, s = np.cos(phi), np.sin(phi)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ turn.T


def along_arc(piece, angle, n=60):
    """Return the integral of a function of the angle along an arc."""
    x, weights = np.polynomial.legendre.leggauss(n)
    return sum(w * piece(phi) for phi, w in zip((x + 1) * angle / 2, weights * angle / 2, strict=True))


def arc_flexibility(R, angle, turn, values, nu):
    """Return the motion of the end of an arc that is held at its start, by loads at its centroid, (6, 6).

    Timoshenko, Strength of Materials II: U = ∫ (M²/(2 A E e R) - M N/(A E R) + N²/(2 A E) + V²/(2 K G A)) ds with e =
    I1/(A R); N is tension and M decreases the curvature. Across the plane as in straight beams. values: A, I1, I2, J,
    both shear areas, E.
    """
    a, i1, i2, j, s1, s2, young = values
    shear = young / 2 / (1 + nu)
    e = i1 / (a * R)
    end = R * arc_directions(angle, turn)[0]

    def piece(phi):
        r, t, z = arc_directions(phi, turn)
        to_end = end - R * r
        N, V, W = (np.concatenate([axis, np.zeros(3)]) for axis in (t, r, z))
        twist, across, M = (np.concatenate([np.cross(axis, to_end), axis]) for axis in (t, r, z))
        M = -M  # about z it turns the end outward in, which increases the curvature
        U = np.outer(M, M) / (a * young * e * R) - (np.outer(M, N) + np.outer(N, M)) / (a * young * R)
        U = U + np.outer(N, N) / (a * young) + np.outer(V, V) / (s1 * shear) + np.outer(W, W) / (s2 * shear)
        return (U + np.outer(twist, twist) / (shear * j) + np.outer(across, across) / (young * i2)) * R

    return along_arc(piece, angle)
