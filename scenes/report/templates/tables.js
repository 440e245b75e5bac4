// Tables: sort by a click on a heading, copy as tab-separated text for a spreadsheet.
(() => {
  "use strict";
  const text = (cell) => cell.textContent.trim().replaceAll("\u00a0", " ");
  const number = (s) => (s === "" || s === "–" ? NaN : Number(s.replace(/\u202f/g, "").replace("−", "-").replace(",", ".")));
  function sort(table, column, th) {
    const down = th.getAttribute("aria-sort") === "ascending";
    const body = table.tBodies[0];
    const rows = [...body.rows].filter((row) => !row.classList.contains("sum"));
    const numeric = th.classList.contains("number");
    const compare = (a, b) => {
      const s = text(a.cells[column]), t = text(b.cells[column]);
      if (!numeric) return s.localeCompare(t, undefined, { numeric: true });
      const x = number(s), y = number(t);
      return isNaN(x) ? (isNaN(y) ? 0 : 1) : isNaN(y) ? -1 : x - y;
    };
    rows.sort((a, b) => (down ? -compare(a, b) : compare(a, b)));
    for (const other of table.querySelectorAll("th[aria-sort]")) other.removeAttribute("aria-sort");
    th.setAttribute("aria-sort", down ? "descending" : "ascending");
    const sum = body.querySelector(".sum");
    for (const row of rows) body.insertBefore(row, sum);
  }
  for (const table of document.querySelectorAll("table.sortable")) {
    const heads = [...table.tHead.rows[0].cells];  // one tab stop; arrow keys go along the headings
    heads.forEach((th, column) => {
      th.tabIndex = column ? -1 : 0;
      th.addEventListener("focus", () => heads.forEach((one) => { one.tabIndex = one === th ? 0 : -1; }));
      th.addEventListener("click", () => sort(table, column, th));
      th.addEventListener("keydown", (event) => {
        const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
        if (step) {
          event.preventDefault();
          heads[(column + step + heads.length) % heads.length].focus();
        }
        if (event.key === "Enter" || event.key === " ") { event.preventDefault(); sort(table, column, th); }
      });
    });
  }
  // A table is a stop of its own where it is wider than its box, and then it can be moved by keys
  const wide = new ResizeObserver((entries) => {
    for (const { target } of entries) {
      if (target.scrollWidth > target.clientWidth + 1) target.tabIndex = 0;
      else target.removeAttribute("tabindex");
    }
  });
  for (const box of document.querySelectorAll(".scroll")) wide.observe(box);
  function copyText(string) {
    const area = document.createElement("textarea");
    area.value = string;
    area.style.position = "fixed";
    area.style.opacity = "0";
    document.body.append(area);
    area.select();
    const done = document.execCommand("copy");
    area.remove();
    return done;
  }
  for (const button of document.querySelectorAll("button.copy")) {
    button.addEventListener("click", () => {
      const table = button.closest(".table-box").querySelector("table");
      const lines = [...table.rows].map((row) => [...row.cells].map(text).join("\t"));
      const done = copyText(lines.join("\n"));
      const before = button.textContent;
      button.textContent = done ? "✓" : "✗";
      button.disabled = true;
      setTimeout(() => { button.textContent = before; button.disabled = false; }, 1500);
    });
  }
})();
