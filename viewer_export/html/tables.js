// Tables: callbacks with their histograms, which ran on which thread, chains, threads, defects.
import {el, link, svg} from "./dom.js";
import {laneOf, slowest} from "./instances.js";
import {
  atLeast,
  callbackByIndex,
  facts,
  processByIndex,
  report,
  responseTime,
  section,
  severalHosts,
  title,
  whereabouts,
} from "./recording.js";
import {timeline} from "./timeline.js";
import {COLOUR, SIGN, count, percent, plural, time} from "./words.js";

const stat = (c, key, which) => (c[key] === null ? null : c[key][which]);
const ISOLATION = {isolated: ["PASS", "yes"], not_isolated: ["FAIL", "NO"], never_ran: ["NOT_APPLICABLE", "never ran"]};
const isolationOf = c => ISOLATION[c.isolation] || ["INCONCLUSIVE", "unknown"];
const nsOf = r => (r === null ? null : r.ns);
// What is known where a response time is not, or not of all runs.
const boundsOf = c => {
  const lower = c.response_time_lower_ns;
  const upper = c.response_time_upper_ns;
  if (lower === null) return "";
  const most =
    upper === null || upper.count < lower.count
      ? ""
      : `, ${time(upper.p50)}, ${time(upper.p99)} and ${time(upper.max)} at most`;
  return `${plural(lower.count, "run")} whose release is not known exactly: p50 ${time(lower.p50)}, p99 ${time(lower.p99)} and max ${time(lower.max)} at least${most}`;
};
const COLUMNS = [
  ["callback", c => title(c), "text"],
  ["isolated", c => isolationOf(c)[1], "text"],
  ["threads", c => c.threads.length],
  ["runs", c => c.instances],
  ["response p50", c => nsOf(responseTime(c, "p50")), "time", "p50"],
  ["response p99", c => nsOf(responseTime(c, "p99")), "time", "p99"],
  ["response max", c => nsOf(responseTime(c, "max")), "time", "max"],
  ["deadline", (_c, i) => facts.callbacks[i].deadline_ns, "time"],
  ["start latency max", c => stat(c, "start_latency_ns", "max"), "time"],
  ["execution max", c => stat(c, "execution_time_ns", "max"), "time"],
  ["preempted max", c => stat(c, "preempted_ns", "max"), "time"],
  ["blocked max", c => stat(c, "blocked_ns", "max"), "time"],
  ["missed", c => c.missed_releases],
];
export let chosen = -1,
  detail,
  rows = [];
