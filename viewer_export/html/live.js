// The live page: draws each snapshot (cie.live/1) that the server sends. Text of the system goes
// into text nodes only.

import {el, svg} from "./dom.js";
import {COLOUR, SIGN, plural, time} from "./words.js";

const byId = id => document.getElementById(id);
const columns = [
  {title: "callback", text: true, value: c => c.name, tip: fullName},
  {title: "p50", value: c => c.window.response_time_ns?.p50 ?? -1, show: duration, isTime: true},
  {title: "p99", value: c => c.window.response_time_ns?.p99 ?? -1, show: duration, isTime: true, isFirst: true},
  {title: "max", value: c => c.window.response_time_ns?.max ?? -1, show: duration, isTime: true},
  {title: "last minutes", value: c => c.last_response_ns ?? -1, draw: curve},
  {
    title: "last",
    value: c => (c.open.long ? c.open.longest_ns : (c.last_response_ns ?? -1)),
    show: duration,
    isTime: true,
    bound: c => c.open.long,
    bad: c => c.open.long && c.open.certain,
  },
  {title: "deadline", value: c => c.deadline_ns ?? -1, show: duration},
  {
    title: "late",
    value: c => (c.deadline_ns === null ? -1 : c.total.late),
    show: v => (v < 0 ? "-" : String(v)),
    bad: c => c.total.late > 0,
  },
  {
    title: "missed",
    value: c => c.total.missed_releases ?? -1,
    show: v => (v < 0 ? "-" : String(v)),
    bad: c => c.total.missed_too_many,
  },
  {title: "instances/s", value: c => c.window.instances / seconds(), show: v => v.toFixed(1)},
  {title: "pid", value: c => c.pid},
];
const keptInstances = 200;
const keptChanges = 200;
// Of the curves: what is kept of a callback is at most one number for each of these.
const sampleNs = 2e9;
const keptSamples = 150;
const state = {
  snapshot: null,
  sort: columns.findIndex(column => column.isFirst),
  descending: true,
  paused: false,
  chosen: null,
  instances: new Map(),
  curves: new Map(), // by callback: [number of the sample, longest response time in it]
  changes: [],
};

// With its machine in front, where several are followed.
function withHost(host, text) {
  return state.snapshot.hosts.length > 0 ? `${host} ${text}` : text;
}
// What tells a callback from all others.
function fullName(callback) {
  return `${withHost(callback.host, callback.logical_id)} (pid ${callback.pid})`;
}
const isolations = {isolated: "isolated", not_isolated: "not isolated", never_ran: "never ran"};
function seconds() {
  return Math.max(state.snapshot.window_ns / 1e9, 0.1);
}
function duration(ns) {
  return ns === null || ns < 0 ? "-" : time(ns);
}
// A machine of several that is not heard of as it should be.
function isInTrouble(host) {
  return ["silent", "lost"].includes(host.state) || host.message !== "";
}
function inWords(host) {
  const since = host.state === "ended" ? "" : ` for ${duration(host.silent_ns)}`;
  return `${host.host}: ${host.state}${since}${host.message ? `, ${host.message}` : ""}`;
}
// Of a callback with an instance that has been open for long.
function howLongOpen(callback) {
  const open = duration(callback.open.longest_ns);
  return callback.open.certain
    ? `${callback.name} has not ended for ${open}`
    : `${callback.name} began ${open} ago, and its end was not seen`;
}
function table(target, titles, rows) {
  const head = el("thead");
  head.append(el("tr"));
  head.firstChild.append(...titles.map(title => el("th", {scope: "col"}, title)));
  const body = el("tbody");
  body.append(
    ...rows.map(cells => {
      const row = el("tr");
      row.append(...cells.map(cell => (typeof cell === "string" ? el("td", {}, cell) : cell)));
      return row;
    }),
  );
  target.replaceChildren(head, body);
}

// The callback's longest response times, from its deadline's zero on.
function curve(c) {
  const [W, H] = [120, 22];
  // While the page is paused, samples go on; of what ended, old ones stay.
  const last = Math.floor(state.snapshot.realtime_ns / sampleNs);
  const samples = (state.curves.get(c.index) ?? []).filter(([at]) => at <= last && at > last - keptSamples);
  if (!samples.length) return null;
  const first = Math.min(samples[0][0], last - 1);
  const longest = Math.max(...samples.map(([, ns]) => ns));
  const top = Math.max(longest, c.deadline_ns ?? 0, 1);
  const x = at => ((at - first) / Math.max(last - first, 1)) * W;
  const y = ns => H - 1 - (ns / top) * (H - 2);
  const span = duration((last - first + 1) * sampleNs);
  return svg(
    "svg",
    {
      class: "curve",
      viewBox: `0 0 ${W} ${H}`,
      preserveAspectRatio: "none",
      role: "img",
      "aria-label": `Response times of ${c.name} in ${span}: at most ${duration(longest)}`,
    },
    svg("title", {}, `at most ${duration(longest)} in ${span}`),
    c.deadline_ns === null
      ? null
      : svg("line", {class: "mark", x1: 0, x2: W, y1: y(c.deadline_ns), y2: y(c.deadline_ns)}),
    svg("polyline", {points: samples.map(([at, ns]) => `${x(at).toFixed(1)},${y(ns).toFixed(1)}`).join(" ")}),
  );
}

