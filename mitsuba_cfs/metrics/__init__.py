"""Daylight metrics of annual illuminance: per sensor [S] and per room, with their schedules."""
