"""Random legal decks of Abaqus and CalculiX beside an assembler of this file.

Two chains of Euler-Bernoulli beams (B33) of rectangles, circles and pipes with offsets and orientation nodes, masses,
springs and dashpots, equations and kinematic couplings, nodes with axes of their own, in a flat deck or in an instance
that is moved and turned (couplings of single components are refused there); with blanks, comments, small letters, sets
by GENERATE.
"""

from pathlib import Path

import numpy as np
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages
from tests.campaign.deck_bodies import Expected, words, wrong_body
from tests.campaign.verdict import ACCEPTED, REFUSED, WRONG, Verdict
from tests.cms.jobs.decks.nastran_bodies import NU, RHO, E, arm, axes_of, bar_stiffness

__all__ = ["AbaqusDeck", "body_case", "random_deck", "wrong_deck"]

PARTS = ((0, 1, 2), (0, 1, 2, 3, 4, 5), (3, 4, 5))  #: components of couplings, whole halves
SINGLE = ((0,), (1, 2), (0, 4), (2, 3, 5))


def torsion_of_rectangle(a: float, b: float) -> float:
    """Return J of a rectangle a by b by Saint-Venant's series."""
    long, short = max(a, b), min(a, b)
    k = np.arange(1, 200, 2)
    return (
        long
        * short**3
        / 3
        * (1 - 192 * short / (np.pi**5 * long) * np.sum(np.tanh(k * np.pi * long / 2 / short) / k**5))
    )


