"""Spoilt files of panes: read, or one line that names the file."""

from __future__ import annotations

import json

import pytest

from mitsuba_cfs.bsdf.spectral_pane import read_glazing_layers, read_pane_file
from mitsuba_cfs.errors import DataError
from tests.bim.bim_fuzz import mutations, odd_values

ROWS = [(0.3, 0.1, 0.05, 0.06), (0.55, 0.8, 0.08, 0.09), (2.5, 0.6, 0.1, 0.1)]
OPTICS = (
    "{ Units, Wavelength Units } SI Nanometers\n{ Thickness } 6.0\n{ Conductivity } 1.0\n"
    "{ IR Transmittance } TIR=0.01\n{ Emissivity, front back } Emis= 0.84 0.84\n"
    "{ Product Name: Clear }\n{ Coated Side: Neither }\n"
    + "".join(f"{1000 * nm:g} {t} {f} {b}\n" for nm, t, f, b in ROWS)
)
PRODUCT = {
    "type": "monolithic",
    "name": "Clear",
    "coated_side": "neither",
    "measured_data": {
        "thickness": 6.0,
        "conductivity": 1.0,
        "emissivity_front": 0.84,
        "emissivity_back": 0.84,
        "tir_front": 0.0,
        "is_specular": True,
    },
    "spectral_data": {"spectral_data": [{"wavelength": nm, "T": t, "Rf": f, "Rb": b} for nm, t, f, b in ROWS]},
    "integrated_results_summary": [{"tfvis": 0.8, "rfvis": 0.08, "rbvis": 0.09}],
}
LAYERS = {
    "layers": [
        {
            "product_type": "glazing",
            "coated_side": "front",
            "flipped": False,
            "spectral_data": {str(1000 * row[0]): row[1:] for row in ROWS},
        }
    ]
}
OPTICAL = {
    "data": [
        {
            "componentCharacteristics": {"surface": side},
            "dataPoints": [
                {
                    "incidence": {"direction": {"polar": 8}, "wavelengths": {"wavelength": 1000 * nm}},
                    "emergence": {"direction": "hemispherical"},
                    "results": {"transmittance": t, "reflectance": f},
                }
                for nm, t, f, _ in ROWS
            ],
        }
        for side in ("prime", "nonPrime")
    ],
    "serverSpecific": {"igsdb": {"physicalProperties": {"thickness": 4}}},
}
FILES = {
    "optical data": (read_pane_file, OPTICAL),
    "optics": (read_pane_file, OPTICS),
    "product": (read_pane_file, PRODUCT),
    "layers": (read_glazing_layers, LAYERS),
}


def _texts(content):
    if isinstance(content, str):
        return mutations(content.encode(), 200)
    whole = json.dumps(content).encode()
    odd = (json.dumps(one).encode() for one in odd_values(content, 200))
    return [*odd, *mutations(whole, 100)]


@pytest.mark.parametrize("kind", FILES)
def test_a_spoilt_pane_is_read_or_refused(tmp_path, kind):
    read, content = FILES[kind]
    path = tmp_path / "pane.txt"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    panes = read(path)
    pane = panes[0] if isinstance(panes, list) else panes
    assert pane.spectrum.shape == (3, 4)
    refused = 0
    for text in _texts(content):
        path.write_bytes(text)
        try:
            read(path)
        except DataError as error:
            refused += 1
            assert "pane.txt" in str(error) and "\n" not in str(error)
    assert refused > 20
