"""Tables of the system file, and how they are turned into a system."""
