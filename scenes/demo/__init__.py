"""What `cfs demo` runs on: a study of an office, a weather file, a venetian blind (SOURCE.md)."""

from __future__ import annotations

from pathlib import Path

FOLDER = Path(__file__).parent
OFFICE = FOLDER / "office.ifc"
WEATHER = FOLDER / "USA_IL_Chicago-OHare.Intl.AP.725300_TMY3.epw"
VENETIAN_BLIND = FOLDER / "venetian_blind.xml"
STUDY = FOLDER / "study.toml"
