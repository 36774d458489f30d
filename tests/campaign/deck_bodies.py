"""Random legal decks of Nastran beside an assembler of this file.

Two chains of bars and curved beams: axes of their own at points (CD), offsets along them, released ends, no torsion, a
product of inertia, added mass, point masses off their points, a bush, springs and dampers, and a rigid link or a mean
in some components.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import block_diag

from fe_models.body.fe_body import FEBody
from tests.campaign.verdict import ACCEPTED, REFUSED, WRONG, Verdict
from tests.cms.jobs.decks.nastran_bodies import (
    RHO,
    A,
    E,
    J,
    along_arc,
    arc_directions,
    arc_flexibility,
    arm,
    axes_of,
    bar_stiffness,
    body_of,
    released,
)

__all__ = ["Expected", "body_case", "wrong_body"]

PINS = (("", ""), ("", "56"), ("45", "6"), ("5", ""), ("", "3"), ("6", "2"), ("1", ""), ("", "12"))
LINKS = ("123456", "123", "13", "246", "2", "456", "1256")
ROUNDING = 1e-8  #: of the largest entry of a matrix: condensation of released ends loses digits


class RandomDeck:
    """The text of a deck, and what it says: K over six components of each grid point, links, rigid mass."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.n = int(rng.integers(4, 7))
        self.first = int(rng.integers(2, self.n - 1))  #: points of the first chain
        self.points = np.cumsum(rng.uniform(0.3, 1.2, (self.n, 3)) * rng.choice([-1, 1], (self.n, 3)), axis=0)
        self.points[self.first] = self.points[self.first - 1] + (rng.random() < 0.5) * rng.uniform(-0.3, 0.3, 3)
        self.lines = ["CORD2R,7,,.1,.2,.3,.3,.4,1.", ",1.,.1,.4", "CORD2C,8,,-9.,7.,.3,-8.7,7.1,1.", ",1.,.1,.4"]
        self.systems = rng.choice([0, 0, 7, 8], self.n)
        self.K = np.zeros((6 * self.n, 6 * self.n))
        self.D = np.zeros_like(self.K)
        self.rows: list[np.ndarray] = []
        self.M = np.zeros((6, 6))  #: of the rigid motions about the origin
        self.wtmass = float(rng.choice([1.0, 0.5]))
        for k, (point, system) in enumerate(zip(self.points, self.systems, strict=True), start=1):
            self.lines.append(f"GRID,{k},,{words(point)},{system or ''}")
        self.axes = [self.axes_at(k) for k in range(self.n)]

    def axes_at(self, k: int) -> np.ndarray:
        """Return the displacement axes of a point, rows."""
        if not self.systems[k]:
            return np.eye(3)
        origin = np.array([0.1, 0.2, 0.3]) if self.systems[k] == 7 else np.array([-9.0, 7.0, 0.3])
        z = (np.array([0.3, 0.4, 1.0]) if self.systems[k] == 7 else np.array([-8.7, 7.1, 1.0])) - origin
        x = np.array([1.0, 0.1, 0.4]) - origin
        R = axes_of(z, x)[[1, 2, 0]]  # x towards the point, z along the axis
        if self.systems[k] == 7:
            return R
        local = R @ (self.points[k] - origin)
        c, s = local[:2] / np.hypot(*local[:2])
        return np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ R

    def on_dofs(self, nodes: tuple[int, ...]) -> np.ndarray:
        return np.concatenate([6 * node + np.arange(6) for node in nodes])

    def add_bar(self, number: int, a: int, b: int) -> None:
        rng = self.rng
        W = np.zeros((2, 3)) if rng.random() < 0.5 else rng.uniform(-0.1, 0.1, (2, 3))
        if rng.random() < 0.3:
            W[1] = W[0]
        v = rng.uniform(-1, 1, 3)
        pins = PINS[int(rng.integers(len(PINS)))] if rng.random() < 0.5 else ("", "")
        i1, i2, i12 = 3e-6, 1e-6, float(rng.choice([0.0, 0.9e-6, -1.2e-6]))
        added = float(rng.choice([0.0, 2.5]))
        j = 0.0 if "4" not in pins[0] + pins[1] and rng.random() < 0.2 else J
        self.lines.append(f"CBAR,{number},{number},{a + 1},{b + 1},{words(v)}")
        self.lines.append(f",{pins[0]},{pins[1]},{words(W[0])},{words(W[1])}")
        self.lines += [f"PBAR,{number},1,{A!r},{i1!r},{i2!r},{j!r},{added!r}", ",,,,,,,,", f",,,{i12!r}"]
        ends = np.array([self.points[a] + self.axes[a].T @ W[0], self.points[b] + self.axes[b].T @ W[1]])
        length = float(np.linalg.norm(ends[1] - ends[0]))
        R = axes_of(ends[1] - ends[0], self.axes[a].T @ v)
        angle = 0.5 * np.arctan2(2 * i12, i1 - i2)
        mean, radius = (i1 + i2) / 2, np.hypot((i1 - i2) / 2, i12)
        c, s = np.cos(angle), np.sin(angle)
        turn = np.kron(np.eye(4), np.array([[1, 0, 0], [0, c, s], [0, -s, c]]))
        K = turn.T @ bar_stiffness(length, A, mean + radius if i12 else i1, mean - radius if i12 else i2, j) @ turn
        free = [int(letter) - 1 for letter in pins[0]] + [5 + int(letter) for letter in pins[1]]
        K = released(K, free) if free else K
        T = np.kron(np.eye(4), R) @ block_diag(arm(ends[0] - self.points[a]), arm(ends[1] - self.points[b]))
        at = self.on_dofs((a, b))
        self.K[np.ix_(at, at)] += T.T @ K @ T
        line = (RHO * A + added) * self.wtmass
        for x, weight in zip(*np.polynomial.legendre.leggauss(3), strict=True):
            S = arm((ends[0] + ends[1]) / 2 + x / 2 * (ends[1] - ends[0]))[:3]
            self.M += weight * length / 2 * line * S.T @ S
        self.M[3:, 3:] += RHO * self.wtmass * (i1 + i2) * length * np.outer(R[0], R[0])

    def add_bend(self, number: int, a: int, b: int) -> None:
        """Add a CBEND of given radius, with its centroids beside the grid points."""
        rng = self.rng
        chord = self.points[b] - self.points[a]
        v, along = rng.uniform(-1, 1, 3), chord / np.linalg.norm(chord)
        RC, ZC = rng.uniform(-0.05, 0.05, 2) * (rng.random() < 0.5)
        radius = float(np.linalg.norm(chord) * rng.uniform(0.55, 2.0))
        half = float(np.arcsin(np.linalg.norm(chord) / 2 / radius))
        R, added = radius + RC, float(rng.choice([0.0, 2.5]))
        self.lines.append(f"CBEND,{number},{number},{a + 1},{b + 1},{words(v)},3")
        self.lines += [
            f"PBEND,{number},1,{A!r},3.-6,1.-6,{J!r},{float(R)!r}",
            ",,,,,,,,",
            f",.8,.7,{added!r},{words((RC, ZC))}",
        ]
        outward = self.axes[a].T @ v
        outward = outward - (outward @ along) * along
        outward = outward / np.linalg.norm(outward)
        across = np.cross(outward, along)
        center = (self.points[a] + self.points[b]) / 2 - radius * np.cos(half) * outward
        start = (self.points[a] - center) / radius
        turn = np.column_stack([start, np.cross(across, start), across])
        ends = [center + R * arc_directions(phi, turn)[0] + ZC * across for phi in (0.0, 2 * half)]
        K = np.linalg.inv(arc_flexibility(R, 2 * half, turn, (A, 3e-6, 1e-6, J, 0.8 * A, 0.7 * A, E), 0.3))
        B = np.hstack([-arm(ends[1] - ends[0]), np.eye(6)])
        B = B @ block_diag(arm(ends[0] - self.points[a]), arm(ends[1] - self.points[b]))
        at = self.on_dofs((a, b))
        self.K[np.ix_(at, at)] += B.T @ K @ B

        def piece(phi: float) -> np.ndarray:
            S = arm(center + R * arc_directions(phi, turn)[0] + ZC * across)[:3]
            return (RHO * A + added) * self.wtmass * R * S.T @ S

        self.M += along_arc(piece, 2 * half)

    def add_mass(self, number: int, k: int) -> None:
        rng = self.rng
        cid = int(rng.choice([0, 7]))
        R = np.eye(3)
        if cid:
            z, x = np.array([0.2, 0.2, 0.7]), np.array([0.9, -0.1, 0.1])
            R = axes_of(z, x)[[1, 2, 0]]
        offset, spread = rng.uniform(-0.3, 0.3, 3), rng.uniform(-1, 1, (3, 3))
        inertia = spread @ spread.T + np.eye(3) * np.trace(spread @ spread.T)
        m = float(rng.uniform(1, 5))
        C = inertia * np.where(np.eye(3), 1, -1)  # cards have the products with the other sign
        self.lines.append(f"CONM2,{number},{k + 1},{cid},{m!r},{words(offset)},")
        self.lines.append("," + words([C[0, 0], C[1, 0], C[1, 1], C[2, 0], C[2, 1], C[2, 2]]))
        S = arm(self.points[k] + R.T @ offset)[:3]
        self.M += self.wtmass * m * S.T @ S
        self.M[3:, 3:] += self.wtmass * R.T @ inertia @ R

    def add_spring(self, number: int, a: int, b: int) -> None:
        """CELAS and CDAMP along axis c of two points of the same axes at one place; a bush else."""
        rng = self.rng
        value = float(rng.uniform(1e3, 1e5))
        at = self.on_dofs((a, b))
        apart = self.points[b] - self.points[a]
        if np.any(apart) or self.systems[a] != self.systems[b]:
            six = rng.uniform(1e3, 1e5, 6)
            self.lines += [f"CBUSH,{number},{number},{a + 1},{b + 1},,,,7", f"PBUSH,{number},K,{words(six)}"]
            z, x = np.array([0.2, 0.2, 0.7]), np.array([0.9, -0.1, 0.1])
            R = axes_of(z, x)[[1, 2, 0]]
            middle = np.hstack([-arm(apart / 2), arm(-apart / 2)])
            B = np.kron(np.eye(2), R) @ middle
            self.K[np.ix_(at, at)] += B.T @ np.diag(six) @ B
            return
        c = int(rng.integers(6))
        row = np.zeros(12)
        row[c - c % 3 : c - c % 3 + 3] = -self.axes[a][c % 3]
        row[6 + c - c % 3 : 9 + c - c % 3] = self.axes[a][c % 3]
        is_damper = rng.random() < 0.5
        self.lines.append(f"{'CDAMP2' if is_damper else 'CELAS2'},{number},{value!r},{a + 1},{c + 1},{b + 1},{c + 1}")
        (self.D if is_damper else self.K)[np.ix_(at, at)] += value * np.outer(row, row)

    def add_link(self, number: int, a: int, b: int) -> None:
        components = LINKS[int(self.rng.integers(len(LINKS)))]
        if self.rng.random() > 0.6:
            self.add_mean(number, b, components)
            return
        self.lines.append(f"RBE2,{number},{a + 1},{components},{b + 1}")
        r = self.points[b] - self.points[a]
        motion = np.zeros((6, 6 * self.n))
        motion[:, self.on_dofs((b,))], motion[:, self.on_dofs((a,))] = np.eye(6), -arm(r)
        turned = np.kron(np.eye(2), self.axes[b]) @ motion
        self.rows = [turned[int(letter) - 1] for letter in components]

    def add_mean(self, number: int, b: int, components: str) -> None:
        """RBE3: components of a point, along its axes, follow weighted components of the points before it."""
        members = range(b)
        some = [("1245", "1356", "123456", "2346")[int(self.rng.integers(4))] for _ in members]
        some[0] = "123456"  # alone it determines every motion
        weights = self.rng.uniform(0.5, 3.0, b)
        self.lines.append(f"RBE3,{number},,{b + 1},{components}")
        for k in members:
            self.lines.append(f",{float(weights[k])!r},{some[k]},{k + 1},,,,,")
        arms = [self.points[k] - self.points[b] for k in members]
        length = np.mean([np.linalg.norm(each) for each in arms]) or 1.0
        G, along = np.zeros((6 * b, 6)), np.zeros((6 * b, 6 * self.n))
        for k in members:
            at = slice(6 * k, 6 * k + 6)
            along[at, at] = np.kron(np.eye(2), self.axes[k])
            weight = [weights[k] * (str(c + 1) in some[k]) for c in range(6)] * np.repeat([1.0, length**2], 3)
            G[at] = np.sqrt(weight)[:, None] * (along[at, at] @ arm(arms[k]))
            along[at] *= np.sqrt(weight)[:, None]
        motion = -np.linalg.lstsq(G, along, rcond=None)[0]
        motion[:, self.on_dofs((b,))] += np.eye(6)
        turned = np.kron(np.eye(2), self.axes[b]) @ motion
        self.rows = [turned[int(letter) - 1] for letter in components]


