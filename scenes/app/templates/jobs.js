// Commands in words.
import { h, spoken } from "./dom.js";

const { gettext } = cfs;

export function jobName(job) {
  const names = {
    check: gettext("Reading the building"), run: gettext("Report"), comply: gettext("Rules"),
    study: gettext("Comparison of the variants"), export: gettext("Export"), systems: gettext("System of the library"),
  };
  return job.title ? `${names[job.kind]}: ${job.title}` : names[job.kind];
}

export function lastLine(job) {
  const lines = job.lines.filter((line) => line.trim());
  return (lines.findLast((line) => line.startsWith("error:")) || lines.at(-1) || "").replace(/^error: /, "");
}

export function progressText(job) {
  const { stage = "", fraction = 0, item, number, total, left_s: left } = job.progress;
  const parts = [stage && fraction > 0 && fraction < 1 ? `${stage} ${Math.round(100 * fraction)} %` : stage];
  if (item) parts.unshift(`${item} ${number} / ${total}`);
  if (left) parts.push(gettext("about {time} left", { time: spoken(left) }));
  return parts.filter(Boolean).join(", ");
}

// How much of the rooms, or of the cases, is done; undefined where only a step of the command is known
function share(job) {
  const { number, total } = job.progress;
  return total > 1 ? (number - 1) / total : undefined;
}

// A bar of the whole command; it has no length while only a step is known
export function progressBar(job) {
  const done = share(job);
  return h("progress", { max: "1", "aria-label": jobName(job), ...(done === undefined ? {} : { value: done }) });
}