export const callbacks = () => {
  if (!report.callbacks.length) return;
  const shown = COLUMNS.filter(([, get]) => report.callbacks.some((c, i) => get(c, i) !== null));
  const body = el("tbody");
  rows = report.callbacks.map((c, i) =>
    el(
      "tr",
      {},
      shown.map(([name, get, kind, which], at) => {
        const value = get(c, i);
        if (at === 0)
          return el(
            "td",
            {class: "name"},
            link(value, () => choose(i)),
          );
        if (name === "isolated") {
          const [verdict] = isolationOf(c);
          return el("td", {class: `text ${COLOUR[verdict]}`}, `${SIGN[verdict]} ${value}`);
        }
        const isLate =
          name === "response max" && facts.callbacks[i].deadline_ns !== null && value > facts.callbacks[i].deadline_ns;
        const told = which ? responseTime(c, which) : null;
        const text = value === null ? "\u2013" : told ? atLeast(told) : kind === "time" ? time(value) : count(value);
        return el(
          "td",
          {
            class: isLate || (name === "missed" && value > 0) ? "fail" : null,
            title: (which && boundsOf(c)) || null,
            "data-ns": kind === "time" ? value : null,
            "data-bound": told?.isBound,
          },
          isLate ? `${SIGN.FAIL} ${text}` : text,
        );
      }),
    ),
  );
  const order = report.callbacks.map((_, i) => i);
  const state = el("p", {class: "soft", role: "status"});
  const draw = () => {
    const words = filter.value.toLowerCase().split(/\s+/).filter(Boolean);
    const visible = order.filter(i => words.every(w => title(report.callbacks[i]).toLowerCase().includes(w)));
    body.replaceChildren(...visible.map(i => rows[i]));
    state.textContent =
      visible.length === order.length ? "" : `${count(visible.length)} of ${plural(order.length, "callback")}`;
  };
  const sort = (at, direction) => {
    const [, get] = shown[at];
    const value = i => get(report.callbacks[i], i);
    order.sort((a, b) => {
      const x = value(a);
      const y = value(b);
      if (x === y) return a - b;
      if (x === null) return 1;
      if (y === null) return -1;
      return (x < y ? -1 : 1) * direction;
    });
    headers.forEach((h, i) =>
      i === at
        ? h.setAttribute("aria-sort", direction > 0 ? "ascending" : "descending")
        : h.removeAttribute("aria-sort"),
    );
    draw();
  };
  const headers = shown.map(([name, , kind], at) =>
    el(
      "th",
      {scope: "col", class: kind === "text" ? "text" : null},
      el(
        "button",
        {
          type: "button",
          onclick: () =>
            sort(
              at,
              headers[at].getAttribute("aria-sort") === "descending" ||
                (at === 0 && !headers[at].hasAttribute("aria-sort"))
                ? 1
                : -1,
            ),
        },
        name,
      ),
    ),
  );
  const filter = el("input", {
    type: "search",
    placeholder: "Filter by name",
    "aria-label": "Filter callbacks by name",
    oninput: draw,
  });
  detail = el("div", {class: "detail", "aria-live": "polite"});
  section(
    "callbacks",
    "Callbacks",
    el("div", {class: "bar"}, filter, state),
    el(
      "div",
      {class: "scroll tall", tabindex: "0", role: "region", "aria-label": "Table of callbacks"},
      el("table", {id: "callback-table"}, el("thead", {}, el("tr", {}, headers)), body),
    ),
    el(
      "p",
      {class: "soft"},
      "Response time: from release to end. Start latency: from release to start. \u2013: not measured. \u2265: at least, when the release is not known exactly.",
    ),
    detail,
  );
  const byMax = shown.findIndex(([name]) => name === "response max");
  sort(byMax < 0 ? 0 : byMax, byMax < 0 ? 1 : -1);
};

