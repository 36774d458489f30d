"""Tables of the system file, and their conversion into a system."""
