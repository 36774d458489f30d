"""Small motions about a steady one: how markers, coordinates and wrenches change, and what sensors see of it."""
