"""Tall arrays (with many rows) that are stored on disk and processed in slices of rows."""
