"""Traced view factors of a room in the heat balance, and the temperatures a person feels."""

from __future__ import annotations

from dataclasses import replace
from functools import wraps

import numpy as np
import pytest

from bim.shoebox import WindowRectangle, shoebox
from bim.to_thermal import thermal_room
from tests.thermal.rooms import climate, sun
from tests.trace.test_view_factors import parallel
from thermal.balance import simulate
from thermal.blackbox import Fenestration
from thermal.comfort import operative_temperature
from thermal.network import exchange_from_view_factors


@pytest.fixture(scope="module")
def room():
    building = shoebox(4.0, 5.0, 3.0, windows=[WindowRectangle(0.5, 1.0, 3.0, 1.5)])
    space = building.spaces[0]
    return space, thermal_room(space, Fenestration("glass", 1.2))


def test_view_factors_of_a_room_with_a_window(variant, room):
    from scenes.heat.study import radiant_room

    space, zoned = room
    zone = zoned.zone
    radiant = radiant_room(space, zoned)
    count = len(zone.surfaces) + len(zone.windows)
    assert radiant.among.shape == (count, count) and radiant.person.shape == (count,)
    np.testing.assert_allclose(radiant.among.sum(axis=1), 1.0)
    assert radiant.person.sum() == pytest.approx(1.0)
    ups = [i for i, s in enumerate(zone.surfaces) if s.normal[2] > 0.9]
    downs = [i for i, s in enumerate(zone.surfaces) if s.normal[2] < -0.9]
    floor, ceiling = downs[0], ups[0]
    assert radiant.among[floor, ceiling] == pytest.approx(parallel(4, 5, 3), abs=0.01)
    # facade and window lie in one plane: they do not see each other
    window = count - 1
    facade = max(
        (i for i, s in enumerate(zone.surfaces) if s.normal @ zone.windows[0].normal > 0.99),
        key=lambda i: zone.surfaces[i].area,
    )
    assert radiant.among[facade, window] == 0.0
    area = [e.area for e in (*zone.surfaces, *zone.windows)]
    exchange = exchange_from_view_factors(area, np.full(count, 0.9), radiant.among)
    np.testing.assert_allclose(exchange, exchange.T, atol=1e-9)
    np.testing.assert_allclose(exchange.sum(axis=1), 0.9 * np.array(area), rtol=1e-6)


def test_view_factors_are_found_again_while_the_room_is_as_it_was(variant, room, tmp_path, monkeypatch):
    from mitsuba_cfs.matrices.cache import MatrixCache
    from scenes.heat import study as module

    cache = MatrixCache(tmp_path)

    def factors(space, zoned, seed=0):
        return module.radiant_room(space, zoned, samples=256, seed=seed, cache=cache)

    first = factors(*room)
    traced = []
    for name in ("view_factors", "person_view_factors"):
        found = getattr(module, name)
        monkeypatch.setattr(module, name, _counted(found, name, traced))
    again = factors(*room)
    assert not traced
    np.testing.assert_array_equal(again.among, first.among)
    np.testing.assert_array_equal(again.person, first.person)
    other = factors(*room, seed=1)
    assert traced == ["view_factors", "person_view_factors"]
    assert np.any(other.among != first.among)
    space, zoned = room  # other surfaces alone: what a person sees from where is the same
    turned = factors(space, replace(zoned, surface_of_face=zoned.surface_of_face[::-1]))
    assert len(traced) == 4
    assert np.any(turned.among != first.among)


def _counted(function, name, calls):
    """The function, which writes its name into a list whenever it is called."""

    @wraps(function)
    def counted(*arguments, **options):
        calls.append(name)
        return function(*arguments, **options)

    return counted


def test_felt_temperatures_follow_their_rules_and_energy_closes(variant, room):
    from scenes.heat.study import RadiantRoom, felt, radiant_room

    space, zoned = room
    radiant = radiant_room(space, zoned, samples=4096)
    zone = replace(zoned.zone, view_factors=radiant.among)
    hours = 48
    result = simulate(zone, climate(hours, outdoor=-5.0), sun(hours, zone))
    assert np.abs(result.residual).max() < 1e-6
    faces = np.concatenate([result.surface_in_c, result.window_inner_c], axis=1)
    glass = faces.shape[1] - 1
    by_window = np.zeros(glass + 1)
    by_window[glass] = 1.0
    at_glass = felt(result, RadiantRoom(radiant.among, by_window), "view factors", 0, 0.1)
    np.testing.assert_allclose(at_glass.mrt_c, faces[:, glass], atol=1e-9)
    np.testing.assert_allclose(at_glass.operative_c, operative_temperature(result.air_c, faces[:, glass]))
    centre = felt(result, radiant, "room centre", 2, 0.1)
    np.testing.assert_allclose(centre.mrt_c, 0.5 * (faces.mean(axis=1) + faces[:, 2]))
    plain = felt(result, radiant, "area", 0, 0.1)
    np.testing.assert_allclose(plain.mrt_c, result.mrt_c)
    seated = felt(result, radiant, "view factors", 0, 0.1)
    assert np.all(seated.mrt_c <= faces.max(axis=1)) and np.all(seated.mrt_c >= faces.min(axis=1))


def test_open_room_falls_back(variant, room):
    from scenes.heat.study import radiant_room

    space, zoned = room
    keep = [i for i, f in enumerate(space.faces) if f.kind != "ceiling"]
    opened = replace(space, faces=tuple(space.faces[i] for i in keep))
    there = replace(zoned, surface_of_face=zoned.surface_of_face[keep])
    numbers = np.unique(there.surface_of_face, return_inverse=True)[1]
    names = tuple(zoned.zone.surfaces[i] for i in np.unique(there.surface_of_face))
    there = replace(there, surface_of_face=numbers, zone=replace(zoned.zone, surfaces=names))
    assert radiant_room(opened, there, samples=2048) is None
