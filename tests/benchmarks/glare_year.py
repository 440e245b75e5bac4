"""Hours of a year's three-phase glare against dctimestep and evalglare, from equal matrices."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import phases, variants
from mitsuba_cfs.bsdf.evaluate import through_peak
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.glare.annual import annual_glare, full_picture
from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.images.hdr import write_hdr
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.matrices.mtx_io import write_matrix
from mitsuba_cfs.progress import Progress
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.matrix import sky_matrix, sky_series
from mitsuba_cfs.sky.sun import is_up
from scenes.cost import room
from tests.benchmarks import glare_rating, radiance
from tests.benchmarks.annual_product import SYSTEM, WEATHER
from tests.benchmarks.harness import Comparison, Run, timed

SIZE, SAMPLES, SUBDIVISION = 800, 32, 4
EVERY = 36  # of the lit hours, ours; the peer gets PEER_HOURS of these
PEER_HOURS = 3
EYE = (1.8, 2.0, 1.2)
PRODUCT = f"dctimestep -o hour%03d.hdr patch%03d.hdr {SYSTEM.name} daylight.mtx sky.mtx"


class BenchmarkYear:
    """The benchmark room behind the demo's blind: matrices, and the skies of some lit hours."""

    def __init__(self, every: int, size: int = SIZE) -> None:
        """Trace and multiply everything that the pictures need."""
        from mitsuba_cfs.trace.kernels.scattering import KlemsScattering
        from mitsuba_cfs.trace.matrices.daylight import daylight_matrix
        from mitsuba_cfs.trace.pictures.annual import FivePhasePictures, view_matrices
        from mitsuba_cfs.trace.sun.picture_sun import PictureSun

        weather, groups = read_epw(WEATHER), room.window_groups()
        series = sky_series(weather)
        hours = np.flatnonzero(is_up(series.sun))[::every]
        system = read_bsdf_xml(SYSTEM).band("Visible")
        transmission = [system.transmission_matrix()]
        self.sky, sun = (
            sky_matrix(weather, SUBDIVISION, parts=parts, sun_up_only=True)[:, ::every] for parts in ("all", "sun")
        )
        self.daylight, direct = (
            daylight_matrix(room.NOTHING, groups, subdivision=SUBDIVISION, samples=1024, max_depth=depth).values
            for depth in (16, 1)
        )
        luminance = phases.room_side_radiance(transmission, self.daylight, self.sky)
        direct_luminance = phases.room_side_radiance(transmission, direct, sun)
        view = fisheye(EYE, (0, -1, 0), size)
        start = time.perf_counter()
        self.matrices = view_matrices(room.room(), groups, view, samples=SAMPLES)
        self.matrix_seconds = time.perf_counter() - start
        peak = through_peak(system.filled().transmission_front, KLEMS_FULL)
        way = KlemsScattering(KLEMS_FULL, peak.scattered, peak.transmittance)
        disc = PictureSun(room.room(), room.NOTHING, groups, [way], view)
        self.three_phase = self.matrices.three_phase(luminance)
        self.five_phase = FivePhasePictures(
            self.matrices, disc, luminance, direct_luminance, series.sun[hours], series.direct_normal[hours]
        )

    def write(self, folder: Path) -> None:
        """V as a picture for each patch, T, D and the first hours' s: the peer's input."""
        m = self.matrices
        patches = (m.indirect.rows + m.lit.rows)[m.lit.row] * m.lit.share[:, None]
        seen = m.seen.tocsc()
        for k in range(patches.shape[1]):
            values = patches[:, k] + seen[:, [k]].toarray().ravel()
            write_hdr(folder / f"patch{k:03d}.hdr", full_picture(values, m.pixels, m.view), m.view)
        write_matrix(folder / "daylight.mtx", self.daylight[0], components=3)
        write_matrix(folder / "sky.mtx", self.sky[:, :PEER_HOURS], components=3)
        (folder / SYSTEM.name).write_bytes(SYSTEM.read_bytes())


def compare(name: str, progress: Progress) -> Comparison:
    """Both programs' time of an hour: the product, the picture and its glare."""
    radiance.environment()
    variants.activate()
    progress(name, 0.0)
    year = BenchmarkYear(EVERY)
    geometry = GlareView(year.matrices.view)
    progress(name, 0.3)

    def rate(pictures) -> Callable[[], NDArray[np.float64]]:
        return lambda: annual_glare(pictures, geometry=geometry).dgp

    found, seconds, processor = timed(rate(year.three_phase))
    _, five_seconds, five_processor = timed(rate(year.five_phase))
    progress(name, 0.5)
    hours = len(found)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        year.write(folder)
        progress(name, 0.7)

        def theirs() -> list[float]:
            radiance.run(PRODUCT, folder)
            made = sorted(folder.glob("hour*.hdr"))  # they have no VIEW
            return [glare_rating.rated(file, "-vta -vh 180 -vv 180") for file in made]

        peer, peer_seconds, peer_processor = timed(theirs, repeat=1, warm=False)
    progress(name, 1.0)
    difference = float(np.abs(found[:PEER_HOURS] - peer).max())
    return Comparison(
        name,
        f"glare of an hour of the year from matrices, {SIZE} x {SIZE} pixels",
        Run("mitsuba-cfs", "annual_glare", seconds / hours, processor / hours),
        Run("Radiance", f"{PRODUCT}; evalglare", peer_seconds / PEER_HOURS, peer_processor / PEER_HOURS),
        note=(
            f"largest difference of DGP {difference:.2g}; an hour by the five-phase method "
            f"{five_seconds / hours:.3f} s, processor {five_processor / hours:.3f} s; "
            f"the view's matrices {year.matrix_seconds:.1f} s"
        ),
    )


BENCHMARKS = {"glare-year": lambda progress: compare("glare-year", progress)}
