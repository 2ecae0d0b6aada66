// One callback: histogram of its response times, where its time goes, its slowest runs.
import {colour, el, link, scrolled, svg, withoutEmptyColumns} from "./dom.js";
import {laneOf, slowest} from "./instances.js";
import {atLeast, atMostWhereUnknown, fullName, histograms, idleTime, name, report, whyIdle} from "./recording.js";
import {timeline} from "./timeline.js";
import {SIGN, count, percent, plural, roundTime, time} from "./words.js";

// What is known where a response time is not, or not of all runs.
export const boundsOf = c => {
  const lower = c.response_time_lower_ns;
  const upper = c.response_time_upper_ns;
  if (lower === null) return "";
  const most =
    atMostWhereUnknown(c) === null ? "" : `, ${time(upper.p50)}, ${time(upper.p99)} and ${time(upper.max)} at most`;
  return `${plural(lower.count, "instance")} whose release is not known exactly: p50 ${time(lower.p50)}, p99 ${time(lower.p99)} and max ${time(lower.max)} at least${most}`;
};

// The threads that preempted it longest, and what there is besides: the report names a limited number.
const preemptors = c => {
  const FIRST = 4;
  const by = c.preempted_by.filter(p => p.tid !== 0);
  const told = by.slice(0, FIRST).map(p => `${p.name || "thread"} ${p.tid} ${time(p.ns)}`);
  const others = by.length - told.length;
  if (others === 0) return told.join(", ");
  const sum = list => list.reduce((ns, p) => ns + p.ns, 0);
  const rest = c.preempted_ns.sum - sum(by.slice(0, FIRST)) - idleTime(c);
  const isWhole = sum(c.preempted_by) === c.preempted_ns.sum;
  return `${told.join(", ")} and ${isWhole ? "" : "at least "}${plural(others, "thread")} more, ${time(rest)}`;
};

