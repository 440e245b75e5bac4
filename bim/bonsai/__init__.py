"""A panel for Bonsai (Blender): `cfs run` on the open IFC, rooms coloured by their results."""
