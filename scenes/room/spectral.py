"""Daylight of a room by wavelength: alpha-opic quantities of CIE S 026 and colour."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.colours import GREY
from bim.rays import ray_mesh
from mitsuba_cfs.bsdf.spectral_factor import ANGLES, SpectralFactor
from mitsuba_cfs.images.hdr import LUMINANCE_WEIGHTS
from mitsuba_cfs.images.view import pixel_directions
from mitsuba_cfs.methods.colour_view import rgb_over_luminance
from mitsuba_cfs.methods.spectral_light import Detection, SpectralLight, sky_spectra, spectral_light
from mitsuba_cfs.notes import Note
from mitsuba_cfs.picture_year.year import PictureYear
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.spectra.channels import Channels, channels_of
from mitsuba_cfs.spectra.daylight import WATER_CM, water_vapour_cm
from mitsuba_cfs.spectra.detectors import (
    ALPHA_OPIC,
    DETECTORS,
    NANOMETRES,
    colour_rendering,
    colour_temperature,
    detected,
    equivalent_daylight,
    illuminant,
)
from scenes.results import MELANOPIC_BY_DAY, DaylightResult, ExploredColour, SpectralYear
from scenes.room.inputs import EYE_TURNS, RoomInputs
from scenes.room.light import RoomLight, turned_eyes
from scenes.room.luminaires import lamp_spectra
from scenes.room.surface_spectra import ground_reflectance, room_reflectance
from scenes.room.zone import lamp_lux

MELANOPIC = DETECTORS.index("melanopic")
LEAST_LX = 1.0  # illuminance at the eye below which colour is not stated


def room_spectral(
    room: RoomInputs,
    light: RoomLight,
    state: NDArray[np.int64],
    daylight: DaylightResult,
    *,
    progress: Progress = silent,
) -> SpectralYear:
    """Alpha-opic quantities and colour of a year with the shading states of each hour [H, G].

    Args: daylight: of the work plane, whose sensors are the first of the scene's.
    """
    channels, sensors = channels_of(room.options.outputs.channels), len(daylight.points)
    eye = Detection(np.eye(channels.count), slice(-1, None))
    wanted = (
        Detection(channels.detection[[MELANOPIC]], slice(sensors)),
        Detection(channels.detection[[0]], slice(sensors), total=True),
        eye,
    )
    spectral, notes = _light(room, light, state, channels, wanted, progress)
    turned = turned_eyes(light)
    others, _ = _light(room, turned, state, channels, (replace(eye, sensors=slice(-1)),), silent)
    plane, photopic, own = spectral.received
    bands = np.concatenate([others.received[0], own], axis=1)
    lamps, of_lamps = _lamps(room, turned, channels, daylight)
    return spectral_year(
        room, channels, replace(spectral, received=(plane, photopic, bands)), [*notes, *of_lamps], lamps
    )


def eye_illuminances(
    room: RoomInputs, light: RoomLight, state: NDArray[np.int64], *, progress: Progress = silent
) -> tuple[NDArray[np.float64], list[str]]:
    """Illuminance and melanopic EDI [2, H] [lx] of the eye by daylight, and notes; state: [H, G]."""
    channels = channels_of(room.options.outputs.channels)
    wanted = (Detection(channels.detection[[0, MELANOPIC]], slice(-1, None)),)
    spectral, notes = _light(room, light, state, channels, wanted, progress)
    values = spectral.received[0][:, 0].astype(float)
    values[1] = equivalent_daylight(values[1])
    return room.skies.whole_year(values), notes


def _light(
    room: RoomInputs,
    light: RoomLight,
    state: NDArray[np.int64],
    channels: Channels,
    wanted: Sequence[Detection],
    progress: Progress,
) -> tuple[SpectralLight, list[str]]:
    """What detectors receive of a room's daylight, and what was assumed."""
    factors, notes = _factors(room, light)
    left_out = frozenset() if light.inner is None else light.inner.faces
    tables = () if room.operation is None else room.operation.surface
    reflectance, of_surfaces = room_reflectance(room.space, tables, left_out)
    spectral = spectral_light(
        light.light,
        factors,
        channels,
        wanted,
        light.states(state),
        reflectance=reflectance,
        water_cm=_water(room.weather)[room.skies.lit],
        clear=room.options.sky_spectrum,
        ground=ground_reflectance(tables),
        progress=progress,
    )
    return spectral, [*notes, *of_surfaces, *_outdoors(room)]


