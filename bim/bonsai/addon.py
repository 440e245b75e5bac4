"""The add-on: the whole of its module in Blender, which has no other package of this program.

Blender's own Python runs it: nothing but the standard library is imported until `register` is
called there.  It calls the `cfs` command on the saved IFC file and reads its tables.

Source: Blender's "Extensions" and "Operator" pages; Bonsai's `bonsai.tool.Ifc`.
"""

from __future__ import annotations

import csv
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

Colour = tuple[float, float, float, float]
# viridis at five equal steps, sRGB 0 to 1
STOPS = (
    (0.267, 0.005, 0.329),
    (0.229, 0.322, 0.546),
    (0.128, 0.567, 0.551),
    (0.369, 0.789, 0.383),
    (0.993, 0.906, 0.144),
)
POLL_S = 0.5  # how often the panel looks whether the command has ended


@dataclass(frozen=True)
class RoomFigure:
    """A figure of a room: where a run writes it, and the ends of its scale."""

    label: str
    file: str
    column: str
    low: float
    high: float
    digits: int = 0


QUANTITIES = {
    "SDA": RoomFigure("sDA 300 lx, 50 % [%]", "room_metrics.csv", "sda300_50", 0.0, 100.0),
    "DA": RoomFigure("Mean DA 300 lx [%]", "room_metrics.csv", "da300", 0.0, 100.0),
    "DF": RoomFigure("Daylight factor [%]", "room_metrics.csv", "daylight_factor", 0.0, 5.0, 1),
    "DGP": RoomFigure("Worst DGP of the pictures", "dgp.csv", "dgp", 0.2, 0.6, 2),
    "COMFORT": RoomFigure("Comfortable (ASHRAE 55, 80 %) [%]", "comfort.csv", "within_80", 0, 100),
}


def run_command(program: str, ifc: str, weather: str, out: str, *, quick: bool = True, system: str = "") -> list[str]:
    """The words of the command that computes the open file.

    Raises: `ValueError` in one line for a file that is not given or not there.
    """
    for what, path in (("the IFC file (save it first)", ifc), ("the EPW weather file", weather)):
        if not path or not Path(path).is_file():
            raise ValueError(f"cfs: {what} is not there: {path or 'nothing given'}")
    words = [*program.split(), "run", ifc, "--weather", weather, "--out", out]
    return words + ["--cfs", system] * bool(system) + ["--quick"] * quick


def room_values(results: str, quantity: str) -> dict[str, float]:
    """A quantity of each room of a folder of `cfs run`, by the room's GUID; the highest of a table.

    Raises: `ValueError` in one line for a folder that holds no run.
    """
    wanted, folder = QUANTITIES[quantity], Path(results)
    try:
        places = json.loads((folder / "run.json").read_text(encoding="utf-8"))["folders"]
        by_room = {}
        for guid, place in places.items():
            if Path(place).is_absolute() or ".." in Path(place).parts:
                raise ValueError(f"{place[:60]!r} is no name of a room's folder")
            with open(folder / place / wanted.file, encoding="utf-8", newline="") as file:
                cells = [row[wanted.column] for row in csv.DictReader(file)]
            values = [float(cell) for cell in cells if cell]
            if values:
                by_room[guid] = max(values)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError, csv.Error) as error:
        raise ValueError(f"cfs: {folder} holds no results of cfs run ({error})") from None
    return by_room


def colour(value: float, low: float, high: float) -> Colour:
    """The colour of a value between the ends of its scale, sRGB and alpha."""
    place = min(max((value - low) / (high - low), 0.0), 1.0) * (len(STOPS) - 1)
    before = min(int(place), len(STOPS) - 2)
    share = place - before
    one, other = list(pairwise(STOPS))[before]
    red, green, blue = (a + share * (b - a) for a, b in zip(one, other, strict=True))
    return red, green, blue, 1.0


def coloured(values: Mapping[str, float], quantity: str) -> dict[str, Colour]:
    """The colour of each room by its GUID."""
    scale = QUANTITIES[quantity]
    return {guid: colour(value, scale.low, scale.high) for guid, value in values.items()}


def legend(values: Mapping[str, float], quantity: str) -> list[str]:
    """Lines of the panel below its buttons."""
    scale = QUANTITIES[quantity]
    if not values:
        return ["no room has results"]
    low, high = min(values.values()), max(values.values())
    span = f"{low:.{scale.digits}f} to {high:.{scale.digits}f}"
    return [f"{len(values)} room(s): {span}", f"scale {scale.low:g} to {scale.high:g}"]


def last_line(text: str) -> str:
    """Last line of a command's output, for the status bar."""
    return next((line for line in reversed(text.splitlines()) if line.strip()), "cfs: no answer")


def paint(objects: Iterable[tuple[Any, Colour]]) -> int:
    """Give Blender's objects their viewport colours and show them; how many there are."""
    count = 0
    for one, shade in objects:
        one.color = shade
        one.hide_set(False)
        one.display_type = "SOLID"
        count += 1
    return count


