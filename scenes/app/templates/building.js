// Step 2: the building in 3D, its rooms, and what is doubtful.
import { byId, commandLine, fill, h, unfilledText } from "./dom.js";

const { gettext, ngettext, fixed } = cfs;
const JOINT = " + "; // between the names of rooms that are one

// What to do about an issue; flags are for the command line, as this page has no such button
export const remedy = (fix) => !fix ? "" : fix.includes("--")
  ? `; ${gettext("on the command line: {fix}", { fix })}` : `; ${fix}`;
// Uses of rooms by the keys of scenes/comply/uses.toml that people choose from
const USES = () => ({
  office: gettext("office"), meeting: gettext("meeting room"), classroom: gettext("classroom"), nursery: gettext("nursery"),
  living: gettext("living room"), bedroom: gettext("bedroom"), kitchen: gettext("kitchen"), circulation: gettext("circulation"),
  sanitary: gettext("sanitary room"), storage: gettext("storage"), technical: gettext("technical room"),
});
const FACING = () => ({
  north: gettext("north"), "north-east": gettext("north-east"), east: gettext("east"), "south-east": gettext("south-east"),
  south: gettext("south"), "south-west": gettext("south-west"), west: gettext("west"), "north-west": gettext("north-west"), up: gettext("upwards"),
});
const SEVERITY = () => ({
  loss: gettext("left out"), warning: gettext("warning"), assumption: gettext("assumed"), unused: gettext("not used"), info: gettext("note"),
});
// A room's doubt by its consequence; the panel of the room has the reasons
const doubtText = (room) => (room.doubt === "serious" ? gettext("to check")
  : ngettext("{count} assumption", "{count} assumptions", room.doubts.length));
const NORTHS = () => ({ // what is doubtful of north, by the code of the issue
  "true-north-missing": gettext("The file states no north: the arrow is an assumption (+y). Set north below."),
  "true-north-invalid": gettext("The file's north is not usable: the arrow is an assumption (+y). Set north below."),
  "north-contradicts-map": gettext("The file states two different directions of north. Set north below."),
});
const TINTS = { chosen: [0.16, 0.62, 0.4], other: [0.62, 0.65, 0.7], doubt: [0.93, 0.6, 0.1], selected: [0.1, 0.45, 0.9] };
let page = null, viewer = null, shown = null, selected = -1;

const facing = (room) => {
  const names = FACING(), found = new Map();
  for (const window of room.windows) found.set(window.facing, (found.get(window.facing) || 0) + window.glass_m2);
  return [...found].map(([name, area]) => `${names[name] || name} ${fixed(area, 1)} m²`).join(", ") || "–";
};

function tint() {
  if (!viewer) return;
  const chosen = new Set(page.chosen.map((room) => room.guid));
  viewer.tint(page.check.rooms.map((room, i) => (i === selected ? TINTS.selected
    : room.doubt === "serious" ? TINTS.doubt : chosen.has(room.guid) ? TINTS.chosen : TINTS.other)));
}

function select(index) {
  selected = index;
  tint();
  drawRoom();
  for (const [i, row] of [...byId("room-rows").rows].entries()) row.classList.toggle("selected", i === selected);
}

// The view is made anew for another model: its template is cloned, so no old listener stays
function view() {
  if (shown === page.check) return;
  shown = page.check;
  selected = -1;
  const { model } = page.check, box = byId("view-template").content.cloneNode(true);
  byId("view").replaceChildren(box);
  const options = (id, names) => byId(id).replaceChildren(
    ...[gettext("all"), ...names].map((name, i) => h("option", { value: String(i - 1) }, name)));
  options("viewer-room", model.rooms);
  options("viewer-storey", model.storeys);
  if (model.storeys.length < 2) byId("viewer-storey").closest("label").hidden = byId("viewer-lift").closest("label").hidden = true;
  viewer = cfsViewer(model, select);
}

function choose(guid, wanted) {
  const guids = new Set(page.chosen.map((room) => room.guid));
  if (wanted) guids.add(guid);
  else guids.delete(guid);
  const usual = page.check.rooms.filter((room) => room.windows.length).map((room) => room.guid);
  const same = usual.length === guids.size && usual.every((one) => guids.has(one));
  page.change({ spaces: same ? [] : page.check.rooms.map((room) => room.guid).filter((one) => guids.has(one)) });
}

const useOf = (room) => page.state.uses[room.guid] || room.use;

