"""The system file: its tables, and the system it describes."""
