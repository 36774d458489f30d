"""Transfer of masses towards the root of a tree: other moments of the bodies, the same forces along all rates.

If a part of the mass of a node moves in the same way with the inner frame of its joint as with the outer frame, it can
be assigned to the parent. Of the mass, first and second moment m, s, P = ∫ c cᵀ dm of a node, these parts are

        hinge        the mass on its axis: m, s_z, P_zz
        screw        only P_zz, a direction along the axis without position
        slider       P, because its directions do not rotate relative to the parent
        rotation     m, at its centre
        fixed        all
        marker that moves with modes   none

Moments that reach the ground vanish. A body on a hinge keeps seven of its ten parameters. Reactions in joints differ
from those of the original tree; only forces along the rates, and all results that follow from them, are the same.

A rigid body at the tip of the tree, on a hinge or screw, may be symmetric about its axis, such as a wheel:

    s_x = s_y = 0,  P_xx = P_yy,  P_xy = P_xz = P_yz = 0,

It then has the same moments in a frame that does not rotate with it, so that no force depends on its angle.
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
    """Return a tree with as few moments as its joints allow; moments that are symbols do not change."""
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
    """Return a node with other moments."""
    return replace(link, mass=moments[0], s=moments[1], P=moments[2])


def less(link: Link, moved: Link) -> Link:
    """Return a node without the transferred moments."""
    return with_moments(link, (link.mass - moved.mass, link.s - moved.s, link.P - moved.P))


def taken_along(graph: Graph, link: Link) -> tuple:
    """Return the parts of m, s, P that move with the inner frame of the joint, in its axes at joint position zero."""
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
    """Return a node in which rounding errors of moments are zero; `before` has the moments before the transfer."""
    s, P = (terms(graph, without_rounding(values_of(now), float(np.abs(values_of(was)).max())))
            for now, was in ((link.s, before.s), (link.P, before.P)))  # fmt: skip
    return with_moments(link, (link.mass, s, P))


def values_of(numbers: Terms) -> Array:
    """Return an array of constant terms as an array of numbers."""
    return np.array([each.value for each in numbers.ravel()]).reshape(numbers.shape)


def rounded(links: list[Link]) -> tuple[Link, ...]:
    """Return the nodes; `is_round` marks rigid, axisymmetric nodes that carry no other node with modes or mass."""
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
    """Return whether the moments of a node are symmetric about its third axis."""
    (x, y), P = link.s[:2], link.P
    if not all(value.is_constant(0.0) for value in (x, y, P[0, 1], P[0, 2], P[1, 2])):
        return False
    return abs(P[0, 0].value - P[1, 1].value) <= ROUNDING * abs(P[0, 0].value)
