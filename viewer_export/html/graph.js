// Who takes whose messages: callbacks as boxes, messages as arrows, in as few crossings as dagre finds.
import {drawing, el, scrolled, svg} from "./dom.js";
import {callbackByIndex, fullName, name, report, responseTime, severalHosts} from "./recording.js";
import {Graph, layout} from "./vendor/dagre.js";
import {cut, plural, time} from "./words.js";

const MOST_CALLBACKS = 120;
const MOST_EDGES = 300; // for which the layout takes a second
const LONGEST = 32;
const BOX = 36; // height
const LABEL = 26; // height
const widthOf = lines => Math.max(...lines.map(line => line.length)) * 6.4 + 16;
// Null: none is known for certain.
const longestOf = c => {
  const longest = responseTime(c, "max");
  return longest?.isBound ? null : longest;
};
const linesOfBox = c => [cut(name(c), LONGEST), ...(longestOf(c) ? [`at most ${time(longestOf(c).ns)}`] : [])];
const linesOfEdge = e => [
  cut(e.topic, LONGEST),
  ...(e.communication_ns === null ? [] : [time(e.communication_ns.p50)]),
];

// Places boxes and labels in ranks from top to bottom, or from left to right: all of one axis as the layout has it,
// "along" the messages, and "across" them.
const placed = (nodes, edges, isSideways) => {
  const graph = new Graph({multigraph: true});
  graph.setGraph({nodesep: 16, edgesep: 14, ranksep: 48, marginx: 4, marginy: 4});
  const widest = Math.max(...nodes.map(c => widthOf(linesOfBox(c))));
  const widestLabel = Math.max(...edges.map(e => widthOf(linesOfEdge(e))));
  // Ranks of one thickness: edges may pass beside every box of them.
  for (const c of nodes)
    graph.setNode(
      String(c.index),
      isSideways ? {width: BOX, height: widest} : {width: widthOf(linesOfBox(c)), height: BOX},
    );
  edges.forEach((e, i) => {
    const size = isSideways ? {width: LABEL, height: widestLabel} : {width: widthOf(linesOfEdge(e)), height: LABEL};
    graph.setEdge(String(e.from), String(e.to), {...size, labelpos: "c"}, String(i));
  });
  layout(graph);
  const {width, height} = graph.graph();
  const labelDepth = isSideways ? widestLabel : LABEL;
  return {graph, isSideways, labelDepth, W: isSideways ? height : width, H: isSideways ? width : height};
};

// From box to box; beside boxes and labels along the messages, and across only between two ranks, where neither is.
const pathOf = ({graph, isSideways, labelDepth}, from, to, points) => {
  const xy = (across, along) => (isSideways ? `${along},${across}` : `${across},${along}`);
  if (from === to) return `M${points.map(p => xy(p.x, p.y)).join("L")}`;
  const boxes = graph.nodes().map(n => graph.node(n));
  const end = (box, next) => {
    const room = Math.max(box.width / 2 - 8, 0);
    const along = box.y + (Math.sign(next.y - box.y) * box.height) / 2;
    return [Math.min(Math.max(next.x, box.x - room), box.x + room), along];
  };
  const inner = points.slice(1, -1);
  const stops = [end(from, inner[0] ?? to)];
  for (const p of inner) {
    const inRank = boxes.find(box => Math.abs(box.y - p.y) < 1);
    const half = (inRank ? inRank.height : labelDepth) / 2 + 2;
    const direction = Math.sign(to.y - from.y) || 1;
    stops.push([p.x, p.y - direction * half], [p.x, p.y + direction * half]);
  }
  stops.push(end(to, inner[inner.length - 1] ?? from));
  let path = `M${xy(...stops[0])}`;
  for (let i = 1; i < stops.length; ++i) {
    const [[x1, y1], [x2, y2]] = [stops[i - 1], stops[i]];
    const middle = (y1 + y2) / 2;
    path += x1 === x2 ? `L${xy(x2, y2)}` : `C${xy(x1, middle)} ${xy(x2, middle)} ${xy(x2, y2)}`;
  }
  return path;
};

