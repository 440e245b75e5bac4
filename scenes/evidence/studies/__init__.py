"""The dissertation's example applications (chapter 5) as scripts."""
