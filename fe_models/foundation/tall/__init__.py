"""Tall arrays, of many rows, that lie on disk and are worked on a slice of rows at a time."""
