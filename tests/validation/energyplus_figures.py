"""Figures of the EnergyPlus comparison, drawn from its summary."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes

QUANTITIES = ("air", "wall", "window")
COLOURS = {"kuhn": "#b8b8b8", "linear": "#8aa4c8", "films": "#1f5fa8", "layers": "#0b2f5b"}
# dissertation, 4.5.1: RMSE of air and walls for all systems, and of the window by system
PRINTED_AIR_WALL = 0.6
PRINTED_WINDOW = {"dgu": 0.8, "ext_blind": 1.0, "ext_shade": 1.2, "int_shade": 2.8}


def write_figures(summary: dict[str, Any], folder: Path) -> list[Path]:
    """Draw what the summary has; returns the files."""
    files = [_by_group(summary, "system", folder), _by_group(summary, "orientation", folder)]
    files.append(_by_group(summary, "climate", folder))
    if "kappa" in summary:
        files += [_kappa(summary, folder), _measurement(summary, folder)]
    return files


def _by_group(summary: dict[str, Any], by: str, folder: Path) -> Path:
    table = pd.DataFrame(summary[f"by {by}"])
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.6), sharey=False, layout="constrained")
    for axis, quantity in zip(axes, QUANTITIES, strict=True):
        _bars(axis, table, by, quantity)
        if by == "system":
            _printed(axis, quantity, list(dict.fromkeys(table[by])))
    axes[0].set_ylabel("RMSE against EnergyPlus [K]")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, frameon=False, ncols=4, loc="outside lower center")
    return _save(figure, folder / f"energyplus_by_{by}.png")


def _bars(axis: Axes, table: pd.DataFrame, by: str, quantity: str) -> None:
    groups = list(dict.fromkeys(table[by]))
    models = list(dict.fromkeys(table["model"]))
    width = 0.8 / len(models)
    for i, model in enumerate(models):
        rows = table[table["model"] == model].set_index(by)
        x = np.arange(len(groups)) + (i - (len(models) - 1) / 2) * width
        axis.bar(x, rows.loc[groups, f"{quantity} rmse"], width, label=model, color=COLOURS.get(model))
    axis.set_xticks(range(len(groups)), groups, fontsize=8)
    axis.set_title(quantity, loc="left")
    axis.spines[["top", "right"]].set_visible(False)


def _printed(axis: Axes, quantity: str, systems: list[str]) -> None:
    for i, name in enumerate(systems):
        value = PRINTED_WINDOW[name] if quantity == "window" else PRINTED_AIR_WALL
        label = "dissertation" if i == 0 else None
        axis.hlines(value, i - 0.45, i + 0.45, colors="#c03030", linewidth=1.5, label=label)


def _kappa(summary: dict[str, Any], folder: Path) -> Path:
    table = pd.DataFrame(summary["kappa"])
    kappa = table["model"].str.split().str[1].astype(float)
    figure, axes = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained")
    for axis, measure in zip(axes, ("rmse", "bias"), strict=True):
        for quantity in QUANTITIES:
            axis.plot(kappa, table[f"{quantity} {measure}"], marker="o", label=quantity)
        axis.set_xlabel("kappa")
        axis.set_ylabel(f"{measure} [K]")
        axis.spines[["top", "right"]].set_visible(False)
    axes[0].legend(frameon=False)
    return _save(figure, folder / "energyplus_kappa.png")


def _measurement(summary: dict[str, Any], folder: Path) -> Path:
    table = pd.DataFrame(summary["measurement"])
    figure, axes = plt.subplots(1, 2, figsize=(8, 3.7), layout="constrained")
    for axis, quantity in zip(axes, ("g", "U"), strict=True):
        for position, style in (("external or none", "-"), ("internal", "--")):
            rows = table[(table["quantity"] == quantity) & (table["position"] == position)]
            none = {"error": 0.0} | dict.fromkeys(QUANTITIES, 0.0)
            rows = pd.concat([rows, pd.DataFrame([none])]).sort_values("error")
            for i, q in enumerate(QUANTITIES):
                axis.plot(rows["error"], rows[q], style, marker="o", color=f"C{i}", label=f"{q}, {position}")
        axis.set_xlabel("error of g" if quantity == "g" else "error of U [W/(m2 K)]")
        axis.set_ylabel("RMS change [K]")
        axis.spines[["top", "right"]].set_visible(False)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, frameon=False, ncols=3, fontsize=8, loc="outside lower center")
    return _save(figure, folder / "energyplus_measurement_errors.png")


def _save(figure: plt.Figure, path: Path) -> Path:
    figure.savefig(path, dpi=130)
    plt.close(figure)
    return path
