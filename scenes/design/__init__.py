"""Design: which system, sizes and rule of control are best for a room, and how sure that is."""
