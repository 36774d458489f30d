"""Tables and documents: what commands and results write for people and for other programs."""

__all__ = ["TABLE_SUFFIXES"]

TABLE_SUFFIXES = (".csv", ".json", ".mat", ".npz", ".parquet")  #: endings of the files in which tables are written
