// Who takes whose messages.
import {drawing, el, svg} from "./dom.js";
import {callbackByIndex, fullName, name, report, severalHosts} from "./recording.js";
import {plural, time} from "./words.js";

export const graph = () => {
  const edges = new Map();
  const nodes = new Map();
  for (const edge of report.edges) {
    if (edge.from === null) continue;
    for (const end of [edge.from, edge.to]) nodes.set(end, callbackByIndex.get(end));
    edges.set(JSON.stringify([edge.from, edge.to, edge.topic]), [
      edge.from,
      edge.to,
      edge.communication_ns === null ? null : edge.communication_ns.p50,
      edge,
    ]);
  }
  if (!edges.size || nodes.size > 120) return null;
  const level = new Map([...nodes.keys()].map(n => [n, 0]));
  for (let round = 0; round < nodes.size; ++round) {
    let moved = false;
    for (const [from, to] of edges.values())
      if (level.get(to) < level.get(from) + 1 && level.get(from) + 1 < nodes.size) {
        level.set(to, level.get(from) + 1);
        moved = true;
      }
    if (!moved) break;
  }
  const columns = [];
  const at = new Map();
  const w = 214;
  const h = 36;
  const gapX = 84;
  const gapY = 14;
  for (const [n, l] of level) {
    columns[l] ||= [];
    columns[l].push(n);
  }
  const used = columns.filter(Boolean);
  used.forEach((c, i) => {
    const before = n => {
      const p = [...edges.values()].filter(e => e[1] === n).map(e => at.get(e[0])?.y ?? 0);
      return p.length ? p.reduce((a, b) => a + b) / p.length : 0;
    };
    c.map(n => [before(n), n])
      .sort((a, b) => a[0] - b[0])
      .forEach(([, n], k) => at.set(n, {x: 4 + i * (w + gapX), y: 4 + k * (h + gapY)}));
  });
  const W = used.length * (w + gapX) - gapX + 8;
  const H = Math.max(...used.map(c => c.length)) * (h + gapY) + 4;
  const cut = text => (text.length > 32 ? `${text.slice(0, 31)}\u2026` : text);
  const respondsIn = c => (c.response_time_ns ? `: responds within ${time(c.response_time_ns.max)}` : "");
  const id = c => (severalHosts ? fullName(c) : c.logical_id);
  const linesOf = c => [name(c), c.response_time_ns ? `at most ${time(c.response_time_ns.max)}` : ""];
  return el(
    "div",
    {class: "scroll"},
    drawing(
      W,
      H,
      `Graph of ${plural(nodes.size, "callback")} linked by messages`,
      [...edges.values()].map(([from, to, ns, edge]) => {
        const a = at.get(from);
        const b = at.get(to);
        const x1 = a.x + w;
        const y1 = a.y + h / 2;
        const x2 = b.x;
        const y2 = b.y + h / 2;
        const m = Math.max(30, Math.abs(x2 - x1) / 2);
        return [
          svg(
            "path",
            {
              d: `M${x1},${y1}C${x1 + m},${y1} ${x2 - m},${y2} ${x2},${y2}`,
              fill: "none",
              stroke: "currentColor",
              "stroke-opacity": 0.45,
            },
            svg(
              "title",
              {},
              `${id(nodes.get(from))} to ${id(nodes.get(to))} by ${edge.topic}: ${plural(edge.messages, "message")}${ns === null ? "" : `, ${time(ns)} in the middle`}`,
            ),
          ),
          svg(
            "text",
            {class: "soft", x: (x1 + x2) / 2, y: (y1 + y2) / 2 - 3, "text-anchor": "middle"},
            ns === null ? "" : time(ns),
          ),
        ];
      }),
      [...at].map(([n, p]) =>
        svg(
          "g",
          {},
          svg("title", {}, id(nodes.get(n)) + respondsIn(nodes.get(n))),
          svg("rect", {class: "box", x: p.x, y: p.y, width: w, height: h, rx: 5}),
          linesOf(nodes.get(n)).map((text, line) =>
            svg("text", {class: line ? "soft" : null, x: p.x + 7, y: p.y + 15 + 14 * line}, cut(text)),
          ),
        ),
      ),
    ),
  );
};
