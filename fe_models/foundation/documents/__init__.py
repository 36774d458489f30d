"""Tables and documents: output of commands and results for people and for other programs."""

__all__ = ["TABLE_SUFFIXES"]

TABLE_SUFFIXES = (".csv", ".json", ".mat", ".npz", ".parquet")  #: suffixes of table files
