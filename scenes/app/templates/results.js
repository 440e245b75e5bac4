// Step 5: the variants side by side, and the pages and files that the commands wrote.
import { byId, fill, h, post, tried } from "./dom.js";

const { gettext, fixed } = cfs;
let page = null;

// The best and the worst of a column among the systems of a room
function marks(rows, column, key) {
  const values = rows.map((row) => row.values[column]).filter((value) => value !== null);
  if (values.length < 2 || Math.max(...values) === Math.min(...values)) return () => "";
  const best = key === "+" ? Math.max(...values) : Math.min(...values);
  return (value) => (value === best ? "best" : "");
}

function drawVariants() {
  const { variants } = page;
  byId("variants-box").hidden = !variants;
  byId("variants-missing").hidden = Boolean(variants);
  if (!variants) return;
  byId("variants-quick").hidden = !variants.quick;
  const rooms = [...new Set(variants.rows.map((row) => row.room))];
  const unit = (column) => (column.unit ? h("span", { class: "unit" }, ` [${column.unit}]`) : null);
  fill(byId("variants"),
    h("thead", {}, h("tr", {}, h("th", { scope: "col" }, gettext("System")), variants.columns.map((column) => h("th", { scope: "col", class: "number", title: column.meaning }, column.label, unit(column))))),
    rooms.map((room) => {
      const rows = variants.rows.filter((row) => row.room === room);
      const best = variants.columns.map((column, i) => marks(rows, i, column.better));
      return h("tbody", {}, h("tr", { class: "room-row" }, h("th", { scope: "rowgroup", colspan: String(variants.columns.length + 1) }, room)),
        rows.map((row) => h("tr", {}, h("th", { scope: "row" }, row.system), row.error
          ? h("td", { colspan: String(variants.columns.length), class: "fault" }, row.error)
          : row.values.map((value, i) => h("td", { class: `number ${value === null ? "" : best[i](value)}` }, value === null ? "–" : fixed(value, Math.min(variants.columns[i].digits, 2)))))));
    }));
}

// What a folder of results is, by its name
function kindOf(name) {
  if (name === "comparison") return gettext("Comparison of the variants");
  return name.startsWith("report-") ? gettext("Report") : name.startsWith("rules-") ? gettext("Dossier") : name;
}

function remove(result) {
  return tried(async () => {
    page.state = await post("remove", { results: result.name });
    page.variants = result.name === "comparison" ? null : page.variants;
    page.show();
  });
}

// What results do not know yet
function outdated(result) {
  if (!result.outdated.length) return null;
  const names = result.outdated.map((name) => (name === "choices" ? gettext("choices on this page") : name)).join(", ");
  return h("p", {}, h("span", { class: "chip warning" }, gettext("out of date")), " ", gettext("Changed since: {names}. Compute again in step 4.", { names }));
}

function drawFolders() {
  const names = {
    report: gettext("Report"), dossier: gettext("Dossier"), explorer: gettext("Explorer"), table: gettext("Table (CSV)"),
    problems: gettext("Problems (CSV)"), check: gettext("Check of the model"),
  };
  const results = page.state.results.toSorted((a, b) => b.time - a.time), when = new Intl.DateTimeFormat(page.language, { dateStyle: "medium", timeStyle: "short" });
  byId("no-results").hidden = results.length > 0;
  fill(byId("folders"), results.map((result) => h("li", { class: "card" },
    h("h3", {}, kindOf(result.name), result.title ? `: ${result.title}` : ""), h("p", { class: "soft" }, `results/${result.name}, ${when.format(result.time * 1000)}`),
    result.quick ? h("p", {}, h("span", { class: "chip warning" }, gettext("preview")), " ", gettext("Few rays, coarse grid. Compute again with reliable accuracy before you decide.")) : null,
    outdated(result),
    result.answers.length ? h("ul", { class: "answers" }, result.answers.map((text) => h("li", {}, text))) : null,
    h("p", { class: "links" }, Object.entries(result.pages).map(([key, path], i) => h("a", { href: page.link(path), target: "_blank", rel: "noopener", class: i ? "" : "main", ...(path.endsWith(".csv") ? { download: true } : {}) }, names[key]))),
    h("button", { type: "button", class: "quiet", "data-key": `clear ${result.name}`, "aria-label": gettext("Remove {name}", { name: result.name }), onclick: () => remove(result) }, gettext("Remove")))));
}

for (const button of byId("exports").querySelectorAll("button")) {
  button.addEventListener("click", () => page.run({ export: button.dataset.form }));
}

function drawExports() {
  fill(byId("exported"), page.state.exported.map((path) => h("li", {}, h("a", { href: page.link(path), download: true }, path))));
}

export function showResults(one, quiet) {
  page = one;
  if (quiet) return;
  drawVariants();
  drawFolders();
  drawExports();
}
