"""One room: its light, glare, operation and heat, from Python objects to the year's results."""
