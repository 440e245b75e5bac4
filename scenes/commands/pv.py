"""`cfs pv`: irradiance and yield of the photovoltaic modules of a building."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bim.report.issue import COLUMNS, issue_rows
from scenes import quick as quick_run
from scenes.commands.examples import StrictCommand
from scenes.commands.room_options import (
    FILE,
    PrintedHead,
    input_options,
    no_cache_option,
    quick_option,
    replacing,
    results_folder_option,
    seed_option,
)
from scenes.input_options import InputOptions

if TYPE_CHECKING:
    from scenes.result_folder import ResultFolder


@click.command(cls=StrictCommand)
@input_options("", system=False, glazing=False)
@click.option("--study", "study_file", required=True, type=FILE, help="TOML file of the system; see docs/pv.md.")
@results_folder_option
@seed_option
@no_cache_option
@quick_option
def command(study_file: Path, out: Path, seed: int, **chosen) -> None:
    """Irradiance and yield of the photovoltaic modules of a building.

    BUILDING is a honeybee model (.hbjson), gbXML, a Radiance scene (.rad) or IFC: one file or
    several of one building (architecture, facade, site), a folder or an .ifczip of them.

    Modules are selected by material, type, name or GUID.  Shading and reflections by all surfaces
    of the model are traced, with the true disc of the sun.
    """
    from scenes.input_files import read_files
    from scenes.photovoltaics.study_file import read_pv_study
    from scenes.result_folder import ResultFolder

    study = read_pv_study(study_file)
    options = InputOptions(**chosen)
    building, weather, quick = options.building, options.weather, options.quick
    files = read_files(options, hourly=False)
    inputs = (building, *options.linked, weather, study_file)
    folder = ResultFolder(out, "pv", inputs=inputs, replacing=replacing())
    # all that is small is read: what is heavy is loaded now
    from mitsuba_cfs import variants
    from mitsuba_cfs.matrices.cache import MatrixCache
    from scenes.commands.progress_bar import ProgressBar
    from scenes.photovoltaics.study import run_pv

    variants.activate()
    head = PrintedHead()
    if quick:
        click.echo(quick_run.NOTE)
    with ProgressBar() as progress:
        result = run_pv(
            options,
            files,
            study,
            file=study_file,
            seed=seed,
            progress=progress,
            cache=MatrixCache.of_user() if options.cache else None,
            on_head=head,
            **(quick_run.PV if quick else {}),
        )
        progress("results", 0.0)
        record = {
            "quick": quick,
            "head": head.record,
            "building": str(building),
            "weather": str(weather),
            "study": study.model_dump(mode="json"),
            "seed": seed,
            "relative_standard_error_of_diffuse": result.irradiance.diffuse_error,
        }
        _write(result, record, folder)
        progress("results", 1.0)
    for row in result.yield_table().itertuples():
        click.echo(
            f"{row.subsystem} (modules: {row.modules}): {row.peak_kw:.2f} kW, "
            f"{row.yield_kwh:.0f} kWh a year ({row.kwh_per_kw:.0f} kWh/kW), "
            f"mismatch {100 * row.mismatch_loss:.1f} %"
        )
    head.notes(result.weather.notes)
    click.echo(f"results: {out}")


def _write(result, record: dict[str, Any], results: ResultFolder) -> None:
    """Tables, hourly power, pictures."""
    import pandas as pd

    from mitsuba_cfs.files import json_text, write_table, write_text
    from scenes.photovoltaics.picture import view_directions, write_irradiation_picture

    times = result.weather.times[result.irradiance.steps]
    power = pd.DataFrame(
        {one.name: one.alternating_current for one in result.yields}, index=pd.Index(times, name="time")
    )
    with results.replaced() as folder:
        write_table(result.module_table().round(4), folder / "modules.csv", index=False)
        write_table(result.yield_table().round(4), folder / "yield.csv", index=False)
        write_table(power.astype("float32"), folder / "power_w.parquet")
        table = pd.DataFrame(issue_rows(result.issues, "command"), columns=list(COLUMNS))
        write_table(table, folder / "problems.csv", index=False)
        for name, towards in view_directions(result):
            write_irradiation_picture(folder / f"irradiation_{name}.png", result, towards)
        write_text(folder / "run.json", json_text(record, indent=2) + "\n")
