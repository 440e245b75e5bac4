"""Surroundings of a building, from separate files."""