// --- one callback: histogram, ECDF, where the time goes, slowest runs ----------------------------
const axisTicks = (low, high) => {
  const ticks = [];
  for (let e = Math.floor(low); e <= Math.ceil(high); ++e)
    for (const step of high - low < 1.7 ? [1, 2, 5] : [1]) {
      const at = e + Math.log10(step);
      if (at >= low && at <= high) ticks.push(at);
    }
  return ticks;
};
const histogram = (c, f) => {
  const W = 640;
  const H = 210;
  const left = 46;
  const right = 40;
  const top = 18;
  const bottom = 34;
  const per = facts.bins_per_decade;
  const first = f.responses[0][0];
  const last = f.responses[f.responses.length - 1][0] + 1;
  const deadline = f.deadline_ns === null ? null : Math.log10(f.deadline_ns);
  const low = Math.min(first / per, deadline ?? Number.POSITIVE_INFINITY) - 0.05;
  const high = Math.max(last / per, deadline ?? Number.NEGATIVE_INFINITY) + 0.05;
  const x = e => left + ((e - low) / (high - low)) * (W - left - right);
  const most = Math.max(...f.responses.map(b => b[1]));
  const all = f.responses.reduce((n, b) => n + b[1], 0);
  const y = n => H - bottom - (n / most) * (H - top - bottom);
  const share = s => H - bottom - s * (H - top - bottom);
  let sum = 0;
  let path = `M${x(first / per)},${share(0)}`;
  for (const [bin, n] of f.responses) {
    path += `L${x(bin / per)},${share(sum / all)}`;
    sum += n;
    path += `L${x((bin + 1) / per)},${share(sum / all)}`;
  }
  const marks = [
    ["p50", c.response_time_ns.p50, "middle"],
    ["p99", c.response_time_ns.p99, "end"],
    ["max", c.response_time_ns.max, "start"],
  ];
  const id = `hist-${report.callbacks.indexOf(c)}`;
  return svg(
    "svg",
    {viewBox: `0 0 ${W} ${H}`, role: "img", "aria-labelledby": id},
    svg(
      "title",
      {id},
      `Response times of ${title(c)}: ${count(all)} runs, p50 ${time(c.response_time_ns.p50)}, p99 ${time(c.response_time_ns.p99)}, max ${time(c.response_time_ns.max)}`,
    ),
    svg("line", {class: "axis", x1: left, x2: W - right, y1: H - bottom, y2: H - bottom}),
    axisTicks(low, high).map(e => [
      svg("line", {class: "axis", x1: x(e), x2: x(e), y1: top, y2: H - bottom + 4}),
      svg(
        "text",
        {class: "soft", x: x(e), y: H - bottom + 16, "text-anchor": "middle"},
        time(10 ** e).replace(/\.0+(?=\u202f)/, ""),
      ),
    ]),
    f.responses.map(([bin, n]) =>
      svg(
        "rect",
        {
          class: "f-run",
          x: x(bin / per) + 0.3,
          width: Math.max(x((bin + 1) / per) - x(bin / per) - 0.6, 0.8),
          y: y(n),
          height: H - bottom - y(n),
        },
        svg("title", {}, `${time(10 ** (bin / per))} to ${time(10 ** ((bin + 1) / per))}: ${plural(n, "run")}`),
      ),
    ),
    svg("path", {class: "ecdf", d: path}),
    svg("text", {class: "soft", x: left - 6, y: y(most) + 4, "text-anchor": "end"}, count(most)),
    svg("text", {class: "soft", x: left - 6, y: H - bottom, "text-anchor": "end"}, "0"),
    svg("text", {class: "soft", x: W - right + 5, y: share(1) + 4}, "100\u202f%"),
    svg("text", {class: "soft", x: W - right + 5, y: H - bottom}, "0"),
    marks.map(([name, ns, anchor]) => {
      const at = Math.min(Math.max(x(Math.log10(Math.max(ns, 1))), left), W - right);
      return [
        svg("line", {class: "axis", x1: at, x2: at, y1: top - 4, y2: H - bottom}),
        svg("text", {x: at + {end: -3, middle: 0, start: 3}[anchor], y: top - 6, "text-anchor": anchor}, name),
      ];
    }),
    deadline === null
      ? null
      : [
          svg("line", {class: "mark", x1: x(deadline), x2: x(deadline), y1: top, y2: H - bottom}),
          svg("text", {x: x(deadline) + 4, y: top + 12}, `deadline ${time(f.deadline_ns)}`),
        ],
    svg(
      "text",
      {class: "soft", x: (left + W - right) / 2, y: H - 3, "text-anchor": "middle"},
      "response time (bars: runs, left; line: share of runs at most as long, right)",
    ),
  );
};
const stack = (parts, text) => {
  const all = parts.reduce((sum, part) => sum + part[2], 0);
  let at = 0;
  return el(
    "div",
    {},
    svg(
      "svg",
      {
        viewBox: "0 0 640 22",
        role: "img",
        "aria-label": `${text}: ${parts.map(p => `${p[0]} ${time(p[2])}`).join(", ")}`,
      },
      parts.map(([what, kind, ns]) => {
        const w = (ns / all) * 640;
        const r = svg(
          "rect",
          {class: `f-${kind}`, x: at, width: w, y: 0, height: 22},
          svg("title", {}, `${what}: ${time(ns)}`),
        );
        at += w;
        return r;
      }),
    ),
    el(
      "div",
      {class: "key"},
      parts.map(([what, kind, ns]) =>
        el(
          "span",
          {},
          svg(
            "svg",
            {width: 11, height: 11, "aria-hidden": "true"},
            svg("rect", {class: `f-${kind}`, width: 11, height: 11}),
          ),
          `${what} ${time(ns)} (${percent(ns / all)})`,
        ),
      ),
    ),
  );
};
const meanParts = c => {
  const mean = key => (c[key] === null ? 0 : c[key].mean);
  const parts = [["waited to start", "wait", mean("start_latency_ns")]];
  if (c.execution_time_ns === null) parts.push(["ran or was kept from running", "run", mean("duration_ns")]);
  else
    parts.push(
      ["executed", "run", mean("execution_time_ns")],
      ["preempted", "preempted", mean("preempted_ns")],
      ["blocked", "blocked", mean("blocked_ns")],
      ["waited for a CPU after waking", "wake", mean("wake_delay_ns")],
    );
  return parts.filter(part => part[2] > 0);
};
export const choose = (index, scroll) => {
  if (chosen >= 0) rows[chosen].classList.remove("chosen");
  chosen = index;
  rows[index].classList.add("chosen");
  const c = report.callbacks[index];
  const f = facts.callbacks[index];
  const lane = laneOf(index);
  const threads = c.threads.map(t => `${t.name || "thread"} ${t.tid} (${plural(t.instances, "run")})`).join(", ");
  const worst = lane ? slowest(lane, 8) : [];
  const parts = meanParts(c);
  detail.replaceChildren(
    ...[
      el("h3", {id: "detail"}, title(c)),
      el(
        "p",
        {class: "soft"},
        [
          `${c.kind}${c.source ? ` on ${c.source}` : ""} of ${c.node || "no node"}`,
          c.period_ns === null ? null : `period ${time(c.period_ns)}`,
          c.symbol || null,
          threads ? `threads: ${threads}` : null,
        ]
          .filter(Boolean)
          .join("; "),
      ),
      el(
        "div",
        {class: "two"},
        el(
          "div",
          {},
          c.response_time_ns === null || !f.responses.length
            ? el(
                "p",
                {},
                c.isolation === "never_ran"
                  ? "It never ran."
                  : "Its response times are not known exactly: the trace does not say when its runs were released.",
              )
            : histogram(c, f),
          c.response_time_lower_ns === null ? null : el("p", {id: "bounds"}, `Response times of ${boundsOf(c)}.`),
        ),
        el(
          "div",
          {},
          parts.length ? [el("p", {}, "Where the time goes, on average:"), stack(parts, "Where the time goes")] : null,
          c.preempted_by.length
            ? el(
                "p",
                {},
                "Preempted by: ",
                c.preempted_by
                  .slice(0, 4)
                  .map(p => `${p.name || "thread"} ${p.tid} ${time(p.ns)}`)
                  .join(", "),
                " (all runs)",
              )
            : null,
          c.execution_time_ns === null
            ? el(
                "p",
                {class: "soft"},
                "Who ran meanwhile is not known: that takes the kernel's scheduler events (cie record --kernel=yes).",
              )
            : null,
        ),
      ),
      worst.length
        ? el(
            "div",
            {class: "scroll"},
            el(
              "table",
              {},
              el("caption", {}, "Slowest runs"),
              el(
                "thead",
                {},
                el(
                  "tr",
                  {},
                  ["run", "response", "waited", "ran for", "executed", "preempted", "blocked", "thread", ""].map(h =>
                    el("th", {scope: "col"}, h),
                  ),
                ),
              ),
              el(
                "tbody",
                {},
                worst.map(i =>
                  el(
                    "tr",
                    {},
                    el("td", {}, `#${count(lane.seq[i])}`),
                    [
                      lane.response(i),
                      lane.wait[i],
                      lane.duration[i],
                      lane.execution[i],
                      lane.preempted[i],
                      lane.blocked[i],
                    ].map((ns, at) =>
                      el(
                        "td",
                        {class: at === 0 && lane.isLate(i) ? "fail" : null},
                        Number.isNaN(ns) ? "\u2013" : time(ns),
                      ),
                    ),
                    el("td", {}, lane.tid(i)),
                    el(
                      "td",
                      {class: "text"},
                      link("show", () => timeline.show(lane, i)),
                    ),
                  ),
                ),
              ),
            ),
          )
        : null,
    ].filter(Boolean),
  );
  if (scroll) detail.scrollIntoView({block: "nearest"});
};

