"""The main job: a building, a weather and a fenestration system to the results of its rooms."""
