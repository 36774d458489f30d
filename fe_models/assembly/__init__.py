"""Bodies of several kinds of elements on shared nodes: solids, shells and beams in one, with constraints."""
