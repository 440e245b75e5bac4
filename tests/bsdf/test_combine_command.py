"""`cfs bsdf combine`: a system of several files, its absorptances, its errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KLEMS_QUARTER, KlemsBsdf
from mitsuba_cfs.bsdf.xml import BsdfFile, read_bsdf_xml, write_bsdf_xml
from scenes import cli


def diffuser(path: Path, basis, transmittance: float, reflectance: float, **bands: float) -> Path:
    """A Lambertian sheet; its solar transmittance may differ."""
    shape = (basis.size, basis.size)

    def sheet(tau: float) -> KlemsBsdf:
        t, r = np.full(shape, tau / np.pi), np.full(shape, reflectance / np.pi)
        return KlemsBsdf(basis, basis, t, t, r, r)

    files = {"Visible": sheet(transmittance)} | {k: sheet(v) for k, v in bands.items()}
    write_bsdf_xml(BsdfFile(files, name=path.stem, thickness=0.01), path)
    return path


def test_two_diffusers_are_the_geometric_series(tmp_path, capsys):
    outer = diffuser(tmp_path / "outer.xml", KLEMS_FULL, 0.3, 0.5, Solar=0.2)
    inner = diffuser(tmp_path / "inner.xml", KLEMS_FULL, 0.4, 0.2)
    out, table = tmp_path / "both.xml", tmp_path / "absorbed.csv"
    names = [str(p) for p in (outer, inner)]
    assert cli.run(["bsdf", "combine", *names, "--out", str(out), "--absorptances", str(table)]) == 0
    expected = 0.3 * 0.4 / (1 - 0.5 * 0.2)
    assert f"{expected:.4f}" in capsys.readouterr().out
    file = read_bsdf_xml(out)
    assert list(file.bands) == ["Visible"] and file.thickness == pytest.approx(0.02)
    system = file.band("Visible")
    np.testing.assert_allclose(system.direct_hemispherical(system.transmission_front), expected, rtol=1e-5)
    absorbed = pd.read_csv(table)
    front = absorbed[(absorbed.side == "front") & (absorbed.patch == 7)].set_index("layer")
    forward = 0.3 / (1 - 0.5 * 0.2)  # in the gap, towards the room
    assert front.absorptance[names[1]] == pytest.approx(0.4 * forward, rel=1e-4)
    assert front.absorptance[names[0]] == pytest.approx(0.2 + 0.2 * 0.2 * forward, rel=1e-4)


def test_other_bases_and_missing_bands(tmp_path, capsys):
    full = diffuser(tmp_path / "full.xml", KLEMS_FULL, 0.3, 0.5)
    quarter = diffuser(tmp_path / "quarter.xml", KLEMS_QUARTER, 0.4, 0.2)
    out = tmp_path / "out.xml"
    assert cli.run(["bsdf", "combine", str(full), str(quarter), "--out", str(out)]) == 0
    system = read_bsdf_xml(out).band("Visible")
    assert system.basis_in == KLEMS_FULL
    shares = system.direct_hemispherical(system.transmission_front)
    np.testing.assert_allclose(shares, 0.12 / 0.9, rtol=1e-5)

    write_bsdf_xml(BsdfFile({"Solar": read_bsdf_xml(full).band("Visible")}), tmp_path / "s.xml")
    out.unlink()
    assert cli.run(["bsdf", "combine", str(full), str(tmp_path / "s.xml"), "--out", str(out)]) == 1
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert error == f"error: {full}: has no band that all the other layers have"
    assert not out.exists()
