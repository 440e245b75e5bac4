// One case at a time: chosen in the list, by a dot of the scatter or with the arrows.
(() => {
  "use strict";
  const list = document.getElementById("case-choice");
  const sections = [...document.querySelectorAll("section.case")];
  const dots = [...document.querySelectorAll("button.dot[data-case]")];
  function show(number) {
    for (const section of sections) section.hidden = section.dataset.case !== number;
    for (const dot of dots) dot.setAttribute("aria-pressed", String(dot.dataset.case === number));
    list.value = number;
  }
  list.addEventListener("change", () => show(list.value));
  for (const dot of dots) {
    dot.addEventListener("click", () => {
      if (![...list.options].some((o) => o.value === dot.dataset.case)) return;
      show(dot.dataset.case);
      document.getElementById("cases").scrollIntoView();
    });
  }
  const step = (by) => {
    const at = sections.findIndex((s) => !s.hidden);
    show(sections[(at + by + sections.length) % sections.length].dataset.case);
  };
  document.getElementById("case-back").addEventListener("click", () => step(-1));
  document.getElementById("case-next").addEventListener("click", () => step(1));
  document.querySelector(".chooser").hidden = false;
  show(sections[0].dataset.case);
})();