def words(values) -> str:
    return ",".join(repr(float(value)) for value in values)


def random_deck(seed: int) -> RandomDeck:
    rng = np.random.default_rng([12, seed])
    deck = RandomDeck(rng)
    for k in range(deck.n - 1):
        if k + 1 != deck.first:
            (deck.add_bend if rng.random() < 0.25 else deck.add_bar)(10 + k, k, k + 1)
    for k in range(int(rng.integers(0, 3))):
        deck.add_mass(30 + k, int(rng.integers(deck.n)))
    if deck.first - 1 >= 0 and rng.random() < 0.7:
        deck.add_spring(40, deck.first - 1, deck.first)
    if rng.random() < 0.7:
        deck.add_link(50, deck.first - 1, deck.first)
    deck.lines += [f"MAT1,1,{E!r},,.3,{RHO!r}", "PARAM,COUPMASS,1", f"PARAM,WTMASS,{deck.wtmass!r}"]
    return deck


def wrong_deck(deck: RandomDeck, folder: Path) -> str:
    """Return what of the body differs from the assembler; empty: nothing."""
    body, _ = body_of(folder, "\n".join(deck.lines) + "\n")
    numbers = body.numbering.nodes
    nodes = [int(np.flatnonzero(numbers[: len(body.nodes)] == k + 1)[0]) for k in range(deck.n)]
    return wrong_body(body, nodes, Expected(deck.K, deck.D, np.array(deck.rows), deck.M))


