// Parallel coordinates: ends of each axis that keep the cases within, by mouse and by keys.
(() => {
  "use strict";
  const figure = document.querySelector("figure.parallel");
  if (!figure) return;  // the page does without it, or has one figure alone
  const lines = [...figure.querySelectorAll("a.line")];
  const heights = lines.map((line) => line.dataset.at.split(",").map((v) => (v === "" ? NaN : Number(v))));
  const dots = new Map([...document.querySelectorAll("button.dot[data-case]")].map((d) => [d.dataset.case, d]));
  const status = figure.querySelector(".within");
  const clamp = (v) => Math.max(0, Math.min(100, v));
  const axes = [...figure.querySelectorAll(".axis")].map((box, i) => axis(box, i));

  function axis(box, number) {
    const { unit, digits, low, high } = box.dataset;
    const words = (at) => (Number(low) + (high - low) * at / 100).toFixed(digits) + " " + unit;
    const brush = document.createElement("div");
    brush.className = "brush";
    box.append(brush);
    const own = { range: [0, 100], set };
    const handles = ["lower", "upper"].map((end, k) => {
      const handle = document.createElement("span");
      handle.className = "handle";
      handle.tabIndex = 0;
      const said = { role: "slider", "aria-orientation": "vertical", "aria-label": box.dataset[end],
        "aria-valuemin": 0, "aria-valuemax": 100 };
      for (const key in said) handle.setAttribute(key, said[key]);
      handle.addEventListener("keydown", (event) => move(event, k));
      box.append(handle);
      return handle;
    });
    function set(from, to) {
      own.range = [clamp(Math.min(from, to)), clamp(Math.max(from, to))];
      const whole = own.range[0] === 0 && own.range[1] === 100;
      brush.hidden = whole;
      brush.style.bottom = own.range[0] + "%";
      brush.style.height = own.range[1] - own.range[0] + "%";
      handles.forEach((handle, k) => {
        handle.style.bottom = own.range[k] + "%";
        handle.setAttribute("aria-valuenow", Math.round(own.range[k]));
        handle.setAttribute("aria-valuetext", words(own.range[k]));
      });
    }
    function move(event, k) {
      const steps = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1, PageUp: 10, PageDown: -10, Home: -100, End: 100 };
      if (event.key === "Escape") set(0, 100);
      else if (event.key in steps) {
        const range = [...own.range];
        const to = clamp(range[k] + steps[event.key]);
        range[k] = k ? Math.max(to, range[0]) : Math.min(to, range[1]);
        set(...range);
      } else return;
      event.preventDefault();
      keep();
    }
    let start = null, moved = false;
    const at = (event) => {
      const { bottom, height } = box.getBoundingClientRect();
      return clamp(100 * (bottom - event.clientY) / height);
    };
    box.addEventListener("pointerdown", (event) => {
      const held = handles.indexOf(event.target);
      start = held < 0 ? at(event) : own.range[1 - held];
      moved = false;
      box.setPointerCapture(event.pointerId);
    });
    box.addEventListener("pointermove", (event) => {
      if (start === null || (!moved && Math.abs(at(event) - start) < 1)) return;
      moved = true;
      set(start, at(event));
      keep();
    });
    box.addEventListener("pointerup", (event) => {
      if (!moved && !handles.includes(event.target)) { set(0, 100); keep(); }
      start = null;
    });
    set(0, 100);
    return own;
  }

  function keep() {
    const chosen = axes.map(({ range: [from, to] }) => from > 0 || to < 100);
    let count = 0;
    lines.forEach((line, i) => {
      const inside = axes.every(({ range: [from, to] }, k) => !chosen[k]
        || (heights[i][k] >= from - 0.005 && heights[i][k] <= to + 0.005));
      line.classList.toggle("out", !inside);
      dots.get(line.dataset.case)?.classList.toggle("out", !inside);
      count += inside;
    });
    status.hidden = !chosen.includes(true);
    status.textContent = status.dataset.words.replace("##", lines.length).replace("#", count);
    enter(lines.find((line) => line.tabIndex === 0 && !line.classList.contains("out")));
  }

  // One tab stop for all lines; arrow keys go from one to the next
  function enter(line) {
    const open = lines.filter((one) => !one.classList.contains("out"));
    const first = line || open[0];
    for (const one of lines) one.tabIndex = one === first ? 0 : -1;
    return first;
  }
  for (const line of lines) {
    line.addEventListener("keydown", (event) => {
      const step = { ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      event.preventDefault();
      const open = lines.filter((one) => !one.classList.contains("out"));
      enter(open[(open.indexOf(line) + step + open.length) % open.length]).focus();
    });
  }
  enter(lines[0]);
})();
