"""Fleets: many jobs reduced by parallel workers, with a journal of finished jobs."""
