"""The modal file, a reduced body as self-describing HDF5; `file` writes and reads it."""
