"""Files of matrices, their cache on disk, and bases of high resolution."""
