// Rooms on the storeys' plans in the colours of the figure that is chosen.
(() => {
  "use strict";
  const data = document.getElementById("storey-data");
  if (!data) return;
  const metrics = JSON.parse(data.textContent);
  const rooms = [...document.querySelectorAll(".storey a[data-room]")];
  const rankings = [...document.querySelectorAll(".ranking")];
  const list = document.getElementById("storey-metric");
  list.addEventListener("change", () => {
    const chosen = metrics[list.value];
    for (const room of rooms) {
      const [words, fill, ink] = chosen.rooms[room.dataset.room];
      const title = room.querySelector("title"), text = room.querySelector("text");
      title.textContent = title.textContent.replace(/: [^:]*$/, ": " + words + " " + chosen.unit);
      room.querySelector("path").setAttribute("fill", fill);
      text.setAttribute("fill", ink);
      text.textContent = words;
    }
    rankings.forEach((ranking, i) => { ranking.hidden = String(i) !== list.value; });
  });
  const storey = document.getElementById("storey-choice");
  if (storey) storey.addEventListener("change", () => {
    for (const plan of document.querySelectorAll("figure.storey")) {
      plan.hidden = storey.value !== "" && plan.dataset.storey !== storey.value;
    }
  });
})();
