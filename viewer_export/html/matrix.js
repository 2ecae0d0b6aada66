// Which callback ran on which thread.
import {drawing, el, scrolled, svg} from "./dom.js";
import {fullName, name, report, section} from "./recording.js";
import {cut, plural} from "./words.js";

export const matrix = () => {
  if (!report.callbacks.length) return;
  const ran = new Set(report.callbacks.flatMap(c => c.threads.map(t => t.thread)));
  const columns = report.threads.filter(t => ran.has(t.index)).map(t => t.index); // by host, process, tid
  const column = new Map(columns.map((thread, i) => [thread, i]));
  const load = columns.map(thread => report.callbacks.filter(c => c.threads.some(t => t.thread === thread)).length);
  const cell = Math.max(4, Math.min(18, Math.floor(760 / Math.max(columns.length, 1))));
  const row = Math.max(6, Math.min(18, cell));
  const isNamed = row >= 11;
  const threads = new Map(report.threads.map(t => [t.index, t]));
  const called = columns.map(thread => threads.get(thread).name);
  // The tid tells apart what has the same name.
  const columnName = i => {
    const {name: own, tid} = threads.get(columns[i]);
    return own && called.indexOf(own) === called.lastIndexOf(own) ? own : `${own || "thread"} ${tid}`;
  };
  const room = (texts, most) => 6.6 * Math.min(most, Math.max(0, ...texts.map(text => text.length))) + 12;
  const LONGEST = 40;
  const LONGEST_THREAD = 24;
  const label = isNamed ? room(report.callbacks.map(name), LONGEST) : 0;
  const top = isNamed
    ? room(
        columns.map((_, i) => columnName(i)),
        LONGEST_THREAD,
      )
    : 16;
  const W = label + columns.length * cell + 8;
  const H = top + report.callbacks.length * row + 4;
  section(
    "matrix",
    "Which callback ran on which thread",
    el(
      "p",
      {class: "soft"},
      "A row for each callback, a column for each thread. Isolated: one mark in its row, one in its column; crossed red marks are not, of hollow ones it is not known.",
    ),
    scrolled(
      "Matrix of callbacks and threads",
      drawing(
        W,
        H,
        `Matrix of ${plural(report.callbacks.length, "callback")} and ${plural(columns.length, "thread")}`,
        columns.map((_, i) =>
          i % 5 === 0
            ? svg("line", {class: "axis", x1: label + i * cell, x2: label + i * cell, y1: isNamed ? 0 : 10, y2: H})
            : null,
        ),
        isNamed
          ? columns.map((_, i) => {
              const x = label + (i + 0.5) * cell + 4;
              return svg(
                "text",
                {x, y: top - 6, transform: `rotate(-90 ${x} ${top - 6})`, class: "column"},
                cut(columnName(i), LONGEST_THREAD),
                svg("title", {}, columnName(i)),
              );
            })
          : null,
        report.callbacks.map((c, r) => [
          label
            ? svg(
                "text",
                {x: label - 6, y: top + r * row + row * 0.72, "text-anchor": "end"},
                cut(name(c), LONGEST),
                svg("title", {}, fullName(c)),
              )
            : null,
          label === 0
            ? null
            : svg("line", {
                class: "axis",
                x1: label,
                x2: W - 8,
                y1: top + r * row + row / 2,
                y2: top + r * row + row / 2,
              }),
          c.threads.flatMap(t => {
            const at = column.get(t.thread);
            const isAlone = c.threads.length === 1 && load[at] === 1;
            const isUnknown = isAlone && c.isolation === null;
            const doubt = isUnknown ? ", perhaps not isolated" : isAlone ? "" : ", not isolated";
            const x = label + at * cell + 1;
            const y = top + r * row + 1;
            const [w, h] = [cell - 2, row - 2];
            return [
              svg(
                "rect",
                {
                  class: isUnknown ? "f-lost" : isAlone ? "f-run" : "f-fail",
                  x,
                  y,
                  width: w,
                  height: h,
                  rx: isAlone ? 2 : 0,
                },
                svg(
                  "title",
                  {},
                  `${fullName(c)} on ${t.name || "thread"} ${t.tid}: ${plural(t.instances, "instance")}${doubt}`,
                ),
              ),
              isAlone || w < 6
                ? null
                : svg("path", {class: "cross", d: `M${x + 3},${y + 3}l${w - 6},${h - 6}m0,${6 - h}l${6 - w},${h - 6}`}),
            ];
          }),
        ]),
      ),
      true,
    ),
  );
};
