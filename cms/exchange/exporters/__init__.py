"""Writers for the file formats of multibody programs; each reports data that its format cannot hold."""
