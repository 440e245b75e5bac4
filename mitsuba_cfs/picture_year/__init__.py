"""All pictures of a view in a year, compressed for a browser."""
