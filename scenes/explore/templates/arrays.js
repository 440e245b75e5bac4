// Arrays as the data files hold them: base64 of deflated bytes, 16-bit numbers as planes of bytes.
var cfs = globalThis.cfs || (globalThis.cfs = {});
(() => {
  "use strict";
  const KINDS = {
    u1: Uint8Array, i2: Int16Array, u2: Uint16Array, i4: Int32Array, f4: Float32Array,
  };

  function bytesOf(text) {
    if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
    const raw = atob(text), bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
    return bytes;
  }

  async function inflated(bytes) {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  // The numbers of an array {kind, length, data}; its bytes lie plane by plane, lowest first.
  async function arrayOf(packed) {
    const Kind = KINDS[packed.kind], width = Kind.BYTES_PER_ELEMENT, n = packed.length;
    const planes = await inflated(bytesOf(packed.data)), bytes = new Uint8Array(n * width);
    for (let p = 0; p < width; p++) {
      for (let i = 0, from = p * n, to = p; i < n; i++, from++, to += width) bytes[to] = planes[from];
    }
    return new Kind(bytes.buffer);
  }

  async function arraysOf(table) {
    const names = Object.keys(table), found = {};
    const all = await Promise.all(names.map((name) => arrayOf(table[name])));
    names.forEach((name, i) => { found[name] = all[i]; });
    return found;
  }

  // Data files are scripts, which a page opened as a file may load; each calls cfs.give(data).
  const loaded = new Map(), given = new Map();
  cfs.give = (data) => given.set(document.currentScript.dataset.name, data);
  function load(name) {
    if (!loaded.has(name)) {
      loaded.set(name, new Promise((done, failed) => {
        const script = document.createElement("script");
        script.src = name + ".js";
        script.dataset.name = name;
        script.addEventListener("load", () => { script.remove(); done(given.get(name)); });
        script.addEventListener("error", () => failed(new Error(name + ".js cannot be loaded")));
        document.head.append(script);
      }));
    }
    return loaded.get(name);
  }
  Object.assign(cfs, { bytesOf, inflated, arrayOf, arraysOf, load });
})();