class AbaqusDeck:
    """The text of a deck, and what it says: K and D over six components of each node, equations, rigid pieces."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.program = str(rng.choice(["abaqus", "calculix"]))
        self.n = int(rng.integers(4, 7))
        self.first = int(rng.integers(2, self.n - 1))
        self.points = np.cumsum(rng.uniform(0.3, 1.2, (self.n, 3)) * rng.choice([-1, 1], (self.n, 3)), axis=0)
        self.points[self.first] = self.points[self.first - 1]
        self.points[self.first, 1] += (rng.random() < 0.5) * 0.2
        self.Q, self.t = np.eye(3), np.zeros(3)
        self.is_turned = bool(rng.random() < 0.5)  #: whether the whole is an instance, moved and turned
        self.K = np.zeros((6 * self.n, 6 * self.n))
        self.D = np.zeros_like(self.K)
        self.rows: list[np.ndarray] = []
        self.pieces: list[tuple[float, np.ndarray, np.ndarray]] = []  #: mass, place, inertia about it
        self.axes = [np.eye(3)] * self.n
        self.lines = ["*node, nset=ALL", *(f" {k},  {words(x)}" for k, x in enumerate(self.points, start=1))]
        self.extra = self.n  #: last number of a node

    def on_dofs(self, a: int, b: int) -> np.ndarray:
        return np.concatenate([6 * a + np.arange(6), 6 * b + np.arange(6)])

    def add_axes(self) -> None:
        for k in range(self.n):
            if self.rng.random() < 0.3:
                x, y = self.rng.uniform(-1, 1, (2, 3))
                self.axes[k] = axes_of(x, y)
                self.lines += [f"*NSET,NSET=T{k}", f"{k + 1}", f"*TRANSFORM, NSET=T{k}, TYPE=R", words([*x, *y])]

    def add_beam(self, number: int, a: int, b: int) -> None:
        rng = self.rng
        ends = self.points[[a, b]]
        n1 = rng.uniform(-1, 1, 3)
        kind = str(rng.choice(["RECT", "CIRC", "PIPE"]))
        offsets = rng.uniform(-0.4, 0.4, 2) if rng.random() < 0.4 else np.zeros(2)
        p, q = rng.uniform(0.05, 0.09), rng.uniform(0.02, 0.08)
        if kind == "RECT":
            size, data, A = np.array([p, q]), [p, q], p * q
            i1, i2, J = q * p**3 / 12, p * q**3 / 12, torsion_of_rectangle(p, q)
        elif kind == "CIRC":
            r = p if self.program == "abaqus" else p / 2
            size, data, A = np.array([2 * r, 2 * r]), [p, p] if self.program == "calculix" else [p], np.pi * r**2
            i1 = i2 = np.pi * r**4 / 4
            J = 2 * i1
        else:
            inner = p - q / 4
            size, data, A = np.array([2 * p, 2 * p]), [p, q / 4], np.pi * (p**2 - inner**2)
            i1 = i2 = np.pi * (p**4 - inner**4) / 4
            J = 2 * i1
        orients = self.program == "abaqus" and rng.random() < 0.3
        node = ""
        if orients:
            self.extra += 1
            self.lines += ["*NODE", f"{self.extra}, {words(ends[0] + n1)}"]
            node = f", {self.extra}"
        self.lines += [f"*ELEMENT, TYPE=B33, ELSET=E{number}", f"{number}, {a + 1}, {b + 1}{node}", "** beam"]
        keyword = str(
            rng.choice(["*BEAM SECTION", "*Beam  Section" if self.program == "calculix" else "*beam section"])
        )
        given = f"{keyword}, elset=E{number}, MATERIAL=Steel, SECTION={kind}"
        given += f", OFFSET1={float(offsets[0])!r}, OFFSET2={float(offsets[1])!r}" if offsets.any() else ""
        self.lines += [given, words(data)] + ([] if orients else [words(n1)])
        R = axes_of(ends[1] - ends[0], n1)
        shift = -(offsets * size) @ R[1:]
        length = float(np.linalg.norm(ends[1] - ends[0]))
        T = np.kron(np.eye(4), R) @ block_diag(arm(shift), arm(shift))
        at = self.on_dofs(a, b)
        self.K[np.ix_(at, at)] += T.T @ bar_stiffness(length, A, i1, i2, J) @ T
        mass = RHO * A * length
        across = np.eye(3) - np.outer(R[0], R[0])
        section = RHO * length * R.T @ np.diag([i1 + i2, i2, i1]) @ R  # about x; about y of z², about z of y²
        self.pieces.append((mass, ends.mean(axis=0) + shift, section + mass * length**2 / 12 * across))

    def add_mass(self, number: int, k: int) -> None:
        m = float(self.rng.uniform(1, 5))
        self.lines += [
            f"*ELEMENT, TYPE=MASS, ELSET=M{number}",
            f"{number}, {k + 1}",
            f"*MASS, ELSET=M{number}",
            f"{m!r}",
        ]
        self.pieces.append((m, self.points[k], np.zeros((3, 3))))

    def add_spring(self, number: int, a: int, b: int) -> None:
        """Between the chains: SPRING2 along a component whose forces balance, or SPRINGA between nodes apart."""
        rng = self.rng
        apart = self.points[b] - self.points[a]
        keyword = str(rng.choice(["SPRING", "DASHPOT"]))
        value = float(rng.uniform(1e3, 1e5))
        row = np.zeros(12)
        if apart.any() and rng.random() < 0.5:
            row[:3], row[6:9] = -apart / np.linalg.norm(apart), apart / np.linalg.norm(apart)
            kind, data = f"{keyword}A", ["", f"{value!r}"]
        elif (np.eye(3) == self.axes[a]).all() and (np.eye(3) == self.axes[b]).all():
            c = int(rng.choice([1, 3, 4, 5] if apart.any() else range(6)))
            row[c], row[6 + c] = -1.0, 1.0
            kind, data = f"{keyword}2", [f"{c + 1}, {c + 1}", f"{value!r}"]
        else:
            return
        self.lines += [f"*ELEMENT, TYPE={kind}, ELSET=S{number}", f"{number}, {a + 1}, {b + 1}"]
        self.lines += [f"*{keyword}, ELSET=S{number}", *data]
        at = self.on_dofs(a, b)
        (self.K if keyword == "SPRING" else self.D)[np.ix_(at, at)] += value * np.outer(row, row)

    def add_coupling(self, a: int, b: int) -> None:
        """Node b follows node a; or single components of it do, by equations along axes of the nodes."""
        rng = self.rng
        plain = all((np.eye(3) == self.axes[k]).all() for k in (a, b))
        motion = np.zeros((6, 6 * self.n))
        motion[:, 6 * b : 6 * b + 6] = np.eye(6)
        if rng.random() < 0.5:
            choices = PARTS + (SINGLE if plain and not self.is_turned else ())
            components = choices[int(rng.integers(len(choices)))]
            motion[:, 6 * a : 6 * a + 6] = -arm(self.points[b] - self.points[a])
            self.lines += ["*NSET, NSET=NB, GENERATE", f"{b + 1}, {b + 1}, 1", "*SURFACE, TYPE=NODE, NAME=SB", "NB, 1."]
            self.lines += ["*NSET, NSET=NA", f"{a + 1},", "*COUPLING, REF NODE=NA, SURFACE=SB, CONSTRAINT NAME=C"]
            self.lines += ["*KINEMATIC", *(f"{c + 1}, {c + 1}" for c in components)]
            self.rows = [motion[c] for c in components]
            return
        self.lines.append("*EQUATION")
        turn = np.kron(np.eye(2), self.axes[a])
        for c in sorted(rng.choice(6, int(rng.integers(1, 4)), replace=False).tolist()):
            scale = float(rng.uniform(0.5, 2))
            e = np.zeros(6)
            e[c - c % 3 : c - c % 3 + 3] = self.axes[b][c % 3]
            follows = -scale * turn @ (arm(self.points[b] - self.points[a]).T @ e)  # along the axes of node a
            terms = [(b + 1, c + 1, scale)]
            terms += [(a + 1, k + 1, float(value)) for k, value in enumerate(follows) if abs(value) > 1e-13]
            self.lines.append(f"{len(terms)}")
            for k in range(0, len(terms), 4):
                self.lines.append(", ".join(f"{node}, {j}, {value!r}" for node, j, value in terms[k : k + 4]))
            row = np.zeros(6 * self.n)
            row[6 * b : 6 * b + 6], row[6 * a : 6 * a + 6] = scale * e, turn.T @ follows
            self.rows.append(row)

    def finish(self) -> None:
        """Write the material, and an instance that is moved around the whole in some decks."""
        rng = self.rng
        material = ["*MATERIAL, NAME=STEEL", "*ELASTIC", f"{E!r}, {NU!r}", "*DENSITY", f"{RHO!r},"]
        if not self.is_turned:
            self.lines += material
            return
        shift, at, axis, angle = (
            rng.uniform(-2, 2, 3),
            rng.uniform(-1, 1, 3),
            rng.uniform(-1, 1, 3),
            rng.uniform(-170, 170),
        )
        self.Q = Rotation.from_rotvec(np.deg2rad(angle) * axis / np.linalg.norm(axis)).as_matrix()
        self.t = self.Q @ (shift - at) + at
        self.lines = [
            "*PART, NAME=P", *self.lines, "*END PART", "*ASSEMBLY, NAME=A", "*INSTANCE, NAME=P-1, PART=P", words(shift),
            words([*at, *(at + axis), angle]), "*END INSTANCE", "*END ASSEMBLY", *material,
        ]  # fmt: skip

    def expected(self) -> Expected:
        """Return what the assembler says, where the deck lies."""
        turn = np.kron(np.eye(2 * self.n), self.Q)
        M = np.zeros((6, 6))
        for mass, place, inertia in self.pieces:
            S = arm(self.Q @ place + self.t)[:3]
            M += mass * S.T @ S
            M[3:, 3:] += self.Q @ inertia @ self.Q.T
        rows = np.array(self.rows) @ turn.T if self.rows else np.zeros((0, 6 * self.n))
        return Expected(turn @ self.K @ turn.T, turn @ self.D @ turn.T, rows, M)


def random_deck(seed: int) -> AbaqusDeck:
    """Return the deck of a seed."""
    deck = AbaqusDeck(np.random.default_rng([13, seed]))
    deck.add_axes()
    for k in range(deck.n - 1):
        if k + 1 != deck.first:
            deck.add_beam(10 + k, k, k + 1)
    for k in range(int(deck.rng.integers(0, 3))):
        deck.add_mass(30 + k, int(deck.rng.integers(deck.n)))
    if deck.rng.random() < 0.7:
        deck.add_spring(40, deck.first - 1, deck.first)
    if deck.rng.random() < 0.7:
        deck.add_coupling(deck.first - 1, deck.first)
    deck.finish()
    return deck


def wrong_deck(deck: AbaqusDeck, folder: Path) -> str:
    """Return what of the body differs from the assembler; empty: nothing."""
    path = folder / "model.inp"
    path.write_text("\n".join(deck.lines) + "\n")
    job = job_text(parse_deck(path, program=deck.program), DeckOptions("m-kg-s", {}), path.name)
    path.with_suffix(".toml").write_text(job.replace("[body]", '[body]\naccept = ["parts"]'))
    body = uncoupled_body(read_job(path.with_suffix(".toml")), Stages())
    numbers = body.numbering.nodes[: len(body.nodes)]
    nodes = [int(np.flatnonzero(numbers == k + 1)[0]) for k in range(deck.n)]
    return wrong_body(body, nodes, deck.expected())


def body_case(seed: int, folder: Path) -> Verdict:
    """Compare the body of one random deck with the assembler."""
    try:
        reason = wrong_deck(random_deck(seed), folder)
    except ValueError as error:
        return Verdict(REFUSED, str(error)[:600])
    return Verdict(WRONG if reason else ACCEPTED, reason or "compared")
