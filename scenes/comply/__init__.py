"""Rooms against the rules that authorities and certificates ask for, with a dossier of each."""
