"""The building and its neighbours: daylight and sun that neighbours lose, sun that glass reflects."""
