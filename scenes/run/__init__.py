"""The main job: files of a building, a weather and a system to the results of its rooms."""
