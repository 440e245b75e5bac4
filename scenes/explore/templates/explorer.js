// The page: one hour for all that is shown, one or two variants, and their difference.
(() => {
  "use strict";
  const { gettext, ngettext, fixed } = cfs;
  const byId = (id) => document.getElementById(id);
  const PLAY = 200; // [ms] an hour at least
  const explorer = { rooms: [], variants: [], panels: [], playing: false };
  let turn = 0; // of the latest choice
  let updating = null; // while the page follows the choices
  const frame = () => new Promise((on) => { requestAnimationFrame(() => setTimeout(on)); });

  async function start() {
    const data = await cfs.load("case");
    explorer.data = data;
    explorer.calendar = new cfs.Calendar(data.first_day, data.hours);
    explorer.palette = cfs.bytesOf(data.palette);
    byId("title").textContent = data.title;
    byId("site").textContent = data.site;
    for (const entry of data.rooms) {
      let promise;
      const room = () => (promise ||= cfs.Room.load(entry));
      const several = data.rooms.length > 1, which = several ? entry.name : "", group = which || gettext("Shading");
      if (entry.states.length > 1) explorer.variants.push({ group, which, label: gettext("as operated"), state: -1, room, entry });
      entry.states.forEach((label, state) => explorer.variants.push({ group, which, label, state, room, entry }));
    }
    const count = explorer.variants.length, first = namedVariant(), second = secondVariant(first);
    ["one", "two"].forEach((id, i) => {
      const box = byId("panel").content.firstElementChild.cloneNode(true);
      box.id = id;
      byId("panels").append(box);
      explorer.panels.push(new cfs.Panel(box, explorer.variants, i ? second : first, update));
    });
    byId("compare").disabled = count < 2;
    const isColoured = data.rooms.some((room) => (room.melanopic || []).length);
    for (const option of byId("colours").options) if (["true", "melanopic"].includes(option.value)) option.hidden = option.disabled = !isColoured;
    byId("of-colours").hidden = !isColoured;
    hands(data);
    await update();
    document.body.dataset.ready = "yes";
  }

  function hands() {
    const date = byId("date"), hour = byId("hour");
    date.max = explorer.calendar.days - 1;
    [date.value, hour.value] = beginning();
    for (const one of [date, hour]) one.addEventListener("input", update);
    for (const id of ["colours", "high", "outline", "on-floor", "on-desk", "compare"]) byId(id).addEventListener("change", update);
    byId("play").addEventListener("click", () => (explorer.playing ? stop() : play()));
    const carpet = byId("carpet");
    carpet.addEventListener("click", (event) => {
      const box = carpet.getBoundingClientRect();
      date.value = Math.floor((event.clientX - box.left) / box.width * explorer.calendar.days);
      hour.value = 23 - Math.floor((event.clientY - box.top) / box.height * 24);
      update();
    });
    const months = byId("months");
    for (const [day, name] of explorer.calendar.months()) {
      const mark = document.createElement("span");
      mark.style.left = `${100 * day / explorer.calendar.days}%`;
      mark.textContent = name;
      months.append(mark);
    }
    addEventListener("resize", update);
    addEventListener("hashchange", () => location.reload());
  }

  // What the address names behind its #, as in #case-3&06-21T09
  const named = () => location.hash.slice(1).split("&");

  // The variant of the room that the address names, else the first
  const namedVariant = () => Math.max(0, explorer.variants.findIndex((v) => v.entry.id && named().includes(v.entry.id)));

  // What to put beside a variant: the closed state of its room, else that of another, else any
  function secondVariant(first) {
    const { entry } = explorer.variants[first] || {};
    const at = [(v) => v.entry === entry && v.state === 1, (v) => v.state === 1, (v) => v.entry !== entry]
      .map((is) => explorer.variants.findIndex(is)).find((i) => i >= 0);
    return at ?? 0;
  }

  // The hour that the address names (MM-DDThh), else noon of the spring equinox
  function beginning() {
    const found = named().map((one) => /^(\d\d)-(\d\d)T(\d\d)$/.exec(one)).find(Boolean) || [0, "03", "21", "12"], { calendar } = explorer;
    for (let d = 0; d < calendar.days; d++) {
      const date = calendar.date(d);
      if (date.getUTCMonth() + 1 === Number(found[1]) && date.getUTCDate() === Number(found[2])) return [d, Number(found[3])];
    }
    return [0, 12];
  }

  function look() {
    const planes = ["floor", "desk"].filter((name) => byId("on-" + name).checked);
    return { colours: byId("colours").value, high: Number(byId("high").value), outline: byId("outline").checked, planes, palette: explorer.palette };
  }

  // Show what is chosen: the picture first, glare and plan in the next frames, so that a slider moves
  // smoothly while it is dragged; of choices that come faster than they are computed, the latest is shown
  function update() {
    turn++;
    sayTime();
    updating ||= (async () => {
      try {
        for (let last = 0; last !== turn;) { last = turn; await show(); }
      } finally {
        updating = null;
      }
    })();
    return updating;
  }

  function sayTime() {
    const day = Number(byId("date").value), clock = Number(byId("hour").value);
    byId("date-now").textContent = explorer.calendar.words(day);
    byId("hour-now").textContent = gettext("{start}:00 to {end}:00", { start: clock, end: clock + 1 });
    byId("hour").setAttribute("aria-valuetext", byId("hour-now").textContent);
    byId("date").setAttribute("aria-valuetext", byId("date-now").textContent);
  }

  async function show() {
    const day = Number(byId("date").value), clock = Number(byId("hour").value), hour = day * 24 + clock;
    const both = byId("compare").checked;
    document.body.classList.toggle("both", both);
    const shown = explorer.panels.slice(0, both ? 2 : 1), found = [];
    for (const panel of shown) found.push(await panel.compute(hour)); // arrays of one state are shared
    const suns = found.map((f) => Array.from(f.room.arrays.sun.subarray(3 * hour, 3 * hour + 3)));
    const lit = found.find((f) => f.l !== undefined), toned = lit && ["seen", "true"].includes(look().colours);
    const curve = toned ? cfs.toneCurve(lit.values) : () => 0;
    shown.forEach((panel, i) => panel.paintPicture(found[i], look(), curve));
    explorer.pictured = hour;
    await frame();
    for (const [i, panel] of shown.entries()) panel.rate(found[i]);
    await frame();
    shown.forEach((panel, i) => panel.paintRest(found[i], hour, day, look(), suns[i]));
    paintDifference(found);
    sayHour(found[0], suns[0], lit);
    paintCarpet(found[0], day, clock);
    paintScale();
    explorer.found = found;
    explorer.now = hour;
  }

  function paintDifference(found) {
    const alike = found.length === 2 && found.every((f) => f.l !== undefined)
      && found[0].values.length === found[1].values.length;
    byId("difference").hidden = !alike;
    if (!alike) return;
    const { view } = found[0].room.facts, canvas = byId("ratio");
    canvas.width = view.width;
    canvas.height = view.height;
    canvas.getContext("2d").putImageData(cfs.difference(view, found[0].room.arrays.pixels, found[0].values, found[1].values), 0, 0);
    const d = found[1].glare.dgp - found[0].glare.dgp, median = (f) => Array.from(f.lux).sort((a, b) => a - b)[f.lux.length >> 1];
    const sign = (v, digits) => (v < 0 ? "−" : "+") + fixed(Math.abs(v), digits);
    byId("changes").textContent = gettext("Second minus first: DGP {dgp}, {eye} lx at the eye, {median} lx median of the work plane.", {
      dgp: sign(d, 3), eye: sign(found[1].glare.Ev - found[0].glare.Ev, 0), median: sign(median(found[1]) - median(found[0]), 0),
    });
  }

  function sayHour(found, sun, lit) {
    const degrees = (v) => Math.round(v * 180 / Math.PI), altitude = degrees(Math.asin(Math.max(-1, Math.min(1, sun[2]))));
    let text = gettext("Sun below the horizon.");
    if (altitude > 0) {
      const azimuth = (degrees(Math.atan2(sun[0], sun[1])) + (found.room.entry.turned || 0) + 360) % 360;
      text = found.l === undefined
        ? gettext("Solar altitude {altitude}°, azimuth {azimuth}°.", { altitude, azimuth })
        : gettext("Solar altitude {altitude}°, azimuth {azimuth}°, direct normal illuminance {lux} lx.", {
          altitude, azimuth, lux: cfs.number(found.room.arrays.sun_lux[found.l], 2),
        });
    }
    byId("sun").textContent = text;
    byId("time").textContent = lit ? gettext("Computing time: picture {picture} ms, glare {glare} ms, with decompression {whole} ms.", { picture: fixed(lit.milliseconds, 0), glare: fixed(lit.glareMilliseconds, 0), whole: fixed(lit.wholeMilliseconds, 0) }) : "";
    const check = found.room.facts.checks[found.state];
    const mean = check && (check.mean < 0.0001 ? `< ${fixed(0.0001, 4)}` : fixed(check.mean, 4));
    byId("error").textContent = check ? ngettext("In {count} random hour the DGP shown differs from that of the uncompressed pictures by {most}.", "In {count} random hours the DGP shown differs from that of the uncompressed pictures by at most {most}, on average {mean}.", check.hours.length, { most: fixed(check.largest, 4), mean }) : "";
  }

  function paintCarpet(found, day, clock) {
    const { room, variant } = found, values = new Float32Array(explorer.calendar.days * 24).fill(NaN);
    room.arrays.lit.forEach((hour, l) => { values[hour] = room.arrays.eye[room.stateOf(variant.state, hour) * room.L + l]; });
    cfs.paintCarpet(byId("carpet"), values, explorer.calendar.days, explorer.palette, 50, 20000, [day, clock]);
  }

  function paintScale() {
    const { colours, high, palette } = look(), box = byId("scale");
    box.hidden = colours === "seen" || colours === "true";
    byId("bar").style.background = cfs.gradient(palette);
    for (const [end, value] of [["low-end", high / 1000], ["high-end", high]]) {
      const number = cfs.number(value, 2);
      byId(end).textContent = colours === "melanopic" ? gettext("{value} cd/m², melanopic EDL", { value: number }) : `${number} cd/m²`;
    }
    for (const bar of document.querySelectorAll(".lux-bar")) bar.style.background = cfs.gradient(palette);
    const ratios = Array.from({ length: 9 }, (_, i) => `rgb(${cfs.ratioColour(cfs.MOST_RATIO ** ((i - 4) / 4)).join()})`);
    byId("ratio-bar").style.background = `linear-gradient(90deg,${ratios.join(",")})`;
  }

  async function play() {
    explorer.playing = true;
    byId("play").textContent = gettext("Pause");
    const date = byId("date"), hour = byId("hour");
    while (explorer.playing) {
      const begun = performance.now();
      let clock = Number(hour.value) + 1, day = Number(date.value);
      if (clock > 21) { clock = 4; day = (day + 1) % explorer.calendar.days; }
      hour.value = clock;
      date.value = day;
      await update();
      await new Promise((done) => { setTimeout(done, Math.max(0, PLAY - (performance.now() - begun))); });
    }
  }
  function stop() {
    explorer.playing = false;
    byId("play").textContent = gettext("Play");
  }
  cfs.explorer = explorer;
  start().catch((error) => { byId("fault").hidden = false; byId("fault").textContent = gettext("This page cannot be shown: {reason}", { reason: error.message }); throw error; });
})();