function drawCallbacks() {
  const head = el("tr");
  columns.forEach((column, i) => {
    const cell = el("th", {scope: "col"});
    if (i === state.sort) cell.setAttribute("aria-sort", state.descending ? "descending" : "ascending");
    const button = el("button", {type: "button"}, column.title);
    button.addEventListener("click", () => {
      state.descending = state.sort === i ? !state.descending : !column.text;
      state.sort = i;
      draw();
    });
    cell.append(button);
    head.append(cell);
  });
  const wanted = byId("filter").value.toLowerCase();
  const chosen = state.snapshot.callbacks.filter(c =>
    `${c.logical_id}\n${c.name}\n${c.host}\n${c.pid}`.toLowerCase().includes(wanted),
  );
  const {value} = columns[state.sort];
  const compare = (a, b) => (value(a) < value(b) ? -1 : value(a) > value(b) ? 1 : 0);
  chosen.sort((a, b) => (state.descending ? compare(b, a) : compare(a, b)) || (a.logical_id < b.logical_id ? -1 : 1));
  const body = el("tbody");
  for (const c of chosen) {
    const row = el("tr", {tabindex: "0"});
    row.dataset.index = String(c.index);
    row.classList.toggle("ended", c.ended);
    row.classList.toggle("chosen", c.index === state.chosen);
    for (const column of columns) {
      if (column.draw) {
        row.append(el("td", {}, column.draw(c)));
        continue;
      }
      const shown = column.show ? column.show(column.value(c)) : String(column.value(c));
      const isBad = Boolean(column.bad?.(c));
      const isBound = column.isTime && (!c.exact || column.bound?.(c));
      const bound = isBound && shown !== "-" ? ">" : "";
      const cell = el("td", {title: column.tip?.(c)}, (isBad ? `${SIGN.FAIL} ` : "") + bound + shown);
      if (column.text) cell.classList.add("name");
      if (isBad) cell.classList.add("bad");
      row.append(cell);
    }
    const open = () => {
      state.chosen = state.chosen === c.index ? null : c.index;
      draw();
    };
    row.addEventListener("click", open);
    row.addEventListener("keydown", event => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      open();
    });
    body.append(row);
  }
  const focused = document.activeElement?.closest?.("#callbacks tbody tr")?.dataset.index;
  const thead = el("thead");
  thead.append(head);
  byId("callbacks").replaceChildren(thead, body);
  if (focused !== undefined) [...body.rows].find(row => row.dataset.index === focused)?.focus();
}

function drawDetail() {
  const detail = byId("detail");
  const callback = state.snapshot.callbacks.find(c => c.index === state.chosen);
  detail.hidden = !callback;
  if (!callback) return;
  const list = el("table");
  const rows = [...(state.instances.get(callback.index) ?? [])].reverse().map(i => [
    String(i.seq),
    String(i.tid),
    i.cpu === null ? "-" : String(i.cpu),
    (() => {
      const cell = el("td", {}, (i.late ? `${SIGN.FAIL} ` : "") + (i.exact ? "" : ">") + duration(i.response_ns));
      if (i.late) cell.classList.add("bad");
      return cell;
    })(),
    duration(i.execution_ns),
    String(i.missed),
  ]);
  table(list, ["seq", "tid", "CPU", "response time", "execution time", "missed"], rows);
  const scroll = el("div", {class: "scroll tall"});
  scroll.append(list);
  detail.replaceChildren(
    el("h3", {title: fullName(callback)}, callback.name),
    el(
      "p",
      {},
      `${fullName(callback)}: ${callback.kind}, ${isolations[callback.isolation] ?? "isolation unknown"}, ${callback.total.instances} instances since the start`,
    ),
    scroll,
  );
}

const violation = (v, ...says) =>
  el(
    "li",
    {},
    el("span", {class: "sign fail", "aria-hidden": "true"}, SIGN.FAIL),
    el("strong", {}, `${v.rule} ${v.name}`),
    ...says,
  );

