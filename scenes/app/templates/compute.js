// Step 4: what to compute, its commands, and how far they are.
import { byId, commandLine, fill, h, post, spoken, tried, unfilledText } from "./dom.js";
import { jobName, lastLine, progressBar, progressText } from "./jobs.js";

const { gettext, ngettext } = cfs;
let page = null, asked = "", planned = [];
const CHOICES = ["report", "annual_glare", "explore", "compare"];
const LOADS = ["heating_c", "cooling_c", "equipment_w_m2", "lighting_w_m2", "lighting_target_lx"];

const wanted = () => ({ ...page.wanted, language: page.language });

// The commands of what is chosen, as the program would run them
async function plan() {
  const { report, compare, standards } = page.wanted, heat = report || compare;
  const lacking = heat || standards.length ? page.unfilled(heat) : 0;
  const text = JSON.stringify([wanted(), page.state, lacking]);
  if (text === asked) return;
  asked = text;
  let fault = "";
  try {
    planned = await post("plan", wanted());
  } catch (error) {
    planned = [];
    fault = error.message;
  }
  const button = byId("start");
  button.disabled = !planned.length || lacking > 0;
  fill(byId("plan-fault"), lacking && !fault
    ? [`${unfilledText(lacking)} `, h("a", { href: "#systems" }, gettext("Systems of the windows"))]
    : fault || (planned.length ? "" : gettext("Choose what to compute.")));
  fill(byId("plan"), planned.map((one) => h("li", {}, commandLine(one.command))));
  byId("plan-count").textContent = ngettext("{count} command", "{count} commands", planned.length);
}

function drawRules() {
  fill(byId("rules"), page.rules.map((rule) => h("label", { class: "check" },
    h("input", {
      type: "checkbox", "data-key": `rule ${rule.name}`, checked: page.wanted.standards.includes(rule.name),
      onchange: (event) => {
        const rest = page.wanted.standards.filter((name) => name !== rule.name);
        page.wanted.standards = event.target.checked ? [...rest, rule.name] : rest;
        if (event.target.checked && rule.glare) page.wanted.annual_glare = true;  // else it has no verdict
        draw();
      },
    }), h("span", {}, rule.title, h("small", {}, ` ${rule.edition}`)))));
}

function drawJobs() {
  const jobs = page.jobs.filter((job) => job.kind !== "check" || job.state === "failed").toReversed();
  byId("jobs-box").hidden = !jobs.length;
  const names = { waiting: gettext("waits"), running: gettext("runs"), done: gettext("done"), failed: gettext("failed"), stopped: gettext("stopped") };
  const open = new Set([...byId("jobs").querySelectorAll("details[open]")].map((one) => one.dataset.key));
  fill(byId("jobs"), jobs.map((job) => {
    const time = job.started ? spoken((job.ended || Date.now() / 1000) - job.started) : "";
    const bar = job.state === "running" ? progressBar(job) : null;
    const again = page.jobs.some((one) => one.number > job.number && one.command === job.command);
    const act = job.state === "waiting" || job.state === "running"
      ? h("button", { type: "button", "data-key": `stop ${job.number}`, onclick: () => tried(async () => { await post("stop", { number: job.number }); await page.news(); }) }, gettext("Stop"))
      : (job.state === "stopped" || job.state === "failed") && !again
        ? h("button", { type: "button", "data-key": `again ${job.number}`, onclick: () => tried(async () => { await post("again", { number: job.number }); await page.news(); }) }, gettext("Resume"))
        : null;
    const key = `job ${job.number}`, since = job.state === "running" ? { "data-since": job.started } : {};
    const output = h("details", { "data-key": key, open: open.has(key) }, h("summary", {}, gettext("Command and output")), commandLine(job.command), h("pre", { tabindex: "0" }, job.lines.join("\n")));
    return h("li", { class: job.state },
      h("div", { class: "job" }, h("b", {}, jobName(job)), h("span", { class: `chip ${job.state}` }, names[job.state]), h("span", { class: "soft", ...since }, time), again ? h("span", { class: "soft" }, gettext("resumed since")) : null, act),
      bar, job.state === "running" ? h("p", { class: "soft" }, progressText(job) || gettext("starting")) : null,
      job.state === "failed" ? h("p", { class: "fault" }, lastLine(job)) : null, output);
  }));
}

// The first plan of a run stands in the place of its report until that is there
function drawFirst() {
  const job = page.running, box = byId("first"), frame = box.querySelector("iframe");
  const there = job?.kind === "run" && job.lines.some((line) => line.startsWith("First plan"));
  box.hidden = !there;
  const address = there ? page.link(`${job.out}/report.html`) : "about:blank";
  if (there && frame.dataset.of !== String(job.number)) {
    frame.dataset.of = String(job.number);
    frame.src = address;
  }
}

for (const name of CHOICES) {
  byId(`want-${name}`).addEventListener("change", (event) => { page.wanted[name] = event.target.checked; draw(); });
}
byId("quality").addEventListener("change", (event) => page.change({ quick: event.target.value === "quick" }));
byId("conditioned").addEventListener("change", (event) => {
  const on = event.target.value === "heated";
  page.change({ loads: { ...page.state.loads, heating_c: on ? 20 : null, cooling_c: on ? 26 : null } });
});
for (const name of LOADS) {
  byId(name).addEventListener("change", (event) => {
    const text = event.target.value.trim();
    page.change({ loads: { ...page.state.loads, [name]: text === "" ? null : Number(text) } });
  });
}
byId("start").addEventListener("click", async () => { if (await page.run(wanted())) byId("jobs-title").scrollIntoView({ block: "nearest" }); });
byId("to-results").addEventListener("click", () => { location.hash = "#results"; });

function draw() {
  const { state } = page;
  for (const name of CHOICES) byId(`want-${name}`).checked = page.wanted[name];
  byId("want-annual_glare").disabled = !page.wanted.report && !page.wanted.standards.length;
  byId("want-explore").disabled = !page.wanted.report;
  byId("quality").value = state.quick ? "quick" : "full";
  const heated = state.loads.heating_c !== null || state.loads.cooling_c !== null;
  byId("conditioned").value = heated ? "heated" : "free";
  for (const name of LOADS) byId(name).value = state.loads[name] ?? "";
  byId("set-points").hidden = !heated;
  drawRules();
  plan();
}

export function showCompute(one, quiet) {
  page = one;
  if (!quiet) draw();
  drawJobs();
  drawFirst();
}
