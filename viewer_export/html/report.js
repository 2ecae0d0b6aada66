import {callbacks, choose} from "./callbacks.js";
import {chains} from "./chains.js";
import {defects} from "./defects.js";
// The page of a report.
import {el} from "./dom.js";
import {head, inShort, rules, worstIndex} from "./findings.js";
import {decode, findLimits, knowsWhomItWaitedFor, laneOf, waitedFor, worstRun} from "./instances.js";
import {matrix} from "./matrix.js";
import {fullName, lanes, page, report} from "./recording.js";
import {threads} from "./threads.js";
import {timeline} from "./timeline.js";
import {time} from "./words.js";

decode()
  .then(() => {
    head();
    inShort();
    timeline.build();
    callbacks();
    rules();
    matrix();
    chains();
    threads();
    defects();
    page.append(
      el(
        "footer",
        {class: "soft"},
        el("p", {}, `Written by cie ${report.tool.version}. Times are of CLOCK_MONOTONIC.`),
      ),
    );
    const worst = worstIndex();
    if (report.callbacks.length) choose(Math.max(worst, 0));
    const lane = worst < 0 ? undefined : laneOf(worst);
    const run = lane ? worstRun(lane) : undefined;
    if (run !== undefined) timeline.lookAt(lane, run);
    addEventListener("beforeprint", () => {
      for (const d of document.querySelectorAll("details")) d.open = true;
    });
    document.documentElement.dataset.ready = "yes";
  })
  .catch(error => {
    page.prepend(el("p", {class: "fail", role: "alert"}, `This page cannot be drawn: ${error.message}`));
    document.documentElement.dataset.ready = "failed";
  });

// For the browser's console, and for tests.
export {findLimits, fullName, knowsWhomItWaitedFor, lanes, time, timeline, waitedFor};
