"""WINDOW's engine on the glazings of Table 15's room, as the comparisons read it.

    python -m tests.validation window_reference --out DIR [--systems dgu ext_shade ...]

Needs `pywincalc` alone, whose layers are stated here and whose engine is called here: so it can
judge `thermal.iso15099`, which calls it too.  For each system `blackbox_NAME.json` (U at twelve
conditions, films, temperatures of the faces; solar properties and g by the angle of incidence and
for diffuse light; inward fractions), and one `blackbox_R.json`, `blackbox_back.json` for all
(resistance between the faces by their temperatures, with the fit of it; the room side).

The double glazing takes a second, a shade as a matrix over Klems patches some minutes.  The set's
ventilated blind is not among them: its slats need the engine anew for each of 145 directions.
U, films and resistances are those of the earlier set to eight digits, and so are the optics of the
double glazing; an outside shade passes 0.0454 here, 0.0439 there and 0.0451 in EnergyPlus.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pywincalc
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
SYSTEMS = ("dgu", "ext_shade", "int_shade")
MEASURED = (20.0, 2.7)  # convection outdoors and indoors [W/(m2 K)] where U and g are measured
CALM = (12.0, 2.0)  # and over a year, for the resistance between the faces
SUNNY = (25.0, 24.0, 500.0)  # outdoors, indoors [degC], sun [W/m2]
CONDITIONS = (  # outdoors, indoors [degC]; the first is the one of U
    (0, 20),
    (-10, 20),
    (10, 20),
    (15, 25),
    (2.5, 17.5),
    (5, 15),
    (-15, 5),
    (25, 35),
    (35, 25),
    (45, 30),
    (20, 0),
    (30, 20),
)
OUTDOOR, INDOOR = range(-25, 50, 10), range(5, 50, 10)
ANGLES_DEG = (0, 10, 20, 30, 40, 50, 60, 70, 75, 80, 85)
WIDTH, HEIGHT = 3.0, 1.5  # [m] of the window
SHADE = {"transmittance": 0.10, "reflectance": 0.55, "emissivity": 0.9}  # Lambertian, IR opaque
SHADE_DEPTH, SHADE_CONDUCTIVITY = 0.0005, 0.15  # [m], [W/(m K)]
SHADE_GAP = {"ext_shade": 0.1, "int_shade": 0.05}  # [m] to the glass


def layers(system: str) -> tuple[list[Any], list[Any]]:
    """Solid layers and the gaps between them, outside to inside."""
    argon = pywincalc.create_gas([(0.9, pywincalc.PredefinedGasType.ARGON), (0.1, pywincalc.PredefinedGasType.AIR)])
    panes = [_pane(0.775, 0.071, 0.071, 0.84, 0.84), _pane(0.600, 0.220, 0.170, 0.05, 0.84)]
    gaps = [pywincalc.Layers.gap(thickness=0.016, gas=argon)]
    if system == "dgu":
        return panes, gaps
    beside = pywincalc.Layers.gap(thickness=SHADE_GAP[system])
    if system == "ext_shade":
        return [_shade(), *panes], [beside, *gaps]
    return [*panes, _shade()], [*gaps, beside]


def _pane(tau: float, front: float, back: float, e_front: float, e_back: float) -> Any:
    """A pane of 6 mm with the same values at all wavelengths; coated where it emits little."""
    coated = e_front < 0.5
    kind = pywincalc.MaterialType.COATED if coated else pywincalc.MaterialType.MONOLITHIC
    side = pywincalc.CoatedSide.FRONT if coated else pywincalc.CoatedSide.NEITHER
    spectrum = [pywincalc.WavelengthData(w, tau, front, back) for w in (0.3, 1.0, 2.5)]
    optical = pywincalc.ProductDataOpticalNBand(kind, 0.006, spectrum, side, 0.0, 0.0, e_front, e_back)
    return pywincalc.ProductDataOpticalAndThermal(optical, pywincalc.ProductDataThermal(0.9, 0.006))


def _hemisphere() -> Any:
    return pywincalc.BSDFHemisphere.create(pywincalc.BSDFBasisType.FULL)


def _shade() -> Any:
    """A sheet that scatters evenly, open all around; the engine's own diffuse sheet does not."""
    passed, thrown = (np.full((145, 145), SHADE[name] / np.pi).tolist() for name in ("transmittance", "reflectance"))
    optical = pywincalc.ProductDataOpticalDualBandBSDF(
        passed,
        passed,
        thrown,
        thrown,
        passed,
        passed,
        thrown,
        thrown,
        _hemisphere(),
        SHADE_DEPTH,
        0.0,
        0.0,
        SHADE["emissivity"],
        SHADE["emissivity"],
    )
    openings = {f"opening_{side}": 1.0 for side in ("top", "bottom", "left", "right")}
    thermal = pywincalc.ProductDataThermal(SHADE_CONDUCTIVITY, SHADE_DEPTH, **openings)
    return pywincalc.ProductDataOpticalAndThermal(optical, thermal)


