"""honeybee models (HBJSON) in and out."""
