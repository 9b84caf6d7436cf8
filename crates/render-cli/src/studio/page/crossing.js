// What is at the crossing that is pointed at: thread, segment, and every parameter.

import { byId, h, short, words } from "./dom.js";

export function showCrossing(session) {
  const place = byId("crossing");
  const [endInput, pickInput] = [byId("end"), byId("pick")];
  const units = new Map(session.parameters.numbers.map(({ name, unit }) => [name, unit]));
  const facts = (rows) =>
    h("dl", { class: "small" }, rows.map(([name, value, isWhole]) =>
      h("div", { class: isWhole ? "whole" : "" }, h("dt", { class: "soft" }, name), h("dd", {}, value))));

  session.on("crossing", (detail) => {
    const { crossing, draft, cloth } = session;
    if (!crossing) {
      place.replaceChildren(h("p", { class: "soft small" },
        "Point at a crossing here or at a thread in the picture to see what it is."));
      return;
    }
    const { end, pick } = crossing;
    if (document.activeElement !== endInput) endInput.value = end;
    if (document.activeElement !== pickInput) pickInput.value = pick;
    const seesWarp = (e, p) => isWarpUp(draft, e, p) !== (detail?.side === "back");
    const onTop = detail?.warp_on_top ?? seesWarp(end, pick);
    const isGap = detail?.yarn === null;
    const yarn = detail?.yarn ?? (onTop ? draft.end_yarns[end - 1] : draft.pick_yarns[pick - 1]);
    const type = cloth.yarns[yarn];
    const rows = [
      ["Thread", isGap ? "gap between threads" : onTop ? `end ${end} over pick ${pick}` : `pick ${pick} over end ${end}`, true],
      ["Segment", segmentText(draft, end, pick, seesWarp), true],
    ];
    if (detail?.length_mm != null) {
      rows.push(["Size", `${short(detail.length_mm, 3)} × ${short(detail.width_mm, 3)} mm`, true]);
      rows.push(["u, v", `${short(detail.u, 3)}, ${short(detail.v, 3)} rad`, true]);
    }
    if (type) {
      rows.push(["colour", type.srgb]);
      for (const [kind, name] of Object.entries(type.kind)) rows.push([words(kind), words(name)]);
      for (const [name, value] of Object.entries(detail?.values ?? type.values)) {
        rows.push([name, `${short(value)} ${units.get(name) ?? ""}`.trim()]);
      }
    }
    place.replaceChildren(facts(rows));
  });

  const go = () => {
    const within = (input, most) => Math.min(most, Math.max(1, Math.round(Number(input.value)) || 1));
    const { ends, picks } = session.draft;
    session.point({ end: within(endInput, ends), pick: within(pickInput, picks) });
  };
  for (const input of [endInput, pickInput]) input.addEventListener("input", go);
  session.on("draft", () => {
    endInput.max = session.draft.ends;
    pickInput.max = session.draft.picks;
  });
}

const isWarpUp = (draft, end, pick) => draft.drawdown?.[pick - 1]?.[end - 1] === "1";

/** The run of crossings over which a thread stays in sight; the draft repeats at its edges. */
function segmentText(draft, end, pick, seesWarp) {
  if (!draft.drawdown) return "not known: the draft is too large";
  const isWarp = seesWarp(end, pick);
  const most = isWarp ? draft.picks : draft.ends;
  const from = isWarp ? pick : end;
  const wrap = (number) => ((((number - 1) % most) + most) % most) + 1;
  const stays = (number) =>
    (isWarp ? seesWarp(end, wrap(number)) : seesWarp(wrap(number), pick)) === isWarp;
  let [first, last] = [from, from];
  while (last - first + 1 < most && stays(first - 1)) first -= 1;
  while (last - first + 1 < most && stays(last + 1)) last += 1;
  const length = last - first + 1;
  const noun = isWarp ? "pick" : "end";
  const span = length === 1 ? `${noun} ${wrap(first)}` : `${noun}s ${wrap(first)} to ${wrap(last)}`;
  return `${isWarp ? "warp" : "weft"} float of ${length}, ${span}`;
}
