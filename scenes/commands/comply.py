"""`cfs comply`: the rooms of a building against daylight rules, with a dossier that prints."""

from __future__ import annotations

import re
from pathlib import Path

import click

from bim.report.issue import issue_text
from scenes import quick as quick_run
from scenes.commands.examples import StrictCommand
from scenes.commands.room_options import (
    FILE,
    PrintedHead,
    check_is_ifc,
    chosen_language,
    directions_option,
    eye_height_option,
    grid_option,
    input_options,
    named_settings,
    replacing,
    room_options,
    stated_options,
    taken,
    write_ifc_option,
)
from scenes.commands.under_way import FirstPlanPage
from scenes.comply.options import ComplyOptions
from scenes.room.options import RoomOptions

OF_RULES = (  # choices of a run that are the rules' own, or of what a check has not
    "sensor_spacing",
    "sensor_height",
    "sensor_margin",
    "picture_hours",
    "picture_count",
)
DAYS = ((2, 1), (3, 21))  # between which EN 17037 has the day of the sunlight chosen


def list_rules(context: click.Context, _: click.Parameter, value: bool) -> None:
    """Print the included and omitted parts of each rule's standard, and end."""
    if not value or context.resilient_parsing:
        return
    from scenes.comply.rules import read_rule, rule_names

    for name in rule_names():
        rule = read_rule(name)
        click.echo(f"{name}: {rule.title} ({rule.edition})")
        if rule.sites:
            words = [f"'{word}'" for word in rule.sites]
            click.echo(f"  asks for the weather of: {rule.weather_asked} (site or file name has {' or '.join(words)})")
        if rule.header:
            click.echo(f"  gives a verdict where the header of the weather file states {' or '.join(rule.header)}")
        for label, sentences in (("included", rule.included), ("left out", rule.left_out)):
            for sentence in sentences:
                click.echo(f"  {label}: {sentence}")
    context.exit()


@click.command(cls=StrictCommand)
@click.option(
    "--list",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=list_rules,
    help="List the rule sets, with the parts of each standard that are included and left out.",
)
@input_options("all")
@room_options
@click.option(
    "--standard",
    "standards",
    multiple=True,
    required=True,
    metavar="NAME|FILE.toml",
    help="Rule set: en17037, leed-v4.1, another of docs/comply.md, or a file; may be repeated.",
)
@click.option(
    "--closed",
    type=FILE,
    help="BSDF XML file of every window with its blinds closed; default: the last state that the "
    "IFC holds, else LM-83's shade.",
)
@click.option(
    "--operation",
    type=FILE,
    help="TOML file: shading states and control, gains, set points; its [control] moves the blinds for glare, "
    "temperatures and light at the eye; default: LM-83's rule.",
)
@click.option("--uses", type=FILE, help="TOML file of room uses; see docs/comply.md.")
@click.option(
    "--lamps",
    type=FILE,
    help="Operation file: [[gains.luminaire]] with spectra and [[surface]], for rules of light at the eye.",
)
@click.option(
    "--day", default="03-21", show_default=True, metavar="MM-DD", help="Date for exposure to sunlight, 02-01 to 03-21."
)
@click.option(
    "--sun-altitude",
    "least_altitude_deg",
    type=click.FloatRange(0, 45),
    help="Minimum solar altitude [deg]; default: the rule's value for the country.",
)
@eye_height_option
@grid_option
@directions_option
@write_ifc_option("a level for each criterion and room")
def command(
    *, out: Path, day: str, write_ifc: Path | None, page: Path | None, settings: tuple[str, ...], **chosen
) -> None:
    """Check the rooms of a building against rules of daylight and heat; write a dossier.

    BUILDING is a honeybee model (.hbjson), gbXML, a Radiance scene (.rad) or IFC: one file or
    several of one building (architecture, facade, site), a folder or an .ifczip of them.
    """
    named = named_settings(settings, OF_RULES)
    if chosen["quick"]:
        chosen |= quick_run.picks(quick_run.ROOM, stated_options())
    chosen |= named
    own = taken(ComplyOptions, chosen)
    options = ComplyOptions(**own, day=day_of(day), room=RoomOptions.of(**chosen))
    building, quick = options.building, options.quick
    from mitsuba_cfs.files import check_file
    from scenes.comply.files import read_files
    from scenes.page_options import DossierSection, read_page
    from scenes.result_folder import DOSSIER, ResultFolder

    page_options = read_page(page, DossierSection, chosen_language())
    inputs = (building, options.weather, options.system, options.closed, options.operation)
    inputs += (options.uses, options.lamps)
    inputs += (*options.linked, *options.surroundings, *page_options.inputs)
    rules = [name for name in options.standards if name[-5:] != ".toml"]
    inputs += tuple(Path(name) for name in options.standards if name[-5:] == ".toml")
    folder = ResultFolder(out, "comply", inputs=inputs, rules=rules, replacing=replacing())
    if write_ifc is not None:
        check_is_ifc(building, "--write-ifc")
        check_file(write_ifc, field="--write-ifc", inputs=(building,))
    files = read_files(options)  # before anything heavy is loaded
    from scenes.commands.progress_bar import ProgressBar, compiled_beside
    from scenes.comply.comply import check_building
    from scenes.comply.outputs import answers, write_compliance, write_into_ifc

    if quick:
        click.echo(quick_run.NOTE)
    head = PrintedHead()
    with ProgressBar() as progress, compiled_beside():
        plan = FirstPlanPage(folder, DOSSIER, page_options.language, refined=False)
        result = check_building(options, progress, files, head, on_plan=plan)
        write_compliance(result, folder, quick=quick, page=page_options)
    for title, sentence in answers(result):
        click.echo(f"{title}: {sentence}")
    head.notes((*result.assumptions, *result.notes, *result.settings))
    click.echo(f"dossier: {out / DOSSIER}")
    if write_ifc is not None:
        for issue in write_into_ifc(result, write_ifc):
            click.echo(f"note: {issue.where}: {issue_text(issue, 'command').what}")
        click.echo(f"building with results: {write_ifc}")


def day_of(text: str) -> tuple[int, int]:
    """Month and day of "MM-DD", between those of EN 17037."""
    match = re.fullmatch(r"(\d{1,2})-(\d{1,2})", text)
    day = (int(match[1]), int(match[2])) if match else (0, 0)
    if not DAYS[0] <= day <= DAYS[1] or day[1] > (29 if day[0] == 2 else 31) or day[1] < 1:
        raise click.UsageError(f"--day {text!r}: expected a day from 02-01 to 03-21, as 03-21")
    return day
