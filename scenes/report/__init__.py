"""The report of a run: one HTML file that needs nothing else (`page.write_report`)."""
