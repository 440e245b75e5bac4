// The luminance picture of an hour from patterns and codes (mitsuba_cfs/picture_year):
//   L[pixel] = share reflected[row] + window ratio + beam
(() => {
  "use strict";

  class PictureYear {
    // view: arrays that all states share; model: those of one state; name: of its file
    constructor(name, fisheye, view, model, facts) {
      Object.assign(this, { name, fisheye, view, model, facts });
      this.parts = [this.part("rows"), this.part("windows")];
      this.isWindow = new Int32Array(view.row.length).fill(-1);
      model.window.forEach((pixel, i) => { this.isWindow[pixel] = i; });
      this.values = new Float32Array(view.row.length);
      this.ofBeam = new Float32Array(view.row.length); // parts of the values: the sun's beam, what windows show
      this.ofWindow = new Float32Array(view.row.length);
      this.files = new Map();
    }

    static async load(fisheye, view, name) {
      const data = await cfs.load(name);
      return new PictureYear(name, fisheye, view, await cfs.arraysOf(data.arrays), data.facts);
    }

    part(name) {
      const m = this.model, typical = m[name + "_typical"], n = typical.length;
      return {
        n, typical, pattern: m[name + "_pattern"], step: this.facts[name + "_step"],
        scale: m[name + "_scale"], amounts: m[name + "_amounts"], amountStep: m[name + "_amount_step"],
        found: new Float32Array(n),
      };
    }

    ofPart(part, hour) {
      const { n, found, pattern, typical } = part, rank = part.amountStep.length;
      found.fill(0);
      for (let r = 0; r < rank; r++) {
        const much = part.amounts[hour * rank + r] * part.amountStep[r] * part.step, from = r * n;
        for (let i = 0; i < n; i++) found[i] += much * pattern[from + i];
      }
      const scale = part.scale[hour];
      for (let i = 0; i < n; i++) found[i] = found[i] > 0 ? found[i] * typical[i] * scale : 0;
      return found;
    }

    // Codes of an hour: [levels, codes] of the beam and of the windows' ratios; null without any
    async codes(hour) {
      const files = this.facts.codes, number = files.findIndex((f) => hour >= f.first && hour < f.first + f.sizes.length);
      const file = files[number], at = hour - file.first;
      if (!this.files.has(number)) this.files.set(number, cfs.load(`${this.name}_${number}`).then(cfs.bytesOf));
      const bytes = await this.files.get(number);
      let start = 0;
      for (let i = 0; i < at; i++) start += file.sizes[i];
      if (!file.sizes[at]) return null;
      const raw = await cfs.inflated(bytes.subarray(start, start + file.sizes[at]));
      const counts = new Uint16Array(raw.slice(0, 4).buffer);
      const levels = new Float32Array(raw.slice(4, 4 + 4 * (counts[0] + counts[1])).buffer);
      const from = 4 + 4 * levels.length, n = this.view.row.length;
      return {
        beam: levels.subarray(0, counts[0]), ratio: levels.subarray(counts[0]),
        beamCode: raw.subarray(from, from + n), ratioCode: raw.subarray(from + n),
      };
    }

    // Luminance [cd/m2] of the pixels in an hour (a number among the hours with the sun up)
    compute(hour, codes) {
      const rows = this.ofPart(this.parts[0], hour), windows = this.ofPart(this.parts[1], hour);
      const { row, share } = this.view, { values, ofBeam, ofWindow } = this, n = values.length;
      ofBeam.fill(0);
      ofWindow.fill(0);
      for (let i = 0; i < n; i++) values[i] = rows[row[i]] * share[i];
      if (codes) {
        const { beam, beamCode, ratio, ratioCode } = codes, floor = this.model.floor[hour];
        if (beam.length) for (let i = 0; i < n; i++) if (beamCode[i]) { ofBeam[i] = beam[beamCode[i] - 1]; values[i] += ofBeam[i]; }
        if (ratio.length) {
          for (let i = 0; i < windows.length; i++) {
            if (ratioCode[i]) windows[i] = Math.max(windows[i], floor) * ratio[ratioCode[i] - 1];
          }
        }
      }
      const { window } = this.model;
      for (let i = 0; i < window.length; i++) { values[window[i]] += windows[i]; ofWindow[window[i]] = windows[i]; }
      return values;
    }

    // The sun's disc and its images in mirrors
    discs(hour) {
      const { disc, disc_hour } = this.model, discs = [];
      for (let at = disc_hour.indexOf(hour); at >= 0 && disc_hour[at] === hour; at++) {
        const d = disc.subarray(5 * at, 5 * at + 5);
        discs.push({ direction: [d[0], d[1], d[2]], luminance: d[3], solidAngle: d[4] });
      }
      return discs;
    }

    async picture(hour) {
      const codes = await this.codes(hour), start = performance.now();
      const values = this.compute(hour, codes);
      return { values, ofBeam: this.ofBeam, ofWindow: this.ofWindow, discs: this.discs(hour), milliseconds: performance.now() - start };
    }
  }
  cfs.PictureYear = PictureYear;
})();
