"""Rooms that Radiance renders: sun, overcast, blinds, lamps, night."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

ROOM = """
void plastic wall 0 0 5 .6 .6 .6 0 0
void plastic floor 0 0 5 .3 .25 .2 0 0
void plastic ceil 0 0 5 .8 .8 .8 0 0
void glass glz 0 0 3 .7 .72 .7
void plastic slat 0 0 5 .7 .7 .7 .02 .05
void metal shiny 0 0 5 .8 .8 .8 .9 .02
void light lamp 0 0 3 {lamp} {lamp} {lamp}
floor polygon f 0 0 12 0 0 0 4 0 0 4 6 0 0 6 0
ceil polygon c 0 0 12 0 0 3 0 6 3 4 6 3 4 0 3
wall polygon b 0 0 12 0 6 0 4 6 0 4 6 3 0 6 3
wall polygon l 0 0 12 0 0 0 0 6 0 0 6 3 0 0 3
wall polygon r 0 0 12 4 0 0 4 0 3 4 6 3 4 6 0
wall polygon s 0 0 30 0 0 0 0 0 3 4 0 3 4 0 0 3.5 0 0
  3.5 0 2.7 .5 0 2.7 .5 0 .9 3.5 0 .9 3.5 0 0
{desk} polygon d 0 0 12 1 2 .75 3 2 .75 3 3 .75 1 3 .75
"""
GLAZING = "glz polygon g 0 0 12 .5 0 .9 3.5 0 .9 3.5 0 2.7 .5 0 2.7\n"
LAMP = "lamp polygon la{0} 0 0 12 {0}.8 2 2.98 {0}.8 3.2 2.98 {1} 3.2 2.98 {1} 2 2.98\n"
LAMPS = "".join(LAMP.format(i, i + 1) for i in range(3))
SKY = """
skyfunc glow skyglow 0 0 4 1 1 1 0
skyglow source sky 0 0 4 0 0 1 180
skyfunc glow ground 0 0 4 .6 .5 .4 0
ground source below 0 0 4 0 0 -1 180
"""
NIGHT = "void glow n 0 0 4 .0001 .0001 .0001 0\nn source ns 0 0 4 0 0 1 360\n"
VIEWS = {
    "window": "-vta -vp 2 3.5 1.2 -vd 0 -1 0",
    "side": "-vta -vp 3 3 1.2 -vd -1 0 0",
    "askew": "-vta -vp 3 2.5 1.2 -vd -.6 -.8 0",
    "back": "-vta -vp 2 1.5 1.2 -vd 0 1 0",
    "down": "-vta -vp 2 3.5 1.2 -vd 0 -.8 -.5",
    "up": "-vta -vp 2 3 1.2 -vd 0 -.8 .5",
    "near": "-vta -vp 2 .8 1.4 -vd .1 -1 .05",
    "hemi": "-vth -vp 2 3.5 1.2 -vd 0 -1 0",
}
# name: gensky's date and kind (None: night), options of the room, views
SCENES = {
    "noon": ("12 21 12 +s", {}, "window side askew down up near hemi back"),
    "morning": ("3 21 8.5 +s", {}, "window askew near"),
    "afternoon": ("10 5 15 +s", {}, "window side hemi up"),
    "overcast": ("3 21 12 -c", {}, "window side back near"),
    "dusk": ("12 21 16.2 -c", {}, "window near back"),
    "no sun": ("6 21 12 -s", {}, "window askew up down"),
    "blinds": ("12 21 12 +s", {"slats": (0.08, 35, "slat")}, "window side askew near"),
    "flat blinds": ("12 21 11 +s", {"slats": (0.06, 0, "slat")}, "window near askew"),
    "shiny blinds": ("3 21 12 +s", {"slats": (0.08, -20, "shiny")}, "window near side hemi"),
    "overcast blinds": ("6 21 12 -c", {"slats": (0.1, 45, "slat")}, "window near"),
    "open": ("12 21 12 +s", {"glazing": False, "desk": "shiny"}, "window near down"),
    "lamps": (None, {"lamp": 60}, "window up back hemi"),
    "dim lamps": (None, {"lamp": 5}, "window up"),
    "bright lamps": (None, {"lamp": 1200}, "window up"),
}
CASES = [(scene, view) for scene, (_, _, views) in SCENES.items() for view in views.split()]


class Renderer:
    """Radiance on one folder: scenes are compiled once."""

    def __init__(self, programs: Path, folder: Path) -> None:
        self.programs, self.folder = programs, folder
        self.environment = dict(os.environ, RAYPATH=str(programs.parent / "lib"))

    def run(self, program: str, *arguments: object, given: str | None = None) -> bytes:
        command = [self.programs / program, *map(str, arguments)]
        data = None if given is None else given.encode()
        done = subprocess.run(command, input=data, capture_output=True, cwd=self.folder, env=self.environment)
        assert done.returncode == 0, done.stderr
        return done.stdout

    def octree(self, scene: str) -> Path:
        path = self.folder / f"{scene.replace(' ', '_')}.oct"
        if not path.exists():
            path.write_bytes(self.run("oconv", "-", given=self.description(scene)))
        return path

    def description(self, scene: str) -> str:
        sky, options, _ = SCENES[scene]
        text = NIGHT
        if sky is not None:
            place = "-a 48 -o -8 -m -15".split()
            text = self.run("gensky", *sky.split(), *place).decode() + SKY
        text += ROOM.format(lamp=options.get("lamp", 0.001), desk=options.get("desk", "floor"))
        text += GLAZING if options.get("glazing", True) else ""
        text += LAMPS if "lamp" in options else ""
        if "slats" in options:
            depth, angle, material = options["slats"]
            blind = self.run("genblinds", material, "bl", depth, 3, 1.8, 22, angle).decode()
            move = "-rz 90 -t 3.5 0.1 .9".split()
            text += self.run("xform", *move, given=blind).decode()
        return text

    def picture(self, scene: str, view: str, size: int) -> Path:
        path = self.folder / f"{scene}_{view}.hdr".replace(" ", "_")
        quality = "-ab 1 -ad 24 -as 0 -aa 0 -ds .3 -dj .5 -ps 2 -pa 0".split()
        shape = ["-vh", 180, "-vv", 180, "-x", size, "-y", size]
        sight = VIEWS[view].split()
        path.write_bytes(self.run("rpict", *quality, *sight, *shape, self.octree(scene)))
        return path
