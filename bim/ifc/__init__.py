"""Reading and writing IFC: the only modules that know ifcopenshell."""
