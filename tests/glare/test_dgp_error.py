"""The standard error that is stated of DGP, against the spread over seeds."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import f

from mitsuba_cfs.glare import annual
from mitsuba_cfs.glare.annual import annual_glare
from mitsuba_cfs.glare.dgp_error import STUDENT, dgp_error, dgp_errors, hours_by_halves, random_signs
from mitsuba_cfs.glare.evaluation import GlareOptions, evaluate
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.methods import glare as method_glare
from mitsuba_cfs.methods.glare import _by_path_tracing, rated_pictures
from tests.glare.test_outdoor_pictures import sky
from tests.trace import rooms

SEEDS = 8
HOURS = 5


def test_hours_by_halves_are_spread_over_the_order_of_dgp() -> None:
    dgp = np.random.default_rng(2).random(400)
    hours = hours_by_halves(dgp)
    assert len(hours) == 24
    ranks = np.searchsorted(np.sort(dgp), dgp[hours])
    assert ranks[0] == 0 and ranks[-1] == 399
    assert np.diff(ranks).max() <= 18
    assert len(hours_by_halves(dgp[:3])) == 3


def test_errors_of_all_hours_follow_those_of_some() -> None:
    """An error that grows with DGP comes back, out of estimates of one degree of freedom."""
    random = np.random.default_rng(3)
    dgp = random.random(4000)
    hours = hours_by_halves(dgp)
    truth = 0.001 + 0.01 * dgp
    found = [dgp_errors(dgp, hours, np.abs(random.normal(0, truth[hours]))) ** 2 for _ in range(400)]
    middle = (dgp > 0.1) & (dgp < 0.9)
    mean = np.sqrt(np.mean(found, axis=0))
    # 400 times: the mean square is good to 7 %, and the means over neighbours bend by 2 %
    np.testing.assert_allclose(mean[middle], truth[middle], rtol=0.12)
    assert np.isnan(dgp_errors(dgp[:0], hours[:0], dgp[:0])).all()


VIEW = fisheye((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 48)
PIXELS = np.arange(48 * 48)
LUMINANCE = np.where(PIXELS % 48 < 24, 500.0, 4_000.0).astype(np.float32)
SHARE = 0.2  # of the luminance that half pictures are off
DISC = 100.0  # of the sun, in the first pixel [cd/m2]


class Rated:
    """Pictures of one hour of which the noise is known."""

    view, pixels, hours = VIEW, PIXELS, 1

    @staticmethod
    def values(batch):
        return np.tile(LUMINANCE, (len(batch), 1))

    @staticmethod
    def without_disc(batch):
        return Rated.values(batch), [()] * len(batch)

    @staticmethod
    def add_disc(values, batch):
        values[:, 0] += DISC

    @staticmethod
    def noise(batch):
        return SHARE * Rated.values(batch)


def dgp_of(factor: float) -> float:
    return evaluate((factor * LUMINANCE).reshape(48, 48), VIEW).dgp


def one_sign(monkeypatch) -> None:
    """All of the view has one sign: the noise of its parts goes together."""
    for module in (annual, method_glare):
        ones = lambda view, pixels: np.ones((2, len(pixels)), dtype=np.float32)  # noqa: E731
        monkeypatch.setattr(module, "random_signs", ones)


def test_the_error_of_a_year_is_half_of_what_its_half_pictures_differ(monkeypatch) -> None:
    one_sign(monkeypatch)
    found = annual_glare(Rated(), threads=1)
    assert found.dgp[0] == pytest.approx(dgp_of(1.0), rel=1e-6)
    expected = STUDENT * abs(dgp_of(1 + SHARE) - dgp_of(1 - SHARE)) / 2
    assert expected > 0.01
    assert found.dgp_standard_error[0] == pytest.approx(expected, rel=1e-5)


def test_the_error_of_a_shown_picture_is_that_of_its_halves(monkeypatch) -> None:
    light = SimpleNamespace(
        scene=SimpleNamespace(eye=VIEW), systems=[[None]], sky=SimpleNamespace(lit=np.zeros(1, dtype=int), hours=1)
    )
    one_sign(monkeypatch)
    made = [(np.array([0]), Rated())]
    monkeypatch.setattr(method_glare, "pictures_by_state", lambda *_: made)
    ((shown, rated),) = rated_pictures(light, np.array([0]))
    assert shown[0, 0] == LUMINANCE[0] + DISC  # which a source's rating takes apart
    np.testing.assert_array_equal(shown.ravel()[1:], LUMINANCE[1:])
    expected = STUDENT * abs(dgp_of(1 + SHARE) - dgp_of(1 - SHARE)) / 2
    assert rated.dgp_standard_error == pytest.approx(expected, rel=1e-5)


def test_the_stated_error_covers_95_percent_at_twice() -> None:
    """Noise that is independent from part to part, estimated once in each pixel."""
    random, size = np.random.default_rng(5), 96
    view = fisheye((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), size)
    patch = round(0.06 * size / np.pi)  # pixels of one noise, as smoothing leaves it
    row, column = np.divmod(np.arange(size * size), size)
    part = (row // patch) * size + column // patch
    truth = np.where(column < size / 2, 500.0, 4_000.0)
    signs = random_signs(view, np.arange(size * size))

    def dgp(values) -> float:
        return evaluate(values.reshape(size, size), view).unlimited_dgp

    def noise():
        return (0.1 * truth * random.normal(size=part.max() + 1)[part]).astype(np.float32)

    right, off = dgp(truth), []
    for _ in range(200):
        values = (truth + noise()).astype(np.float32)
        off.append(abs(dgp(values) - right) / dgp_error(dgp, values, noise(), signs))
    # 1.5 % of noise by 200 trials; one estimate without signs covers 70 %
    assert 0.92 <= np.mean(np.array(off) < 2) < 1.0


def test_a_dgp_at_its_limit_has_the_error_of_what_is_beyond_it() -> None:
    bright = np.full(48 * 48, 20_000.0, dtype=np.float32)
    rated = evaluate(bright.reshape(48, 48), VIEW)
    assert rated.dgp == 1.0 < rated.unlimited_dgp
    found = dgp_error(
        lambda some: evaluate(some.reshape(48, 48), VIEW).unlimited_dgp,
        bright,
        0.1 * bright,
        np.ones((2, 48 * 48), dtype=np.float32),
    )
    assert found > 0.1


def test_the_error_by_paths_is_that_of_another_seed(monkeypatch) -> None:
    """Two pictures of as many paths each differ by sqrt(2) of the error of one."""

    def picture(light, room, hour, seed=0, **given):
        return ((1 + SHARE * seed) * LUMINANCE).reshape(48, 48)

    monkeypatch.setattr(method_glare, "picture_of_room", picture)
    monkeypatch.setattr(method_glare, "discs_of_room", lambda *_: ())
    monkeypatch.setattr(method_glare, "rooms_by_state", lambda *_: {(0,): None})
    light = SimpleNamespace(scene=SimpleNamespace(eye=VIEW), sampling=SimpleNamespace(seed=0))
    state = np.zeros((1, 1), dtype=np.int64)
    options = GlareOptions()
    found = _by_path_tracing(light, "DGP", np.array([0]), state, options, lambda *_: None)
    expected = abs(dgp_of(1 + SHARE) - dgp_of(1.0)) / np.sqrt(2)
    assert found.dgp_standard_error[0] == pytest.approx(expected, rel=1e-5)


@pytest.mark.slow
@pytest.mark.usefixtures("variant")
@pytest.mark.parametrize("five_phase", [True, False])
def test_the_stated_error_is_the_spread_over_seeds(five_phase: bool) -> None:
    """Behind clear glass, eye to the window; the ratio of both variances by the F distribution."""
    import mitsuba_cfs as cfs

    room, groups = rooms.test_room()
    view = fisheye((1.8, 2.5, 1.2), (0.5, -1.0, 0.0), 64)
    scene = cfs.DaylightScene(room, rooms.NOTHING, groups, view=view)
    glass = cfs.AngularOptics([0.0, 0.3, 0.3, 0.3, 0.3])
    rated, stated = [], []
    for seed in range(SEEDS):
        sampling = cfs.Sampling(view_samples=2, seed=seed)
        traced = cfs.phase_matrices(scene, sampling, five_phase=five_phase)
        light = cfs.phase_light(traced, [[glass]], sky(HOURS))
        glare = cfs.hourly_glare(light)
        rated.append(glare.dgp)
        stated.append(glare.dgp_standard_error)
    variance = np.var(rated, axis=0, ddof=1).mean()
    ratio = np.mean(np.square(stated)) / STUDENT**2 / variance
    # the hours share their matrices: no more degrees of freedom than one hour has, 8 and 7
    low, high = f.ppf([0.005, 0.995], SEEDS, SEEDS - 1)
    assert variance > 0
    assert low < ratio < high, f"{np.sqrt(variance):.2g}, {np.sqrt(ratio):.2g} times"
