"""Tall arrays (with many rows) that lie on disk and are processed in slices of rows."""
