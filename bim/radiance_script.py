"""The script beside an exported room: three or five phases with nothing but Radiance."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

# Source: A. McNeil, "The Three-Phase Method for Simulating Complex Fenestration with Radiance" and
# "The Five-Phase Method" (LBNL 2013), with rfluxmtx in place of rcontrib; the lm/W of Radiance's
# three channels
SCRIPT = """#!/bin/sh
# {Quantity} of the room's sensors by Radiance alone, the three- or the five-phase method:
#
#   V T D s    or    V T D s - V_d T D_d s_d + C_ds s_ds
#
#   ./run.sh                 coefficients.mtx: V T D, {unit} at each sensor by each patch's
#                            {radiance}
#   ./run.sh WEATHER.wea     also {result} [{unit}]: a row for each sensor, a column for each
#                            hour (epw2wea CITY.epw CITY.wea makes the weather)
#
# MATERIALS in their colours, or grey.rad: as grey as they are light, as cfs itself has them
# SENSORS   points and directions, default sensors.pts; surfaces.pts: on all walls
# PHASES    3, or 5: also direct.mtx, V_d T D_d, and sun_coefficients.mtx, C_ds
# INDOORS   rays from each sensor, OUTDOORS: from each direction of a window's basis
# BOUNCES   in the room and outdoors
# SUNS      Reinhart's MF of the places of the sun: 6 has 5,185
# STRAIGHT  rays from each sensor to what a window scatters of the sun
set -eu
[ $# -eq 0 ] || weather=$(realpath "$1")
cd "$(dirname "$0")"
materials=${MATERIALS:-materials.rad}
sensors=${SENSORS:-sensors.pts}
phases={phases}
indoors=${INDOORS:-20000}
outdoors=${OUTDOORS:-1000}
bounces=${BOUNCES:-8}
suns=${SUNS:-6}
straight=${STRAIGHT:-20000}
count=$(wc -l < "$sensors")
case $phases in 3|5) ;; *) echo "PHASES=$phases: 3 or 5" >&2; exit 1;; esac

# weight below which a ray ends: a hundredth of one of many
least() { echo "0.01 / $1" | awk '{ printf "%.3g", $1 / $3 }'; }
{group}groups() {
{groups}
}

oconv "$materials" room.rad > room.oct
oconv "$materials" outdoors.rad > outdoors.oct
groups "" "$bounces" "$bounces"
rmtxop -ff {sum} > whole.mtx
rmtxop -fa -c {weights} whole.mtx > coefficients.mtx

if [ "$phases" = 5 ]; then
    echo "void plastic black 0 0 5 0 0 0 0 0" > black.rad
    xform -m black room.rad | oconv black.rad - > room_direct.oct
    xform -m black outdoors.rad | oconv black.rad - > outdoors_direct.oct
    groups _direct 1 0
    rmtxop -ff {direct} > direct.mtx
    # a sun in the middle of each patch, seen through the windows' own materials; by their light
    # (-V+), since rcontrib drops coefficients below 1e-6, which is much of what a blind scatters
    echo "void light solar 0 0 3 1e6 1e6 1e6" > suns.rad
    printf 'solar source sun\\n0\\n0\\n4 ${ Dx } ${ Dy } ${ Dz } 0.533\\n' > suns.fmt
    cnt $((144 * suns * suns + 1)) |
        rcalc -e "MF:$suns" -f reinsrc.cal -e "Rbin=recno" -o suns.fmt >> suns.rad
    for one in {names}; do xform -m "system_$one" "windows_$one.rad"; done > panes.rad
    xform -m black room.rad |
        oconv black.rad systems.rad - shades.rad panes.rad suns.rad > suns.oct
    rcontrib -faf -I+ -V+ -ab 1 -ad "$straight" -lw "$(least "$straight")" \\
        -dc 1 -dt 0 -dj 0 -y "$count" \\
        -e "MF:$suns" -f reinhart.cal -b rbin -bn Nrbins -m solar suns.oct \\
        < "$sensors" | rmtxop -ff -s 1e-6 - > sun_coefficients.mtx
