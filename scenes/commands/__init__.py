"""Subcommands of the `cfs` command line, one module each."""