@dataclass(frozen=True, eq=False)
class Expected:
    """What the assembler says of n points."""

    K: np.ndarray  #: over six components of each point
    D: np.ndarray
    rows: np.ndarray  #: equations between these components, which are zero
    M: np.ndarray  #: of the rigid motions about the origin, (6, 6)


def wrong_body(body: FEBody, nodes: list[int], expected: Expected) -> str:
    """Return what of a body differs from the assembler; empty: nothing.

    Parameters
    ----------
    nodes
        Node of the body at each point. Other dofs, such as those of released ends, are condensed.
    """
    place = {(int(node), int(c)): k for k, (node, c) in enumerate(body.recovery.dofs)}
    T = body.recovery.matrix.toarray()
    n = len(nodes)
    if any((node, 0) not in place for node in nodes):
        return "a point is lost"
    full = np.array([T[place[node, c]] for node in nodes for c in range(6)])
    of_points = np.flatnonzero(np.abs(full).sum(axis=0))
    own = np.setdiff1d(np.arange(body.n_dof), of_points)
    full = full[:, of_points]
    n_rows = len(expected.rows)
    if n_rows and np.abs(expected.rows @ full).max() > ROUNDING:
        return "the link is not kept"
    if np.linalg.matrix_rank(full) != 6 * n - n_rows or full.shape[1] != 6 * n - n_rows:
        return f"{full.shape[1]} motions of the points, expected {6 * n - n_rows}"
    for name, ours, theirs in (("K", body.K, expected.K), ("D", body.D, expected.D)):
        B = np.zeros((body.n_dof, body.n_dof)) if ours is None else ours.toarray()
        inner = B[np.ix_(own, own)]
        B = (
            B[np.ix_(of_points, of_points)]
            - B[np.ix_(of_points, own)] @ np.linalg.pinv(inner, rcond=1e-11) @ B[np.ix_(own, of_points)]
        )
        scale = max(np.abs(theirs).max(), 1e-9)  # not of what a link leaves of it, which may be nothing
        difference = np.abs(B - full.T @ theirs @ full).max() / scale
        if difference > ROUNDING:
            return f"{name} differs by {difference:.2g}"
    rigid = np.zeros((body.n_dof, 6))
    for k, (node, c) in enumerate(body.dofs):
        rigid[k] = arm(body.nodes[node])[c]
    difference = np.abs(rigid.T @ body.M @ rigid - expected.M).max() / np.abs(expected.M).max()
    return f"the rigid mass differs by {difference:.2g}" if difference > ROUNDING else ""


def body_case(seed: int, folder: Path) -> Verdict:
    """Compare the body of one random deck with the assembler."""
    try:
        reason = wrong_deck(random_deck(seed), folder)
    except ValueError as error:
        return Verdict(REFUSED, str(error)[:600])
    return Verdict(WRONG if reason else ACCEPTED, reason or "compared")
