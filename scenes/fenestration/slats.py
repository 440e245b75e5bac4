"""The BSDF of a blind and panes by their recipe, and what it becomes where the slats change.

The recipe of a system is its `[[layers]]`: panes with their light, and slats with size, tilt and
reflectance. The slats are traced (`mitsuba_cfs.bsdf.generate`), and the layers are joined by Klems
matrix algebra. An input of the slats is moved to both sides with the same random numbers, so that
the noise of tracing largely cancels in the difference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import groupby

import numpy as np

from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.layers import combine_layers
from mitsuba_cfs.bsdf.periodic import plastic
from mitsuba_cfs.errors import DataError
from scenes.fenestration.systems import FenestrationSystem, States, system_of_panes
from scenes.fenestration.thermal_file import ClosureTable, GlazingLayerTable, SlatTable
from scenes.fenestration.tilts import between_tilts

BANDS = ("Visible", "Solar")
PATHS = 65_536  # for each incident patch and side, of a moved blind
SEED = 1
SLAT_INPUTS = ("tilt_deg", "slat_width_mm", "slat_reflectance")  # of `scenes.uncertain_inputs`

Bands = dict[str, KlemsBsdf]


def recipe_slats(recipe: ClosureTable) -> SlatTable:
    """The slats of a recipe; `ValueError` where the table is none."""
    slats = next((layer.slats for layer in recipe.layers if layer.slats is not None), None)
    if slats is None or slats.visible is None:
        raise ValueError("layers: expected slats with `visible`")
    return slats


def layers_bsdf(
    layers: Sequence[GlazingLayerTable],
    *,
    paths: int = PATHS,
    seed: int = SEED,
    reflectances: Sequence[tuple[float, float]] = (),
) -> tuple[Bands, ...]:
    """The BSDF of panes and slats in both bands, the outermost layer first.

    Args:
        paths: for each incident patch and side of the slats.
        reflectances: visible and solar ones of the slats, from the same paths; a BSDF for each.
            Empty: the one of the slats.

    Raises: `DataError` for slats whose sizes do not go together.
    """
    parts: list[tuple[Bands, ...]] = []
    for is_shade, group in groupby(layers, key=lambda layer: layer.is_shade):
        some = tuple(group)
        if not is_shade:
            panes = system_of_panes(some)
            parts.append(({"Visible": panes.visible, "Solar": panes.solar},))
        for layer in some if is_shade else ():
            if layer.slats is None:
                raise DataError("expected panes and slats", field="layers")
            parts.append(_slat_bands(layer.slats, reflectances or (layer.slats.reflectances,), paths, seed))
    return tuple(
        {band: combine_layers([of[min(n, len(of) - 1)][band] for of in parts]).bsdf for band in BANDS}
        for n in range(max(len(of) for of in parts))
    )


def _slat_bands(
    slats: SlatTable, reflectances: Sequence[tuple[float, float]], paths: int, seed: int
) -> tuple[Bands, ...]:
    """The BSDF of slats alone in both bands, for each pair of reflectances."""
    from mitsuba_cfs.bsdf.generate import generate_klems

    colour = [value for pair in reflectances for value in pair]
    try:
        layer = venetian_blind(
            plastic("slats", *colour, specular=slats.specular, roughness=slats.roughness),
            depth=slats.width,
            spacing=slats.spacing,
            tilt=float(np.radians(slats.tilt_deg)),
            radius=slats.radius or np.inf,
            thickness=slats.thickness if "thickness" in slats.model_fields_set else 0.0,
        )
    except ValueError as error:  # sizes that do not go together
        raise DataError(str(error), field="slats") from None
    channels = generate_klems(layer, samples=paths, seed=seed).bsdf
    return tuple(dict(zip(BANDS, channels[n : n + 2], strict=True)) for n in range(0, len(channels), 2))


def slat_value(recipe: ClosureTable, key: str) -> float:
    """An input of `SLAT_INPUTS` of a recipe, in its unit; of reflectances the visible one."""
    slats = recipe_slats(recipe)
    return {"tilt_deg": slats.tilt_deg, "slat_width_mm": 1e3 * slats.width, "slat_reflectance": slats.reflectances[0]}[
        key
    ]


def greatest_step(recipe: ClosureTable, key: str) -> float:
    """How far an input can be moved to both sides."""
    slats = recipe_slats(recipe)
    if key == "tilt_deg":
        return 90.0 - abs(slats.tilt_deg)
    if key == "slat_width_mm":
        room = np.inf if slats.radius is None else 2 * slats.radius - slats.width
        return float(1e3 * min(0.25 * slats.width, room))
    return min(min(value, 1.0 - value) for value in slats.reflectances)


def _moved(recipe: ClosureTable, key: str, by: float) -> ClosureTable:
    """The recipe with an input of its slats changed by so much."""
    slats = recipe_slats(recipe)
    if key == "tilt_deg":
        changes: dict[str, float] = {"tilt_deg": slats.tilt_deg + by}
    elif key == "slat_width_mm":
        changes = {"width": slats.width + by / 1e3}
    else:
        visible, solar = slats.reflectances
        changes = {"visible": visible + by, "solar": solar + by}
    moved = slats.model_copy(update=changes)
    layers = (one if one.slats is None else one.model_copy(update={"slats": moved}) for one in recipe.layers)
    return recipe.model_copy(update={"layers": tuple(layers)})


Ends = tuple[FenestrationSystem, FenestrationSystem]


@lru_cache(maxsize=64)  # each room of a building asks for them again
def _traced_ends(system: FenestrationSystem, key: str, step: float) -> Ends:
    """A system with a recipe with an input of its slats a step lower and higher."""
    if system.recipe is None:
        raise ValueError(f"{system.name} has no recipe")
    recipes = [_moved(system.recipe, key, by) for by in (-step, step)]
    if key == "slat_reflectance":
        pairs = [recipe_slats(one).reflectances for one in recipes]
        bands = layers_bsdf(recipes[0].layers, reflectances=pairs)
    else:
        bands = tuple(layers_bsdf(one.layers)[0] for one in recipes)
    low, high = (
        replace(
            system,
            visible=replace(of["Visible"], see_through=system.fine.see_through),
            solar=of["Solar"],
            tree=None,
            closure=recipe.closure(),
        )
        for of, recipe in zip(bands, recipes, strict=True)
    )
    return low, high


def _ends(system: FenestrationSystem, key: str, step: float, known: dict[int, Ends]) -> Ends:
    """The system with an input a step lower and higher; itself without a recipe. Args: known: by id."""
    if id(system) not in known:
        tilts = system.between
        if not has_recipe(system):
            known[id(system)] = system, system
        elif tilts is None:
            known[id(system)] = _traced_ends(system, key, step)
        else:
            of_tilts = (_ends(one, key, step, known) for one in (tilts.low, tilts.high))
            low, high = (between_tilts(a, b, tilts.share) for a, b in zip(*of_tilts, strict=True))
            known[id(system)] = low, high
    return known[id(system)]


def has_recipe(system: FenestrationSystem) -> bool:
    """Whether the BSDF of a system follows from its layers."""
    if system.between is not None:
        return has_recipe(system.between.low) and has_recipe(system.between.high)
    return system.recipe is not None


def recipes_of(systems: Sequence[States]) -> tuple[ClosureTable, ...]:
    """The recipes of some systems."""
    return tuple(one.recipe for states in systems for one in states if one.recipe is not None)


def states_g(systems: Sequence[States]) -> bool:
    """Whether a system with a recipe states its g, which then does not follow from its layers."""
    stated = (one.g_value is not None or one.g_by_patch is not None for of in systems for one in of if one.recipe)
    return any(stated)


def moved_slats(systems: Sequence[States], key: str, step: float) -> tuple[tuple[States, ...], tuple[States, ...]]:
    """The states of windows with an input of the slats a step lower and higher; those without a recipe as they are."""
    known: dict[int, Ends] = {}
    ends = [[_ends(one, key, step, known) for one in states] for states in systems]
    low, high = (tuple(tuple(pair[n] for pair in states) for states in ends) for n in (0, 1))
    return low, high
