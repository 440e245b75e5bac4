"""Issues of a building model as data, their texts in one catalogue, and their order by weight."""
