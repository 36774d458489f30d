"""Writers for the file formats of multibody programs; each reports what its format cannot hold."""
