"""What the program is held against: validation, benchmarks, case studies; not in the wheel."""
