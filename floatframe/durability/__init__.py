"""Durability: vibration tests and fatigue."""
