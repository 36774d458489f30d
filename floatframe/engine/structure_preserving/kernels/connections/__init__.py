"""What one connection of a kind does in a step, compiled: bushings, contacts, couplers, rolling, user forces."""
