"""gbXML in and out."""
