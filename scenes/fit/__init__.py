"""Inputs of a model fitted to measured illuminance, luminance or temperatures."""
