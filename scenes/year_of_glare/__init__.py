"""A year of glare in a room of a building: views, ratings, heat maps."""
