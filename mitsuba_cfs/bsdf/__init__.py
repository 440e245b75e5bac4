"""Bidirectional scattering of fenestration systems: files, values, tracing, making, plugins."""