// --- which callback ran on which thread -----------------------------------------------------------
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
      svg(
        "svg",
        {
          viewBox: `0 0 ${W} ${H}`,
          width: W,
          height: H,
          class: "wide",
          role: "img",
          "aria-label": `Matrix of ${plural(report.callbacks.length, "callback")} and ${plural(columns.length, "thread")}`,
        },
        columns.map((_, i) =>
          i % 5 === 0 ? svg("line", {class: "axis", x1: label + i * cell, x2: label + i * cell, y1: 10, y2: H}) : null,
        ),
        report.callbacks.map((c, r) => [
          label
            ? svg(
                "text",
                {x: label - 6, y: 16 + r * row + row * 0.72, "text-anchor": "end"},
                title(c).length > 48 ? `\u2026${title(c).slice(-47)}` : title(c),
                svg("title", {}, title(c)),
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
                `${title(c)} on ${t.name || "thread"} ${t.tid}: ${plural(t.instances, "run")}${isAlone ? "" : ", not isolated"}`,
              ),
            );
          }),
        ]),
      ),
    ),
  );
};

// --- chains -----------------------------------------------------------------------------------------
const graph = () => {
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
  const cut = text => (text.length > 32 ? `\u2026${text.slice(-31)}` : text);
  const respondsIn = c => (c.response_time_ns ? `: responds within ${time(c.response_time_ns.max)}` : "");
  const name = c => (severalHosts ? title(c) : c.logical_id);
  const halves = n => {
    const i = n.indexOf("@");
    return i < 0 ? [n, ""] : [n.slice(0, i), n.slice(i + 1)];
  };
  return el(
    "div",
    {class: "scroll"},
    svg(
      "svg",
      {
        viewBox: `0 0 ${W} ${H}`,
        width: W,
        height: H,
        class: "wide",
        role: "img",
        "aria-label": `Graph of ${plural(nodes.size, "callback")} linked by messages`,
      },
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
              `${name(nodes.get(from))} to ${name(nodes.get(to))} by ${edge.topic}: ${plural(edge.messages, "message")}${ns === null ? "" : `, ${time(ns)} in the middle`}`,
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
          svg("title", {}, name(nodes.get(n)) + respondsIn(nodes.get(n))),
          svg("rect", {class: "box", x: p.x, y: p.y, width: w, height: h, rx: 5}),
          halves(nodes.get(n).logical_id).map((text, line) =>
            svg("text", {class: line ? "soft" : null, x: p.x + 7, y: p.y + 15 + 14 * line}, cut(text)),
          ),
        ),
      ),
    ),
  );
};
export const chains = () => {
  if (!report.chains.length) {
    const drawn = graph();
    if (drawn) section("chains", "Who takes whose messages", drawn);
    return;
  }
  // A chain without a name of its own is named by all its callbacks.
  const short = c =>
    (c.hops.length > 2 && c.name === c.hops.join(" -> ")
      ? `${c.hops[0]} \u2026 ${c.hops[c.hops.length - 1]}`
      : c.name) + (severalHosts && c.process !== null ? whereabouts(processByIndex.get(c.process)) : "");
  // Which host a hop is on is said where the chain passes from one to another.
  const hopName = (c, i) =>
    severalHosts && c.process === null && c.hop_table.length === c.callbacks.length
      ? title(callbackByIndex.get(c.callbacks[i]))
      : c.hop_table[i].from;
  const cells = s => (s === null ? ["\u2013", "\u2013", "\u2013"] : [time(s.p50), time(s.p99), time(s.max)]);
  const header = names =>
    el(
      "thead",
      {},
      el(
        "tr",
        {},
        names.map(n => el("th", {scope: "col"}, n)),
      ),
    );
  section(
    "chains",
    "Chains of callbacks",
    graph(),
    el(
      "div",
      {class: "scroll"},
      el(
        "table",
        {id: "chain-table"},
        header([
          "chain",
          "hops",
          "runs",
          "path latency p50",
          "p99",
          "max",
          "reaction time p50",
          "p99",
          "max",
          "data age p50",
          "p99",
          "max",
        ]),
        el(
          "tbody",
          {},
          report.chains.map(c =>
            el(
              "tr",
              {},
              el("td", {class: "name", title: c.name}, short(c)),
              el("td", {}, c.hops.length),
              el("td", {}, count(c.instances)),
              [c.path_latency_ns, c.reaction_time_ns, c.data_age_ns].flatMap(cells).map(t => el("td", {}, t)),
            ),
          ),
        ),
      ),
    ),
    report.chains.slice(0, 60).map(c =>
      el(
        "details",
        {},
        el("summary", {}, `Where ${short(c)} spends its time`),
        el(
          "div",
          {class: "scroll"},
          el(
            "table",
            {},
            header(["in", "p50", "p99", "max", "then to the next, p50", "p99", "max"]),
            el(
              "tbody",
              {},
              c.hop_table.map((hop, i) =>
                el(
                  "tr",
                  {},
                  el("td", {class: "name"}, hopName(c, i)),
                  [hop.processing_ns, hop.communication_ns].flatMap(cells).map(t => el("td", {}, t)),
                ),
              ),
              c.undivided_ns
                ? el(
                    "tr",
                    {},
                    el("td", {class: "name"}, "not divided"),
                    cells(c.undivided_ns).map(t => el("td", {}, t)),
                    el("td", {colspan: 3}),
                  )
                : null,
            ),
          ),
        ),
        c.instances === 0
          ? el(
              "p",
              {class: "soft"},
              "No instance of it was seen: a callback of it never ran, or no message leads from one to the next.",
            )
          : null,
        c.undivided_ns
          ? el(
              "p",
              {class: "soft"},
              `A release is not known on ${plural(c.undivided_ns.count, "instance")}: from the publish before it to the one after it their time is not divided. The sums of all rows add up to the path latency's.`,
            )
          : null,
      ),
    ),
  );
};

