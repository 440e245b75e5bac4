"""Scenes of Radiance: primitives, their shapes and materials."""
