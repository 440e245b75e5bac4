"""Transmission peaks of systems: whether they pass straight on, and what that does to results."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.evaluate import HIDDEN, LEAST_PEAK, UNRESOLVED, peak_kind, through_peak
from mitsuba_cfs.glare.sun_disc import spread_sun_dgp
from mitsuba_cfs.notes import Note
from scenes.fenestration.systems import FenestrationSystem, States, with_see_through

DIM = 10.0  # [lx] at the eye, below which relative changes do not matter
SAME_DGP, SAME_LIGHT = 0.001, 0.1  # least differences of DGP and of light [%] that are stated


def as_lobes(systems: tuple[States, ...]) -> tuple[States, ...] | None:
    """The systems of window groups [G] with lobes where a peak may be one; None: nowhere."""
    changed = {id(one): with_see_through(one, 0.0) for states in systems for one in states if is_undecided(one)}
    if not changed:
        return None
    return tuple(tuple(changed.get(id(one), one) for one in states) for states in systems)


def lobe_effect(
    beam: tuple[NDArray[np.float64], NDArray[np.float64]], lobe: tuple[NDArray[np.float64], NDArray[np.float64]]
) -> dict[str, float]:
    """What an undecided peak does to some hours, as columns of a table.

    Args: beam, lobe: DGP and illuminance at the eye [n] [lx] with the peak as a beam, as a lobe.
    """
    most = int(np.argmax(np.abs(lobe[0] - beam[0])))
    change = 100 * (lobe[1] - beam[1]) / np.maximum(beam[1], DIM)
    return {
        "hours_both_ways": float(len(change)),
        "dgp_as_beam": float(beam[0][most]),
        "dgp_as_lobe": float(lobe[0][most]),
        "eye_change_least": float(change.min()),  # [%]
        "eye_change_most": float(change.max()),  # [%]
    }


def lobe_effect_on_sensors(beam: NDArray[np.float64], lobe: NDArray[np.float64]) -> dict[str, float]:
    """What an undecided peak does to the mean illuminance of some hours, as figures.

    Args: beam, lobe: illuminance of the sensors [S, n] [lx] with the peak as a beam, as a lobe.
    """
    change = 100 * (lobe - beam).mean(axis=1) / np.maximum(beam.mean(axis=1), DIM)
    return {
        "sensor_hours_both_ways": float(beam.shape[1]),
        "sensor_change_least": float(change.min()),  # [%]
        "sensor_change_most": float(change.max()),  # [%]
    }


def lobe_notes(effects: Iterable[Mapping[str, Any]]) -> tuple[str, ...]:
    """Sentences on several `lobe_effect` and `lobe_effect_on_sensors`; none without any."""
    effects, notes = list(effects), []
    rated = [one for one in effects if "dgp_as_lobe" in one]
    if rated:
        notes.append(_lobe_note(max(rated, key=_dgp_change)))
    lit = [one for one in effects if "sensor_change_most" in one]
    if lit:
        notes.append(_sensor_note(lit))
    return tuple(notes)


def _sensor_note(effects: Sequence[Mapping[str, Any]]) -> str:
    count = int(effects[0]["sensor_hours_both_ways"])
    least = min(effect["sensor_change_least"] for effect in effects)
    most = max(effect["sensor_change_most"] for effect in effects)
    if max(abs(least), abs(most)) < SAME_LIGHT:
        return Note(
            "As a lobe, an undecided transmission peak changes the illuminance of a sensor by "
            "less than {light} % (mean of {count} hours with sun).",
            "As a lobe, an undecided transmission peak changes the illuminance of a sensor by "
            "less than {light} % (in an hour with sun).",
            count=count,
            light=SAME_LIGHT,
        )
    return Note(
        "As a lobe, an undecided transmission peak changes the illuminance of a sensor by "
        "{least:+.1f} to {most:+.1f} % (mean of {count} hours with sun).",
        "As a lobe, an undecided transmission peak changes the illuminance of a sensor by "
        "{least:+.1f} to {most:+.1f} % (in an hour with sun).",
        count=count,
        least=least,
        most=most,
    )


def _dgp_change(effect: Mapping[str, Any]) -> float:
    return abs(float(effect["dgp_as_lobe"] - effect["dgp_as_beam"]))


def _lobe_note(effect: Mapping[str, Any]) -> str:
    least, most = effect["eye_change_least"], effect["eye_change_most"]
    if _dgp_change(effect) < SAME_DGP and max(abs(least), abs(most)) < SAME_LIGHT:
        return Note(
            "The data do not show whether the transmission peak is specular. Computed both ways in {count} hours: "
            "DGP differs by less than {dgp}, the illuminance at the eye by less than {light} %.",
            "The data do not show whether the transmission peak is specular. Computed both ways: "
            "DGP differs by less than {dgp}, the illuminance at the eye by less than {light} %.",
            count=int(effect["hours_both_ways"]),
            dgp=SAME_DGP,
            light=SAME_LIGHT,
        )
    return Note(
        "The data do not show whether the transmission peak is specular. Computed both ways in "
        "{count} hours: as a lobe, DGP is {lobe:.3f} instead of {beam:.3f} where it differs most, "
        "and the illuminance at the eye differs by {least:+.1f} to {most:+.1f} %.",
        "The data do not show whether the transmission peak is specular. Computed both ways: as a "
        "lobe, DGP is {lobe:.3f} instead of {beam:.3f}, and the illuminance at the eye differs by "
        "{most:+.1f} %.",
        count=int(effect["hours_both_ways"]),
        lobe=effect["dgp_as_lobe"],
        beam=effect["dgp_as_beam"],
        least=least,
        most=most,
    )


def is_undecided(system: FenestrationSystem) -> bool:
    """Whether the data do not show if a transmission peak is specular or a lobe."""
    return _kind(system) == "undecided"


def _kind(system: FenestrationSystem) -> str:
    """See `peak_kind`; none where the optics are a function of the angle."""
    return "" if system.angular is not None else peak_kind(system.visible, system.tree)


def peak_note(system: FenestrationSystem) -> tuple[str, ...]:
    """A sentence on whether a transmission peak passes straight on, and on the error of that."""
    kind, bsdf, tree = _kind(system), system.visible.filled(), system.tree
    if not kind or bsdf.transmission_front is None:
        return ()
    basis, omega = bsdf.basis_in, bsdf.basis_in.projected_solid_angles()
    beam = through_peak(bsdf.transmission_front, basis, 1.0).transmittance
    values = {"system": system.name, "peak": float(beam[0]), "file": system.names[0]}
    if kind == "stated":
        share = (bsdf.see_through if tree is None else tree.see_through) or 0.0
        if share == 1.0:
            note = Note(
                "{system}: the transmission peak ({peak:.2f} at normal incidence) passes straight on, as stated.",
                **values,
            )
        else:
            note = Note(
                "{system}: {share:.0f} % of the transmission peak ({peak:.2f} at normal incidence) "
                "passes straight on, as stated; the rest is a lobe.",
                share=100 * share,
                **values,
            )
    elif kind == "lobe":
        peaked = beam >= LEAST_PEAK
        widest = float((omega / np.cos(basis.centres()[0]))[peaked].max())
        note = Note(
            "{system}: the transmission peak ({peak:.2f} at normal incidence) is a lobe, as it "
            "spreads into the neighbouring Klems patches: no sun or view passes straight on. In "
            "patches it is wider: DGP is up to {error:.2f} too low where the sun is seen through "
            "it. If it is specular: see_through = 'specular' in its table, or --see-through "
            "{file}=specular of cfs run.",
            error=max(spread_sun_dgp(HIDDEN) - spread_sun_dgp((widest / 2 / np.pi) ** 0.5), 0.0),
            **values,
        )
    elif kind == "specular":
        note = Note(
            "{system}: the transmission peak ({peak:.2f} at normal incidence) is specular, as "
            "hardly any light is scattered; direct sun and view out use it.",
            **values,
        )
    else:
        width = HIDDEN
        if tree is not None:
            depth = max(t.depth for t in tree.blocks().values())
            width = UNRESOLVED * np.sqrt(np.pi) / (1 << depth)
        note = Note(
            "{system}: the data do not show whether the transmission peak ({peak:.2f} at normal "
            "incidence) is specular or a lobe of less than {width:.1f} degrees; it is taken as "
            "specular. As a lobe, DGP is up to {error:.2f} lower where the sun is seen through "
            "it: see_through = 'lobe' in its table, or --see-through {file}=lobe of cfs run.",
            width=float(np.degrees(width)),
            error=-spread_sun_dgp(width),
            **values,
        )
    return (note,)
