"""Open a page in headless Chromium and let it report on itself: errors, sizes, overlaps, clicks."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

from tests.devtools import chromium

LISTEN = """<script>
window.faults = [];
window.requestAnimationFrame = (act) => setTimeout(act, 0);  // headless frames come when they like
addEventListener("error", (e) => faults.push(String(e.message || e.target.outerHTML)), true);
addEventListener("unhandledrejection", (e) => faults.push(String(e.reason)));
for (const kind of ["error", "warn"]) {
  const said = console[kind].bind(console);
  console[kind] = (...words) => { faults.push(words.join(" ")); said(...words); };
}
</script>"""

INSPECT = """<script>
addEventListener("load", () => setTimeout(() => {
  const box = (e) => e.getBoundingClientRect();
  const size = (e) => [Math.round(box(e).width), Math.round(box(e).height)];
  const cross = (a, b) => a.left < b.right - 1 && b.left < a.right - 1
    && a.top < b.bottom - 1 && b.top < a.bottom - 1;
  const report = { width: box(document.body).width, scroll: document.body.scrollWidth };
  report.figures = [...document.querySelectorAll("[data-figure]")].map((f) => [
    f.dataset.figure, ...[...f.querySelectorAll("svg[role], img, canvas")].map(size)]);
  report.overlaps = [];
  const rows = ".x-ticks, .y-ticks, .scale-ticks, .legend, .facts";
  for (const row of document.querySelectorAll(rows)) {
    const shown = [...row.children].filter((e) => e.className !== "sizer" && e.offsetParent);
    shown.forEach((a, i) => shown.slice(i + 1).forEach((b) => {
      if (cross(box(a), box(b))) report.overlaps.push(a.textContent + " | " + b.textContent);
    }));
  }
  const texts = ".tick, .x-ticks span, .scale-ticks span, .card *";
  // what a row of plans shows when it is scrolled sideways is not cut off
  const inRow = (e) => { const row = e.closest(".plans"); return row && getComputedStyle(row).overflowX === "auto"; };
  report.clipped = [...document.querySelectorAll(texts)]
    .filter((e) => e.offsetParent && !inRow(e) && (box(e).left < -0.5 || box(e).right > report.width + 0.5))
    .map((e) => e.textContent);
  const click = (id) => document.getElementById(id).click();
  const choose = (id, value) => {
    const e = document.getElementById(id);
    e.value = value;
    e.dispatchEvent(new Event("change"));
  };
  const canvas = document.getElementById("viewer");
  const later = (act) => new Promise((done) => {
    act();
    setTimeout(() => done(canvas.toDataURL()), 20);
  });
  const use = async () => {
    //USE//
  };
  use().catch((e) => faults.push(String(e))).finally(() => {
    report.faults = faults;
    const out = document.createElement("pre");
    out.id = "inspection";
    out.textContent = JSON.stringify(report);
    document.body.append(out);
  });
}, 300));
</script>"""

# What is done on the page of a run, and what is reported of it
USE = """
    const pictures = [await later(() => {})];
    pictures.push(await later(() => click("viewer-outdoors")));
    pictures.push(await later(() => choose("viewer-layer", "1")));
    pictures.push(await later(() => choose("viewer-room", "1")));
    pictures.push(await later(() => click("viewer-top")));
    pictures.push(await later(() => click("viewer-in")));
    report.scenes = new Set(pictures).size;
    report.scalesShown = [...document.querySelectorAll("#viewer-scales > div")]
      .map((e) => !e.hidden);
    const table = document.querySelector("[data-table^='Sensors of'] table");
    const headings = [...table.tHead.rows[0].cells];
    const column = headings.findIndex((c) => c.textContent.includes("DA 300"));
    const values = () => [...table.tBodies[0].rows].map((r) => Number(r.cells[column].textContent));
    headings[column].click();
    report.ascending = values();
    headings[column].click();
    report.descending = values();
    const plot = document.querySelector(".carpet-data").parentElement, at = box(plot);
    plot.dispatchEvent(new PointerEvent("pointerenter"));
    for (let i = 0; i < 100 && !plot.dataset.read; i++) {
      await new Promise((on) => setTimeout(on, 20));
    }
    plot.dispatchEvent(new PointerEvent("pointermove", {
      clientX: at.left + at.width * 171.5 / 365, clientY: at.top + at.height * 11.5 / 24 }));
    report.tip = document.querySelector(".tip").textContent;
"""


def inspect(page: str, folder: Path, *flags: str, width: int = 1400, use: str = USE) -> dict:
    """What the page reports on itself at that width.

    Chromium's window is at least 500 pixels wide: for a phone the page's body is made narrower.
    """
    file = folder / "inspected.html"
    narrow = f"<style>body {{ width: {width}px; }}</style>" if width < 500 else ""
    watched = page.replace("<head>", "<head>" + LISTEN, 1).replace("</head>", narrow + "</head>")
    watched = watched.replace("</body>", INSPECT.replace("//USE//", use) + "</body>")
    file.write_text(watched, encoding="utf-8")
    command = [
        chromium(),
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        f"--user-data-dir={folder / 'profile'}",
        f"--window-size={width},1000",
        "--virtual-time-budget=8000",
        *flags,
        "--dump-dom",
        file.as_uri(),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    found = re.search(r'<pre id="inspection">(.*?)</pre>', done.stdout, re.DOTALL)
    if not found:
        raise AssertionError("the page did not report on itself:\n" + done.stderr[-2000:])
    text = found.group(1).replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")
    return json.loads(text)
