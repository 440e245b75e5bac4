"""Sentences on g_tot: the shipped blind's own figure and class, layers by ISO 52022-3."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import scenes.demo
from scenes.comply.blinds import open_and_closed
from scenes.comply.comply import solar_sentence, solar_sentences
from scenes.fenestration.ratings import rated_state
from scenes.fenestration.systems import read_system

BLIND = Path(scenes.demo.__file__).with_name("venetian_blind.xml")
LAYERS = """
shading_position = "internal"
[[layers]]
thickness = 0.006
solar = [0.775, 0.071, 0.071]
gap = { width = 0.05 }
[[layers]]
openness = 0.02
"""


def test_the_shipped_blind_by_its_file():
    """`venetian_blind.toml`: 0.2093, from 0.15 to 0.35: class 2."""
    text = solar_sentence(read_system(BLIND))
    assert "g_tot 0.21 at normal incidence (as in the heat balance), class 2 for" in text
    assert "limits 0.50, 0.35, 0.15, 0.10 of EN 14501 (not verified)" in text


def test_layers_are_rated_by_the_standard(shade):
    """Where the layers are known the line is `cfs bsdf thermal`'s row of ISO 52022-3."""
    shade.with_suffix(".toml").write_text(LAYERS)
    rows = {row["method"]: row for row in rated_state(shade, place=None, glazing=None, kappa=0.4).rows()}
    wanted = rows["ISO 52022-3, reference"]
    text = solar_sentence(read_system(shade))
    assert f"g_tot {wanted['g_tot']:.2f} at normal incidence (ISO 52022-3, reference)" in text
    assert f"class {wanted['class of g_tot']} for the limits" in text


def test_each_state_has_one_sentence_and_the_default_shade_none():
    blind = read_system(BLIND)
    other = replace(blind, name="other", u_value=None, g_value=None, g_by_patch=None, closure=None)
    states = {"north": (other, blind), "south": (other, blind)}
    named, texts = solar_sentences(states)
    assert [text.partition(":")[0] for text in named] == ["other", blind.name]
    assumed = [text for text in texts if "no U-value given" in text]
    assert len(assumed) == 1 and assumed[0].startswith("other: ")
    shaded = open_and_closed({"north": (other,)}, None)
    assert len(shaded["north"]) == 2 and len(solar_sentences(shaded)[0]) == 1
