"""Discomfort glare of luminance pictures: sources, position index, indices."""
