"""Rules of shading control that an IFC file holds, and those of an operation for its rooms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from bim.ifc.control import StoredGroup, read_control
from bim.model import Building
from mitsuba_cfs.errors import DataError
from scenes.room.control_groups import control_groups, shared_groups
from scenes.room.operation_tables import OperationTables
from scenes.room.shading_rules import ControlTable, stated_keys
from scenes.toml_file import validated


def stored_groups(building: Building, tables: OperationTables, file: Path) -> list[StoredGroup]:
    """The control groups of a building's rooms with their rules, as an IFC file holds them.

    Raises: `DataError` for a rule by a schedule that the file has by name, as IFC has none of it.
    """
    groups: list[StoredGroup] = []
    shared: dict[str, int] = {}
    of_building = {group.name: group for group in shared_groups(building, tables)}
    for space in building.spaces:
        of_room = tables.of_room(building, space)
        control = control_groups(space, of_room.control, building)
        for c, (name, rule) in enumerate(zip(control.names, control.rules, strict=True)):
            windows = tuple(w.guid for w, n in zip(space.windows, control.number, strict=True) if n == c)
            of_several = control.shared[c]
            if of_several in shared:
                known = groups[shared[of_several]]
                groups[shared[of_several]] = replace(known, windows=(*known.windows, *windows))
                continue
            for leaf in rule.leaves:
                if isinstance(leaf.schedule, str):
                    message = f"{leaf.schedule!r}: an IFC file holds 24 states, no named schedule"
                    raise DataError(message, file=file, field=f"{control.places[c]}.schedule")
            stated = stated_keys(rule)
            if rule.rule == "predictive":
                stated["predictive"] = of_room.control.predictive.model_dump(mode="json")
            if of_several:
                shared[of_several] = len(groups)
                stated["across"] = "building"
                rooms = [room.guid for room in of_building[of_several].sensor_rooms]
                stated |= {"sensor_rooms": rooms} if len(rooms) < len(of_building[of_several].windows) else {}
            groups.append(StoredGroup(of_several or name, windows, stated, "" if of_several else space.label))
    return groups


def stored_control(path: Path) -> ControlTable:
    """The control of the groups that an IFC file holds.

    Raises: `DataError` for a file without any, or a rule that cannot be.
    """
    groups = read_control(path)
    if not groups:
        message = "holds no rules of shading control: cfs ifc control writes them"
        raise DataError(message, file=path)
    tables = [
        {"name": one.name, "windows": list(one.windows)}
        | {key: value for key, value in one.rule.items() if key != "predictive"}
        for one in groups
    ]
    control: dict[str, object] = {"group": tables}
    if groups[0].rule.get("rule") == "predictive":
        control |= {k: v for k, v in groups[0].rule.items() if k in ("rule", "predictive")}
    return validated(ControlTable, control, path)
