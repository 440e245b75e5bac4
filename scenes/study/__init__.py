"""Studies: rooms x fenestration systems x orientations x climates x methods, case by case."""
