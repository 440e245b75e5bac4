"""Matrices of the phase methods: view, daylight, exchange, absorption, view factors."""
