"""Makes the demo's systems: a double low-e glazing, and an exterior blind before it.

Each is an XML file with a `.toml` beside it: `glazing`, `venetian_blind`.

    python -m tests.demo.make_blind

The blind is that of the dissertation: slats 80 mm deep, of 104 mm radius, 72 mm apart, 55 % grey
with 1 % gloss of roughness 0.06, here at 45 degrees; its BSDF is traced by this project's virtual
goniophotometer.  The glazing is 4 mm clear float, 16 mm argon, 4 mm float with a low-e coating on
the third surface; its values at normal incidence are those usual for such panes.
"""

from __future__ import annotations

import numpy as np

from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.generate import generate_klems
from mitsuba_cfs.bsdf.glazing import Pane, specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.layers import LayeredSystem, combine_layers
from mitsuba_cfs.bsdf.periodic import plastic
from mitsuba_cfs.bsdf.xml import BsdfFile, write_bsdf_xml
from scenes.demo import FOLDER

BLIND = plastic("55 % grey", 0.55, specular=0.01, roughness=0.06)
TILT_DEG = 45.0
PANES = {  # outer, inner: normal transmittance, front and back reflectance
    "Visible": (Pane("clear", 0.90, 0.08, 0.08), Pane("low-e", 0.88, 0.050, 0.055, coated=True)),
    "Solar": (Pane("clear", 0.84, 0.075, 0.075), Pane("low-e", 0.62, 0.27, 0.20, coated=True)),
}
GLAZING_U = 1.1  # [W/(m2 K)] EN 673, 16 mm argon, emissivity 0.03
OUTER_FILM, INNER_FILM = 0.04, 0.13  # [m2 K/W] that are part of 1 / U
GAP = 1 / GLAZING_U - OUTER_FILM - INNER_FILM
PANES_THICKNESS = 0.024  # [m]
BLIND_TO_GLASS, BLIND_TO_AIR = 6.0, 18.0  # [W/(m2 K)] EN 13363-1, external blind
BEFORE_BLIND = 1 / BLIND_TO_AIR, 1 / BLIND_TO_GLASS, GAP  # [m2 K/W] on the way in to each layer
BLIND_TOTAL = 1 / GLAZING_U + sum(BEFORE_BLIND[:2])  # [m2 K/W]
PLACE = 'shading_position = "external"  # before the glazing\n'
BEAM = 'see_through = "specular"  # the beam between the slats\n'
PATHS = 262_144  # for each incident patch and side


def main() -> None:
    """Trace the blind, put it before the glazing, write both."""
    layer = venetian_blind(BLIND, depth=0.080, radius=0.104, spacing=0.072, tilt=np.radians(TILT_DEG))
    blind = generate_klems(layer, samples=PATHS, seed=1).bsdf[0]
    panes = {band: [specular_klems(pane, KLEMS_FULL) for pane in pair] for band, pair in PANES.items()}
    blinds = {band: combine_layers([blind, *pair]) for band, pair in panes.items()}
    name = f"Exterior venetian blind at {TILT_DEG:.0f} degrees, double low-e glazing"
    text = thermal_values(blinds["Solar"], BEFORE_BLIND, BLIND_TOTAL) + PLACE + BEAM
    _write("venetian_blind", blinds, name, layer.thickness + PANES_THICKNESS, 0.9, text)
    glazings = {band: combine_layers(pair) for band, pair in panes.items()}
    text = thermal_values(glazings["Solar"], (OUTER_FILM, GAP), 1 / GLAZING_U)
    _write("glazing", glazings, "Double low-e glazing", PANES_THICKNESS, 0.84, text)


def _write(
    stem: str, systems: dict[str, LayeredSystem], name: str, thickness: float, emissivity: float, thermal: str
) -> None:
    """Write a system's XML file, and the `.toml` beside it."""
    file = BsdfFile(
        {band: system.bsdf for band, system in systems.items()},
        name=name,
        manufacturer="mitsuba-cfs",
        thickness=thickness,
        emissivity_front=emissivity,
        emissivity_back=0.84,
    )
    write_bsdf_xml(file, FOLDER / f"{stem}.xml", digits=5)
    (FOLDER / f"{stem}.toml").write_text(thermal, encoding="utf-8")


def thermal_values(system: LayeredSystem, resistances: tuple[float, ...], total: float) -> str:
    """U, g and the absorptances as TOML; the inward shares are those of EN 13363-1.

    Each layer's heat is divided by the resistances on its two sides.

    Args:
        resistances: on the way in to each layer, from the one before or outdoors [m2 K/W].
        total: 1 / U [m2 K/W].
    """
    inward = np.cumsum(resistances) / total
    tau = system.bsdf.direct_hemispherical(system.bsdf.transmission_front)
    g = tau + inward @ system.absorptance_front
    u_value = 1 / total
    names = ("blind", "outer pane", "inner pane")[-len(resistances) :]
    lines = [
        "# written by tests/demo/make_blind.py",
        f"u_value = {u_value:.3f}  # [W/(m2 K)]"
        + (" with the blind's air layer, EN 13363-1" if "blind" in names else ""),
        f"g_value = {g[0]:.4f}  # at normal incidence (Klems patch 0)",
        f"inward_fractions = {_numbers(inward)}  # of the heat in "
        + ("blind, outer and inner pane" if "blind" in names else "outer and inner pane"),
        f"g_value_by_patch = {_numbers(g)}",
        *(
            f"absorptance_{name.replace(' ', '_')} = {_numbers(values)}"
            for name, values in zip(names, system.absorptance_front, strict=True)
        ),
    ]
    return "\n".join(lines) + "\n"


def _numbers(values) -> str:
    return "[" + ", ".join(f"{value:.4f}" for value in values) + "]"


if __name__ == "__main__":
    main()