def room_objects(ifc: Any, colours: Mapping[str, Colour]) -> list[tuple[Any, Colour]]:
    """Blender's object of each room with its colour; ifc: `bonsai.tool.Ifc`."""
    objects = []
    for guid, shade in colours.items():
        try:
            one = ifc.get_object(ifc.get().by_guid(guid))
        except RuntimeError:  # no such GUID: another file is open
            continue
        if one is not None:
            objects.append((one, shade))
    return objects


def add_on_classes(bpy: Any) -> Sequence[type]:
    """The settings, operators and panel, made of Blender's own types.

    The program that is run is a preference of the user: settings of a scene come with its file,
    which may be a stranger's.
    """
    props = bpy.props

    class CfsSettings(bpy.types.PropertyGroup):
        __annotations__ = {
            "weather": props.StringProperty(name="Weather (EPW)", subtype="FILE_PATH"),
            "system": props.StringProperty(name="BSDF of all windows", subtype="FILE_PATH"),
            "results": props.StringProperty(name="Results", subtype="DIR_PATH"),
            "quick": props.BoolProperty(name="Quick", default=True),
            "quantity": props.EnumProperty(
                name="Colour by", items=[(key, one.label, "") for key, one in QUANTITIES.items()]
            ),
            "said": props.StringProperty(),
        }

    class CfsPreferences(bpy.types.AddonPreferences):
        bl_idname = __package__ or __name__
        __annotations__ = {"program": props.StringProperty(name="Command", default="cfs")}

        def draw(self, context: Any) -> None:
            self.layout.prop(self, "program")

    class CFS_OT_run(bpy.types.Operator):
        bl_idname, bl_label = "cfs.run", "Compute rooms"

        def execute(self, context: Any) -> set[str]:
            settings = context.scene.cfs
            preferences = context.preferences.addons[CfsPreferences.bl_idname].preferences
            out = bpy.path.abspath(settings.results) or tempfile.mkdtemp(prefix="cfs-")
            try:
                words = run_command(
                    preferences.program,
                    _ifc().get_path() or "",
                    bpy.path.abspath(settings.weather),
                    out,
                    quick=settings.quick,
                    system=bpy.path.abspath(settings.system),
                )
                self.log = tempfile.TemporaryFile("w+", encoding="utf-8")
                self.job = subprocess.Popen(words, stdout=self.log, stderr=subprocess.STDOUT)
            except (ValueError, OSError) as error:
                self.report({"ERROR"}, str(error))
                return {"CANCELLED"}
            settings.results, settings.said = out, "computing ..."
            self.timer = context.window_manager.event_timer_add(POLL_S, window=context.window)
            context.window_manager.modal_handler_add(self)
            return {"RUNNING_MODAL"}

        def modal(self, context: Any, event: Any) -> set[str]:
            if event.type != "TIMER" or self.job.poll() is None:
                return {"PASS_THROUGH"}
            context.window_manager.event_timer_remove(self.timer)
            self.log.seek(0)
            context.scene.cfs.said = last_line(self.log.read())
            if self.job.returncode:
                self.report({"ERROR"}, context.scene.cfs.said)
                return {"CANCELLED"}
            return bpy.ops.cfs.colour()

    class CFS_OT_colour(bpy.types.Operator):
        bl_idname, bl_label = "cfs.colour", "Colour rooms"

        def execute(self, context: Any) -> set[str]:
            settings = context.scene.cfs
            try:
                values = room_values(bpy.path.abspath(settings.results), settings.quantity)
            except ValueError as error:
                self.report({"ERROR"}, str(error))
                return {"CANCELLED"}
            count = paint(room_objects(_ifc(), coloured(values, settings.quantity)))
            for area in context.screen.areas if context.screen else ():
                if area.type == "VIEW_3D":
                    area.spaces.active.shading.color_type = "OBJECT"
            settings.said = "; ".join(legend(values, settings.quantity))
            self.report({"INFO"}, f"{count} room(s) coloured; {settings.said}")
            return {"FINISHED"}

    class CFS_PT_panel(bpy.types.Panel):
        bl_label, bl_space_type, bl_region_type = "Daylight, glare, comfort", "VIEW_3D", "UI"
        bl_category = "mitsuba-cfs"

        def draw(self, context: Any) -> None:
            settings = context.scene.cfs
            for name in ("weather", "system", "results", "quick"):
                self.layout.prop(settings, name)
            self.layout.operator("cfs.run")
            self.layout.prop(settings, "quantity")
            self.layout.operator("cfs.colour")
            self.layout.label(text=settings.said)

    return CfsSettings, CfsPreferences, CFS_OT_run, CFS_OT_colour, CFS_PT_panel


def _ifc() -> Any:
    """Bonsai's door to the open IFC file."""
    try:
        import bonsai.tool as tool
    except ImportError:
        raise ValueError("cfs: Bonsai is not installed in this Blender") from None
    return tool.Ifc


_registered: list[type] = []


def register() -> None:
    """Called by Blender when the add-on is switched on."""
    import bpy

    for made in add_on_classes(bpy):
        bpy.utils.register_class(made)
        _registered.append(made)
    bpy.types.Scene.cfs = bpy.props.PointerProperty(type=_registered[0])


def unregister() -> None:
    """Called by Blender when the add-on is switched off."""
    bpy = sys.modules["bpy"]
    del bpy.types.Scene.cfs
    while _registered:
        bpy.utils.unregister_class(_registered.pop())