function useSelect(room) {
  const uses = USES(), key = useOf(room), known = key in uses || key === "unknown" || !key;
  const options = [["", gettext("as in the file: {use}", { use: uses[room.use] || room.use || gettext("not stated") })], ...Object.entries(uses)];
  if (!known && page.state.uses[room.guid]) options.push([key, key]);
  const element = h("select", {
    "data-key": `use ${room.guid}`, "aria-label": gettext("Use of {room}", { room: room.label }),
    onchange: (event) => page.change({ uses: { [room.guid]: event.target.value } }),
  }, options.map(([value, text]) => h("option", { value }, text)));
  element.value = page.state.uses[room.guid] || "";
  return element;
}

function outdoors(room, out) {
  const { outdoors: named = [] } = page.state.corrections;
  page.change({ corrections: { outdoors: out ? [...named, room.guid] : named.filter((one) => one !== room.guid) } });
}

// Rooms are joined to one, or separated again; the model is read anew
function join(pair) {
  const guids = pair.guids, named = page.state.spaces.map((one) => page.check.rooms.find((room) => room.label === one)?.guid || one);
  const spaces = named.filter((guid) => guid !== guids[1] || !named.includes(guids[0]));
  page.change({ join: [...page.state.join, pair.join], ...(named.length ? { spaces } : {}) });
}
const separate = (group) => page.change({ join: page.state.join.filter((one) => one !== group) });
const joinButton = (pair) => h("button", {
  type: "button", "data-key": `join ${pair.join}`, "aria-label": gettext("Join {rooms}", { rooms: pair.rooms.join(JOINT) }),
  disabled: page.reading, onclick: () => join(pair),
}, gettext("Join the rooms"));

const openTo = (pair) => h("li", {}, gettext("{rooms}: open to each other by {area} m²; a wall face closes the opening.", { rooms: pair.rooms.join(JOINT), area: fixed(pair.area_m2, 1) }), " ", joinButton(pair));

// The reasons of a room's doubt, the gravest first
function doubts(room) {
  const open = page.check.open_rooms.filter((pair) => pair.guids.includes(room.guid));
  const rest = room.doubts.filter((one) => one.code !== "rooms-open-to-each-other");
  if (!open.length && !rest.length) return null;
  return h("ul", { class: "doubts" }, open.map(openTo), rest.map((one) => h("li", { class: one.level }, `${one.what}: ${one.effect}`,
    one.glass_m2 ? ` (${fixed(one.glass_m2, 2)} m² ${gettext("of glass")})` : "")));
}

function air(room) {
  const volume = `${fixed(room.volume_m3, 1)} m³`, drawn = room.drawn_volume_m3;
  return Math.abs(drawn - room.volume_m3) < 0.02 * drawn ? volume : gettext("{volume} (as drawn: {drawn} m³)", { volume, drawn: fixed(drawn, 1) });
}

function drawRoom() {
  const room = page.check.rooms[selected];
  if (!room) {
    fill(byId("room"), h("p", { class: "soft" }, gettext("Click a room in the view or in the table.")), legend());
    return;
  }
  const chosen = page.chosen.includes(room), isIfc = /\.ifc$/i.test(page.state.building[0] || "");
  fill(byId("room"),
    h("h3", {}, room.label),
    h("dl", { class: "facts" }, [[gettext("Storey"), room.storey || "–"], [gettext("Floor"), `${fixed(room.floor_m2, 1)} m²`],
      [gettext("Air"), air(room)], [gettext("Windows"), facing(room)]]
      .map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value)))),
    doubts(room),
    h("label", { class: "field" }, gettext("Use"), useSelect(room)),
    h("p", { class: "soft" }, room.use_source),
    h("label", { class: "check" }, h("input", { type: "checkbox", "data-key": "room-chosen", checked: chosen, onchange: (event) => choose(room.guid, event.target.checked) }), gettext("Compute this room")),
    isIfc ? h("button", { type: "button", "data-key": "room-outdoors", onclick: () => outdoors(room, true) }, gettext("This is no room: it is outdoors")) : null,
    legend());
}

function legend() {
  const entry = (name, text) => h("li", {}, h("i", { style: `background: rgb(${TINTS[name].map((v) => Math.round(v * 255)).join(" ")})` }), text);
  return h("ul", { class: "legend" }, entry("chosen", gettext("computed")), entry("doubt", gettext("doubtful")), entry("other", gettext("not computed")), entry("selected", gettext("selected")));
}

