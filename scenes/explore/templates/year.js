// The year as a calendar: hours and dates, the carpet to choose an hour from, the day's temperatures.
(() => {
  "use strict";
  const DAY = 24;
  const CLASSES = [[0.35, "imperceptible"], [0.40, "perceptible"], [0.45, "disturbing"], [Infinity, "intolerable"]];

  class Calendar {
    constructor(first, hours) {
      this.first = Date.parse(first + "T00:00:00Z");
      this.days = Math.ceil(hours / DAY);
    }
    date(day) { return new Date(this.first + day * 864e5); }
    words(day) { return cfs.day(this.date(day), "long"); }
    months() {
      const found = [];
      for (let d = 0; d < this.days; d++) if (this.date(d).getUTCDate() === 1) found.push([d, cfs.month(this.date(d))]);
      return found;
    }
  }

  const WORDS = {
    imperceptible: cfs.gettext("imperceptible"), perceptible: cfs.gettext("perceptible"),
    disturbing: cfs.gettext("disturbing"), intolerable: cfs.gettext("intolerable"),
  };
  const glareWords = (dgp) => WORDS[glareClass(dgp)];
  const glareClass = (dgp) => CLASSES.find(([limit]) => dgp <= limit)[1];

  // Paint values [H] (NaN: empty) as days across and hours up, with a frame round the chosen hour
  function paintCarpet(canvas, values, days, palette, low, high, chosen) {
    canvas.width = days;
    canvas.height = DAY;
    const pen = canvas.getContext("2d"), picture = pen.createImageData(days, DAY);
    for (let d = 0; d < days; d++) {
      for (let h = 0; h < DAY; h++) {
        const v = values[d * DAY + h], at = 4 * ((DAY - 1 - h) * days + d);
        if (!(v > 0)) continue;
        const from = cfs.shade(palette, Math.log(Math.max(v, low) / low) / Math.log(high / low));
        for (let k = 0; k < 3; k++) picture.data[at + k] = palette[from + k];
        picture.data[at + 3] = 255;
      }
    }
    const mark = ([d, h]) => { const at = 4 * ((DAY - 1 - h) * days + d); picture.data.set([255, 0, 144, 255], at); };
    const [day, hour] = chosen;
    for (let h = 0; h < DAY; h++) if (h !== hour && h % 2) mark([day, h]);
    for (let d = 0; d < days; d++) if (d !== day && d % 6 === 0) mark([d, hour]);
    mark(chosen);
    pen.putImageData(picture, 0, 0);
  }

  // The day's lines [{values [24], colour, dash}] with the chosen hour, on a canvas
  function paintDay(canvas, lines, hour) {
    const ratio = Math.min(devicePixelRatio || 1, 2), w = Math.max(canvas.clientWidth, 100) * ratio, h = Math.max(canvas.clientHeight, 60) * ratio;
    canvas.width = w;
    canvas.height = h;
    const pen = canvas.getContext("2d"), style = getComputedStyle(canvas), all = lines.flatMap((l) => Array.from(l.values));
    const low = Math.floor(Math.min(...all) / 5) * 5, high = Math.max(Math.ceil(Math.max(...all) / 5) * 5, low + 5);
    const left = 34 * ratio, x = (t) => left + (w - left - 6 * ratio) * t / DAY, y = (v) => h - 16 * ratio - (h - 24 * ratio) * (v - low) / (high - low);
    pen.font = `${11 * ratio}px system-ui, sans-serif`;
    pen.fillStyle = pen.strokeStyle = style.color;
    pen.globalAlpha = 0.75;
    for (const v of [low, high]) pen.fillText(`${v} °C`.replace("-", "−"), 0, y(v) + 4 * ratio);
    for (const t of [0, 6, 12, 18, 24]) pen.fillText(String(t), Math.min(x(t), w - 14 * ratio), h - 2 * ratio);
    pen.globalAlpha = 0.3;
    pen.fillRect(x(hour), y(high), x(hour + 1) - x(hour), y(low) - y(high));
    pen.globalAlpha = 1;
    pen.lineWidth = 2 * ratio;
    for (const line of lines) {
      pen.strokeStyle = style.getPropertyValue(line.colour) || line.colour;
      pen.setLineDash((line.dash || []).map((v) => v * ratio));
      pen.beginPath();
      line.values.forEach((v, t) => (t ? pen.lineTo(x(t + 0.5), y(v)) : pen.moveTo(x(0.5), y(v))));
      pen.stroke();
    }
    pen.setLineDash([]);
  }
  Object.assign(cfs, { Calendar, glareClass, glareWords, paintCarpet, paintDay });
})();
