// A case, or several side by side: chosen in the lists, by a dot of the scatter or with the arrows.
(() => {
  "use strict";
  const list = document.getElementById("case-choice");
  const besides = [...document.querySelectorAll("select.beside")];
  const cases = document.querySelector(".cases");
  const sections = [...document.querySelectorAll("section.case")];
  const dots = [...document.querySelectorAll("button.dot[data-case]")];
  const lines = [...document.querySelectorAll("a.line[href]")];
  function show(number) {
    list.value = number;
    const chosen = new Set([number, ...besides.map((one) => one.value)].filter(Boolean));
    for (const section of sections) section.hidden = !chosen.has(section.dataset.case);
    for (const dot of dots) dot.setAttribute("aria-pressed", String(chosen.has(dot.dataset.case)));
    for (const line of lines) line.classList.toggle("chosen", chosen.has(line.dataset.case));
    cases.classList.toggle("side", chosen.size > 1);
    cases.style.setProperty("--beside", chosen.size);
  }
  const alone = (number) => {
    for (const one of besides) one.value = "";
    show(number);
  };
  for (const one of [list, ...besides]) one.addEventListener("change", () => show(list.value));
  function open(number) {
    alone(number);
    const section = document.getElementById("case-" + number);
    section.scrollIntoView();
    section.focus({ preventScroll: true });
  }
  for (const dot of dots) {
    dot.addEventListener("click", () => {
      if (dot.dataset.explorer) location.href = dot.dataset.explorer;
      else if ([...list.options].some((o) => o.value === dot.dataset.case)) open(dot.dataset.case);
    });
  }
  for (const line of lines) {
    if (line.getAttribute("href").startsWith("#")) {  // else a link to its explorer
      line.addEventListener("click", (event) => { event.preventDefault(); open(line.dataset.case); });
    }
  }
  const step = (by) => {
    const at = sections.findIndex((s) => s.dataset.case === list.value);
    alone(sections[(at + by + sections.length) % sections.length].dataset.case);
  };
  document.getElementById("case-back").addEventListener("click", () => step(-1));
  document.getElementById("case-next").addEventListener("click", () => step(1));
  document.querySelector(".chooser").hidden = false;
  for (const one of besides) {  // as many as the page is of, where they are few
    const first = sections[Number(one.dataset.first) - 1];
    if (one.dataset.first && first) one.value = first.dataset.case;
  }
  show(sections[0].dataset.case);
})();

// Sections for reference are folded on a phone, never on paper or where a link leads into one
(() => {
  "use strict";
  const folds = [...document.querySelectorAll("details.fold")];
  const open = (all) => { for (const one of all) one.open = true; };
  if (matchMedia("(max-width: 40rem)").matches) for (const one of folds) one.open = false;
  addEventListener("beforeprint", () => open(folds));
  addEventListener("hashchange", () => {
    const target = document.getElementById(location.hash.slice(1));
    if (target) open(target.querySelectorAll(":scope > details.fold"));
  });
})();