class Engine:
    """The engine with one system, at any condition."""

    def __init__(self, system: str) -> None:
        solid, gaps = layers(system)
        more = {} if system == "dgu" else {"bsdf_hemisphere": _hemisphere()}
        self._system = pywincalc.GlazingSystem(
            solid_layers=solid,
            gap_layers=gaps,
            width_meters=WIDTH,
            height_meters=HEIGHT,
            environment=_environments(*SUNNY, MEASURED),
            **more,
        )

    def dark(
        self, outdoor: float, indoor: float, convection: tuple[float, float] = MEASURED
    ) -> tuple[float, FloatArray]:
        """U [W/(m2 K)] and the temperatures of the faces [degC], outside to inside."""
        self._system.environments(_environments(outdoor, indoor, 0.0, convection))
        faces = self._system.layer_temperatures(pywincalc.TarcogSystemType.U)
        return float(self._system.u()), np.array(faces) - 273.15

    def optics(self, theta_deg: float) -> Any:
        """The engine's solar results at an angle of incidence, by layer and whole."""
        return self._system.optical_method_results("SOLAR", theta_deg, 0.0)

    def g_value(self, theta_deg: float) -> float:
        """Total solar energy transmittance."""
        self._system.environments(_environments(*SUNNY, MEASURED))
        return float(self._system.shgc(theta_deg, 0.0))


def _environments(outdoor: float, indoor: float, sun: float, convection: tuple[float, float]) -> Any:
    prescribed = pywincalc.BoundaryConditionsCoefficientModelType.HC_PRESCRIBED

    def one(celsius: float, film: float, light: float) -> Any:
        kelvin = celsius + 273.15
        return pywincalc.Environment(
            air_temperature=kelvin,
            pressure=101325.0,
            convection_coefficient=film,
            coefficient_model=prescribed,
            radiation_temperature=kelvin,
            emissivity=1.0,
            direct_solar_radiation=light,
        )

    return pywincalc.Environments(one(outdoor, convection[0], sun), one(indoor, convection[1], 0.0))


def u_values(engine: Engine) -> list[dict[str, Any]]:
    """U, its films and the faces' temperatures at each condition."""
    found = []
    for outdoor, indoor in CONDITIONS:
        u, faces = engine.dark(outdoor, indoor)
        heat = u * (indoor - outdoor)
        found.append(
            {
                "T_e": outdoor,
                "T_i": indoor,
                "U": u,
                "R_e": (faces[0] - outdoor) / heat,
                "R_i": (indoor - faces[-1]) / heat,
                "T_layers": faces.tolist(),
            }
        )
    return found


