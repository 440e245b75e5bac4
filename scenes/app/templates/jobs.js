// Commands in words.
import { spoken } from "./dom.js";

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
  const { stage = "", item, number, total, left_s: left } = job.progress;
  const parts = [stage];
  if (item) parts.unshift(`${item} ${number} / ${total}`);
  if (left) parts.push(gettext("about {time} left", { time: spoken(left) }));
  return parts.filter(Boolean).join(", ");
}

export function share(job) {
  const { fraction = 0, number, total } = job.progress;
  return total > 1 ? (number - 1 + Math.min(fraction, 1)) / total : fraction;
}