export const graph = () => {
  const edges = report.edges.filter(e => e.from !== null);
  const nodes = [...new Set(edges.flatMap(e => [e.from, e.to]))].map(index => callbackByIndex.get(index));
  if (!edges.length) return null;
  if (nodes.length > MOST_CALLBACKS || edges.length > MOST_EDGES)
    return el(
      "p",
      {class: "soft"},
      `${plural(nodes.length, "callback")} and ${plural(edges.length, "link")} are too many to draw here.`,
    );
  // From above, unless that is too wide and from the left needs less room.
  const size = p => Math.max(p.W / 1200, p.H / 1000);
  const upright = placed(nodes, edges, false);
  const sideways = upright.W > 1200 ? placed(nodes, edges, true) : null;
  const chosen = sideways && size(sideways) < size(upright) ? sideways : upright;
  const {graph: drawn, isSideways, W, H} = chosen;
  const at = ({x, y}) => (isSideways ? {x: y, y: x} : {x, y});
  const id = c => (severalHosts ? fullName(c) : c.logical_id);
  const respondsIn = c => (longestOf(c) ? `: responds within ${time(longestOf(c).ns)}` : "");
  const texts = (lines, x, y) =>
    lines.map((line, i) =>
      svg(
        "text",
        {class: i ? "soft" : null, x, y: y + 4 + 14 * (i - (lines.length - 1) / 2), "text-anchor": "middle"},
        line,
      ),
    );
  const arrow = svg(
    "defs",
    {},
    svg(
      "marker",
      {id: "arrow", viewBox: "0 0 8 8", refX: 8, refY: 4, markerWidth: 8, markerHeight: 8, orient: "auto"},
      svg("path", {class: "head", d: "M0,0L8,4L0,8z"}),
    ),
  );
  const picture = drawing(
    Math.ceil(W),
    Math.ceil(H),
    `Graph of ${plural(nodes.length, "callback")} linked by messages`,
    arrow,
    edges.map((edge, i) => {
      const {points} = drawn.edge(String(edge.from), String(edge.to), String(i));
      const [from, to] = [callbackByIndex.get(edge.from), callbackByIndex.get(edge.to)];
      const ns = edge.communication_ns === null ? null : edge.communication_ns.p50;
      return svg(
        "path",
        {
          class: from.process === to.process ? "edge" : "edge between",
          d: pathOf(chosen, drawn.node(String(edge.from)), drawn.node(String(edge.to)), points),
          "marker-end": "url(#arrow)",
        },
        svg(
          "title",
          {},
          `${id(from)} to ${id(to)} by ${edge.topic}: ${plural(edge.messages, "message")}${ns === null ? "" : `, ${time(ns)} in the middle`}`,
        ),
      );
    }),
    edges.map((edge, i) => {
      const {x, y} = at(drawn.edge(String(edge.from), String(edge.to), String(i)));
      const lines = linesOfEdge(edge);
      const width = widthOf(lines) - 8;
      return svg(
        "g",
        {class: "label"},
        svg("title", {}, edge.topic),
        svg("rect", {
          class: "f-paper",
          x: x - width / 2,
          y: y - (LABEL / 4) * lines.length,
          width,
          height: (LABEL / 2) * lines.length,
        }),
        texts(lines, x, y),
      );
    }),
    nodes.map(c => {
      const box = drawn.node(String(c.index));
      const {x, y} = at(box);
      const width = isSideways ? box.height : box.width;
      return svg(
        "g",
        {class: "callback"},
        svg("title", {}, id(c) + respondsIn(c)),
        svg("rect", {class: "box", x: x - width / 2, y: y - BOX / 2, width, height: BOX, rx: 5}),
        texts(linesOfBox(c), x, y),
      );
    }),
  );
  picture.classList.add("graph");
  picture.style.minWidth = `${Math.round(W * 0.6)}px`; // smaller, nobody could read it
  return [
    el(
      "p",
      {class: "soft"},
      "An arrow: messages on the topic beside it, and the latency from publish to release in the middle; dashed: to another process.",
    ),
    scrolled("Graph of callbacks", picture),
  ];
};
