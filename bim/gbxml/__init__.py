"""gbXML in."""
