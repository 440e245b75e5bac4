"""Tracing: view, daylight and direct-sun matrices, paths and pictures, with their errors."""