def _outdoors(room: RoomInputs) -> list[Note]:
    """That the colours of surfaces outdoors are not used, where there are any."""
    count = sum(element.hue != GREY for element in room.building.elements)
    if not count:
        return []
    return [
        Note(
            "Room {room}: surfaces outdoors with a colour in the model ({count}) reflect all wavelengths equally.",
            room=room.space.label,
            count=count,
        )
    ]


@dataclass(frozen=True, slots=True)
class LampYear:
    """Light of the lamps by wavelength."""

    power: NDArray[np.float64]  # [S + E, C] of the work plane's sensors and the eyes at full power [W/m2]
    lux: NDArray[np.float64]  # [S] of the work plane's sensors at full power
    share: NDArray[np.float64]  # [H] of it that is on


def _lamps(
    room: RoomInputs, light: RoomLight, channels: Channels, daylight: DaylightResult
) -> tuple[LampYear | None, list[str]]:
    """The light of the lamps that have a spectrum, dimmed by daylight, and notes; light: of the eyes."""
    tables = room.operation
    if tables is None or not tables.gains.lighting_w_m2:
        return None, []
    points, normals = light.scene.sensors()
    upwards = np.tile([0.0, 0.0, 1.0], (len(daylight.points), 1))
    places = np.concatenate([daylight.points, points]), np.concatenate([upwards, normals])
    lamps = lamp_spectra(tables, room.space, *places, seed=room.options.sampling.seed)
    full = tables.gains.lighting_full_lx
    if lamps is None or not full:
        return None, [
            Note(
                "Room {room}: light by wavelength has no lamps: state the spectrum of each [[gains.luminaire]].",
                room=room.space.label,
            )
        ]
    lit = lamp_lux(tables, room.weather, daylight.illuminance.mean(axis=1, dtype=float))
    power, lux = lamps
    notes: list[str] = []
    missed = 1 - float(detected(power)[:, 0].sum() / max(lux.sum(), 1e-9))
    if missed > 1e-3:
        notes.append(
            Note(
                "Room {room}: {share:.0f} % of the lamps' light has no spectrum, and is left out by wavelength.",
                room=room.space.label,
                share=100 * missed,
            )
        )
    share = np.zeros(len(room.weather.times)) if lit is None else lit / full
    return LampYear(channels.power(power), detected(power)[: len(daylight.points), 0], share), notes


