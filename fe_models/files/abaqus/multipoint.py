"""Nonlinear constraints of CalculiX, linearised at the undeformed position as in its first increment.

- PLANE: nodes stay in the plane of the first three nodes that span one. A node at Σ N_a x_a (N_1 + N_2 + N_3 = 1)
  fulfils n · (u - Σ N_a u_a) = 0 with the normal n.
- STRAIGHT: nodes stay on the line of the first two. For a node at (1 - s) x_1 + s x_2, the difference
  d = u - (1 - s) u_1 - s u_2 is along the tangent t. These are two equations d_c - t_c/t_m d_m = 0, where t_m is the
  largest component of t.
- MEANROT: the first component of a node is the mean angle of other nodes about an axis e through their centroid:
  theta = 1/n Σ e · (r × u) / r², where r is the position of a node normal to the axis.
"""

import numpy as np

from fe_models.files.abaqus.draft import Draft
from fe_models.files.decks.deck import Coupling, Equation
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["LINEARISED", "read_linearised"]

AWAY = 1e-3  #: largest distance of a node from its line or plane, divided by the size of the group
ROUNDOFF = 1e-9


def read_linearised(here: str, draft: Draft, kind: str, words: list[str]) -> str:
    """Convert one constraint of `LINEARISED`; return a text with the reason if this is impossible."""
    numbers = [int(number) for word in words for number in draft.nodes_of(here, word)]
    return LINEARISED[kind](here, draft, numbers)


def _points(draft: Draft, numbers: list[int] | IntArray) -> Array:
    return np.asarray(draft.mesh.coordinates[draft.mesh.rows_of(np.asarray(numbers, dtype=np.int64))])


def _add(here: str, draft: Draft, terms: list[tuple[int, int, float]]) -> None:
    """Add an equation with node numbers; its first term is eliminated."""
    named = [(draft.node_group(here, [node]), c, a) for node, c, a in terms if a != 0]
    draft.equations.append(Equation(tuple(named)))


def _plane(here: str, draft: Draft, numbers: list[int]) -> str:
    nodes = list(dict.fromkeys(numbers))
    if len(nodes) < 4:
        return "expected four nodes or more"
    X = _points(draft, nodes)
    size = float(np.ptp(X, axis=0).max())
    areas = np.linalg.norm(np.cross(X[1] - X[0], X - X[0]), axis=1)
    third = int(np.argmax(areas > AWAY * size**2))
    if not third:
        return "all nodes lie on one line"
    order = [0, 1, third, *(k for k in range(2, len(nodes)) if k != third)]
    nodes, X = [nodes[k] for k in order], X[order]
    n = np.cross(X[1] - X[0], X[2] - X[0])
    n = n / np.linalg.norm(n)
    if np.abs((X - X[0]) @ n).max() > AWAY * size:
        return "nodes that do not lie in one plane"
    m = int(np.argmax(np.abs(n)))
    components = [m, *(c for c in range(3) if c != m)]
    edges = np.stack([X[1] - X[0], X[2] - X[0]], axis=1)
    for node, x in zip(nodes[3:], X[3:], strict=True):
        b, c = np.linalg.lstsq(edges, x - X[0], rcond=None)[0]
        shares = ((nodes[0], 1 - b - c), (nodes[1], b), (nodes[2], c))
        terms = [(node, k, float(n[k])) for k in components]
        _add(here, draft, terms + [(other, k, float(-share * n[k])) for other, share in shares for k in range(3)])
    return ""


def _straight(here: str, draft: Draft, numbers: list[int]) -> str:
    nodes = list(dict.fromkeys(numbers))
    if len(nodes) < 3:
        return "expected three nodes or more"
    X = _points(draft, nodes)
    t = X[1] - X[0]
    length = float(np.linalg.norm(t))
    if length == 0:
        return "the first two nodes are at one place"
    t = t / length
    arms = X - X[0]
    along = arms @ t
    if np.linalg.norm(arms - np.outer(along, t), axis=1).max() > AWAY * np.abs(along).max():
        return "nodes that do not lie on the line of the first two"
    m = int(np.argmax(np.abs(t)))
    for node, s in zip(nodes[2:], along[2:] / length, strict=True):
        shares = ((node, 1.0), (nodes[0], s - 1.0), (nodes[1], -s))
        for c in range(3):
            if c != m:
                terms = [(k, c, float(share)) for k, share in shares]
                _add(here, draft, terms + [(k, m, float(-share * t[c] / t[m])) for k, share in shares])
    return ""


def _mean_rotation(here: str, draft: Draft, numbers: list[int]) -> str:
    """Convert MEANROT; return why it cannot be converted, or an empty text.

    The last node, whose rotation is the mean angle, is moved to the centroid and follows the mean displacement.
    """
    *listed, pilot = numbers
    nodes, counts = np.unique(np.array(listed, dtype=np.int64), return_counts=True)
    axis = _points(draft, [pilot])[0]
    if len(nodes) < 2 or (counts != 3).any() or pilot in nodes:
        return "expected every node three times, and behind them the node of the angle"
    if any(pilot in table[:, 1:] for _, _, table in draft.mesh.elements):
        return f"the node of the angle, {pilot}, belongs to an element"
    if not np.any(axis):
        return f"the coordinates of node {pilot} are the axis, which has no length"
    e = axis / np.linalg.norm(axis)
    c = int(np.argmax(np.abs(e)))
    if abs(abs(e[c]) - 1) > ROUNDOFF:
        return "about an axis that is not along x, y or z"
    e = np.eye(3)[c] * np.sign(e[c])
    X = _points(draft, nodes)
    centre = X.mean(axis=0)
    r = X - centre
    across = r - np.outer(r @ e, e)
    length2 = (across**2).sum(axis=1)
    if length2.min() <= AWAY**2 * length2.max():
        return "nodes on the axis through their centroid"
    rows = np.cross(e, across) / length2[:, None] / len(nodes)  # e · (r × u) = (e × r) · u
    rows -= rows.mean(axis=0)  # u from the mean displacement
    turned = np.einsum("nk,jnk->j", rows, np.stack([np.cross(axis_j, r) for axis_j in np.eye(3)]))
    if np.abs(turned - e).max() > ROUNDOFF * 1e3:
        return "nodes whose mean angle also counts turns about other axes"
    draft.moved[pilot] = centre
    draft.pilots[pilot] = e
    group = draft.node_group(here, [pilot])
    name = f"mean_rotation_{pilot}"
    members = draft.node_group(here, nodes, f"{name}_nodes")
    draft.couplings.append(Coupling(name, group, ((members, 1.0),), (0, 1, 2)))
    terms = [(int(node), k, float(a)) for node, row in zip(nodes, rows, strict=True) for k, a in enumerate(row)]
    terms = [term for term in terms if abs(term[2]) > ROUNDOFF * np.abs(rows).max()]
    terms.sort(key=lambda term: -abs(term[2]))
    _add(here, draft, [*terms, (pilot, 3 + c, float(-e[c]))])
    draft.ledger.note(
        "*MPC, MEANROT", f"the angle is the rotation of node {pilot}, which is put at the centroid of its nodes"
    )
    return ""


LINEARISED = {"PLANE": _plane, "STRAIGHT": _straight, "MEANROT": _mean_rotation}
