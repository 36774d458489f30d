"""Masses carried inwards: other moments of the bodies of a tree, the same forces along all its rates.

What moves with the inner frame of a joint as it does with the outer one can be counted to the parent. Of mass, first
and second moment m, s, P = ∫ c cᵀ dm of a node these are

    hinge        all that lies on its axis: m, s_z, P_zz
    screw        P_zz alone: a direction along the axis, that no place belongs to
    slider       P: directions that do not turn against the parent
    rotation     m, in its centre
    nothing      all
    marker that moves with modes   nothing

and what comes to the ground vanishes. Seven numbers are left of the ten of a body on a hinge. Reactions in joints are
others than before: only the forces along the rates are the same, and all that follows from them.

A rigid body that hangs at the tip of the tree on a hinge or screw and is the same all around its axis, as a wheel,

    s_x = s_y = 0,  P_xx = P_yy,  P_xy = P_xz = P_yz = 0,

has these moments in a frame that does not turn with it as well: no force depends on its angle.
"""

from dataclasses import replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.design.generation.graph import CONSTANT, Graph, Terms, terms
from floatframe.design.generation.links import ROUNDING, Link, TreeTerms, without_rounding
from floatframe.design.generation.recursions import shifted_moments, turned_moment
from floatframe.engine.tree.recursion.nodes import FIXED, ROTATION, SCREW

__all__ = ["carried_inwards"]


def carried_inwards(tree: TreeTerms) -> TreeTerms:
    """Return a tree with as few moments as its joints allow; unchanged where moments are symbols."""
    links = list(tree.links)
    moments = [value for link in links for value in (link.mass, *link.s, *link.P.ravel())]
    if any(value.kind != CONSTANT for value in moments):
        return tree
    for k in range(len(links) - 1, -1, -1):
        link = links[k]
        moved = with_moments(link, taken_along(tree.graph, link))
        links[k] = cleaned(tree.graph, less(link, moved), link)
        if link.parent >= 0:
            s, P = shifted_moments(moved.mass, link.A @ moved.s, turned_moment(link.A, moved.P), link.r)
            above = links[link.parent]
            links[link.parent] = with_moments(above, (above.mass + moved.mass, above.s + s, above.P + P))
    return replace(tree, links=rounded(links))


def with_moments(link: Link, moments: tuple) -> Link:
    """Return a node that carries other moments."""
    return replace(link, mass=moments[0], s=moments[1], P=moments[2])


def less(link: Link, moved: Link) -> Link:
    """Return a node without what was moved."""
    return with_moments(link, (link.mass - moved.mass, link.s - moved.s, link.P - moved.P))


def taken_along(graph: Graph, link: Link) -> tuple:
    """Return m, s, P that move with the inner frame as well, its axes where the joint is at zero."""
    s, P = terms(graph, np.zeros(3)), terms(graph, np.zeros((3, 3)))
    if link.above is not None or link.own is not None:
        return graph.zero, s, P
    if link.kind == FIXED:
        return link.mass, link.s, link.P
    if link.kind == ROTATION:
        return link.mass, s, P
    if link.kind == SCREW and not link.turn.is_constant(0.0):
        P[2, 2] = link.P[2, 2]
        if not link.slide.is_constant(0.0):
            return graph.zero, s, P
        s[2] = link.s[2]
        return link.mass, s, P
    return graph.zero, s, link.P


def cleaned(graph: Graph, link: Link, before: Link) -> Link:
    """Return a node whose moments that vanish but for rounding are zero; before: what they were taken from."""
    s, P = (terms(graph, without_rounding(values_of(now), float(np.abs(values_of(was)).max())))
            for now, was in ((link.s, before.s), (link.P, before.P)))  # fmt: skip
    return with_moments(link, (link.mass, s, P))


def values_of(numbers: Terms) -> Array:
    """Return an array of constants as one of numbers."""
    return np.array([each.value for each in numbers.ravel()]).reshape(numbers.shape)


def rounded(links: list[Link]) -> tuple[Link, ...]:
    """Return nodes with those marked that are round, rigid, and carry no other that moves or weighs."""
    counts = [False] * len(links)
    out = list(links)
    for k in range(len(links) - 1, -1, -1):
        link = links[k]
        if link.kind == SCREW and not counts[k] and link.modes is None and is_round(link):
            out[k] = replace(link, is_round=True)
        if link.parent >= 0 and (counts[k] or link.n_z or link.has_moments or link.modes is not None):
            counts[link.parent] = True
    return tuple(out)


def is_round(link: Link) -> bool:
    """Whether the moments of a node are the same all around its third axis."""
    (x, y), P = link.s[:2], link.P
    if not all(value.is_constant(0.0) for value in (x, y, P[0, 1], P[0, 2], P[1, 2])):
        return False
    return abs(P[0, 0].value - P[1, 1].value) <= ROUNDING * abs(P[0, 0].value)
