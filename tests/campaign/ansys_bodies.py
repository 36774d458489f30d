"""Random legal .cdb files of ANSYS beside an assembler of this file.

A block of straight cells of SOLID185 (bricks with incompatible modes, wedges, pyramids, tetrahedra), of curved bricks
(SOLID186, reduced or full) or of tetrahedra (SOLID187, or SOLID186 with equal nodes), some of them left out, of
isotropic and orthotropic materials by major or minor ratios, blank constants, tables over temperature, element types
by number or name, gaps in numbers, several widths of fields, two EBLOCKs.
"""

from itertools import product
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages
from tests.campaign.verdict import ACCEPTED, REFUSED, WRONG, Verdict

__all__ = ["AnsysDeck", "body_case", "random_deck", "wrong_deck"]

CORNERS = np.array([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)])
EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
MIDDLES = np.array([(CORNERS[a] + CORNERS[b]) / 2 for a, b in EDGES])
TET_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
#: five tetrahedra of a brick do not fit their neighbours; six along its diagonal do
TETS = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
ROUNDING = 1e-9  #: of the largest entry


def brick_shapes(x: np.ndarray) -> np.ndarray:
    """Return the twenty functions of a serendipity brick at a point."""
    t = 1 + CORNERS * x
    corners = t.prod(axis=1) * ((CORNERS * x).sum(axis=1) - 2) / 8
    middles = np.prod(np.where(MIDDLES == 0, 1 - x**2, 1 + MIDDLES * x), axis=1) / 4
    return np.concatenate([corners, middles])


def tet_shapes(x: np.ndarray) -> np.ndarray:
    """Return the ten functions of a quadratic tetrahedron at a point."""
    L = np.array([1 - x.sum(), *x])
    return np.concatenate([L * (2 * L - 1), [4 * L[a] * L[b] for a, b in TET_EDGES]])


def gradients(shapes, x: np.ndarray) -> np.ndarray:
    """Return the gradients of polynomial shape functions by complex steps, exact to rounding, (n, 3)."""
    return np.array([shapes(x + 1e-30j * e).imag / 1e-30 for e in np.eye(3)]).T


def gauss(n: int) -> list[tuple[np.ndarray, float]]:
    p, w = np.polynomial.legendre.leggauss(n)
    return [(p[list(k)], float(np.prod(w[list(k)]))) for k in product(range(n), repeat=3)]


def irons() -> list[tuple[np.ndarray, float]]:
    """Return Irons' rule of 14 points, exact to degree five on the cube [-1, 1]³."""
    a, b = np.sqrt(19 / 30), np.sqrt(19 / 33)
    return [(s * a * e, 320 / 361) for e in np.eye(3) for s in (-1, 1)] + [(b * c, 121 / 361) for c in CORNERS]


def tet_rule(n: int) -> list[tuple[np.ndarray, float]]:
    """Return a rule on the unit tetrahedron by collapsing a cube, n points along each edge."""
    found = []
    for x, w in gauss(n):
        u, v, s = (x + 1) / 2
        found.append((np.array([u, v * (1 - u), s * (1 - u) * (1 - v)]), w / 8 * (1 - u) ** 2 * (1 - v)))
    return found


NEAR = (5 - np.sqrt(5)) / 20
FOUR = [(np.where(np.arange(3) == k, 1 - 3 * NEAR, NEAR), 1 / 24) for k in range(4)]  #: exact to degree two


def matrices(shapes, nodes, C, rho, stiff, massive):
    """Return K and M of an element, dofs node-major."""
    n = len(nodes)
    K, M = np.zeros((3 * n, 3 * n)), np.zeros((3 * n, 3 * n))
    for x, w in stiff:
        dN = gradients(shapes, x)
        J = nodes.T @ dN
        g = dN @ np.linalg.inv(J)
        B = np.zeros((6, 3 * n))
        for k, (p, q) in enumerate(((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))):
            B[k, p::3] += g[:, q]
            if p != q:
                B[k, q::3] += g[:, p]
        K += w * np.linalg.det(J) * B.T @ C @ B
    for x, w in massive:
        N = np.kron(shapes(x), np.eye(3))
        M += w * np.linalg.det(nodes.T @ gradients(shapes, x)) * rho * N.T @ N
    return K, M


