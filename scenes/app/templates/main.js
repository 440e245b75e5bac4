// The page: what is known of the project, the steps, and news of the commands.
import { byId, fill, get, h, notice, post, spoken, tried } from "./dom.js";
import { showBuilding } from "./building.js";
import { showCompute } from "./compute.js";
import { showFiles } from "./files.js";
import { jobName, lastLine, progressBar, progressText } from "./jobs.js";
import { showResults } from "./results.js";
import { showSystems } from "./systems.js";

const { gettext } = cfs;
const STEPS = ["files", "building", "systems", "compute", "results"];
const SHOW = { files: showFiles, building: showBuilding, systems: showSystems, compute: showCompute, results: showResults };

const page = {
  files: document.body.dataset.files, language: document.documentElement.lang,
  state: null, check: null, rules: [], library: null, jobs: [], variants: null, step: "files",
  // what is computed, as it was chosen last
  wanted: { report: true, annual_glare: false, explore: false, compare: false, standards: [] },

  async refresh() {
    this.state = await get("state");
    this.show();
  },
  async change(value) {
    const state = await tried(() => post("change", value));
    if (state) this.state = state;
    this.show();
  },
  async run(value) {
    const numbers = await tried(() => post("run", value));
    if (numbers) await this.news();
    return numbers;
  },
  async news() {
    const { version, jobs } = await get("jobs");
    this.version = version;
    this.take(jobs);
  },
  take(jobs) {
    const ended = (list) => list.filter((job) => !["waiting", "running"].includes(job.state)).map((job) => job.number);
    const before = new Set(ended(this.jobs)), fresh = ended(jobs).filter((number) => !before.has(number));
    this.jobs = jobs;
    showStatus();
    if (fresh.length) this.ended(jobs.filter((job) => fresh.includes(job.number)));
    SHOW[this.step](this, true);
  },
  async ended(jobs) {
    for (const job of jobs.filter((one) => one.state === "failed")) {
      notice(`${jobName(job)}: ${lastLine(job)}`);
    }
    if (jobs.some((job) => job.kind === "check")) await this.loadCheck();
    if (jobs.some((job) => job.kind === "study")) this.variants = await get("variants");
    await this.refresh();
  },
  async loadCheck() { this.check = await get("check"); },
  link(path) { return this.files + path.split("/").map(encodeURIComponent).join("/"); },
  get running() { return this.jobs.find((job) => job.state === "running"); },
  // Whether the building is being read, or will be
  get reading() { return this.jobs.some((job) => job.kind === "check" && ["waiting", "running"].includes(job.state)); },
  // A sentence where the weather station is far from the building's site
  farText() {
    const { station } = this.state, site = this.check?.site;
    if (!station || !this.state.building.length || !site || site.latitude_deg === null || site.longitude_deg === null) return "";
    const east = (((site.longitude_deg - station.longitude_deg + 180) % 360) + 360) % 360 - 180, north = site.latitude_deg - station.latitude_deg;
    if (Math.max(Math.abs(north), Math.abs(east)) <= station.far_deg) return "";
    const km = 111.2 * Math.hypot(north, east * Math.cos(site.latitude_deg * Math.PI / 180));
    return gettext("The weather station {station} is about {distance} km from the building's site; sun and weather are those of the station.", { station: station.name, distance: String(Math.round(km / 10) * 10) });
  },
  get waiting() { return this.jobs.filter((job) => job.state === "waiting"); },
  // The rooms that are computed, of those that the check found
  get chosen() {
    const rooms = this.check?.rooms || [], named = this.state.spaces;
    return rooms.filter((room) => (named.length ? named.includes(room.guid) || named.includes(room.label) : room.windows.length));
  },
  // Windows of these rooms without glazing data in the building's file, where no variant fills them
  unfilled(heat = true) {
    if (this.state.systems.length || (heat && this.state.operated)) return 0;
    const enough = heat ? ["all"] : ["all", "light"];
    const windows = this.chosen.flatMap((room) => room.windows);
    return new Set(windows.filter((one) => !enough.includes(one.glazing ?? "all")).map((one) => one.guid)).size;
  },
  show() {
    if (!this.state) return;
    byId("title").textContent = this.state.title || this.state.name;
    byId("folder").textContent = this.state.folder;
    document.title = `${this.state.title || this.state.name} · mitsuba-cfs`;
    for (const name of STEPS) {
      byId(name).hidden = name !== this.step;
      const link = document.querySelector(`nav [href="#${name}"]`);
      if (name === this.step) link.setAttribute("aria-current", "step");
      else link.removeAttribute("aria-current");
      link.querySelector(".mark").className = `mark ${mark(name)}`;
    }
    SHOW[this.step](this, false);
    showStatus();
  },
};

// Whether a step is done, has a fault, or is still to do
function mark(name) {
  const { state, check } = page;
  if (name === "files") return state.building.length && state.weather.length ? "done" : "todo";
  if (name === "building") return check && state.building.length ? (check.rooms.some((room) => room.doubt === "serious") ? "doubt" : "done") : "todo";
  if (name === "systems") return state.systems.length ? "done" : page.unfilled() ? "doubt" : "todo";
  const results = state.results.filter((one) => one.pages.report || one.pages.dossier);
  return results.length ? "done" : "todo";
}

const stop = (job) => tried(async () => { await post("stop", { number: job.number }); await page.news(); });

// The bar at the foot: what runs, how far it is, and how to end it
function showStatus() {
  const job = page.running;
  byId("status").hidden = !job;
  if (!job) return;
  const bar = progressBar(job);
  fill(byId("status"),
    h("div", { class: "doing" }, h("b", {}, jobName(job), ", ", h("span", { class: "time", "data-since": job.started }, spoken(Date.now() / 1000 - job.started))), h("span", {}, progressText(job) || gettext("starting"))),
    bar,
    page.waiting.length ? h("span", { class: "soft" }, cfs.ngettext("{count} command waits", "{count} commands wait", page.waiting.length)) : null,
    h("button", { type: "button", "data-key": "stop", onclick: () => stop(job) }, gettext("Stop")));
}

async function follow() {
  for (;;) {
    try {
      const { version, jobs } = await get(`jobs?version=${page.version ?? ""}`);
      const changed = version !== page.version;
      page.version = version;
      if (changed) page.take(jobs);
      byId("lost").hidden = true;
    } catch {
      byId("lost").hidden = false;
      await new Promise((on) => setTimeout(on, 2000));
    }
    await new Promise((on) => setTimeout(on, 300));
  }
}

function go() {
  const name = location.hash.slice(1);
  page.step = STEPS.includes(name) ? name : "files";
  page.show();
  byId(page.step).querySelector("h2")?.focus({ preventScroll: true });
  document.querySelector("nav [aria-current]").scrollIntoView({ block: "nearest", inline: "nearest" }); // on a phone
  scrollTo({ top: 0, behavior: "instant" });
}

setInterval(() => {
  for (const element of document.querySelectorAll("[data-since]")) element.textContent = spoken(Date.now() / 1000 - element.dataset.since);
}, 1000);

addEventListener("hashchange", go);
// Each part alone: a damaged file of results leaves the rest of the page
await Promise.all(["state", "check", "rules", "variants", "library"].map((path) => tried(async () => { page[path] = await get(path); })));
const last = page.state?.journal.findLast((one) => one.kind === "comply");
page.wanted.standards = last ? last.command.filter((_, i) => last.command[i - 1] === "--standard") : [];
page.step = STEPS.includes(location.hash.slice(1)) ? location.hash.slice(1) : "files";
page.show();
follow();
document.body.dataset.ready = "yes";
