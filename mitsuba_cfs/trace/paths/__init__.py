"""Path tracing under one sky: what crosses the windows, point-in-time illuminance."""
