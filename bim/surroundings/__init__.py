"""What stands around a building, from files of its own."""
