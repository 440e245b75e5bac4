"""`cfs thermal`: gains, temperatures, loads and comfort of the rooms of a study file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scenes.commands.examples import StrictCommand
from scenes.commands.room_options import FILE, replacing

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from bim.energyplus_twin import EnergyPlusTwin
    from scenes.heat.study import BalancedRooms, ThermalYear
    from scenes.heat.study_file import StudyFile
    from scenes.result_folder import ResultFolder
from scenes import quick as quick_run
from scenes.commands.room_options import (
    PrintedHead,
    quick_option,
    results_folder_option,
    surroundings_offset_option,
    surroundings_option,
    with_flags,
)


@click.command(cls=StrictCommand)
@click.argument("study", type=FILE, metavar="STUDY.toml")
@results_folder_option
@click.option("--figures", is_flag=True, help="Write a figure of each room's year as SVG.")
@click.option(
    "--energyplus", is_flag=True, help="Also write the rooms as EnergyPlus input (model.epJSON, schedules.csv)."
)
@surroundings_option
@surroundings_offset_option
@quick_option
def command(
    study: Path,
    out: Path,
    *,
    figures: bool,
    energyplus: bool,
    surroundings: tuple[Path, ...],
    surroundings_offset: tuple[float, float, float] | None,
    quick: bool,
) -> None:
    """Compute hourly gains, temperatures, loads and comfort of rooms.

    The study file names the weather, the rooms (an IFC file or a box), the shading states (BSDF
    files) and their control, gains, outdoor air and set points; docs/thermal.md lists every field.
    """
    from scenes.heat.files import read_files
    from scenes.heat.study_file import read_study
    from scenes.result_folder import ResultFolder

    parsed = read_study(study, quick=quick)
    parsed = with_flags(parsed, surroundings, surroundings_offset)
    inputs = (
        study,
        parsed.weather,
        parsed.building,
        *(one.bsdf for one in parsed.system if one.bsdf),
        *parsed.surroundings,
    )
    folder = ResultFolder(out, "thermal", inputs=inputs, replacing=replacing())
    files = read_files(parsed, study)  # before anything heavy is loaded
    from scenes.commands.progress_bar import ProgressBar, compiled_beside
    from scenes.heat.study import run_study

    if quick:
        click.echo(quick_run.NOTE)
    twins: list[EnergyPlusTwin] = []
    head = PrintedHead()
    balanced = _twin_taken(parsed, twins) if energyplus else None
    with ProgressBar() as progress, compiled_beside():
        rooms, notes = run_study(parsed, progress, files, balanced=balanced, on_head=head)
    in_twin = (f"model.epJSON: {note}." for twin in twins for note in twin.notes)
    notes = (*[quick_run.NOTE] * quick, *notes, *in_twin)
    record = {"quick": quick, "study": parsed.model_dump(mode="json"), "head": head.record, "notes": list(notes)}
    _write(rooms, record, folder, figures=figures, twins=twins)
    for room in rooms:
        summary = room.summary
        click.echo(
            f"{room.name}: operative {summary['operative_min_c']:.1f} to "
            f"{summary['operative_max_c']:.1f} C, heating {summary['heat_kwh']:.0f} kWh, "
            f"cooling {summary['cold_kwh']:.0f} kWh, comfortable in "
            f"{summary['comfortable_h ASHRAE 55 80 %']:.0f} of {summary['occupied_h']:.0f} "
            "occupied hours"
        )
    head.notes(notes[quick:])
    click.echo(f"results: {out}")


def _twin_taken(study: StudyFile, twins: list[EnergyPlusTwin]) -> Callable[[BalancedRooms], None]:
    """What puts the EnergyPlus model of balanced rooms into a list; checks the study now."""
    from scenes.heat.energyplus import check_twin, energyplus_twin

    check_twin(study)
    return lambda found: twins.append(energyplus_twin(study, found))


def _write(
    rooms: Sequence[ThermalYear],
    record: dict[str, Any],
    results: ResultFolder,
    *,
    figures: bool,
    twins: Sequence[EnergyPlusTwin],
) -> None:
    """All files of a study."""
    import pandas as pd

    from mitsuba_cfs.files import json_text, write_table, write_text

    with results.replaced() as folder:
        for number, room in enumerate(rooms, 1):
            name = "hours.csv" if len(rooms) == 1 else f"hours_{number}.csv"
            write_table(room.hours.round(4), folder / name)
            write_table(room.powers.round(3), folder / name.replace("hours", "energy"))
            if figures:
                from scenes.heat.plots import year_figure

                year_figure(room, folder / name.replace("hours", "year").replace("csv", "svg"))
        if rooms[0].design is not None:
            days = pd.concat([room.design for room in rooms])
            write_table(days.round(3), folder / "design_days.csv", index=False)
        table = pd.DataFrame([{"room": r.name, "floor_m2": r.floor_area} | r.summary for r in rooms])
        write_table(table.round(4), folder / "summary.csv", index=False)
        months = pd.concat({r.name: r.months for r in rooms}, names=["room"])
        write_table(months, folder / "discomfort_by_month.csv")
        energy = pd.concat({r.name: r.energy for r in rooms}, names=["room"])
        write_table(energy.round(4), folder / "energy_by_month.csv")
        for twin in twins:
            twin.write(folder)
        write_text(folder / "run.json", json_text(record, indent=2) + "\n")