// Why it fails, a line for each rule: the gravest first, as the snapshot has them.
function drawReasons() {
  const most = 3;
  const rules = state.snapshot.violations;
  const firstOf = rule => state.snapshot.verdicts.find(v => v.verdict === "FAIL" && v.rule === rule);
  const lines = rules.slice(0, most).map(({rule, name, subjects}) => {
    const says = firstOf(rule)?.says; // the list is cut
    return violation(
      {rule, name},
      subjects > 1 ? ` (${plural(subjects, "subject")})` : "",
      says === undefined ? "" : `: ${says}`,
    );
  });
  if (rules.length > most)
    lines.push(el("li", {}, el("a", {href: "#violations"}, `and ${plural(rules.length - most, "more rule")}`)));
  byId("reasons").hidden = !lines.length;
  byId("reasons").replaceChildren(...lines);
}

function drawVerdicts() {
  const items = state.snapshot.verdicts.filter(v => v.verdict === "FAIL").map(v => violation(v, `, ${v.says}`));
  byId("violations").replaceChildren(...(items.length ? items : [el("li", {}, "none")]));
  table(
    byId("changes"),
    ["time", "rule", "subject and evidence", "was", "is"],
    [...state.changes].reverse().map(c => [c.at, `${c.rule} ${c.name}`, c.says, c.from, c.to]),
  );
}

function drawThreads() {
  const key = (row, id) => JSON.stringify([row.host, row.pid, id]);
  const names = new Map(state.snapshot.callbacks.map(c => [key(c, c.logical_id), c.name]));
  const sorted = [...state.snapshot.threads].sort((a, b) => (b.cpu_percent ?? -1) - (a.cpu_percent ?? -1));
  table(
    byId("threads"),
    ["thread", "pid", "tid", "CPU %", "callbacks"],
    sorted.map(t => [
      withHost(t.host, t.name),
      String(t.pid),
      String(t.tid),
      t.cpu_percent === null ? "-" : t.cpu_percent.toFixed(1),
      t.callbacks.map(id => names.get(key(t, id)) ?? id).join(", ") || t.role,
    ]),
  );
}

function draw() {
  const s = state.snapshot;
  if (!s) return;
  byId("source").textContent = `${s.source.watched || s.source.url}, ${s.source.state}`;
  byId("source").title = s.source.url;
  const open = s.callbacks.filter(c => c.open.long).map(howLongOpen);
  byId("message").textContent = [s.source.message, ...s.hosts.filter(isInTrouble).map(inWords), ...open]
    .filter(Boolean)
    .join("; ");
  const verdict = byId("verdict");
  verdict.textContent = `${SIGN[s.verdict]} ${s.verdict}`;
  verdict.className = `verdict ${COLOUR[s.verdict] === "soft" ? "open" : COLOUR[s.verdict]}`;
  const lost = s.lost_events === null ? `unknown, ${s.lost_packets} packets` : String(s.lost_events);
  byId("facts").replaceChildren(
    ...[
      `${s.events} events`,
      `${s.events_per_second.toFixed(0)} events/s`,
      `lost: ${lost}`,
      ...(s.delay_ns === null ? [] : [`${duration(s.delay_ns)} old`]),
    ].map(text => el("li", {}, text)),
  );
  drawReasons();
  drawCallbacks();
  drawDetail();
  drawVerdicts();
  drawThreads();
}

// The samples of a callback, with what came since the snapshot before.
function sampled(samples, c, now) {
  const longest = Math.max(...c.recent.map(i => i.response_ns), -1);
  if (longest < 0) return samples;
  const at = Math.floor(now / sampleNs);
  const last = samples[samples.length - 1];
  if (last?.[0] === at) return [...samples.slice(0, -1), [at, Math.max(last[1], longest)]];
  return [...samples, [at, longest]].filter(([when]) => when > at - keptSamples);
}

function take(snapshot) {
  const at = new Date(snapshot.realtime_ns / 1e6).toLocaleTimeString();
  const instances = new Map();
  const curves = new Map();
  for (const c of snapshot.callbacks) {
    curves.set(c.index, sampled(state.curves.get(c.index) ?? [], c, snapshot.realtime_ns));
    instances.set(c.index, [...(state.instances.get(c.index) ?? []), ...c.recent].slice(-keptInstances));
  }
  state.instances = instances;
  state.curves = curves;
  state.changes = [...state.changes, ...snapshot.changes.map(c => ({...c, at}))].slice(-keptChanges);
  if (state.paused) return;
  state.snapshot = snapshot;
  draw();
  document.documentElement.dataset.ready = "true";
}

byId("filter").addEventListener("input", draw);
byId("pause").addEventListener("click", () => {
  state.paused = !state.paused;
  byId("pause").setAttribute("aria-pressed", String(state.paused));
  byId("pause").textContent = state.paused ? "Go on" : "Pause";
});
const events = new EventSource("events");
events.addEventListener("message", event => take(JSON.parse(event.data)));
events.addEventListener("error", () => {
  byId("message").textContent = "The connection to cie live is lost; trying again.";
});