def spectral_year(
    room: RoomInputs, channels: Channels, light: SpectralLight, notes: Sequence[str], lamps: LampYear | None = None
) -> SpectralYear:
    """The results of a year from its light.

    Args:
        light: melanopic [W/m2] of the work plane's sensors [1, S, L], their photopic total
            [1, S] [lx], irradiance of the eyes in each band [C, E, L] [W/m2], the view's own
            direction last.
    """
    skies, occupied = room.skies, room.occupied
    plane, photopic, bands = light.received
    eyes = skies.whole_year(bands)  # [C, E, H]
    edi = equivalent_daylight(skies.whole_year(plane[0]))  # [S, H]
    total = photopic[0].astype(float)
    if lamps is not None:
        count = len(edi)
        eyes += (lamps.power[count:].T[..., None] * lamps.share).astype(np.float32)
        edi += equivalent_daylight(lamps.power[:count] @ channels.detection[MELANOPIC])[:, None] * lamps.share
        total += lamps.lux * lamps.share.sum()
    received = np.einsum("dc,ceh->edh", channels.detection, eyes)  # [E, 9, H]
    own = received[-1]
    melanopic = equivalent_daylight(received[:, MELANOPIC])  # [E, H]
    temperature, distance = colour_temperature(np.where(own[0] >= LEAST_LX, own[-3:], 0.0).T)
    table = pd.DataFrame({"melanopic_edi_lx": melanopic[-1]}, index=room.weather.midpoints)
    table["melanopic_der"] = _ratio(melanopic[-1], own[0])
    table["photopic_lx"] = own[0]
    for name in ALPHA_OPIC:
        table[f"{name}_irradiance_mw_m2"] = 1e3 * own[DETECTORS.index(name)]
    table["cct_k"], table["duv"] = temperature, distance
    for turn, values in zip(EYE_TURNS, melanopic, strict=False):
        table[f"melanopic_edi_{turn}_lx"] = values
    on_plane = edi.astype(np.float32).T
    return SpectralYear(
        channels.edges_nm,
        table.rename_axis("time"),
        on_plane,
        _sensors(total, on_plane, occupied),
        np.ascontiguousarray(eyes[:, -1].T),
        _summary(channels, table, eyes[:, -1], light.outdoors, room.weather.step_h, occupied),
        tuple(notes),
    )


def _sensors(photopic: NDArray[np.float64], edi: NDArray[np.float32], occupied: NDArray[np.bool_]) -> pd.DataFrame:
    """Mean melanopic EDI [lx], DER and share of occupied hours at 250 lx or more, by sensor.

    Args: photopic: sum over the hours [S] [lx].
    """
    melanopic = edi.sum(axis=0, dtype=float)
    return pd.DataFrame(
        {
            "melanopic_edi_mean_lx": edi.mean(axis=0, dtype=float),
            "melanopic_der": _ratio(melanopic, photopic),
            "melanopic_250_percent": _share(edi >= MELANOPIC_BY_DAY, occupied),
        }
    ).rename_axis("sensor")


def _summary(
    channels: Channels,
    table: pd.DataFrame,
    bands: NDArray[np.float32],
    outdoors: NDArray[np.float64],
    step_h: float,
    occupied: NDArray[np.bool_],
) -> dict[str, float]:
    """Figures of the year at the eye; colour is that of the sum of its light."""
    edi, lit = table["melanopic_edi_lx"].to_numpy(), table["photopic_lx"].to_numpy()
    enough = edi >= MELANOPIC_BY_DAY
    figures = {
        "melanopic_250_percent": float(_share(enough[:, None], occupied)[0]),
        "melanopic_250_h": float(np.count_nonzero(enough) * step_h),
        "melanopic_edi_median_lx": float(np.median(edi[occupied])) if occupied.any() else 0.0,
        "melanopic_der": float(_ratio(edi.sum(), lit.sum())),
    }
    total = bands.sum(axis=1, dtype=float)
    if total.any():
        temperature, distance = colour_temperature(channels.detection[-3:] @ total)
        index, fidelity = colour_rendering(channels.spectrum(total))
        figures |= {
            "cct_k": float(temperature),
            "duv": float(distance),
            "colour_rendering_index": index,
            "colour_fidelity_index": fidelity,
        }
    horizontal = detected(outdoors)
    figures["outdoor_melanopic_der"] = float(_ratio(equivalent_daylight(horizontal[MELANOPIC]), horizontal[0]))
    return figures


