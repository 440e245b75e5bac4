// Glare of a picture as evalglare 3 rates it: mitsuba_cfs/glare/scan.py, sources.py, evaluation.py.
// Which source a pixel joins depends on the order of the visits, so that order is part of the rule.
(() => {
  "use strict";
  const COUNT = 0, OMEGA = 1, FLUX = 2, FLUX_X = 3, FLUX_Y = 4, SUMS = 5;
  const RADIUS = 0.2, PEAK = 50000, THRESHOLD = 2000, EFFICACY = 179;

  class Scan {
    constructor(fisheye) {
      this.eye = fisheye;
      this.nx = fisheye.width;
      this.ny = fisheye.height;
      this.luminance = new Float64Array(this.nx * this.ny);
      this.labels = new Int32Array(this.nx * this.ny);
      this.listed = new Int32Array(this.nx * this.ny);
      this.bright = this.listed.subarray(0, 0); // pixels above the threshold, in scan order: all that have labels
      this.boxes = new Int32Array(0);
    }

    // Whether twice the angle between two pixels is at most the radius
    near(a, b, radius, cosine) {
      if (a === b) return !this.eye.blind[a];
      const d = this.eye.directions, i = 3 * a, j = 3 * b;
      const dot = d[i] * d[j] + d[i + 1] * d[j + 1] + d[i + 2] * d[j + 2];
      if (dot > 1 || dot < cosine - 1e-9) return false;
      return dot > cosine + 1e-9 || 2 * Math.acos(dot) <= radius;
    }

    search(x, y, radius, cosine, reach, own, lowest, highest) {
      const { nx, ny, labels, sums } = this, from = x * ny + y, lastX = own === 0 ? x : nx - 1;
      let found = 0, largest = own > 0 ? sums[own * SUMS + OMEGA] : 0;
      for (const stepY of [-1, 1]) {
        let left = x, right = x, row = stepY < 0 ? y : y + 1, done = false;
        while (!done && row >= 0 && row < ny && Math.abs(row - y) <= reach) {
          for (const stepX of [-1, 1]) {
            let column = Math.floor((left + right) / 2);
            while (!done && column >= 0 && column <= lastX) {
              if (!this.near(from, column * ny + row, radius, cosine)) {
                if (stepX < 0) left = column + 1; else right = column - 1;
                break;
              }
              const label = labels[column * ny + row];
              if (label > 0) {
                if (own === 0) { found = label; done = true; }
                else if (sums[label * SUMS + OMEGA] > largest && label >= lowest && label <= highest) {
                  found = label; largest = sums[label * SUMS + OMEGA]; done = true;
                }
              }
              column += stepX;
            }
          }
          row += stepY;
        }
      }
      return found;
    }

    labelBright(radius, reach, follow) {
      const { nx, ny, labels, luminance, eye } = this, cosine = Math.cos(Math.min(radius / 2, Math.PI));
      labels.fill(0);
      let count = 0;
      for (let x = 0; x < nx; x++) {
        let last = 0;
        for (let y = 0; y < ny; y++) {
          const at = x * ny + y;
          if (!eye.valid[at]) continue;
          if (luminance[at] > THRESHOLD) {
            let label = last;
            if (last === 0 || !follow) label = this.search(x, y, radius, cosine, reach, 0, 0, 0);
            if (label === 0) label = ++count;
            labels[at] = label;
            last = label;
          } else last = 0;
        }
      }
      return count;
    }

    addPixel(label, at, sign) {
      const { sums, ny } = this, omega = this.eye.omega[at] * sign, flux = this.luminance[at] * omega, s = label * SUMS;
      sums[s + COUNT] += sign;
      sums[s + OMEGA] += omega;
      sums[s + FLUX] += flux;
      sums[s + FLUX_X] += flux * Math.floor(at / ny);
      sums[s + FLUX_Y] += flux * (at % ny);
    }

    sumSources(size) {
      this.sums = new Float64Array(size * SUMS);
      for (const at of this.bright) if (this.labels[at] > 0) this.addPixel(this.labels[at], at, 1);
    }

    boxesOf() {
      const { nx, ny, labels } = this, boxes = new Int32Array(this.sums.length / SUMS * 4);
      for (let i = 0; i < boxes.length; i += 4) { boxes[i] = nx; boxes[i + 1] = -1; boxes[i + 2] = ny; boxes[i + 3] = -1; }
      for (const at of this.bright) {
        if (labels[at] <= 0) continue;
        const x = Math.floor(at / ny), y = at % ny, b = labels[at] * 4;
        boxes[b] = Math.min(boxes[b], x); boxes[b + 1] = Math.max(boxes[b + 1], x);
        boxes[b + 2] = Math.min(boxes[b + 2], y); boxes[b + 3] = Math.max(boxes[b + 3], y);
      }
      return boxes;
    }

    largerInReach(boxes, x, y, own, lowest, highest, reach) {
      const { sums } = this, mine = sums[own * SUMS + OMEGA];
      for (let l = lowest; l <= highest; l++) {
        const b = l * 4;
        if (sums[l * SUMS + OMEGA] > mine && boxes[b] - reach <= x && x <= boxes[b + 1] + reach
          && boxes[b + 2] - reach <= y && y <= boxes[b + 3] + reach) return true;
      }
      return false;
    }

    inside(x, y) {
      const { nx, ny, labels } = this, at = x * ny + y, label = labels[at];
      if (!(x > 1 && x < nx - 2 && y > 1 && y < ny - 2)) return false;
      for (let i = -1; i <= 1; i++) for (let j = -1; j <= 1; j++) if (labels[at + i * ny + j] !== label) return false;
      return true;
    }

    moveSource(boxes, old, now) {
      const { ny, labels, sums } = this, o = old * 4, w = now * 4;
      sums.fill(0, old * SUMS, old * SUMS + SUMS);
      for (let x = boxes[o]; x <= boxes[o + 1]; x++) {
        for (let y = boxes[o + 2]; y <= boxes[o + 3]; y++) {
          const at = x * ny + y;
          if (labels[at] === old) { labels[at] = now; this.addPixel(now, at, 1); }
        }
      }
      for (const k of [0, 2]) {
        boxes[w + k] = Math.min(boxes[w + k], boxes[o + k]);
        boxes[w + k + 1] = Math.max(boxes[w + k + 1], boxes[o + k + 1]);
      }
    }

    mergeSources(radius, reach, lowest, highest, edges) {
      if (highest <= lowest) return;
      const { ny, labels, eye } = this, cosine = Math.cos(Math.min(radius / 2, Math.PI)), boxes = this.boxesOf();
      let changed = true;
      while (changed) {
        changed = false;
        for (const at of this.bright) {
          const own = labels[at];
          if (own < lowest || !eye.valid[at]) continue;
          const x = Math.floor(at / ny), y = at % ny;
          if (edges && this.inside(x, y)) continue;
          if (!this.largerInReach(boxes, x, y, own, lowest, highest, reach)) continue;
          const now = this.search(x, y, radius, cosine, reach, own, lowest, highest);
          if (now > 0) { this.moveSource(boxes, own, now); changed = true; }
        }
      }
    }

    searchPeak(x, y, radius, cosine, lowest, highest) {
      const { nx, ny, labels } = this, from = x * ny + y, lastX = Math.min(nx, ny) - 1;
      let found = 0;
      for (const stepY of [-1, 1]) {
        for (let row = stepY < 0 ? y : y + 1; row >= 0 && row < ny; row += stepY) {
          let some = false;
          for (const stepX of [-1, 1]) {
            for (let column = stepX < 0 ? x : x + 1; column >= 0 && column <= lastX; column += stepX) {
              const at = column * ny + row;
              if (!this.near(from, at, radius, cosine)) break;
              some = true;
              if (labels[at] >= lowest && labels[at] <= highest) found = labels[at];
            }
          }
          if (!some) break;
        }
      }
      return found;
    }

    peaksOf(source, first, radius) {
      const { ny, labels, luminance, eye } = this, cosine = Math.cos(Math.min(radius / 2, Math.PI));
      let last = first - 1;
      for (const at of this.bright) {
        if (labels[at] !== source || luminance[at] < PEAK || !eye.valid[at]) continue;
        let label = 0;
        if (last >= first) label = this.searchPeak(Math.floor(at / ny), at % ny, radius, cosine, first, last);
        if (label === 0) label = ++last;
        this.addPixel(source, at, -1);
        this.addPixel(label, at, 1);
        labels[at] = label;
      }
      return last;
    }

    extractPeaks(count, radius, reach) {
      const brightest = new Float64Array(count + 1);
      for (const at of this.bright) {
        const label = this.labels[at];
        if (label > 0) brightest[label] = Math.max(brightest[label], this.luminance[at]);
      }
      let last = count;
      for (let source = 1; source <= count; source++) {
        if (this.sums[source * SUMS] > 0 && brightest[source] >= PEAK) {
          const first = last + 1;
          last = this.peaksOf(source, first, RADIUS / 2);
          this.mergeSources(radius, reach, first, last, false);
        }
      }
    }

    sources() {
      const { eye, labels, luminance } = this, radius = Math.fround(RADIUS);
      const step = eye.pixelsIn(RADIUS), reach = eye.reach(radius / 2);
      const count = this.labelBright(radius, reach, step > 1);
      let bright = 0;
      if (step >= 1 && count) for (const at of this.bright) if (luminance[at] >= PEAK) bright++;
      this.sumSources(count + 1 + bright);
      if (step > 1) this.mergeSources(radius, reach, 1, count, true);
      if (bright) this.extractPeaks(count, radius, reach);
      const numbers = new Int32Array(this.sums.length / SUMS), found = [];
      for (let l = 1; l < numbers.length; l++) {
        const [pixels, omega, flux, fluxX, fluxY] = this.sums.subarray(l * SUMS, l * SUMS + SUMS);
        if (pixels <= 0) continue;
        const x = Math.floor(Math.fround(fluxX / flux)), y = Math.floor(Math.fround(fluxY / flux));
        const way = eye.directionOf(x * this.ny + y);
        found.push({ luminance: flux / omega, solidAngle: omega, x, y, position: eye.positionIndex(way) });
        numbers[l] = found.length;
      }
      for (const at of this.bright) if (labels[at]) labels[at] = numbers[labels[at]];
      return found;
    }

    // Glare of the pixels' luminance and of the discs beside them: the sun and its images in mirrors
    rate(values, discs) {
      const { eye, luminance } = this;
      let Ev = 0, largest = 0;
      luminance.fill(0);
      for (let i = 0; i < values.length; i++) {
        const at = eye.scan[i];
        if (!eye.valid[at]) continue;
        const value = EFFICACY * Math.fround(values[i] / EFFICACY);
        luminance[at] = value;
        Ev += eye.projected[at] * value;
        if (value > largest) largest = value;
      }
      let count = 0;
      for (let at = 0; at < luminance.length; at++) if (luminance[at] > THRESHOLD) this.listed[count++] = at;
      this.bright = this.listed.subarray(0, count);
      const sources = this.sources();
      for (const disc of discs) {
        Ev += disc.luminance * disc.solidAngle * cfs.dot(disc.direction, eye.frame.forward);
        largest = Math.max(largest, disc.luminance);
        if (disc.luminance > THRESHOLD) {
          const place = eye.placeOf(disc.direction);
          sources.push({
            luminance: disc.luminance, solidAngle: disc.solidAngle, sun: true,
            x: Math.floor(place / this.ny), y: place % this.ny, position: eye.positionIndex(disc.direction),
          });
          if (!this.labels[place]) this.labels[place] = sources.length;
        }
      }
      const contrast = sources.reduce((sum, s) => sum + s.luminance ** 2 * s.solidAngle / s.position ** 2, 0);
      return { dgp: daylightGlareProbability(Ev, contrast), Ev, largest, sources, labels: this.labels };
    }
  }

  // Wienold and Christoffersen (2006), with evalglare's constants
  function daylightGlareProbability(Ev, contrast) {
    if (Ev <= 0) return 0.159;
    return Math.min(1, 5.87e-5 * Ev + 0.092 * Math.log10(1 + contrast / Ev ** 1.87) + 0.159);
  }
  Object.assign(cfs, { Scan, daylightGlareProbability });
})();
