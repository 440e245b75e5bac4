"""The script beside an exported room: Radiance's three phases with nothing but Radiance."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

# Source: A. McNeil, "The Three-Phase Method for Simulating Complex Fenestration with Radiance"
# (LBNL 2013), with rfluxmtx in place of rcontrib; the lm/W of Radiance's three channels
SCRIPT = """#!/bin/sh
# Illuminance of the room's sensors by Radiance alone: V T D s, the three-phase method.
#
#   ./run.sh                 coefficients.mtx: lux at each sensor by the luminance of each patch
#   ./run.sh WEATHER.wea     also illuminance.txt [lx]: a row for each sensor, a column for each
#                            hour (epw2wea CITY.epw CITY.wea makes the weather)
#
# SENSORS   points and directions, default sensors.pts; surfaces.pts: on all walls
# INDOORS   rays from each sensor, OUTDOORS: from each direction of a window's basis
# BOUNCES   in the room and outdoors
set -eu
cd "$(dirname "$0")"
sensors=${SENSORS:-sensors.pts}
indoors=${INDOORS:-20000}
outdoors=${OUTDOORS:-1000}
bounces=${BOUNCES:-8}
count=$(wc -l < "$sensors")

oconv materials.rad room.rad > room.oct
oconv materials.rad outdoors.rad > outdoors.oct
# one group of windows: view matrix, daylight matrix, and both with its BSDF between them
group() {
    rfluxmtx -faf -I+ -ab "$bounces" -ad "$indoors" -lw "$(least "$indoors")" -y "$count" \\
        - "windows_$1.rad" -i room.oct < "$sensors" > "view_$1.mtx"
    rfluxmtx -ffa -ab "$bounces" -ad 16 -lw 1e-4 -c "$outdoors" \\
        "windows_$1.rad" sky.rad -i outdoors.oct > "daylight_$1.mtx"
    rmtxop -ff "view_$1.mtx" . "windows_$1.xml" . "daylight_$1.mtx" > "part_$1.mtx"
}
# weight below which a ray ends: a hundredth of one of many
least() { echo "0.01 / $1" | awk '{ printf "%.3g", $1 / $3 }'; }

{groups}
rmtxop -fa {sum} -c 0.265 0.67 0.065 > coefficients.mtx
if [ $# -gt 0 ]; then
    gendaymtx -m {division} -of "$1" > sky_of_hours.mtx
    rmtxop -ff {sum} > whole.mtx
    rmtxop -ff whole.mtx . sky_of_hours.mtx > hours.mtx
    rmtxop -fa -c 47.435 119.93 11.635 hours.mtx | getinfo - > illuminance.txt
fi
"""
NO_BSDF = """#!/bin/sh
echo "no BSDF is known of the windows {names}: put windows_NAME.xml beside this script, run" >&2
echo "cfs ifc attach, and export again" >&2
exit 1
"""


def run_script(groups: Mapping[str, Path | None], division: int) -> str:
    """The shell script of a folder.

    Args:
        groups: name of each group's files and its BSDF, where it is known.
        division: of the sky, Reinhart's MF.
    """
    unknown = [name for name, bsdf in groups.items() if bsdf is None]
    if unknown:
        return NO_BSDF.format(names=", ".join(unknown))
    calls = "\n".join(f"group {name}" for name in groups)
    total = " + ".join(f"part_{name}.mtx" for name in groups)
    text = SCRIPT.replace("{groups}", calls).replace("{sum}", total)
    return text.replace("{division}", str(division))
