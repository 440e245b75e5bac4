"""The sun: direct, reflected by surfaces indoors and outdoors, at sensors and in pictures."""
