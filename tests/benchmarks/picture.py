"""A point-in-time picture of the room behind the demo's blind against rpict.

    picture        rpict with the dissertation's parameters (Table 9), of a picture with a sixteenth
                   of the pixels: its ambient cache takes nearly all of its time
    picture-loose  rpict with a looser ambient cache, of all pixels

Errors are of the luminance averaged over squares of 4 x 4 pixels, and of DGP, against a long run of
ours in which no pixel shares its light with another.
"""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.images.hdr import read_hdr
from mitsuba_cfs.images.view import fisheye, format_view
from mitsuba_cfs.progress import Progress
from mitsuba_cfs.sky.epw import read_epw
from scenes.cost import room
from tests.benchmarks import radiance
from tests.benchmarks.annual_product import WEATHER
from tests.benchmarks.harness import Comparison, Run, timed
from tests.validation.rendered_pictures import DIRECTION, EYE, PicturedSystem, moments, rendered_room, set_moment

SIZE, COARSE = 800, 4  # [px] of the picture; of the squares that errors are of
MOMENT = 6  # of the validation's twelve: March, early afternoon
SAMPLES, REFERENCE_SAMPLES = 8, 1024
SEEDS = 4  # for the noise of DGP
TABLE_9 = "-ab 12 -ad 5000 -as 5000 -aa 0.15 -lw 1e-4"
LOOSE = "-ab 5 -ad 1000 -as 500 -aa 0.25 -lw 1e-3"


class PictureScene:
    """The room, its blind and its sky, for both programs."""

    def __init__(self, folder: Path) -> None:
        from mitsuba_cfs.trace.paths.scene import PathTracingScene, Sky

        fenestration = PicturedSystem("blind", folder)
        moment = moments(read_epw(WEATHER))[MOMENT]
        self.room = PathTracingScene(room.room(), room.NOTHING, room.window_groups(), [fenestration.system])
        self.sky = Sky(moment.patches, moment.sun, moment.sun_luminance)
        self.folder = folder
        set_moment(rendered_room(folder, fenestration), moment)

    def ours(self, size: int, samples: int, **options) -> NDArray[np.float32]:
        """Our picture."""
        from mitsuba_cfs.trace.pictures.point_in_time import point_in_time_picture

        view = fisheye(EYE, DIRECTION, size)
        return point_in_time_picture(self.room, self.sky, view, samples=samples, **options)

    def theirs(self, size: int, parameters: str) -> NDArray[np.float64]:
        """Radiance's picture."""
        view = format_view(fisheye(EYE, DIRECTION, size))
        command = f"rpict {parameters} {view} -x {size} -y {size} scene.oct > picture.hdr"
        radiance.run(command, self.folder)
        return read_hdr(self.folder / "picture.hdr").luminance

    @cache  # noqa: B019  one scene a process
    def reference(self) -> NDArray[np.float32]:
        """The converged picture, of squares."""
        return self.ours(SIZE // COARSE, REFERENCE_SAMPLES, tile=1, seed=99)

    def errors(self, picture: NDArray) -> str:
        """How far a picture is from the reference."""
        n = len(picture) * COARSE // SIZE
        squares = picture.reshape(SIZE // COARSE, n, SIZE // COARSE, n).mean(axis=(1, 3))
        truth, view = self.reference(), fisheye(EYE, DIRECTION, SIZE // COARSE)
        lit = truth > 0
        off = np.median(np.abs(squares[lit] / truth[lit] - 1))
        found, right = evaluate(squares, view), evaluate(truth, view)
        return (
            f"median of pixels {100 * off:.1f} %, Ev {100 * (found.Ev / right.Ev - 1):+.2f} %, "
            f"DGP {found.dgp - right.dgp:+.4f}"
        )


def compare(name: str, parameters: str, size: int, progress: Progress) -> Comparison:
    """Both programs' time of a picture, and their errors."""
    radiance.environment()
    variants.activate()
    with tempfile.TemporaryDirectory() as temporary:
        scene = PictureScene(Path(temporary))
        found, seconds, processor = timed(lambda: scene.ours(SIZE, SAMPLES), repeat=2)
        view = fisheye(EYE, DIRECTION, SIZE)
        pictures = [found, *(scene.ours(SIZE, SAMPLES, seed=seed) for seed in range(1, SEEDS))]
        noise = np.std([evaluate(picture, view).dgp for picture in pictures], ddof=1)
        progress(name, 0.3)
        peer, peer_seconds, peer_processor = timed(lambda: scene.theirs(size, parameters), repeat=1, warm=False)
        progress(name, 0.8)
        note = f"noise of our DGP {noise:.1g}; errors: ours {scene.errors(found)}; Radiance's {scene.errors(peer)}"
    progress(name, 1.0)
    return Comparison(
        name,
        f"a picture under sun and sky, {SIZE} x {SIZE} pixels (rpict: {size} x {size})",
        Run("mitsuba-cfs", f"point_in_time_picture(samples={SAMPLES})", seconds, processor),
        Run("Radiance", f"rpict {parameters}", peer_seconds, peer_processor),
        note=note,
    )


BENCHMARKS = {
    "picture": lambda progress: compare("picture", TABLE_9, SIZE // COARSE, progress),
    "picture-loose": lambda progress: compare("picture-loose", LOOSE, SIZE, progress),
}
