"""From a building model (IFC) to rooms, surfaces, windows and sensors."""