def linear_shapes(n: int):
    """Return the functions of a brick (8 nodes), a wedge (6), a pyramid (5) or a tetrahedron (4) of first order.

    Those of a pyramid are those of a brick whose last four nodes are one, as SOLID185 has them.
    """

    def shapes(x: np.ndarray) -> np.ndarray:
        if n in (5, 8):
            brick = (1 + CORNERS * x).prod(axis=1) / 8
            return brick if n == 8 else np.append(brick[:4], brick[4:].sum())
        L = np.array([1 - x[0] - x[1], x[0], x[1]])
        return np.array([*(L * (1 - x[2]) / 2), *(L * (1 + x[2]) / 2)]) if n == 6 else np.array([1 - x.sum(), *x])

    return shapes


def linear_rule(n: int) -> list[tuple[np.ndarray, float]]:
    """Return a rule that is exact on straight cells with parallel faces."""
    if n == 6:  # a collapsed square times a line
        return [
            (np.array([(1 + x[0]) / 2, (1 + x[1]) / 2 * (1 - x[0]) / 2, x[2]]), w / 4 * (1 - x[0]) / 2)
            for x, w in gauss(3)
        ]
    return gauss({8: 2, 5: 4}[n]) if n in (5, 8) else tet_rule(3)


def with_modes(nodes: np.ndarray, C: np.ndarray) -> np.ndarray:
    """Return K of a brick with parallel faces and the modes 1 - x², 1 - y², 1 - z², condensed (Wilson)."""
    J = nodes.T @ gradients(linear_shapes(8), np.zeros(3))
    K = np.zeros((33, 33))
    for x, w in gauss(2):
        g = np.vstack([gradients(linear_shapes(8), x), -2 * np.diag(x)]) @ np.linalg.inv(J)
        B = np.zeros((6, 33))
        for k, (p, q) in enumerate(((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))):
            B[k, p::3] += g[:, q]
            if p != q:
                B[k, q::3] += g[:, p]
        K += w * np.linalg.det(J) * B.T @ C @ B
    return K[:24, :24] - K[:24, 24:] @ np.linalg.solve(K[24:, 24:], K[24:, :24])


#: SOLID185: nodes of a cell -> the cells that a brick is cut into, by its corners and its centre
PYRAMIDS = [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (3, 2, 6, 7), (0, 3, 7, 4), (1, 5, 6, 2)]
CUTS = {
    8: [tuple(range(8))],
    5: [(*base, 8) for base in PYRAMIDS],
    6: [(0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)],
    4: TETS,
}


