"""The explorer: one folder with a page that shows any hour of a run, without any network."""
