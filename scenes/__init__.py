"""The command line, studies and reports built on mitsuba_cfs, bim and thermal."""
