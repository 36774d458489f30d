"""The modal file: a reduced body as self-describing HDF5."""
