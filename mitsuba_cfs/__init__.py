"""Daylight, glare and solar gains behind complex fenestration systems, traced with Mitsuba 3."""
