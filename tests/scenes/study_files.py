"""Small studies for the tests: a box room, the demo's weather and blind."""

from __future__ import annotations

from pathlib import Path

from scenes.demo import VENETIAN_BLIND, WEATHER

BOX = """
[[room]]
name = "box"
[room.box]
width = 3.0
depth = 4.0
height = 3.0
[[room.box.window]]
x = 0.5
sill = 1.0
width = 2.0
height = 1.5
"""
SYSTEM = f"""
[[system]]
name = "blind"
bsdf = "{VENETIAN_BLIND}"
"""
CLIMATE = f"""
[[climate]]
name = "Chicago"
weather = "{WEATHER}"
"""
FEW_RAYS = """
[options]
sensor_spacing = 1.0
sensor_samples = 256
patch_samples = 256
sky_subdivision = 1
picture_size = 96
picture_samples = 4
"""


def study_file(folder: Path, head: str = "", *, rest: str = FEW_RAYS, system: str = SYSTEM) -> Path:
    """A study file with these first lines; one case unless they say otherwise."""
    path = folder / "study.toml"
    path.write_text(head + BOX + system + CLIMATE + rest, encoding="utf-8")
    return path
