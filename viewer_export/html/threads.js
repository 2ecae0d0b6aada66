// Threads, and how they were scheduled.
import {el, scrolled, withoutEmptyColumns} from "./dom.js";
import {inWords, processByIndex, report, section, severalHosts} from "./recording.js";
import {time} from "./words.js";

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
  // As the kernel's switches show it, where nobody read it back.
  const switched = s => (s.changes ? `${s.text} (changed)` : s.text);
  section(
    "threads",
    "Threads",
    scrolled(
      "Table of threads",
      withoutEmptyColumns(
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
                el("td", {class: "text"}, t.switched === undefined ? sched(t.sched) : switched(t.switched)),
                el("td", {class: "text"}, t.sched === null ? "\u2013" : t.sched.cpus.join(" ")),
                el("td", {}, time(t.busy_ns)),
                el("td", {class: "text name", title: t.callbacks.join(", ")}, t.callbacks.map(inWords).join(", ")),
              ),
            ),
          ),
        ),
      ),
      true,
    ),
  );
};
