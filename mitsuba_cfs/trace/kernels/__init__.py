"""Building blocks of the tracers: scenes, samples, bins, paths, estimates."""
