// One variant on the page: its picture, its figures, its plan.
(() => {
  "use strict";
  const { gettext, ngettext, fixed } = cfs;
  const TEMPERATURES = [["operative", gettext("operative"), "--operative"], ["air", gettext("air"), "--air"], ["outdoor", gettext("outdoors"), "--outdoor"]];
  const LEAST_SUN = 1; // [lx] of direct sun on a level plane that is shown
  const levelSun = (found, sun) => found.room.arrays.sun_lux[found.l] * Math.max(sun[2], 0); // [lx]

  class Panel {
    // root: its element; variants: [{label, which room where there are several, room (a promise), state}]
    constructor(root, variants, first, changed) {
      Object.assign(this, { root, variants });
      this.at = (name) => root.querySelector("." + name);
      const select = this.at("variant");
      for (const [title, group] of Map.groupBy(variants.map((v, i) => [v, i]), ([v]) => v.group)) {
        const box = document.createElement("optgroup");
        box.label = title;
        for (const [variant, i] of group) box.append(new Option(variant.label, i));
        select.append(box);
      }
      select.value = first;
      select.addEventListener("change", changed);
      this.at("eye").addEventListener("pointermove", (event) => this.point(event));
      this.at("eye").addEventListener("pointerleave", () => { this.at("under").textContent = "\u00a0"; });
      this.at("plan").addEventListener("pointermove", (event) => { if (this.drawing) this.at("there").textContent = this.drawing.words(event) || "\u00a0"; });
    }

    get variant() { return this.variants[this.at("variant").value]; }

    async compute(hour) {
      const variant = this.variant, room = await variant.room();
      const state = room.stateOf(variant.state, hour), l = room.number.get(hour);
      if (l === undefined) return { room, state, variant };
      const [picture, lux] = await Promise.all([room.picture(state, l), room.illuminance(state, l)]);
      const found = { room, state, variant, l, lux, ...picture };
      if (room.coloured) {
        found.tints = room.tints(state, l);
        found.melanopic = await room.illuminance(state, l, true);
        found.melanopicEye = room.arrays.melanopic_eye[state * room.L + l];
      }
      return found;
    }

    // Glare of what was computed; the rooms' states share a scan, whose labels are of the last picture
    rate(found) {
      if (found.l === undefined) return;
      Object.assign(found, found.room.rate(found));
      found.labels = found.glare.labels.slice();
    }

    // The picture, without its glare; look: {colours, high, outline, planes, palette}; curve: shared
    // by the panels side by side
    paintPicture(found, look, curve) {
      this.found = found;
      const { room } = found, view = room.facts.view, canvas = this.at("eye"), pen = canvas.getContext("2d");
      if (canvas.width !== view.width) canvas.width = view.width;
      if (canvas.height !== view.height) canvas.height = view.height;
      if (found.l === undefined) pen.clearRect(0, 0, view.width, view.height);
      else {
        const { pixels } = room.arrays;
        const inFalse = (values) => cfs.falseColour(view, pixels, values, look.palette, look.high / 1000, look.high);
        let picture;
        if (look.colours === "seen") picture = cfs.toneMapped(view, pixels, found.values, curve);
        else if (look.colours === "true" && found.tints) picture = cfs.trueColour(view, pixels, found, found.tints, curve);
        else if (look.colours === "melanopic" && found.tints) picture = inFalse(cfs.melanopic(found, found.tints));
        else picture = inFalse(found.values);
        pen.putImageData(picture, 0, 0);
        this.picture = picture;
      }
    }

    // Glare, plan and temperatures
    paintRest(found, hour, day, look, sun) {
      const { room, state } = found;
      if (found.l !== undefined && look.outline) {
        cfs.outlines(this.picture, found.labels);
        this.at("eye").getContext("2d").putImageData(this.picture, 0, 0);
      }
      this.say(found);
      this.drawing ||= null;
      if (!this.drawing || this.drawing.plan !== room.plan) this.drawing = new cfs.Plan(this.at("plan"), room.plan, look.palette);
      const shining = found.l !== undefined && sun[2] > 0.01 && room.arrays.sun_lux[found.l] > 0;
      const beams = shining ? room.beams(state, found.l) : [];
      this.asMelanopic = look.colours === "melanopic" && Boolean(found.melanopic);
      this.at("quantity").textContent = this.asMelanopic ? gettext("Melanopic EDI of the work plane") : gettext("Illuminance of the work plane");
      const seen = beams.filter((beam) => levelSun(found, sun) * beam.through >= LEAST_SUN);
      this.drawing.paint((this.asMelanopic ? found.melanopic : found.lux) || null, shining ? { direction: sun, groups: seen, planes: look.planes } : null);
      this.sayLight(found, beams, sun);
      this.sayHeat(room, hour, day);
    }

    say(found) {
      const { glare, room, state, variant } = found, set = (name, text) => { this.at(name).textContent = text; };
      set("state", [variant.which, room.facts.states[state]].filter(Boolean).join(" \u00b7 "));
      set("up", room.entry.turned ? gettext("as modelled, before rotation by {degrees}°", { degrees: room.entry.turned }) : gettext("north up"));
      const dgp = this.at("dgp");
      dgp.className = "dgp";
      if (!glare) {
        set("dgp", gettext("sun below the horizon"));
        set("figures", "\u00a0");
        return;
      }
      dgp.classList.add(cfs.glareClass(glare.dgp));
      set("dgp", `DGP ${fixed(glare.dgp, 3)} ${cfs.glareWords(glare.dgp)}`);
      const n = glare.sources.length, { melanopicEye } = found;
      const facts = [
        gettext("{lux} lx at the eye", { lux: cfs.number(glare.Ev) }),
        n ? ngettext("{count} glare source", "{count} glare sources", n) : gettext("no glare source"),
      ];
      if (melanopicEye !== undefined) facts.push(gettext("{lux} lx melanopic EDI at the eye", { lux: cfs.number(melanopicEye) }));
      if (glare.sources.some((s) => s.sun)) facts.push(gettext("solar disc in view"));
      facts.push(gettext("up to {value} cd/m²", { value: cfs.number(glare.largest, 2) }));
      set("figures", facts.join(", "));
    }

    sayLight(found, beams, sun) {
      const { lux } = found;
      if (!lux) { this.at("light").textContent = "\u00a0"; return; }
      const sorted = Array.from(lux).sort((a, b) => a - b), middle = sorted[sorted.length >> 1];
      let text = gettext("Work plane: median {median} lx, {least} to {most} lx.", {
        median: cfs.number(middle), least: cfs.number(sorted[0]), most: cfs.number(sorted.at(-1)),
      });
      const direct = levelSun(found, sun) * Math.max(0, ...beams.map((b) => b.through));
      if (direct >= LEAST_SUN) text += " " + gettext("Sun patches reach {lux} lx.", { lux: cfs.number(direct, 2) });
      else if (beams.length) text += " " + gettext("No direct sun is transmitted.");
      this.at("light").textContent = text;
    }

    sayHeat(room, hour, day) {
      const lines = TEMPERATURES.filter(([name]) => room.arrays[name]).map(([name, label, colour]) => ({
        label, colour, now: room.arrays[name][hour], values: room.arrays[name].subarray(day * 24, day * 24 + 24),
        dash: name === "outdoor" ? [2, 3] : name === "air" ? [7, 3] : [],
      }));
      this.at("heat").hidden = !lines.length;
      if (!lines.length) return;
      const loads = [["heating", gettext("heating")], ["cooling", gettext("cooling")], ["lighting", gettext("lighting")]]
        .filter(([name]) => room.arrays[name] && room.arrays[name][hour] >= 1)
        .map(([name, label]) => `${label} ${cfs.number(room.arrays[name][hour], 2)} W`);
      const operated = room.facts.states.length > 1 ? " " + gettext("(as operated in the year)") : "";
      this.at("temperatures").textContent = lines.map((l) => `${l.label} ${fixed(l.now, 1)} °C`).concat(loads).join(", ") + operated;
      cfs.paintDay(this.at("day"), lines, hour % 24);
    }

    point(event) {
      const { found } = this;
      if (!found || found.l === undefined) return;
      const box = this.at("eye").getBoundingClientRect(), { view } = found.room.facts;
      const x = Math.floor((event.clientX - box.left) / box.width * view.width), y = Math.floor((event.clientY - box.top) / box.height * view.height);
      this.lookup ||= new Map();
      if (!this.lookup.has(found.room)) this.lookup.set(found.room, new Map(Array.from(found.room.arrays.pixels, (p, i) => [p, i])));
      const i = this.lookup.get(found.room).get(y * view.width + x);
      this.at("under").textContent = i === undefined ? "\u00a0" : gettext("{value} cd/m² at the pointer", { value: cfs.number(found.values[i]) });
    }
  }
  cfs.Panel = Panel;
})();
