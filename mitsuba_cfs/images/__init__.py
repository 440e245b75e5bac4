"""Views, their pixel geometry, and Radiance pictures."""
