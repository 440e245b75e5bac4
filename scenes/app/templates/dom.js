// Elements, requests and numbers.
const { gettext } = cfs;

// An element with attributes; `on...` are listeners, true and false set or leave out an attribute
export function h(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (key === "value" || key === "checked" || key === "disabled") element[key] = value;
    else if (value === true) element.setAttribute(key, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(key, value);
  }
  element.append(...children.flat().filter((one) => one !== null && one !== undefined && one !== false));
  return element;
}

export const byId = (id) => document.getElementById(id);

// Put children into an element, its own ones before gone; the focus stays on what has the same key
export function fill(element, ...children) {
  const key = document.activeElement?.closest?.("[data-key]")?.dataset.key;
  element.replaceChildren(...children.flat().filter((one) => one !== null && one !== undefined && one !== false));
  if (key && element.isConnected) element.querySelector(`[data-key="${CSS.escape(key)}"]`)?.focus({ preventScroll: true });
}

async function answered(answer) {
  if (answer.status === 403) throw new Error(gettext("The page has lost its access: open the address that cfs app printed."));
  const value = await answer.json().catch(() => ({}));
  if (!answer.ok) throw new Error(value.error || gettext("The program has a fault; its terminal says more."));
  return value;
}

export const get = async (path, options = {}) => answered(await fetch(`/api/${path}`, options));
export const post = async (path, value) => answered(await fetch(`/api/${path}`, {
  method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(value),
}));

// Send a file; `told` is called with the share that has gone
export function upload(file, told) {
  return new Promise((done, failed) => {
    const request = new XMLHttpRequest();
    request.open("POST", `/api/upload?name=${encodeURIComponent(file.name)}`);
    request.responseType = "json";
    request.upload.onprogress = (event) => { if (event.lengthComputable) told(event.loaded / event.total); };
    request.onload = () => (request.status === 200 ? done(request.response)
      : failed(new Error(request.response?.error || `${file.name}: ${request.status}`)));
    request.onerror = () => failed(new Error(gettext("{name} could not be sent: the program has ended or refused it.", { name: file.name })));
    request.send(file);
  });
}

export const sized = (bytes) => (bytes < 1e6
  ? `${Math.max(1, Math.round(bytes / 1e3))} kB` : `${cfs.fixed(bytes / 1e6, 1)} MB`);

// A time as people say it: 48 s, 3 min 20 s
export function spoken(seconds) {
  const s = Math.max(0, Math.round(seconds));
  if (s < 60) return `${s} s`;
  if (s < 3600) return `${Math.floor(s / 60)} min ${s % 60} s`;
  return `${Math.floor(s / 3600)} h ${Math.floor((s % 3600) / 60)} min`;
}

// A command as it is typed, with a button that copies it
export function commandLine(text) {
  const copy = h("button", { type: "button", class: "copy-command", "aria-label": gettext("Copy the command") }, gettext("Copy"));
  copy.addEventListener("click", async () => {
    await navigator.clipboard.writeText(text);
    copy.textContent = gettext("Copied");
    setTimeout(() => { copy.textContent = gettext("Copy"); }, 1500);
  });
  return h("div", { class: "command" }, h("code", { tabindex: "0" }, text), copy);
}

// What the building's file lacks, before a command refuses it
export const unfilledText = (count) => cfs.ngettext(
  "{count} window of the chosen rooms has no glazing data in the building's file: choose a system.",
  "{count} windows of the chosen rooms have no glazing data in the building's file: choose a system.", count);

// Say something to all who listen: a fault stays until it is closed
export function notice(text, kind = "fault") {
  const box = h("div", { class: `notice ${kind}` }, h("p", {}, text),
    h("button", { type: "button", "aria-label": gettext("Close"), onclick: () => box.remove() }, "×"));
  byId("notices").append(box);
  if (kind !== "fault") setTimeout(() => box.remove(), 6000);
}

// Do what may fail, and say why it did
export async function tried(act) {
  try {
    return await act();
  } catch (error) {
    notice(error.message);
    return undefined;
  }
}