// --- threads ----------------------------------------------------------------------------------------
export const threads = () => {
  if (!report.threads.length) return;
  const sched = s =>
    s === null
      ? "\u2013"
      : [
          s.policy_name || `policy ${s.policy}`,
          s.priority ? s.priority : null,
          s.nice ? `nice ${s.nice}` : null,
          s.runtime_ns ? `${time(s.runtime_ns)} of ${time(s.period_ns)}, deadline ${time(s.deadline_ns)}` : null,
          s.error ? `error ${s.error}` : null,
        ]
          .filter(x => x !== null)
          .join(" ");
  section(
    "threads",
    "Threads",
    el(
      "div",
      {class: "scroll tall", tabindex: "0", role: "region", "aria-label": "Table of threads"},
      el(
        "table",
        {},
        el(
          "thead",
          {},
          el(
            "tr",
            {},
            [
              "thread",
              ...(severalHosts ? ["host"] : []),
              "pid",
              "tid",
              "role",
              "scheduling",
              "CPUs",
              "busy",
              "callbacks",
            ].map(n =>
              el("th", {scope: "col", class: ["thread", "pid", "tid", "busy"].includes(n) ? null : "text"}, n),
            ),
          ),
        ),
        el(
          "tbody",
          {},
          report.threads.map(t =>
            el(
              "tr",
              {},
              el("td", {}, t.name || "\u2013"),
              severalHosts ? el("td", {class: "text"}, processByIndex.get(t.process).host) : null,
              el("td", {}, processByIndex.get(t.process).pid),
              el("td", {}, t.tid),
              el("td", {class: "text"}, t.role || "\u2013"),
              el("td", {class: "text"}, sched(t.sched)),
              el("td", {class: "text"}, t.sched === null ? "\u2013" : t.sched.cpus.join(" ")),
              el("td", {}, time(t.busy_ns)),
              el("td", {class: "text name"}, t.callbacks.join(", ")),
            ),
          ),
        ),
      ),
    ),
  );
};

export const defects = () => {
  if (!report.defects.length) return;
  section(
    "defects",
    "What this trace lacks",
    el(
      "ul",
      {},
      report.defects.map(d =>
        el("li", {}, el("strong", {}, d.kind), ` (${d.severity}, ${count(d.count)}): ${d.advice}`),
      ),
    ),
  );
};
