"""Kuhn's Blackbox fenestration model in a transient room heat balance."""
