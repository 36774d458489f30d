"""The time loop (`integrate`), and what it calls: events, restart, and the watches over steps and linear frames."""