const axisTicks = (low, high) => {
  const ticks = [];
  for (let e = Math.floor(low); e <= Math.ceil(high); ++e)
    for (const step of high - low < 1.7 ? [1, 2, 5] : [1]) {
      const at = e + Math.log10(step);
      if (at >= low && at <= high) ticks.push(at);
    }
  return ticks;
};
const PER_DECADE = 20;
// Buckets of the report's histogram in bars of equal width on a logarithmic axis: [from, to, runs], ascending, in
// nanoseconds. A bucket's number is within 0.8 % of its runs' times, so inner edges are about right; none lies outside
// the shortest and the longest run.
export const barsOf = (buckets, {min, max}) => {
  const bars = new Map();
  for (const [ns, runs] of buckets) {
    const bar = Math.floor(Math.log10(Math.max(Math.min(Math.max(ns, min), max), 1)) * PER_DECADE);
    bars.set(bar, (bars.get(bar) ?? 0) + runs);
  }
  const edge = bar => Math.min(Math.max(10 ** (bar / PER_DECADE), min, 1), Math.max(max, 1));
  return [...bars].sort((a, b) => a[0] - b[0]).map(([bar, runs]) => [edge(bar), edge(bar + 1), runs]);
};
const rangeOf = (from, to) => (from === to ? time(from) : `about ${time(from)} to ${time(to)}`);
// Quantiles and deadline with rows for their labels, so that none hides another.
const ROW = 13;
const marksOf = (c, place, W) => {
  const {p50, p99, max} = c.response_time_ns;
  const all = [
    ["p50", p50],
    ["p99", p99],
    ["max", max],
  ];
  if (c.response_deadline_ns !== null) all.push(["deadline", c.response_deadline_ns]);
  const ends = [];
  return all
    .map(([what, ns]) => ({what, ns, at: place(ns), text: `${what} ${time(ns)}`}))
    .sort((a, b) => a.at - b.at)
    .map(mark => {
      const width = mark.text.length * 6.3 + 6;
      const from = Math.min(mark.at + 3, W - width);
      let row = 0;
      while (ends[row] > from) ++row;
      ends[row] = from + width;
      return {...mark, row, from};
    });
};
const histogram = (c, bars) => {
  const W = matchMedia("(max-width: 46rem)").matches ? 360 : 640;
  const H = 230;
  const left = 46;
  const right = 40;
  const bottom = 34;
  const first = Math.log10(bars[0][0]);
  const last = Math.log10(bars[bars.length - 1][1]);
  const deadline = c.response_deadline_ns === null ? null : Math.log10(c.response_deadline_ns);
  const low = Math.min(first, deadline ?? Number.POSITIVE_INFINITY) - 0.05;
  const high = Math.max(last, deadline ?? Number.NEGATIVE_INFINITY) + 0.05;
  const x = e => left + ((e - low) / (high - low)) * (W - left - right);
  const marks = marksOf(c, ns => Math.min(Math.max(x(Math.log10(Math.max(ns, 1))), left), W - right), W);
  const top = ROW * (1 + Math.max(...marks.map(m => m.row))) + 10;
  const most = Math.max(...bars.map(b => b[2]));
  const all = bars.reduce((n, b) => n + b[2], 0);
  const xOf = ns => x(Math.log10(ns));
  const y = n => H - bottom - (n / most) * (H - top - bottom);
  const share = s => H - bottom - s * (H - top - bottom);
  let sum = 0;
  let path = `M${x(first)},${share(0)}`;
  for (const [from, to, n] of bars) {
    path += `L${xOf(from)},${share(sum / all)}`;
    sum += n;
    path += `L${xOf(to)},${share(sum / all)}`;
  }
  const id = `hist-${report.callbacks.indexOf(c)}`;
  return svg(
    "svg",
    {viewBox: `0 0 ${W} ${H}`, role: "img", "aria-labelledby": id},
    svg(
      "title",
      {id},
      `Response times of ${name(c)}: ${count(all)} instances, p50 ${time(c.response_time_ns.p50)}, p99 ${time(c.response_time_ns.p99)}, max ${time(c.response_time_ns.max)}`,
    ),
    svg("line", {class: "axis", x1: left, x2: W - right, y1: H - bottom, y2: H - bottom}),
    axisTicks(low, high).map(e => [
      svg("line", {class: "axis", x1: x(e), x2: x(e), y1: top, y2: H - bottom + 4}),
      svg("text", {class: "soft", x: x(e), y: H - bottom + 16, "text-anchor": "middle"}, roundTime(10 ** e)),
    ]),
    bars.map(([from, to, n]) => {
      const width = Math.max(xOf(to) - xOf(from) - 0.6, 2);
      return svg(
        "rect",
        {
          class: "f-run",
          x: (xOf(from) + xOf(to) - width) / 2,
          width,
          y: y(n),
          height: H - bottom - y(n),
        },
        svg("title", {}, `${rangeOf(from, to)}: ${plural(n, "instance")}`),
      );
    }),
    svg("path", {class: "ecdf", d: path}),
    svg("text", {class: "soft", x: left - 6, y: y(most) + 4, "text-anchor": "end"}, count(most)),
    svg("text", {class: "soft", x: left - 6, y: H - bottom, "text-anchor": "end"}, "0"),
    svg("text", {class: "soft", x: W - right + 5, y: share(1) + 4}, "100\u202f%"),
    svg("text", {class: "soft", x: W - right + 5, y: H - bottom}, "0"),
    marks.map(({what, at, row, from, text}) => [
      svg("line", {
        class: what === "deadline" ? "mark" : what === "p50" ? "axis" : "quantile",
        x1: at,
        x2: at,
        y1: ROW * row + 3,
        y2: H - bottom,
      }),
      svg("text", {x: from, y: ROW * (row + 1) - 2}, text),
    ]),
    svg(
      "text",
      {class: "soft", x: (left + W - right) / 2, y: H - 3, "text-anchor": "middle"},
      W > 400
        ? "response time (bars: instances, left; line: share of instances at most as long, right)"
        : "response time (bars: instances; line: share as long at most)",
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
      parts.map(([what, kind, ns]) => colour(kind, `${what} ${time(ns)} (${percent(ns / all)})`)),
    ),
  );
};
// Means over the runs whose execution time is known, which the kernel's record may not tell of all. Means over other
// runs would not add up with them: start latency is left out where it is not known of the same number.
const meanParts = c => {
  const known = c.execution_time_ns ?? c.duration_ns;
  const runs = known === null ? 0 : known.count;
  const mean = key => (c[key] === null || c[key].count !== runs ? 0 : c[key].mean);
  const parts = [["start latency", "wait", mean("start_latency_ns")]];
  if (c.execution_time_ns === null) parts.push(["duration", "run", mean("duration_ns")]);
  else
    parts.push(
      ["execution time", "run", mean("execution_time_ns")],
      ["preempted", "preempted", mean("preempted_ns")],
      ["blocked", "blocked", mean("blocked_ns")],
      ["wake delay", "wake", mean("wake_delay_ns")],
    );
  const isFromStart = c.start_latency_ns !== null && c.start_latency_ns.count !== runs;
  return {
    parts: parts.filter(part => part[2] > 0),
    of: `${runs < c.instances ? ` of ${count(runs)} of ${plural(c.instances, "instance")}` : ""}${isFromStart ? ", from start to end" : ""}`,
  };
};

