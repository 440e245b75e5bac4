"""What each method and metric costs on this machine."""
