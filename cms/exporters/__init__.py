"""A reduced body in the files of multibody programs; what a format cannot hold is said in words."""
