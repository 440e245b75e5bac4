"""Every picture of a view in a year, small enough to be looked at in a browser."""
