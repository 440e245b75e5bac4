// Save a figure as SVG or PNG: what the page shows of it, in the light colours, as one file of its own.
(() => {
  "use strict";
  const NS = "http://www.w3.org/2000/svg";
  const PAINT = ["fill", "fill-rule", "stroke", "stroke-width", "stroke-dasharray", "stroke-linejoin", "opacity", "paint-order"];
  const SCALE = 3;  // pixels of a PNG per pixel of the page
  const seen = (colour) => colour !== "none" && colour !== "transparent" && !/^rgba\(.*, 0\)$/.test(colour);
  const round = (x) => String(Math.round(100 * x) / 100);
  const pen = document.createElement("canvas").getContext("2d");

  /** A part of the file; attributes that are numbers are rounded. */
  function element(name, attributes, text) {
    const made = document.createElementNS(NS, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, typeof value === "number" ? round(value) : value);
    if (text !== undefined) made.textContent = text;
    return made;
  }

  /** The page's colours by day, whatever the screen's are, while something is done. */
  function inLight(work) {
    const { style } = document.documentElement;
    const names = [];
    for (const sheet of document.styleSheets) {
      for (const rule of sheet.cssRules) {
        if (rule.selectorText !== ":root") continue;
        for (const name of rule.style) {
          if (!name.startsWith("--")) continue;
          style.setProperty(name, rule.style.getPropertyValue(name));
          names.push(name);
        }
      }
    }
    try { return work(); } finally { for (const name of names) style.removeProperty(name); }
  }

  /** Paths of straight lines in the figure's pixels: few programs know a stroke that does not scale. */
  function straight(path, matrix) {
    let x = 0, y = 0;
    return path.replace(/([MLHVZ])([^MLHVZ]*)/g, (_, kind, rest) => {
      const numbers = rest.match(/-?[\d.]+/g)?.map(Number) ?? [];
      if (kind === "Z") return "Z";
      const points = [];
      const step = kind === "M" || kind === "L" ? 2 : 1;
      for (let i = 0; i < numbers.length; i += step) {
        if (kind !== "V") x = numbers[i];
        if (kind !== "H") y = numbers[i + step - 1];
        points.push(`${round(matrix.a * x + matrix.e)} ${round(matrix.d * y + matrix.f)}`);
      }
      return (kind === "M" ? "M" : "L") + points.join("L");
    });
  }

  /** A shape or text of the page's own SVG. */
  function drawn(shape, origin, out) {
    const css = getComputedStyle(shape);
    const words = shape.tagName === "text";
    if (css.visibility === "hidden" || (!seen(css.fill) && !seen(css.stroke))) return;
    const matrix = shape.getScreenCTM();
    matrix.e -= origin.left;
    matrix.f -= origin.top;
    const made = element(shape.tagName, {});
    for (const { name, value } of shape.attributes) if (!["class", "style", "tabindex"].includes(name)) made.setAttribute(name, value);
    for (const name of PAINT) if (css[name] && css[name] !== "normal") made.setAttribute(name, css[name]);
    if (css.vectorEffect === "non-scaling-stroke" && /^[MLHVZ\d\s.,-]*$/.test(shape.getAttribute("d") ?? "?")) {
      made.setAttribute("d", straight(shape.getAttribute("d"), matrix));
    } else {
      made.setAttribute("transform", `matrix(${["a", "b", "c", "d", "e", "f"].map((key) => Math.round(1e4 * matrix[key]) / 1e4)})`);
    }
    if (words) {
      for (const name of ["font-family", "font-size", "font-weight", "text-anchor"]) made.setAttribute(name, css[name]);
      if (css.dominantBaseline === "central") made.setAttribute("dy", "0.35em");
      made.textContent = shape.textContent;
    } else {
      for (const title of shape.querySelectorAll("title")) made.append(element("title", {}, title.textContent));
    }
    out.append(made);
  }

  /** The lines of a text of the page, each where the page has it. */
  function written(node, origin, out) {
    const css = getComputedStyle(node.parentElement);
    if (css.visibility === "hidden") return;
    const lines = [];
    for (const word of node.data.matchAll(/\S+/g)) {
      const range = document.createRange();
      range.setStart(node, word.index);
      range.setEnd(node, word.index + word[0].length);
      const box = range.getBoundingClientRect();
      if (!box.width) continue;
      const last = lines.at(-1);
      if (last && Math.abs(last.top - box.top) < 2) {
        last.words.push(word[0]);
        last.right = box.right;
      } else lines.push({ top: box.top, left: box.left, right: box.right, height: box.height, words: [word[0]] });
    }
    pen.font = `${css.fontWeight} ${css.fontSize} ${css.fontFamily}`;
    const font = pen.measureText("x");
    const above = font.fontBoundingBoxAscent / (font.fontBoundingBoxAscent + font.fontBoundingBoxDescent);
    const anchor = css.textAlign === "right" ? "end" : css.position === "absolute" || css.textAlign === "center" ? "middle" : "start";
    for (const line of lines) {
      const x = { start: line.left, middle: (line.left + line.right) / 2, end: line.right }[anchor] - origin.left;
      const y = line.top + above * line.height - origin.top;
      out.append(element("text", {
        x, y, fill: css.color, "font-family": css.fontFamily, "font-size": css.fontSize, "font-weight": css.fontWeight, "text-anchor": anchor,
      }, line.words.join(" ")));
    }
  }

  /** The background, border or gradient of a box. */
  function boxed(box, origin, out) {
    const css = getComputedStyle(box);
    const gradient = css.backgroundImage.startsWith("linear-gradient(");
    const border = ["Top", "Right", "Bottom", "Left"].map((side) =>
      (css[`border${side}Style`] === "solid" && seen(css[`border${side}Color`]) ? parseFloat(css[`border${side}Width`]) : 0));
    if (css.visibility === "hidden" || !box.offsetWidth || (!seen(css.backgroundColor) && !gradient && !border.some(Boolean))) return;
    const { left, right, top, bottom } = box.getBoundingClientRect();
    const [w, h] = [box.offsetWidth, box.offsetHeight];
    const [cx, cy] = [(left + right) / 2 - origin.left, (top + bottom) / 2 - origin.top];
    const whole = border.every(Boolean) ? border[0] : 0;
    const made = element("rect", { x: cx - w / 2 + whole / 2, y: cy - h / 2 + whole / 2, width: w - whole, height: h - whole });
    made.setAttribute("fill", seen(css.backgroundColor) ? css.backgroundColor : "none");
    if (whole) {
      made.setAttribute("stroke", css.borderTopColor);
      made.setAttribute("stroke-width", whole);
    }
    const radius = css.borderTopLeftRadius.endsWith("%") ? Math.min(w, h) / 2 : parseFloat(css.borderTopLeftRadius);
    if (radius) made.setAttribute("rx", round(Math.min(radius, w / 2, h / 2)));
    const [a, b] = css.transform.match(/-?[\d.e-]+/g)?.map(Number) ?? [1, 0];
    if (Math.abs(b) > 1e-3) made.setAttribute("transform", `rotate(${round(Math.atan2(b, a) * 180 / Math.PI)} ${round(cx)} ${round(cy)})`);
    if (gradient) {
      const id = `colours-${out.querySelectorAll("linearGradient").length}`;
      const stops = [...css.backgroundImage.matchAll(/(rgba?\([^)]*\))\s*([\d.]+%)?/g)];
      const scale = element("linearGradient", { id });
      stops.forEach(([, colour, at], i) => scale.append(element("stop", { offset: at ?? `${round(100 * i / (stops.length - 1))}%`, "stop-color": colour })));
      out.append(scale);
      made.setAttribute("fill", `url(#${id})`);
    }
    if (seen(css.backgroundColor) || gradient || whole) out.append(made);
    if (!whole && border[3]) out.append(element("path", { d: `M${round(cx - w / 2)} ${round(cy - h / 2)}V${round(cy + h / 2)}`, stroke: css.borderLeftColor }));
    if (!whole && border[2]) out.append(element("path", { d: `M${round(cx - w / 2)} ${round(cy + h / 2)}H${round(cx + w / 2)}`, stroke: css.borderBottomColor }));
  }

  /** A picture, round where the page cuts it so. */
  function pictured(image, origin, out) {
    const { left, top, width, height } = image.getBoundingClientRect();
    const [x, y] = [left - origin.left, top - origin.top];
    const css = getComputedStyle(image);
    const made = element("image", { x, y, width, height, href: image.src, preserveAspectRatio: "none" });
    if (css.imageRendering === "pixelated") made.setAttribute("style", "image-rendering: pixelated");
    if (css.borderTopLeftRadius === "50%") {
      const clip = element("clipPath", { id: `round-${out.querySelectorAll("clipPath").length}` });
      clip.append(element("circle", { cx: x + width / 2, cy: y + height / 2, r: width / 2 }));
      out.append(clip);
      made.setAttribute("clip-path", `url(#${clip.id})`);
    }
    out.append(made);
  }

  function walk(parent, origin, out) {
    for (const node of parent.childNodes) {
      if (node.nodeType === Node.TEXT_NODE) written(node, origin, out);
      if (node.nodeType !== Node.ELEMENT_NODE || node.matches(".save, script, noscript, title, [hidden], .cursor")) continue;
      if (node.tagName === "IMG") pictured(node, origin, out);
      else if (node.namespaceURI === NS) {
        for (const shape of node.querySelectorAll("path, rect, circle, line, polygon, polyline, text")) drawn(shape, origin, out);
      } else {
        boxed(node, origin, out);
        walk(node, origin, out);
      }
    }
  }

  /** A figure of the page as SVG. */
  function picture(figure) {
    const margin = 10;
    const { left, top, width, height } = figure.getBoundingClientRect();
    const size = { width: width + 2 * margin, height: height + 2 * margin };
    const out = element("svg", { ...size, viewBox: `0 0 ${round(size.width)} ${round(size.height)}` });
    out.append(element("title", {}, figure.dataset.figure));
    out.append(element("rect", { ...size, fill: getComputedStyle(document.body).backgroundColor }));
    walk(figure, { left: left - margin, top: top - margin }, out);
    return { ...size, text: new XMLSerializer().serializeToString(out) };
  }

  /** Room or case, and title of a figure, as a file's name. */
  function fileName(figure, ending) {
    const heading = figure.closest("section")?.querySelector("h2, h3")?.textContent ?? "";
    return `${heading} ${figure.dataset.figure}`.replace(/[^\p{L}\p{N}.]+/gu, "-").replace(/^-|[-.]$/g, "") + ending;
  }

  function save(blob, name) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  }

  async function png({ width, height, text }) {
    const image = new Image();
    image.src = "data:image/svg+xml;charset=utf-8," + encodeURIComponent(text);
    await image.decode();
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [Math.round(SCALE * width), Math.round(SCALE * height)];
    canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
    return new Promise((done) => { canvas.toBlob(done, "image/png"); });
  }

  const all = document.querySelectorAll(".save");
  const shown = document.querySelector("button.figures");
  shown.hidden = all.length === 0;
  shown.addEventListener("click", () => {
    const show = shown.getAttribute("aria-pressed") === "false";
    shown.setAttribute("aria-pressed", String(show));
    for (const buttons of all) buttons.hidden = !show;
  });

  for (const buttons of all) {
    const figure = buttons.closest("figure");
    buttons.addEventListener("click", async ({ target }) => {
      if (target.tagName !== "BUTTON") return;
      const made = inLight(() => picture(figure));
      if (target.dataset.kind === "png") save(await png(made), fileName(figure, ".png"));
      else save(new Blob([made.text], { type: "image/svg+xml" }), fileName(figure, ".svg"));
    });
  }
})();
