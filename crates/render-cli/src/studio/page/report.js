// What the draft's reader and the normalization have to say, and how much each yarn reflects.

import { Refusal, get } from "./api.js";
import { byId, h, latest, short, svg } from "./dom.js";

export function showReport(session) {
  showDiagnostics(session);
  showFactors(session);
  return showAlbedo(session);
}

/** One finding in a draft, with its line and a caret where there is one. */
export function finding({ severity, code, line, text }) {
  const place = line == null ? "" : `, line ${line}`;
  return h("li", { class: severity === "note" ? "soft" : severity },
    h("span", {}, `${severity} `, h("code", {}, code), place),
    h("pre", { class: "code", tabindex: 0, role: "group", "aria-label": `${severity} ${code}` }, text));
}

function showDiagnostics(session) {
  const list = byId("diagnostics");
  const show = (errors, diagnostics, warnings) => {
    const lines = [
      ...errors.map((text) => h("li", { class: "error" }, text)),
      ...warnings.map((text) => h("li", { class: "warning" }, text)),
      ...diagnostics.map(finding),
    ];
    list.replaceChildren(...(lines.length
      ? lines
      : [h("li", { class: "soft" }, "Nothing to tell: the draft says all that it should.")]));
  };
  const showAnswer = () => {
    const { diagnostics = [], warnings = [] } = session.answer;
    byId("diagnostics-title").textContent = "Draft";
    show([], diagnostics, warnings);
  };
  session.on("answer", showAnswer);
  session.on("refused", ({ errors = [], diagnostics = [], name }) => {
    byId("diagnostics-title").textContent = name ? `Not opened: ${name}` : "Not taken over";
    show(errors, diagnostics, []);
  });
}

function showFactors(session) {
  const body = byId("factors");
  const warnings = byId("energy");
  const clamped = byId("clamped");
  const refresh = () => {
    const { prepared, cloth } = session;
    if (!prepared || !cloth) return;
    const known = prepared.yarns.filter(({ yarn }) => cloth.yarns[yarn]);
    body.replaceChildren(...known.map(({ yarn, factors, albedo }) => {
      const { srgb } = cloth.yarns[yarn];
      const cells = [...factors, ...albedo].map((value) => h("td", {}, value == null ? "–" : short(value, 3)));
      const dot = svg("svg", { class: "dot", viewBox: "0 0 10 10", width: 10, height: 10, "aria-hidden": "true" },
        svg("rect", { width: 10, height: 10, rx: 2, fill: srgb }));
      return h("tr", {}, h("th", { scope: "row" }, dot, ` ${yarn + 1}`), cells);
    }));
    const over = known.filter(({ is_clamped: isClamped }) => isClamped);
    warnings.replaceChildren(
      ...over.map(({ yarn, warning }) =>
        h("li", { class: "warning" }, warning ?? `yarn ${yarn + 1}: its highlight would reflect more than it receives, and is scaled down`)),
      ...prepared.lowered.map((text) => h("li", { class: "warning" }, text)));
    clamped.hidden = over.length === 0;
  };
  session.on("prepared cloth", refresh);
}

const [WIDTH, HEIGHT, LEFT, LOW] = [300, 150, 30, 22];

/** The albedo curve; returns what takes the type of yarn that it is about. */
function showAlbedo(session) {
  const chart = byId("albedo");
  const title = byId("albedo-title");
  let type = null;

  const update = latest(300, async (signal) => {
    if (!type) return;
    try {
      const curve = await get(`albedo?yarn=${type.index}`, { signal });
      if (!signal.aborted) draw(curve, type);
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
    }
  });

  function draw({ theta, highlight, total }, { index, srgb }) {
    const top = Math.max(1, ...highlight, ...total);
    const x = (degrees) => LEFT + ((WIDTH - LEFT) * degrees) / 90;
    const y = (albedo) => (HEIGHT - LOW) * (1 - albedo / top) + 8;
    const path = (values) => values.map((value, at) => `${at ? "L" : "M"}${x(theta[at]).toFixed(1)} ${y(value).toFixed(1)}`).join("");
    const text = (left, down, anchor, words) => svg("text", { x: left, y: down, "text-anchor": anchor }, words);
    const level = (albedo, kind) =>
      svg("line", { class: kind, x1: LEFT, x2: WIDTH, y1: y(albedo), y2: y(albedo) });
    chart.replaceChildren(
      level(0, "axis"), level(0.5, "axis"), level(1, "bound"),
      text(LEFT - 5, y(0) + 4, "end", "0"), text(LEFT - 5, y(0.5) + 4, "end", "0.5"), text(LEFT - 5, y(1) + 4, "end", "1"),
      ...[0, 30, 60, 90].map((degrees) => text(x(degrees), HEIGHT + 4, degrees === 90 ? "end" : "middle", `${degrees}°`)),
      svg("path", { class: "under", d: path(total) }),
      svg("path", { class: "curve", d: path(total), stroke: srgb }),
      svg("path", { class: "curve", d: path(highlight), stroke: "currentColor", "stroke-dasharray": "5 3" }),
    );
    chart.setAttribute("aria-label",
      `Albedo of yarn ${index + 1} against the inclination of the light: ${short(total[0], 2)} at 0°, ${short(total.at(-1), 2)} at ${theta.at(-1)}°`);
    title.textContent = `Albedo of yarn ${index + 1}`;
  }

  // The curve takes the server a while: it waits until the picture itself has begun.
  let revision = null;
  session.on("shown", (frame) => {
    if (!frame.full || frame.revision === revision) return;
    revision = frame.revision;
    update();
  });
  return (entry) => {
    const isOther = type?.index !== entry.type.index;
    type = entry.type;
    if (isOther) update();
  };
}
