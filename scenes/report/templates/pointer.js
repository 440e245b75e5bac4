// Numbers under the pointer: hour and value on carpet plots, all curves on charts.
(() => {
  "use strict";
  const language = document.documentElement.lang, comma = language === "en" ? "." : ",";
  const tip = document.createElement("div");
  tip.className = "tip";
  tip.hidden = true;
  document.body.append(tip);
  function show(event, words) {
    tip.textContent = words;
    tip.hidden = false;
    const box = tip.getBoundingClientRect();
    const x = Math.min(event.clientX + 14, document.documentElement.clientWidth - box.width - 6);
    const y = event.clientY - box.height - 12;
    tip.style.left = Math.max(6, x) + "px";
    tip.style.top = (y < 6 ? event.clientY + 18 : y) + "px";
  }
  const hide = () => { tip.hidden = true; };
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  function carpet(plot, data) {
    const values = data.values;
    const start = new Date(data.start + "T00:00:00Z");
    const two = (n) => String(n).padStart(2, "0");
    plot.addEventListener("pointermove", (event) => {
      const box = plot.getBoundingClientRect();
      const day = Math.floor((event.clientX - box.left) / box.width * data.days);
      const row = Math.floor((event.clientY - box.top) / box.height * data.rows);
      if (day < 0 || row < 0 || day >= data.days || row >= data.rows) return hide();
      const code = values[row * data.days + day];
      const minutes = Math.round((data.rows - 1 - row) * 1440 / data.rows);
      const length = Math.round(1440 / data.rows);
      const date = new Date(start.getTime() + day * 864e5);
      const clock = (m) => two(Math.floor(m / 60)) + ":" + two(m % 60);
      let value = "–";
      if (data.names) { if (code >= 0) value = data.names[code].replace(/: [\d.]+ %$/, ""); }
      else if (code !== -32768) {
        const digits = Math.round(Math.log10(data.divide));
        value = (code / data.divide).toFixed(digits).replace(".", comma) + " " + data.unit;
      }
      const name = date.toLocaleDateString(language === "en" ? "en-GB" : language, { day: "numeric", month: "short", timeZone: "UTC" });
      show(event, name + ", " + clock(minutes) + " – " + clock(minutes + length) + "\n" + value);
    });
    plot.addEventListener("pointerleave", hide);
  }
  function readout(plot, data) {
    const cursor = document.createElement("div");
    cursor.className = "cursor";
    cursor.hidden = true;
    plot.append(cursor);
    plot.addEventListener("pointermove", (event) => {
      const box = plot.getBoundingClientRect(), n = data.x.length;
      const bars = n <= 12;
      const at = (event.clientX - box.left) / box.width;
      const i = Math.max(0, Math.min(n - 1, bars ? Math.floor(at * n) : Math.round(at * (n - 1))));
      cursor.hidden = bars;
      cursor.style.left = 100 * i / Math.max(n - 1, 1) + "%";
      show(event, [data.x[i], ...data.series.map(([name, values]) => name + ": " + values[i])].join("\n"));
    });
    plot.addEventListener("pointerleave", () => { cursor.hidden = true; hide(); });
  }
  // Unpacked when the pointer first comes: a building's page has hundreds of them
  async function unpacked(element) {
    const stream = new Blob([bytes(element.textContent)]).stream();
    const text = stream.pipeThrough(new DecompressionStream("deflate-raw"));
    return JSON.parse(await new Response(text).text());
  }
  for (const [name, show] of [["carpet", carpet], ["readout", readout]]) {
    for (const element of document.querySelectorAll("." + name + "-data")) {
      const plot = element.parentElement;
      plot.addEventListener("pointerenter", async () => {
        show(plot, await unpacked(element));
        plot.dataset.read = "yes";
      }, { once: true });
    }
  }
})();
