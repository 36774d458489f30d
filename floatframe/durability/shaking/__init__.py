"""A body or a system on a base that is moved: sine, random, shock, transients, notching, and what comes out of them."""
