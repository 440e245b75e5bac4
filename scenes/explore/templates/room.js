// A room of a case: its arrays, and the pictures and illuminances of its shading states.
(() => {
  "use strict";
  const LUX_STEP = 0.002; // of the logarithm of 1 + lux, see scenes/explore/files.py

  class Room {
    static async load(entry) {
      const data = await cfs.load(entry.file), arrays = await cfs.arraysOf(data.arrays);
      return new Room(entry, data, arrays);
    }

    constructor(entry, data, arrays) {
      Object.assign(this, { entry, facts: data.facts, models: entry.models, luxFiles: entry.lux, arrays });
      const { lit, blockers } = arrays;
      this.number = new Map(Array.from(lit, (hour, l) => [hour, l])); // of an hour of the year
      this.L = lit.length;
      this.G = this.facts.groups;
      this.groups = Array.from({ length: this.G }, (_, g) => arrays["group" + g]);
      this.plan = { ...this.facts.plan, blockers };
      this.states = [];
      this.lux = [];
      this.mel = [];
    }

    // The fisheye of the view and a scan of it, made when first needed
    get scan() {
      if (!this.ownScan) {
        const { pixels, blind } = this.arrays;
        this.ownScan = new cfs.Scan(new cfs.Fisheye(this.facts.view, pixels, blind));
      }
      return this.ownScan;
    }

    // The state that holds in an hour of the year, for a choice of state (-1: as operated)
    stateOf(choice, hour) { return choice < 0 ? this.arrays.operated[hour] : choice; }

    pictures(state) {
      const file = this.models[state];
      this.states[state] ||= cfs.PictureYear.load(this.scan.eye, this.arrays, file);
      return this.states[state];
    }

    // Whether the run was by wavelength
    get coloured() { return Boolean(this.arrays.tint); }

    // Tints [4] of a pixel's parts in a lit hour: red, green and blue over luminance, melanopic DER
    tints(state, l) {
      const { tint, tint_indoors, tint_sky, tint_sun, pixels } = this.arrays, hour = 4 * (state * this.L + l);
      const own = tint.subarray(4 * state * pixels.length, 4 * (state + 1) * pixels.length);
      return { own, indoors: tint_indoors.subarray(hour, hour + 4), sky: tint_sky.subarray(4 * l, 4 * l + 4), sun: tint_sun.subarray(hour, hour + 4) };
    }

    // Illuminance [S] of the sensors in a lit hour [lx], or melanopic EDI
    async illuminance(state, l, melanopic = false) {
      const files = melanopic ? this.entry.melanopic : this.luxFiles, known = melanopic ? this.mel : this.lux;
      known[state] ||= cfs.load(files[state]).then(cfs.arrayOf);
      const codes = await known[state], count = codes.length / this.L, found = new Float32Array(count);
      for (let s = 0; s < count; s++) found[s] = Math.expm1(codes[s * this.L + l] * LUX_STEP);
      return found;
    }

    // Window groups with what their glass passes of the sun's beam in a lit hour
    beams(state, l) {
      return this.groups.map((triangles, g) => ({ triangles, through: this.arrays.through[(state * this.G + g) * this.L + l] }));
    }

    // Luminance picture of a lit hour; times in milliseconds, the whole with decompression
    async picture(state, l) {
      const pictures = await this.pictures(state), begun = performance.now(), picture = await pictures.picture(l);
      return { ...picture, wholeMilliseconds: performance.now() - begun };
    }

    // Glare of a picture
    rate(picture) {
      const begun = performance.now(), glare = this.scan.rate(picture.values, picture.discs), milliseconds = performance.now() - begun;
      return { glare, glareMilliseconds: milliseconds, wholeMilliseconds: picture.wholeMilliseconds + milliseconds };
    }

    // Picture and glare of a lit hour
    async rated(state, l) {
      const picture = await this.picture(state, l);
      return { ...picture, ...this.rate(picture) };
    }
  }
  cfs.Room = Room;
})();
