"""Figures of a report as plain data: positions in percent, SVG paths, small pictures, colours."""
