"""What the methods cost on this machine, and which of them a study should take."""