def resistances(engine: Engine) -> tuple[list[dict[str, float]], list[float]]:
    """R between the outermost and innermost face [m2 K/W] by their temperatures, and its fit.

    1/R = c0 + c1 x + c2 d + c3 d^2 + c4 x d + c5 x^2 with x the mean temperature less 10 degC and
    d the difference of the two.
    """
    points = []
    for outdoor in OUTDOOR:
        for indoor in INDOOR:
            if abs(indoor - outdoor) > 5:
                u, faces = engine.dark(outdoor, indoor, CALM)
                r = (faces[-1] - faces[0]) / (u * (indoor - outdoor))
                points.append({"Tso": faces[0], "Tsi": faces[-1], "R": float(r)})
    outer, inner, r = (np.array([p[name] for p in points]) for name in ("Tso", "Tsi", "R"))
    x, d = 0.5 * (outer + inner) - 10.0, np.abs(inner - outer)
    terms = np.stack([np.ones_like(x), x, d, d**2, x * d, x**2], axis=1)
    return points, np.linalg.lstsq(terms, 1.0 / r, rcond=None)[0].tolist()


def by_angle(engine: Engine) -> list[dict[str, Any]]:
    """Solar transmittance, reflectance, absorptances of the layers and g, to grazing."""
    found = [_at(engine, theta) | {"g": engine.g_value(theta)} for theta in ANGLES_DEG]
    none = [0.0] * len(found[0]["alpha_layers"])
    return [*found, {"theta": 90, "tau": 0.0, "rho": 1.0, "alpha_layers": none, "g": 0.0}]


def _at(engine: Engine, theta_deg: float) -> dict[str, Any]:
    result = engine.optics(theta_deg)
    front = result.system_results.front
    return {
        "theta": theta_deg,
        "tau": _total(front.transmittance),
        "rho": _total(front.reflectance),
        "alpha_layers": [one.front.absorptance.direct for one in result.layer_results],
    }


def _total(part: Any) -> float:
    return float(part.direct_direct + part.direct_diffuse)


def diffuse(engine: Engine, inward: FloatArray) -> dict[str, Any]:
    """Properties for diffuse light from outdoors."""
    result = engine.optics(0.0)
    front = result.system_results.front
    absorbed = [one.front.absorptance.diffuse for one in result.layer_results]
    tau = front.transmittance.diffuse_diffuse
    return {
        "tau": tau,
        "rho": front.reflectance.diffuse_diffuse,
        "alpha_layers": absorbed,
        "g": float(tau + inward @ absorbed),
    }


def from_the_room(engine: Engine) -> dict[str, Any]:
    """Properties for diffuse light from the room; layers in the engine's order."""
    result = engine.optics(0.0)
    back = result.system_results.back
    return {
        "tau_back": back.transmittance.diffuse_diffuse,
        "rho_back": back.reflectance.diffuse_diffuse,
        "alpha_back_layers": [one.back.absorptance.diffuse for one in result.layer_results],
    }


def write(systems: Sequence[str], out: Path) -> None:
    """Write the files of these systems."""
    out.mkdir(parents=True, exist_ok=True)
    by_faces: dict[str, Any] = {}
    room_side: dict[str, Any] = {}
    for name in systems:
        engine = Engine(name)
        angular = by_angle(engine)
        g, tau = (np.array([row[key] for row in angular]) for key in ("g", "tau"))
        absorbed = np.array([row["alpha_layers"] for row in angular])
        inward = np.linalg.lstsq(absorbed, g - tau, rcond=None)[0]
        outdoors, room_side[name] = diffuse(engine, inward), from_the_room(engine)
        by_faces[name], by_faces[f"{name}_fit"] = resistances(engine)
        data = {
            "cfs": name,
            "engine": f"pywincalc {version('pywincalc')}",
            "U": u_values(engine),
            "diffuse": outdoors,
            "N_inward_fractions": inward.tolist(),
            "angular": angular,
        }
        (out / f"blackbox_{name}.json").write_text(json.dumps(data, indent=1) + "\n")
    (out / "blackbox_R.json").write_text(json.dumps(by_faces, indent=1) + "\n")
    (out / "blackbox_back.json").write_text(json.dumps(room_side, indent=1) + "\n")


def main(*, out: Path, systems: Annotated[Sequence[str], SYSTEMS] = tuple(SYSTEMS)) -> None:
    """Write the systems asked for."""
    write(systems, out)
    sys.stdout.write(f"{out}\n")