def _factors(room: RoomInputs, light: RoomLight) -> tuple[list[list[SpectralFactor]], list[str]]:
    """The spectra of each window group's systems [G][J], and a note for each that is not known."""
    notes: list[str] = []
    known: dict[int, SpectralFactor] = {}
    for states in room.windows.systems:
        for system in states:
            if id(system) in known:
                continue
            known[id(system)] = system.spectrum or SpectralFactor.neutral()
            if not known[id(system)].whole and system.between is None:
                notes.append(
                    Note(
                        "{system}: its spectrum is that of the panes among its layers that are "
                        "files; its other layers transmit all wavelengths equally. State "
                        "[spectral] panes and shade.",
                        system=system.name,
                    )
                )
            if system.spectrum is None and system.between is None:
                notes.append(
                    Note(
                        "{system}: its spectrum is not known; it transmits all wavelengths "
                        "equally. State [spectral] panes in its .toml file.",
                        system=system.name,
                    )
                )
    factors = [[known[id(system)] for system in states] for states in room.windows.systems]
    if light.inner is not None:
        notes.append(
            Note(
                "Room {room}: daylight through glass between rooms has the colour of the other room's windows; that "
                "glass and the surfaces of the other room count as neutral.",
                room=room.space.label,
            )
        )
        factors += [[one] for one in light.inner.spectra]
    return factors, notes


def _water(weather: Weather) -> NDArray[np.float64]:
    """Precipitable water of the atmosphere [H] [cm]; that of ASTM G173 without humidity."""
    if weather.dry_bulb_c is None or weather.relative_humidity is None:
        return np.full(len(weather.times), WATER_CM)
    return np.clip(water_vapour_cm(weather.dry_bulb_c, weather.relative_humidity), 0.1, 8.0)


