// What the trace lacks.
import {el} from "./dom.js";
import {report, section} from "./recording.js";
import {count} from "./words.js";

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
