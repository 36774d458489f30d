"""Fleets: many jobs reduced by parallel workers, with a journal of those that are done."""
