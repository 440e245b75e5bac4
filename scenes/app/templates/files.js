// Step 1: the files, dropped or chosen.
import { byId, fill, h, notice, post, sized, tried, upload } from "./dom.js";

const { gettext } = cfs;
const KINDS = () => ({
  building: gettext("Building"), weather: gettext("Weather"), system: gettext("System of the windows"),
  surroundings: gettext("Surroundings"), beside: gettext("Data beside a file"),
});
let page = null;
const sending = new Map();  // names and shares of what is on its way

async function send(files) {
  for (const file of files) {
    sending.set(file.name, 0);
    draw();
    try {
      await upload(file, (share) => { sending.set(file.name, share); draw(); });
    } catch (error) {
      notice(error.message);
    }
    sending.delete(file.name);
  }
  await tried(() => page.refresh());
  await tried(() => page.news());
}

const remove = (file) => tried(async () => {
  page.state = await post("remove", { file: file.path });
  if (!page.state.building.length) page.check = null;
  page.show();
  byId("drop").focus();
});

const demo = () => tried(async () => {
  page.state = await post("demo", {});
  page.show();
  await page.news();
});

function needed() {
  const { state } = page, mark = (done) => h("i", { class: `mark ${done ? "done" : "todo"}`, "aria-hidden": "true" });
  const row = (done, name, text, doubt = "") => h("li", {}, mark(done), h("div", {}, h("b", {}, name), h("span", {}, text), doubt ? h("span", { class: "doubt" }, doubt) : null));
  return h("ul", { class: "needed" },
    row(state.building.length, gettext("Building"), state.building.length
      ? state.building.map((path) => path.split("/").at(-1)).join(" + ")
      : gettext("IFC (one file or several of one building), HBJSON or gbXML")),
    row(state.weather.length, gettext("Weather"), state.weather.length
      ? state.weather[0].split("/").at(-1) : gettext("an EPW file of the site, with every hour of a year"), page.farText()),
    row(state.systems.length, gettext("Systems of the windows"), state.systems.length
      ? state.systems.map((one) => one.name).join(", ")
      : gettext("BSDF files (XML), or choose from the library in step 3; without, what the building's file states")));
}

function draw() {
  const { state } = page;
  fill(byId("needed"), needed());
  fill(byId("sending"), [...sending].map(([name, share]) => h("li", {}, `${name} `, h("progress", { max: "1", value: share, "aria-label": name }))));
  const kinds = KINDS();
  fill(byId("file-rows"), state.files.map((file) => h("tr", {},
    h("td", {}, file.path.replace(/^inputs\//, "")), h("td", {}, kinds[file.kind]),
    h("td", { class: "number" }, sized(file.size)),
    h("td", {}, h("button", {
      type: "button", "data-key": `remove ${file.path}`, "aria-label": gettext("Remove {name}", { name: file.path }), onclick: () => remove(file),
    }, gettext("Remove"))))));
  byId("file-table").hidden = !state.files.length;
  byId("title-text").value = state.title || state.name;
  byId("demo").hidden = state.files.length > 0;
}

export function showFiles(shown, quiet) {
  page = shown;
  if (!quiet) draw();
}

const zone = byId("drop-zone"), input = byId("drop");
input.addEventListener("change", () => { const files = [...input.files]; input.value = ""; send(files); });
for (const name of ["dragover", "dragenter"]) {
  document.addEventListener(name, (event) => {
    if (![...event.dataTransfer.types].includes("Files")) return;
    event.preventDefault();
    zone.classList.add("over");
  });
}
document.addEventListener("dragleave", (event) => { if (!event.relatedTarget) zone.classList.remove("over"); });
document.addEventListener("drop", (event) => {
  zone.classList.remove("over");
  if (!event.dataTransfer.files.length) return;
  event.preventDefault();
  location.hash = "#files";
  send([...event.dataTransfer.files]);
});
byId("title-text").addEventListener("change", (event) => page.change({ title: event.target.value }));
byId("demo").querySelector("button").addEventListener("click", demo);