def _share(enough: NDArray[np.bool_], occupied: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Share of the occupied hours [%] of conditions [H, S]; 0 where there are none."""
    if not occupied.any():
        return np.zeros(enough.shape[1])
    share: NDArray[np.float64] = 100.0 * enough[occupied].mean(axis=0)
    return share


def _ratio(a: NDArray[np.floating] | float, b: NDArray[np.floating] | float) -> NDArray[np.float64]:
    """a / b, NaN where b is 0."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    ratio: NDArray[np.float64] = np.divide(a, b, out=np.full(a.shape, np.nan), where=b > 0)
    return ratio


def explored_colour(
    room: RoomInputs, light: RoomLight, combinations: NDArray[np.int64], pictures: Sequence[PictureYear], sensors: int
) -> ExploredColour:
    """Colours of the explorer's pictures by part, and melanopic light, in each combination of states [J, G].

    Args: sensors: number of sensors of the work plane, the first of the scene's.
    """
    channels = channels_of(room.options.outputs.channels)
    wanted = (
        Detection(channels.detection[[MELANOPIC]], slice(sensors)),
        Detection(channels.detection, slice(-1, None)),
    )
    water = _water(room.weather)[room.skies.lit]
    tables = () if room.operation is None else room.operation.surface
    skies = sky_spectra(room.skies, water, room.options.sky_spectrum, ground=ground_reflectance(tables))
    beam = room.skies.illuminance * np.maximum(room.skies.direction[:, 2], 0.0)
    white = detected(skies.horizontal)
    of_sky = detected(np.maximum(skies.horizontal - beam[:, None] * skies.sun, 0.0))
    factors, _ = _factors(room, light)
    left_out = frozenset() if light.inner is None else light.inner.faces
    reflectance, _ = room_reflectance(room.space, tables, left_out)
    seen = _seen_surfaces(light, pictures[0])
    pixels, indoors, suns, plane = [], [], [], []
    for combination, pictured in zip(combinations, pictures, strict=True):
        states = np.tile(combination, (room.skies.hours, 1))
        spectral, _ = _light(room, light, states, channels, wanted, silent)
        plane.append(equivalent_daylight(spectral.received[0][0]).astype(np.float32))
        indoors.append(spectral.received[1][:, 0].T.astype(float))
        of_groups = [factors[g][min(j, len(factors[g]) - 1)] for g, j in enumerate(combination.tolist())]
        suns.append(detected(skies.sun * _towards_sun(light, of_groups, room.skies.direction)))
        pixels.append(_pixel_tints(light, pictured, seen, reflectance, of_groups))
    indoor, sun = np.array(indoors), np.array(suns)
    return ExploredColour(
        tuple(pixels),
        _tints(indoor, white),
        _tints(of_sky, white),
        _tints(sun, white),
        tuple(plane),
        equivalent_daylight(indoor[..., MELANOPIC]).astype(np.float32),
    )


def _tints(received: NDArray[np.float64], white: NDArray[np.float64] | None = None) -> NDArray[np.float32]:
    """Linear sRGB over luminance and DER [.., 4] of what detectors receive [.., 9], 1 in the dark.

    Args: white: [L, 9] that is balanced; of no hour: D65.
    """
    dark = received[..., 0] <= 0
    x, y, z = np.moveaxis(np.where(dark[..., None], 1.0, received[..., -3:]), -1, 0)
    rgb = rgb_over_luminance(x / y, z / y)
    if white is not None:
        wx, wy, wz = np.where(white[:, :1] <= 0, 1.0, white[:, -3:]).T
        rgb = rgb / np.maximum(rgb_over_luminance(wx / wy, wz / wy), 1e-3)
        rgb = rgb / np.maximum(rgb @ np.asarray(LUMINANCE_WEIGHTS), 1e-6)[..., None]
    ratio = np.where(dark, 1.0, equivalent_daylight(received[..., MELANOPIC]) / np.where(dark, 1.0, received[..., 0]))
    return np.concatenate([rgb, ratio[..., None]], axis=-1).astype(np.float32)


def _seen_surfaces(light: RoomLight, pictures: PictureYear) -> NDArray[np.int64]:
    """The surface of the room that each pixel of the pictures shows [n]; -1: none."""
    interior = light.scene.interior
    ways = pixel_directions(pictures.view)[0].reshape(-1, 3)[pictures.pixels]
    start = np.tile(np.asarray(pictures.view.position, dtype=float), (len(ways), 1))
    _, hit = ray_mesh(interior.triangles).first_hits(start, ways)
    return np.where(hit >= 0, interior.surface[hit], -1)


def _pixel_tints(
    light: RoomLight,
    pictures: PictureYear,
    seen: NDArray[np.int64],
    reflectance: NDArray[np.float64] | None,
    factors: Sequence[SpectralFactor],
) -> NDArray[np.float32]:
    """Tints under D65 of the surfaces and panes that pixels show [n, 4]."""
    tints = np.ones((len(seen), 4), dtype=np.float32)
    if reflectance is not None:
        tints = np.where((seen >= 0)[:, None], _tints(detected(reflectance * illuminant("D65")))[seen], tints)
    ways = pixel_directions(pictures.view)[0].reshape(-1, 3)[pictures.pixels][pictures.window]
    groups = light.scene.groups
    start = np.asarray(pictures.view.position, dtype=float)
    meshes = [ray_mesh(np.concatenate([w.triangles for w in group.windows])) for group in groups]
    far = np.array([mesh.first_hits(np.tile(start, (len(ways), 1)), ways)[0] for mesh in meshes])
    nearest = far.argmin(axis=0) if len(far) else np.zeros(len(ways), dtype=np.int64)
    for g, factor in enumerate(factors):
        of_angle = _tints(detected(factor.transmittance * illuminant("D65")))
        theta = np.arccos(np.clip(ways @ groups[g].frame[2], 0.0, 1.0))
        some = nearest == g
        columns = [np.interp(theta[some], ANGLES, column) for column in of_angle.T]
        tints[pictures.window[some]] = np.stack(columns, axis=1)
    return tints


def _towards_sun(
    light: RoomLight, factors: Sequence[SpectralFactor], towards: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Relative transmittance [L, N] of the window group that faces the sun most."""
    facing = np.array([towards @ group.frame[2] for group in light.scene.groups[: len(factors)]])
    first = facing.argmax(axis=0)
    found = np.ones((len(towards), len(NANOMETRES)))
    for g, factor in enumerate(factors[: len(facing)]):
        some = first == g
        theta = np.arccos(np.clip(facing[g][some], 0.0, 1.0))
        found[some] = factor.transmittance[np.clip(np.rint(np.degrees(theta)), 0, len(ANGLES) - 1).astype(int)]
    return np.maximum(found, 1e-9)