function drawRows() {
  const chosen = new Set(page.chosen), uses = USES();
  fill(byId("room-rows"), page.check.rooms.map((room, i) => h("tr", { class: i === selected ? "selected" : false },
    h("td", {}, h("input", { type: "checkbox", checked: chosen.has(room), "data-key": `choose ${room.guid}`, "aria-label": gettext("Compute {room}", { room: room.label }), onchange: (event) => choose(room.guid, event.target.checked) })),
    h("td", {}, h("button", { type: "button", class: "plain", "data-key": `select ${room.guid}`, onclick: () => select(i) }, room.label)),
    h("td", {}, room.storey), h("td", {}, uses[useOf(room)] || useOf(room) || "–"),
    h("td", { class: "number" }, fixed(room.floor_m2, 1)), h("td", {}, facing(room)),
    h("td", {}, room.doubt ? h("span", { class: `chip ${room.doubt}` }, doubtText(room)) : ""))));
  byId("room-count").textContent = ngettext("{count} room is computed.", "{count} rooms are computed.", chosen.size);
}

function drawIssues() {
  const severity = SEVERITY();
  fill(byId("issues"), page.check.issues.map((issue) => h("li", {},
    h("span", { class: `chip ${issue.severity}` }, severity[issue.severity]),
    h("div", {}, h("b", {}, issue.what), issue.code === "rooms-open-to-each-other" && page.check.open_rooms.length
      ? h("ul", { class: "doubts" }, page.check.open_rooms.map(openTo)) : h("p", {}, issue.effect, remedy(issue.fix)),
      h("p", { class: "soft" }, issue.where, issue.glass_m2 ? `, ${fixed(issue.glass_m2, 2)} m² ${gettext("of glass")}` : "")))));
  byId("no-issues").hidden = page.check.issues.length > 0;
}

function drawOutdoors() {
  const { outdoors: named = [], north } = page.state.corrections;
  byId("north").value = north ?? "";
  fill(byId("outdoors"), named.map((guid) => h("li", {}, h("code", {}, guid), " ",
    h("button", { type: "button", "data-key": `indoors ${guid}`, onclick: () => outdoors({ guid }, false) }, gettext("Take it as the file does")))));
  byId("outdoors-box").hidden = !named.length;
  fill(byId("joined"), page.state.join.map((group) => h("li", {}, group, " ",
    h("button", { type: "button", "data-key": `separate ${group}`, "aria-label": gettext("Separate {rooms}", { rooms: group }), disabled: page.reading, onclick: () => separate(group) }, gettext("Separate the rooms")))));
  byId("joined-box").hidden = !page.state.join.length;
}

// What is not known of the place: beside the arrow and the weather that it decides
function drawPlace() {
  const codes = new Set(page.check.issues.map((issue) => issue.code)), norths = NORTHS();
  const texts = Object.keys(norths).filter((code) => codes.has(code) && page.state.corrections.north === undefined).map((code) => norths[code]);
  fill(byId("place"), [...texts, page.farText()].filter(Boolean).map((text) => h("li", {}, text)));
  byId("place").hidden = !byId("place").children.length;
}

byId("north").addEventListener("change", (event) => {
  const text = event.target.value.trim();
  page.change({ corrections: { north: text === "" ? null : Number(text) } });
});
byId("furniture").addEventListener("change", (event) => page.change({ furniture: event.target.checked }));
byId("all-rooms").addEventListener("click", () => page.change({ spaces: [] }));

export function showBuilding(one, quiet) {
  page = one;
  if (quiet && shown === page.check) {
    for (const button of byId("building").querySelectorAll("[data-key^='join '], [data-key^='separate ']")) button.disabled = page.reading;
    return;
  }
  const there = Boolean(page.check && page.state.building.length);
  byId("building-there").hidden = !there;
  byId("building-missing").hidden = there;
  if (!there) {
    const job = page.jobs.findLast((one) => one.kind === "check");
    byId("building-missing").textContent = job?.state === "running" || job?.state === "waiting"
      ? gettext("The building is being read.") : gettext("There is no building yet: drop its file in step 1.");
    shown = null;
    return;
  }
  view();
  const lacking = page.unfilled();
  fill(byId("head"), [...page.check.head, ...(lacking ? [unfilledText(lacking)] : [])].map((line) => h("li", {}, line)));
  drawPlace();
  byId("north").disabled = !/\.ifc$/i.test(page.state.building[0] || "");
  byId("furniture").checked = page.state.furniture;
  tint();
  drawRoom();
  drawRows();
  drawIssues();
  drawOutdoors();
  const last = page.state.journal.findLast((one) => one.kind === "check");
  fill(byId("check-command"), last ? commandLine(last.command.map((word) => (/^[\w./=:@%+,-]+$/.test(word) ? word : `'${word}'`)).join(" ")) : "");
}
