"""Remakes of published comparisons: scripts that anyone can run, and the figures they print."""
