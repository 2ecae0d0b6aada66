// Which callback ran on which thread.
import {drawing, el, svg} from "./dom.js";
import {fullName, name, report, section} from "./recording.js";
import {plural} from "./words.js";

export const matrix = () => {
  if (!report.callbacks.length) return;
  const ran = new Set(report.callbacks.flatMap(c => c.threads.map(t => t.thread)));
  const columns = report.threads.filter(t => ran.has(t.index)).map(t => t.index); // by host, process, tid
  const column = new Map(columns.map((thread, i) => [thread, i]));
  const load = columns.map(thread => report.callbacks.filter(c => c.threads.some(t => t.thread === thread)).length);
  const cell = Math.max(4, Math.min(18, Math.floor(760 / Math.max(columns.length, 1))));
  const row = Math.max(6, Math.min(18, cell));
  const label = row >= 11 ? 300 : 0;
  const W = label + columns.length * cell + 8;
  const H = 16 + report.callbacks.length * row + 4;
  section(
    "matrix",
    "Which callback ran on which thread",
    el(
      "p",
      {class: "soft"},
      "A row for each callback, a column for each thread. Isolated: one mark in its row, one in its column; red marks are not.",
    ),
    el(
      "div",
      {class: "scroll tall"},
      drawing(
        W,
        H,
        `Matrix of ${plural(report.callbacks.length, "callback")} and ${plural(columns.length, "thread")}`,
        columns.map((_, i) =>
          i % 5 === 0 ? svg("line", {class: "axis", x1: label + i * cell, x2: label + i * cell, y1: 10, y2: H}) : null,
        ),
        report.callbacks.map((c, r) => [
          label
            ? svg(
                "text",
                {x: label - 6, y: 16 + r * row + row * 0.72, "text-anchor": "end"},
                name(c).length > 48 ? `${name(c).slice(0, 47)}\u2026` : name(c),
                svg("title", {}, fullName(c)),
              )
            : null,
          label === 0
            ? null
            : svg("line", {
                class: "axis",
                x1: label,
                x2: W - 8,
                y1: 16 + r * row + row / 2,
                y2: 16 + r * row + row / 2,
              }),
          c.threads.map(t => {
            const at = column.get(t.thread);
            const isAlone = c.threads.length === 1 && load[at] === 1;
            return svg(
              "rect",
              {
                class: isAlone ? "f-run" : "f-fail",
                x: label + at * cell + 1,
                y: 16 + r * row + 1,
                width: cell - 2,
                height: row - 2,
                rx: isAlone ? 2 : 0,
              },
              svg(
                "title",
                {},
                `${fullName(c)} on ${t.name || "thread"} ${t.tid}: ${plural(t.instances, "run")}${isAlone ? "" : ", not isolated"}`,
              ),
            );
          }),
        ]),
      ),
    ),
  );
};
