"""The box-shaped room of a study file as a building."""

from __future__ import annotations

from bim.building_file import surrounded
from bim.model import Building, Construction, MaterialLayer
from bim.shoebox import Plate, WindowRectangle, shoebox
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.gloss import lacquer
from mitsuba_cfs.progress import Progress, silent
from scenes.heat.study_file import BoxTable
from scenes.input_files import building_of
from scenes.input_options import InputOptions


def box_building(box: BoxTable) -> Building:
    """The box of a study as a building."""
    constructions = {
        side: Construction(
            f"{side} of the study", tuple(MaterialLayer(**layer.model_dump()) for layer in layers), "study file"
        )
        for side, layers in box.construction.items()
    }
    for part in box.roughness:
        if part not in box.specular:
            raise DataError("has no `specular` beside it", field=f"box.roughness.{part}")
    gloss = {part: lacquer(value, box.roughness.get(part, 0.0)) for part, value in box.specular.items()}
    try:
        return shoebox(
            box.width,
            box.depth,
            box.height,
            windows=[WindowRectangle(**w.model_dump()) for w in box.window],
            facing_deg=box.facing_deg,
            recess=box.recess,
            reflectance=box.reflectance or None,
            adjacency=box.adjacency or None,
            constructions=constructions or None,
            gloss=gloss or None,
            plates=[Plate(**one.model_dump()) for one in box.plate],
        )
    except ValueError as error:
        raise DataError(str(error), field="box") from error


def building_or_box(box: BoxTable | None, options: InputOptions, progress: Progress = silent) -> Building:
    """The building of the options' file, or a box with its surroundings."""
    if box is None:
        return building_of(options, progress)
    read = options.read
    return surrounded(box_building(box), read.surroundings, read.surroundings_offset)
