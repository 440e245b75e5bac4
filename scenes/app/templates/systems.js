// Step 3: the systems of the windows, from the library or from files; each is a variant.
import { byId, fill, h, post, tried, unfilledText } from "./dom.js";

const { gettext, fixed } = cfs;
let page = null;

const fileOf = (path) => path.split("/").at(-1);
const sheetText = (sheet) => [
  ["τv", fixed(sheet.tau_v, 2)], ["g", fixed(sheet.g_value, 2)], ["U", `${fixed(sheet.u_value, 2)} W/(m² K)`], ["τe", fixed(sheet.tau_e, 2)]];
const sheetList = (sheet) => h("dl", { class: "sheet" }, sheetText(sheet).map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value))));

const sentence = (text) => `${text.slice(0, 1).toUpperCase()}${text.slice(1)}.`;

const save = (systems) => page.change({ systems });

function named(system) {
  const input = h("textarea", { // long names are read whole
    rows: "2", maxlength: "80", value: system.name, "data-key": `name ${system.name}`, "aria-label": gettext("Name of the variant"),
    onchange: (event) => save(page.state.systems.map((one) => (one === system ? { ...one, name: event.target.value.replace(/\s+/g, " ").trim() } : one))),
  });
  return input;
}

function drawChosen() {
  const { systems, sheets } = page.state;
  const lacking = page.unfilled();
  byId("no-systems").hidden = systems.length > 0;
  byId("no-systems").textContent = lacking ? unfilledText(lacking) : gettext("No variant yet.");
  byId("no-systems").className = lacking ? "fault" : "soft";
  fill(byId("chosen"), systems.map((system) => {
    const file = system.bsdf || system.operation, sheet = sheets[file];
    return h("li", { class: "card" }, named(system),
      sheet ? sheetList(sheet) : null,
      h("p", { class: "soft" }, sheet?.source ? `${sentence(sheet.source)} ` : "",
        system.operation ? gettext("Moves between the states of {file}.", { file: fileOf(file) }) : fileOf(file)),
      h("button", { type: "button", class: "quiet", "data-key": `leave ${system.name}`, "aria-label": gettext("Remove {name}", { name: system.name }), onclick: () => save(systems.filter((one) => one !== system)) }, gettext("Remove")));
  }));
}

// What is chosen in the library: a glazing, and a shade or none
function drawSheet() {
  const { library } = page, glazing = byId("glazing").value, shade = byId("shade").value;
  const found = library.sheets.find((one) => one.glazing === glazing && one.shade === shade);
  const glass = library.glazings.find((one) => one.name === glazing), cover = library.shades.find((one) => one.name === shade);
  fill(byId("library-sheet"), found ? sheetList(found) : null,
    h("p", { class: "soft" }, [cover, glass].filter(Boolean).map((one) => one.source).join("; "), "."));
  byId("moving").disabled = !shade || cover.fixed;
  if (byId("moving").disabled) byId("moving").checked = false;
  byId("moving").closest("label").classList.toggle("off", byId("moving").disabled);
}

function drawLibrary() {
  const { library } = page;
  if (byId("glazing").options.length) return;
  fill(byId("glazing"), library.glazings.map((one) => h("option", { value: one.name }, one.title)));
  fill(byId("shade"), h("option", { value: "" }, gettext("none")), library.shades.map((one) => h("option", { value: one.name }, one.title)));
  byId("glazing").value = "double low-e";
  drawSheet();
}

function drawFiles() {
  const used = new Set(page.state.systems.flatMap((one) => [one.bsdf, one.operation]));
  const free = page.state.files.filter((file) => file.kind === "system" && !used.has(file.path));
  byId("free-box").hidden = !free.length;
  fill(byId("free"), free.map((file) => h("li", {}, fileOf(file.path), " ", h("button", {
    type: "button", "data-key": `use ${file.path}`, onclick: () => save([...page.state.systems, { name: fileOf(file.path).replace(/\.xml$/i, ""), bsdf: file.path }]),
  }, gettext("Use as a variant")))));
}

for (const id of ["glazing", "shade"]) byId(id).addEventListener("change", drawSheet);
byId("add-system").addEventListener("click", () => tried(async () => {
  const glazing = byId("glazing").value, shade = byId("shade").value;
  await post("library", { glazing, shade, moving: Boolean(shade) && byId("moving").checked });
  await page.refresh(); // one whose files are there already is a variant at once
  await page.news();
  drawMaking();
}));

// Systems of the library that are being made, or wait behind other commands
function drawMaking() {
  const made = page.jobs.filter((job) => job.kind === "systems" && ["waiting", "running"].includes(job.state));
  byId("making").hidden = !made.length;
  byId("making").textContent = made.some((job) => job.state === "running")
    ? gettext("The system is being made; a traced blind takes about a minute.")
    : gettext("The system is queued: it is made once the commands before it have ended.");
}

export function showSystems(one, quiet) {
  page = one;
  drawMaking();
  if (quiet) return;
  drawChosen();
  drawLibrary();
  drawFiles();
}