class AnsysDeck:
    """The text of a file, and K and M over three components of each node."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.is_brick = bool(rng.random() < 0.5)
        self.counts = rng.integers(1, 3, 3)
        self.is_full = bool(self.is_brick and rng.random() < 0.4)
        self.kind = 186 if self.is_brick or rng.random() < 0.5 else 187
        self.corners = 0
        if rng.random() < 0.35:
            self.kind, self.corners, self.is_full = 185, int(rng.choice([8, 6, 5, 4])), False
        self.nodes: list[np.ndarray] = []
        self.place: dict[tuple[float, ...], int] = {}
        self.elements: list[tuple[int, list[int]]] = []  #: material, nodes
        self.Q = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
        self.bend = np.zeros(3) if self.corners else rng.uniform(-0.08, 0.08, 3)
        self.Q = self.Q @ (np.eye(3) + (self.corners > 0) * rng.uniform(-0.2, 0.2, (3, 3)))
        cells = list(product(*(range(n) for n in self.counts)))
        kept = [cell for cell in cells if rng.random() < 0.8] or cells[:1]
        for cell in kept:
            corners = (CORNERS + 1) / 2 + cell
            pieces = [corners] if self.is_brick else [corners[list(tet)] for tet in TETS]
            edges = EDGES if self.is_brick else TET_EDGES
            if self.corners:
                points = np.vstack([corners, corners.mean(axis=0)])
                pieces, edges = [points[list(cut)] for cut in CUTS[self.corners]], []
            for piece in pieces:
                all_points = [*piece, *((piece[a] + piece[b]) / 2 for a, b in edges)]
                self.elements.append((int(rng.integers(1, 3)), [self.node(x) for x in all_points]))
        self.X = np.array(self.nodes)
        # straight edges, where a rule of degree four is exact
        for _, nodes in [] if self.is_brick or self.corners else self.elements:
            for (a, b), middle in zip(TET_EDGES, nodes[4:], strict=True):
                self.X[middle] = (self.X[nodes[a]] + self.X[nodes[b]]) / 2
        self.numbers = np.sort(rng.choice(np.arange(1, 5 * len(self.X)), len(self.X), replace=False))
        self.materials = {number: self.material(number) for number in (1, 2)}
        self.K = np.zeros((3 * len(self.X),) * 2)
        self.M = np.zeros_like(self.K)
        shapes = brick_shapes if self.is_brick else tet_shapes
        stiff = gauss(3 if self.is_full else 2) if self.is_brick else FOUR
        massive = irons() if self.is_brick else tet_rule(4)
        if self.corners:
            shapes, stiff, massive = linear_shapes(self.corners), *2 * [linear_rule(self.corners)]
        for material, nodes in self.elements:
            _, C, rho = self.materials[material]
            K, M = matrices(shapes, self.X[nodes], C, rho, stiff, massive)
            K = with_modes(self.X[nodes], C) if self.corners == 8 else K
            at = (3 * np.array(nodes)[:, None] + np.arange(3)).ravel()
            self.K[np.ix_(at, at)] += K
            self.M[np.ix_(at, at)] += M

    def node(self, x: np.ndarray) -> int:
        """Return the number of a node of the block, bent and turned."""
        key = tuple(np.round(x, 6).tolist())
        if key not in self.place:
            self.place[key] = len(self.nodes)
            bent = x + self.bend * x[[1, 2, 0]] ** 2
            self.nodes.append(self.Q @ bent + [0.3, -2.0, 1.0])
        return self.place[key]

    def material(self, number: int) -> tuple[list[str], np.ndarray, float]:
        """Return commands, elasticity (11 22 33 23 13 12) and density."""
        rng = self.rng
        rho = float(rng.uniform(2000, 8000))
        E = float(rng.uniform(5e10, 2e11))
        values: dict[str, float] = {"EX": E, "DENS": rho}
        ratio = float(rng.uniform(0.05, 0.2))
        word = str(rng.choice(["PRXY", "NUXY", ""]))
        nu, young = np.full(3, ratio if word else 0.3), np.full(3, E)  # of xy, xz, yz, major
        if word:
            values[word] = ratio
        G = None
        if rng.random() < 0.5:
            young = np.array([E, E * rng.uniform(0.5, 1), E * rng.uniform(0.5, 1)])
            values |= {"EY": float(young[1]), "EZ": float(young[2])}
            of = {"XY": (0, 1), "XZ": (0, 2), "YZ": (1, 2)}
            if word == "NUXY":
                nu[0] = ratio * young[0] / young[1]
            nu[1:] = nu[0]
            for k, (pair, (a, b)) in enumerate(of.items()):
                if k and rng.random() < 0.5:
                    is_minor = rng.random() < 0.5
                    given = float(rng.uniform(0.05, 0.2))
                    values[f"{'NU' if is_minor else 'PR'}{pair}"] = given
                    nu[k] = given * young[a] / young[b] if is_minor else given
            G = np.array([young[a] / (2 * (1 + nu[k])) for k, (a, b) in enumerate(of.values())])
            for k, pair in enumerate(of):
                if rng.random() < 0.5:
                    G[k] = float(rng.uniform(1e10, 4e10))
                    values[f"G{pair}"] = float(G[k])
        S = np.diag([*1 / young, 0, 0, 0])
        for k, (a, b) in enumerate(((0, 1), (0, 2), (1, 2))):
            S[a, b] = S[b, a] = -nu[k] / young[a]
        shear = np.full(3, E / (2 * (1 + nu[0]))) if G is None else G
        S[[3, 4, 5], [3, 4, 5]] = 1 / shear[[2, 1, 0]]
        lines = []
        for label, value in values.items():
            if rng.random() < 0.5:
                lines.append(f"MP,{label},{number},{value!r}")
            elif rng.random() < 0.5:
                lines.append(f"MPDATA,R5.0, 1,{label:4s},{number:8d}, 1, {value!r},")
            else:  # a table over temperature, the same at both
                lines += [
                    "MPTEMP,R5.0, 1, 1,  20.0, 80.0,",
                    f"MPDATA,R5.0, 1,{label:4s},{number:8d}, 1, {value!r}, {value!r},",
                ]
        return lines, np.linalg.inv(S), rho

    def text(self) -> str:
        rng = self.rng
        width = int(rng.choice([8, 9, 10]))
        name = str(rng.choice([f"{self.kind}", f"SOLID{self.kind}", f"solid{self.kind}"]))
        lines = ["/COM,ANSYS RELEASE 2019", "/PREP7", f"ET,3,{name}", "*SET,_Z1,3"]
        if self.is_full:
            lines.append("KEYOP,3,2,1")
        lines += [f"NBLOCK,6,SOLID,{self.numbers[-1]:10d},{len(self.X):10d}", f"(3i{width},6e21.13e3)"]
        for number, x in zip(self.numbers, self.X, strict=True):
            lines.append(f"{number:{width}d}{0:{width}d}{0:{width}d}" + "".join(f"{v:21.13E}" for v in x))
        lines.append("N,R5.3,LOC,       -1,")
        half = int(rng.integers(0, len(self.elements)))
        number = 0
        for part in (self.elements[:half], self.elements[half:]):
            if not part:
                continue
            lines += [f"EBLOCK,19,SOLID,{10:10d},{len(part):10d}", f"(19i{width})"]
            for material, nodes in part:
                number += 3
                named = self.numbers[nodes].tolist()
                if self.corners == 6:
                    i, j, k, m, n, o = named
                    named = [i, j, k, k, m, n, o, o]
                elif self.corners == 5:
                    named = [*named, *3 * named[4:]]
                elif self.corners == 4:
                    i, j, k, m = named
                    named = [i, j, k, k, m, m, m, m]
                elif not self.is_brick and self.kind == 186:  # a brick of which nodes are equal
                    i, j, k, o, *m = named
                    ij, jk, ki, io, jo, ko = m
                    named = [i, j, k, k, o, o, o, o, ij, jk, k, ki, o, o, o, o, io, jo, ko, ko]
                row = [material, 3, 1, 1, 0, 0, 0, 0, len(named), 0, number, *named]
                lines.append("".join(f"{v:{width}d}" for v in row[:19]))
                if row[19:]:
                    lines.append("".join(f"{v:{width}d}" for v in row[19:]))
            lines.append(f"{-1:{width}d}")
        lines += [line for commands, _, _ in self.materials.values() for line in commands]
        lines += ["! a comment", f"D,{self.numbers[0]},UX,0.", f"F,{self.numbers[-1]},FY,3.5", "/GO", "FINISH"]
        return "\n".join(lines) + "\n"


def random_deck(seed: int) -> AnsysDeck:
    """Return the deck of a seed."""
    return AnsysDeck(np.random.default_rng([14, seed]))


def wrong_deck(deck: AnsysDeck, folder: Path) -> str:
    """Return what of the body differs from the assembler; empty: nothing."""
    path = folder / "model.cdb"
    path.write_text(deck.text())
    job = job_text(parse_deck(path), DeckOptions("m-kg-s", {}), path.name)
    path.with_suffix(".toml").write_text(job.replace("[body]", '[body]\naccept = ["parts", "units"]'))
    body = uncoupled_body(read_job(path.with_suffix(".toml")), Stages())
    numbers = body.numbering.nodes[: len(body.nodes)]
    place = {int(number): k for k, number in enumerate(deck.numbers)}
    if body.n_dof != len(deck.K):
        return f"{body.n_dof} dofs, expected {len(deck.K)}"
    at = [3 * place[int(numbers[node])] + int(c) for node, c in body.dofs]
    for what, ours, theirs in (("K", body.K, deck.K), ("M", body.M, deck.M)):
        difference = np.abs(ours.toarray() - theirs[np.ix_(at, at)]).max() / np.abs(theirs).max()
        if difference > ROUNDING:
            return f"{what} differs by {difference:.2g}"
    if len(body.interfaces) != 1 or int(numbers[body.interfaces[0].nodes[0]]) != deck.numbers[0]:
        return "the support is lost"
    return ""


def body_case(seed: int, folder: Path) -> Verdict:
    """Compare the body of one random deck with the assembler."""
    try:
        reason = wrong_deck(random_deck(seed), folder)
    except ValueError as error:
        return Verdict(REFUSED, str(error)[:600])
    return Verdict(WRONG if reason else ACCEPTED, reason or "compared")
