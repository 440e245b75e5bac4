"""Spectra of daylight, detectors of the eye, and the channels that the methods compute with."""
