// Chains of callbacks: path latency, reaction time, data age, hop by hop.
import {el, scrolled, withoutEmptyColumns} from "./dom.js";
import {graph} from "./graph.js";
import {callbackByIndex, inWords, name, report, section, severalHosts, shortNames} from "./recording.js";
import {count, plural, time} from "./words.js";

const soft = text => el("p", {class: "soft"}, text);

// Null: of all messages that were taken it was seen who published them.
const unrecordedPublishers = () => {
  if (!report.taken) return null;
  const {messages, unrecorded} = report.taken;
  return soft(
    `${count(unrecorded)} of ${plural(messages, "message")} taken came from publishers that were not recorded.`,
  );
};

// Null: all messages were sent.
const unsentMessages = () => {
  const publishers = report.processes.flatMap(process => process.unsent ?? []).sort((a, b) => b.messages - a.messages);
  if (!publishers.length) return null;
  const messages = publishers.reduce((sum, publisher) => sum + publisher.messages, 0);
  return soft(
    `${plural(messages, "message")} ${messages === 1 ? "was" : "were"} not sent in time and reached nobody: ` +
      `${publishers.map(({messages, topic}) => `${count(messages)} on ${topic || "an unknown topic"}`).join(", ")}.`,
  );
};

export const chains = () => {
  if (!report.chains.length) {
    const drawn = graph();
    const unsent = unsentMessages();
    const note = unrecordedPublishers();
    if (drawn || unsent || note) section("chains", "Who takes whose messages", drawn, unsent, note);
    return;
  }
  const short = c => shortNames.chains[report.chains.indexOf(c)];
  // Which host a hop is on is said where the chain passes from one to another.
  const hopName = (c, i) =>
    severalHosts && c.process === null && c.hop_table.length === c.callbacks.length
      ? name(callbackByIndex.get(c.callbacks[i]))
      : inWords(c.hop_table[i].from);
  const cells = s => (s ? [time(s.p50), time(s.p99), time(s.max)] : ["\u2013", "\u2013", "\u2013"]);
  // Where first releases are not known, a chain is divided by starts and publishes.
  const isByStarts = c => c.from_start_ns && (!c.path_latency_ns || c.path_latency_ns.count < c.instances);
  const latencyCells = c => (isByStarts(c) ? cells(c.from_start_ns).map(t => `\u2265 ${t}`) : cells(c.path_latency_ns));
  const hopCells = (c, hop) =>
    isByStarts(c) ? [hop.start_to_publish_ns, hop.publish_to_start_ns] : [hop.processing_ns, hop.communication_ns];
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
    unsentMessages(),
    unrecordedPublishers(),
    scrolled(
      "Table of chains",
      withoutEmptyColumns(
        el(
          "table",
          {id: "chain-table"},
          header([
            "chain",
            "callbacks",
            "instances",
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
                [latencyCells(c), cells(c.reaction_time_ns), cells(c.data_age_ns)].flat().map(t => el("td", {}, t)),
              ),
            ),
          ),
        ),
      ),
    ),
    report.chains.slice(0, 60).map(c =>
      el(
        "details",
        {},
        el("summary", {title: c.name}, `Where ${short(c)} spends its time`),
        scrolled(
          `Hops of ${short(c)}`,
          withoutEmptyColumns(
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
                    el("td", {class: "name", title: c.hop_table[i].from}, hopName(c, i)),
                    hopCells(c, hop)
                      .flatMap(cells)
                      .map(t => el("td", {}, t)),
                  ),
                ),
                c.undivided_ns && !isByStarts(c)
                  ? el(
                      "tr",
                      {},
                      el("td", {class: "name"}, "not divided"),
                      cells(c.undivided_ns).map(t => el("td", {}, t)),
                      ["", "", ""].map(() => el("td")),
                    )
                  : null,
              ),
            ),
          ),
        ),
        c.instances === 0
          ? soft("No instance of it was seen: a callback of it never ran, or no message leads from one to the next.")
          : null,
        isByStarts(c)
          ? soft(
              `The first release is not known: path latency is at least that from the first start${
                c.path_latency_upper_ns && c.path_latency_upper_ns.count === c.instances
                  ? `, and at most ${time(c.path_latency_upper_ns.max)} from what the release was not before`
                  : ""
              }. Callbacks count from start to publish, messages from publish to start.`,
            )
          : null,
        c.undivided_ns && !isByStarts(c)
          ? soft(
              `A release is not known on ${plural(c.undivided_ns.count, "instance")}: from the publish before it to the one after it their time is not divided. The sums of all rows add up to the path latency's.`,
            )
          : null,
      ),
    ),
  );
};