fi
if [ $# -gt 0 ]; then
    gendaymtx -m {division} {output}-of "$weather" | rmtxop -ff whole.mtx . - > hours.mtx
    if [ "$phases" = 5 ]; then
        gendaymtx -m {division} {output}-d -of "$weather" |
            rmtxop -ff direct.mtx . - > direct_hours.mtx
        gendaymtx -m "$suns" {output}-5 0.533 -d -of "$weather" |
            rmtxop -ff sun_coefficients.mtx . - > sun_hours.mtx
        rmtxop -ff hours.mtx + -s -1 direct_hours.mtx + sun_hours.mtx > five.mtx
        mv five.mtx hours.mtx
    fi
    rmtxop -fa -c {efficacy} hours.mtx | getinfo - > {result}
fi
"""
MAKEFILE = """# make                 coefficients.mtx, with PHASES=5 also sun_coefficients.mtx
# make WEATHER=FILE.wea [PHASES=5]   {result}; see run.sh
PHASES ?= 3
export PHASES
RESULT = $(if $(WEATHER),{result},$(if $(filter 5,$(PHASES)),sun_)coefficients.mtx)
SCENE = run.sh materials.rad grey.rad room.rad outdoors.rad shades.rad sky.rad systems.rad
all: $(RESULT)
$(RESULT): $(SCENE) $(wildcard windows_* *.pts) $(WEATHER)
\t./run.sh $(abspath $(WEATHER))
.PHONY: all
"""
NO_BSDF = """#!/bin/sh
echo "no BSDF is known of the windows {names}: put windows_NAME.xml beside this script, run" >&2
echo "cfs ifc attach, and export again" >&2
exit 1
"""
GROUP = """# coefficients of one group of windows: view matrix, daylight matrix, and both with its
# BSDF between them; $2: name of the scenes and results, $3, $4: bounces in the room and outdoors
group() {
    rfluxmtx -faf -I+ -ab "$3" -ad "$indoors" -lw "$(least "$indoors")" -y "$count" \\
        - "windows_$1.rad" -i "room$2.oct" < "$sensors" > "view$2_$1.mtx"
    rfluxmtx -ffa -ab "$4" -ad 16 -lw 1e-4 -c "$outdoors" \\
        "windows_$1.rad" sky.rad -i "outdoors$2.oct" > "daylight$2_$1.mtx"
    rmtxop -ff "view$2_$1.mtx" . "windows_$1.xml" . "daylight$2_$1.mtx" > "part$2_$1.mtx"
}
"""
NO_WINDOW = """# a room without windows: what slits of its drawing let in, which ought to be nothing
group() {
    rfluxmtx -faf -I+ -ab 2 -ad 1024 -lw 1e-4 -y "$count" - sky.rad -i room.oct < "$sensors" |
        rmtxop -ff - > "part$2_$1.mtx"
}
"""
LUMINANCE = (0.265, 0.67, 0.065)  # of Radiance's red, green and blue
BANDS = {  # what the script's words stand for
    "visible": {
        "{Quantity}": "Illuminance", "{unit}": "lx", "{radiance}": "luminance [cd/m2]",
        "{result}": "illuminance.txt", "{output}": "", "{weights}": "0.265 0.67 0.065",
        "{efficacy}": "47.435 119.93 11.635",
    },
    "solar": {
        "{Quantity}": "Irradiance", "{unit}": "W/m2", "{radiance}": "radiance [W/(m2 sr)]",
        "{result}": "irradiance.txt", "{output}": "-O1 ", "{weights}": "0.265 0.67 0.065",
        "{efficacy}": "0.265 0.67 0.065",
    },
}  # fmt: skip


def makefile(band: str) -> str:
    """The Makefile beside the script."""
    return _filled(MAKEFILE, BANDS[band])


def run_script(groups: Mapping[str, Path | None], division: int, band: str) -> str:
    """The shell script of a folder.

    Args:
        groups: name of each group's files and its BSDF, where it is known.
        division: of the sky, Reinhart's MF.
        band: "visible" or "solar".
    """
    unknown = [name for name, bsdf in groups.items() if bsdf is None]
    if unknown:
        return NO_BSDF.format(names=", ".join(unknown))
    names = list(groups) or ["none"]
    calls = "\n".join(f'    group {name} "$@"' for name in names)
    sums = (" + ".join(f"part{kind}_{name}.mtx" for name in names) for kind in ("", "_direct"))
    filled = dict(zip(("{sum}", "{direct}"), sums, strict=True))
    filled |= {"{group}": GROUP, "{phases}": "${PHASES:-3}"}
    if not groups:
        filled |= {"{group}": NO_WINDOW, "{phases}": "3"}
    filled |= {"{groups}": calls, "{names}": " ".join(groups), "{division}": str(division)}
    return _filled(SCRIPT, filled | BANDS[band])


def _filled(text: str, words: Mapping[str, str]) -> str:
    for place, word in words.items():
        text = text.replace(place, word)
    return text
