"""Couplings: the nodes of an interface are tied to one reference node, rigidly or by weighted means."""
