// The plan of a room in an hour: sensors in the colour of their illuminance, patches of sun, the eye.
(() => {
  "use strict";
  const MARGIN = 0.45; // [m] round the room
  const LOW = 30, HIGH = 10000; // [lx] ends of the colours
  const SUN = { floor: "rgba(255,178,0,.55)", desk: "rgba(255,222,60,.85)" };

  class Plan {
    constructor(canvas, plan, palette) {
      Object.assign(this, { canvas, plan, palette, layer: document.createElement("canvas") });
    }

    // Metres to the canvas; north is up
    frame() {
      const [west, south, east, north] = this.plan.bounds, width = east - west + 2 * MARGIN, height = north - south + 2 * MARGIN;
      const across = Math.max(this.canvas.clientWidth, 120) * Math.min(devicePixelRatio || 1, 2), scale = across / width;
      const size = [Math.round(across), Math.round(height * scale)];
      for (const canvas of [this.canvas, this.layer]) { // a canvas that gets a size anew is made anew
        if (canvas.width === size[0] && canvas.height === size[1]) canvas.getContext("2d").clearRect(0, 0, ...size);
        else [canvas.width, canvas.height] = size;
      }
      this.canvas.style.aspectRatio = `${width} / ${height}`;
      this.scale = scale;
      this.to = (x, y) => [(x - west + MARGIN) * scale, (north + MARGIN - y) * scale];
      this.from = (u, v) => [u / scale + west - MARGIN, north + MARGIN - v / scale];
    }

    path(rings, close = true) {
      const path = new Path2D();
      for (const ring of rings) {
        ring.forEach(([x, y], i) => (i ? path.lineTo(...this.to(x, y)) : path.moveTo(...this.to(x, y))));
        if (close) path.closePath();
      }
      return path;
    }

    // lux: [S] or null; sun: {direction, groups, planes: ["floor", "desk"]} or null
    paint(lux, sun) {
      this.frame();
      const pen = this.canvas.getContext("2d"), { plan, palette } = this;
      const style = getComputedStyle(this.canvas), ink = style.color, outline = this.path(plan.outline);
      pen.fillStyle = style.getPropertyValue("--floor") || "#eee";
      pen.fill(outline, "evenodd");
      this.lux = lux;
      if (lux) {
        pen.save();
        pen.clip(outline, "evenodd");
        plan.cells.forEach((cell, s) => {
          const at = cfs.shade(palette, Math.log(Math.max(lux[s], LOW) / LOW) / Math.log(HIGH / LOW));
          pen.fillStyle = `rgb(${palette[at]},${palette[at + 1]},${palette[at + 2]})`;
          pen.fill(this.path([cell]));
        });
        pen.restore();
      }
      if (sun) {
        const room = { blockers: plan.blockers, groups: sun.groups, outlinePath: () => outline };
        for (const name of sun.planes) {
          cfs.sunPatch(this.layer, room, sun.direction, plan.heights[name], this.to, SUN[name]);
          pen.drawImage(this.layer, 0, 0);
        }
      }
      pen.strokeStyle = ink;
      pen.lineWidth = 0.08 * this.scale;
      pen.stroke(outline);
      pen.strokeStyle = style.getPropertyValue("--window") || "#0a84e0";
      pen.lineWidth = 0.13 * this.scale;
      for (const ends of plan.windows) pen.stroke(this.path([ends], ends.length > 2));
      this.paintEye(pen, style);
    }

    paintEye(pen, style) {
      const { eye, sight } = this.plan, length = Math.hypot(...sight) || 1, [dx, dy] = sight.map((v) => v / length);
      const at = (a, b) => this.to(eye[0] + a * dx - b * dy, eye[1] + a * dy + b * dx);
      pen.beginPath();
      [[0.24, 0], [-0.14, 0.16], [-0.06, 0], [-0.14, -0.16]].forEach(([a, b], i) => (i ? pen.lineTo(...at(a, b)) : pen.moveTo(...at(a, b))));
      pen.closePath();
      pen.fillStyle = style.getPropertyValue("--poor") || "#b3361b";
      pen.fill();
    }

    // What stands under a place of the canvas, in words
    words(event) {
      const box = this.canvas.getBoundingClientRect(), ratio = this.canvas.width / box.width;
      const [x, y] = this.from((event.clientX - box.left) * ratio, (event.clientY - box.top) * ratio);
      const reach = 0.75 * this.plan.spacing;
      let best = -1, least = reach;
      this.plan.cells.forEach((cell, s) => {
        const distance = Math.max(Math.abs(x - (cell[0][0] + cell[2][0]) / 2), Math.abs(y - (cell[0][1] + cell[2][1]) / 2));
        if (distance < least) { least = distance; best = s; }
      });
      return best < 0 || !this.lux ? "" : cfs.gettext("{lux} lx at x {x} m, y {y} m", { lux: cfs.number(this.lux[best], 3), x: cfs.fixed(x, 1), y: cfs.fixed(y, 1) });
    }
  }
  // A number with so many significant digits, thousands set apart
  cfs.number = (value, digits = 3) => {
    if (!Number.isFinite(value)) return "–";
    const power = value ? Math.floor(Math.log10(Math.abs(value))) : 0, step = 10 ** Math.max(power - digits + 1, -digits);
    const digitsAfter = Math.max(0, digits - 1 - Math.max(power, 0)), text = (Math.round(value / step) * step).toFixed(digitsAfter);
    const [whole, ...rest] = text.split(".");
    return [whole.replace(/\B(?=(\d{3})+$)/g, "\u202f"), ...rest].join(document.documentElement.lang === "en" ? "." : ",");
  };
  Object.assign(cfs, { Plan, LUX: [LOW, HIGH] });
})();
