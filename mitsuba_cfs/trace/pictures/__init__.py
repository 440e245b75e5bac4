"""Pictures: of a year by the phase methods, of one sky by path tracing."""
