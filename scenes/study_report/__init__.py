"""The report of a study: one HTML file that needs nothing else."""

from scenes.study_report.page import write_study_report

__all__ = ["write_study_report"]
