"""Commands: examples in their help, the names near an unknown one, options that are given once."""

from __future__ import annotations

from collections import Counter
from difflib import get_close_matches

import click

EXAMPLES = {
    "app": ("cfs app house", "cfs app house --language de --no-browser"),
    "run": (
        "cfs run house.ifc --weather city.epw --out results --quick",
        "cfs run house.ifc --weather city.epw --cfs blind.xml --u 1.1 --g 0.25 --out results",
        "cfs run house.ifc --weather city.epw --space Kitchen --annual-glare --out results",
        "cfs run house.ifc --weather city.epw --cfs blind.xml --sensitivities --out results",
        "cfs run house.ifc --weather city.epw --cfs blind.xml --bands --out results",
    ),
    "comply": (
        "cfs comply --list",
        "cfs comply house.ifc --weather city.epw --standard en17037 --out dossier",
        "cfs comply school.ifc --weather city.epw --standard lm83 --closed blind.xml --out dossier",
    ),
    "demo": ("cfs demo", "cfs demo --out somewhere"),
    "explore": ("cfs explore results", "cfs explore blind-up blind-down --out comparison"),
    "doctor": ("cfs doctor",),
    "check": (
        "cfs check house.ifc",
        "cfs check house.ifc --html house.html --fix",
        "cfs check architecture.ifc facade.ifc --only-storey 'Level 2'",
    ),
    "export": (
        "cfs export house.ifc --radiance house-radiance",
        "cfs export house.ifc --honeybee house.hbjson --glazing 'double low-e'",
    ),
    "glare": ("cfs glare -d view.hdr", "cfs glare -vta -vv 180 -vh 180 -c check.hdr view.hdr"),
    "picture": (
        "cfs picture house.ifc --weather city.epw --at '03-21 12:00' --out noon.png",
        "cfs picture scene.rad --weather city.wea --at '12-21 10:00' --view eye.vf --out eye.hdr",
    ),
    "dgp": (
        "cfs dgp house.ifc --weather city.epw --space Office --out glare",
        "cfs dgp house.ifc --weather city.epw --grid 1 --directions 4 --quick --out glare",
    ),
    "thermal": ("cfs thermal study.toml --out heat --figures",),
    "study": (
        "cfs study study.toml --out study",
        "cfs study study.toml --out study --method auto --time-budget 20min --dgp-error 10%",
    ),
    "design": ("cfs design design.toml --out design",),
    "fit": ("cfs fit fit.toml --out fit",),
    "pv": ("cfs pv house.ifc --weather city.epw --study modules.toml --out yield",),
    "site neighbours": ("cfs site neighbours next-door.ifc --weather city.epw --proposed tower.glb --out site",),
    "site reflections": ("cfs site reflections house.ifc --weather city.epw --points street.csv --out site",),
    "calibrate": ("cfs calibrate",),
    "ifc attach": (
        "cfs ifc attach house.ifc --facade S --bsdf blind.xml --u 1.1 --g 0.25 -o out.ifc",
        "cfs ifc attach house.ifc --all --bsdf closed.xml --state closed -o out.ifc",
    ),
    "ifc control": ("cfs ifc control house.ifc shading.toml -o controlled.ifc",),
    "ifc correct": ("cfs ifc correct house.ifc -o corrected.ifc",),
    "ifc info": ("cfs ifc info house.ifc", "cfs ifc info house.ifc --json house.json"),
    "ifc query": ("cfs ifc query house.ifc 'IfcWindow, location=\"Level 2\"'",),
    "ifc survey": ("cfs ifc survey models/*.ifc --markdown survey.md",),
    "ifc templates": ("cfs ifc templates --out templates",),
    "ifc bonsai": ("cfs ifc bonsai --out cfs.zip",),
    "bsdf check": ("cfs bsdf check blind.xml",),
    "bsdf info": ("cfs bsdf info blind.xml",),
    "bsdf plot": ("cfs bsdf plot blind.xml --incident 140 90 --out blind.png",),
    "bsdf eval": ("cfs bsdf eval blind.xml --incident 140 90 --outgoing 40 270",),
    "bsdf generate": (
        "cfs bsdf generate --tilt-deg 45 --depth-mm 80 --spacing-mm 72 --out slats.xml",
        "cfs bsdf generate --shape perforated --openness 0.1 --out sheet.xml",
        "cfs bsdf generate --depth-mm 80 --spacing-mm 72 --sheet-colour '#b04a3a' --out red.xml",
    ),
    "bsdf system": ("cfs bsdf system layers.toml --out blind.xml",),
    "bsdf library": (
        "cfs bsdf library",
        "cfs bsdf library --glazing 'triple low-e' --shade 'screen 5 %, grey' --out screen.xml",
    ),
    "bsdf combine": ("cfs bsdf combine blind.xml glazing.xml --out system.xml",),
    "bsdf interpolate": ("cfs bsdf interpolate sample*.txt --out sample.xml",),
    "bsdf thermal": (
        "cfs bsdf thermal open.xml closed.xml --out ratings.csv",
        "cfs bsdf thermal screen.xml --place external --glazing C",
    ),
    "sky matrix": ("cfs sky matrix city.epw city.smx -m 4",),
    "sky positions": ("cfs sky positions city.epw sun.csv",),
    "sky wea": ("cfs sky wea city.epw city.wea",),
    "sky measured": ("cfs sky measured roof.csv roof.wea --latitude 48 --longitude 7.8 --timezone 1",),
    "sky cie": ("cfs sky cie overcast overcast.smx --horizontal 10000",),
}


def with_examples(command: click.Command, name: str) -> click.Command:
    """A command whose help, and that of its subcommands, ends with examples."""
    if isinstance(command, click.Group):
        for part, one in command.commands.items():
            with_examples(one, f"{name} {part}")
    elif lines := EXAMPLES.get(name):
        command.epilog = "\b\n" + "\n".join(("Examples:", *(f"  {line}" for line in lines)))
    return command


class StrictCommand(click.Command):
    """A command that refuses an option given twice; click would take the last without a word."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """As click's."""
        given = Counter(self.make_parser(ctx).parse_args(list(args))[2])
        for option, times in given.items():
            several = not isinstance(option, click.Option) or option.multiple or option.count or option.is_flag
            if times > 1 and not several:
                ctx.fail(f"{option.opts[-1]} is given {times} times and takes one value.")
        return super().parse_args(ctx, args)


class CommandGroup(click.Group):
    """A group whose error about an unknown command names those that are near."""

    command_class = StrictCommand

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """As click's."""
        known = self.list_commands(ctx)
        near = get_close_matches(args[0], known, n=2)
        if args[0] not in known and near:
            hint = " or ".join(f"'{name}'" for name in near)
            ctx.fail(f"No such command {args[0]!r}. (Did you mean {hint}?)")
        return super().resolve_command(ctx, args)