// What is shown of the callback beneath the table.
export const details = index => {
  const c = report.callbacks[index];
  const bars = c.response_time_ns === null ? [] : barsOf(histograms[index], c.response_time_ns);
  const lane = laneOf(index);
  const threads = c.threads.map(t => `${t.name || "thread"} ${t.tid} (${plural(t.instances, "instance")})`).join(", ");
  const worst = lane ? slowest(lane, 8) : [];
  const {parts, of} = meanParts(c);
  return [
    el("h3", {id: "detail", title: fullName(c)}, name(c)),
    el(
      "p",
      {class: "soft"},
      [
        fullName(c),
        `${c.kind}${c.source ? ` on ${c.source}` : ""} of ${c.node || "no node"}`,
        c.period_ns === null ? null : `period ${time(c.period_ns)}`,
        threads ? `threads: ${threads}` : null,
      ]
        .filter(Boolean)
        .join("; "),
    ),
    c.symbol ? el("p", {class: "soft line", title: c.symbol}, el("code", {}, c.symbol)) : null,
    el(
      "div",
      {class: "two"},
      el(
        "div",
        {},
        c.response_time_ns === null || !bars.length
          ? el(
              "p",
              {},
              c.isolation === "never_ran"
                ? c.runs_not_seen
                  ? "No instance of it was seen, though it ran."
                  : "It never ran."
                : "Its response times are not known exactly: the trace does not say when its instances were released.",
            )
          : histogram(c, bars),
        c.response_time_lower_ns === null ? null : el("p", {id: "bounds"}, `Response times of ${boundsOf(c)}.`),
      ),
      el(
        "div",
        {},
        parts.length
          ? [el("p", {}, `Where the time goes, on average${of}:`), stack(parts, "Where the time goes")]
          : null,
        c.preempted_by.some(p => p.tid !== 0) ? el("p", {}, `Preempted by: ${preemptors(c)} (all instances)`) : null,
        idleTime(c) > 0
          ? el(
              "p",
              {id: "idle"},
              `Of "preempted": runnable while its CPU was idle: ${time(idleTime(c))} (all instances), ${whyIdle(c)}`,
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
      ? scrolled(
          "Table of slowest instances",
          withoutEmptyColumns(
            el(
              "table",
              {},
              el("caption", {}, "Slowest instances"),
              el(
                "thead",
                {},
                el(
                  "tr",
                  {},
                  [
                    "instance",
                    "response time",
                    "start latency",
                    "duration",
                    "execution time",
                    "preempted",
                    "blocked",
                    "thread",
                    "",
                  ].map(h => el("th", {scope: "col"}, h)),
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
                      lane.least(i),
                      lane.isExact(i) ? lane.wait[i] : Number.NaN,
                      lane.duration[i],
                      lane.execution[i],
                      lane.preempted[i],
                      lane.blocked[i],
                    ].map((ns, at) =>
                      el(
                        "td",
                        {class: at === 0 && lane.isLate(i) ? "fail" : null},
                        at > 0
                          ? Number.isNaN(ns)
                            ? "\u2013"
                            : time(ns)
                          : `${lane.isLate(i) ? `${SIGN.FAIL} ` : ""}${atLeast({ns, isBound: !lane.isExact(i)})}`,
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
          ),
        )
      : null,
  ].filter(Boolean);
};
