"""The box-shaped room of a study file as a building."""

from __future__ import annotations

from bim.model import Building, Construction, MaterialLayer
from bim.shoebox import Plate, WindowRectangle, shoebox
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.gloss import lacquer
from scenes.heat.study_file import BoxTable


def box_building(box: BoxTable) -> Building:
    """The box of a study as a building."""
    constructions = {
        side: Construction(
            f"{side} of the study",
            tuple(MaterialLayer(**layer.model_dump()) for layer in layers),
            "study file",
        )
        for side, layers in box.construction.items()
    }
    for part in box.roughness:
        if part not in box.specular:
            raise DataError("has no `specular` beside it", field=f"box.roughness.{part}")
    gloss = {
        part: lacquer(value, box.roughness.get(part, 0.0)) for part, value in box.specular.items()
    }
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
