// The list of yarns: all of it, each type that the cloth is made of, and the overrides.

import { byId, h, svg, tell, threads } from "./dom.js";
import {
  BASE, indexOfSelector, selectorOfType, selectorText, threadsOfOverride, withMoved, withOverride,
  withoutOverride,
} from "./fabric.js";

/**
 * What the panel can be about. `layer` is where its values stand, null where there is no such
 * override yet; `selector` is whose threads it is for; `type` is a type of yarn that has them.
 */
function entriesOf(session) {
  const { fabric, cloth, draft } = session;
  const types = cloth.yarns;
  const all = types.reduce(
    (sum, { ends, picks }) => ({ ends: sum.ends + ends, picks: sum.picks + picks }),
    { ends: 0, picks: 0 },
  );
  const base = {
    id: BASE, kind: "base", label: "All yarn", layer: BASE, selector: {}, tally: all, types,
    type: types[0],
  };
  const ofTypes = types.map((type) => {
    const selector = selectorOfType(type, cloth.palette, draft);
    const layer = selector ? indexOfSelector(fabric, selector) : -1;
    return {
      id: `type ${selector ? JSON.stringify(selector) : type.index}`,
      kind: "type",
      label: selector ? selectorText(selector) : `Yarn ${type.index + 1}`,
      layer: layer < 0 ? null : layer,
      selector,
      tally: type,
      types: [type],
      type,
    };
  });
  const ofOverrides = (fabric.overrides ?? []).map((rule, index) => {
    const own = types.filter((type) => type.overrides.includes(index + 1));
    return {
      id: `override ${index}`,
      kind: "override",
      label: selectorText(rule),
      layer: index,
      selector: rule,
      tally: threadsOfOverride(types, index),
      types: own,
      type: own[0] ?? types[0],
    };
  });
  return { base, ofTypes, ofOverrides };
}

/** A square in the colours of `types`, side by side. */
function swatchOf(types) {
  const colors = [...new Set(types.map(({ srgb }) => srgb))].slice(0, 6);
  const width = 22 / Math.max(1, colors.length);
  return svg("svg", { class: "swatch", viewBox: "0 0 22 22", "aria-hidden": "true" },
    colors.map((color, index) =>
      svg("rect", { x: index * width, y: 0, width: width + 0.1, height: 22, fill: color })));
}

/** Shows the list; `choose(entry)` is called with what is chosen, and again when it changes. */
export function showYarns(session, choose) {
  const list = byId("yarns");
  let chosen = BASE;

  function row(entry, after = []) {
    const radio = h("input", {
      type: "radio",
      name: "yarn",
      value: entry.id,
      onchange: () => select(entry.id),
    });
    radio.checked = entry.id === chosen;
    const yarn = entry.kind === "type" ? entry.type.index : null;
    return h("div", {
      class: "row",
      onpointerenter: () => yarn !== null && session.emit("yarn-shown", yarn),
      onpointerleave: () => yarn !== null && session.emit("yarn-shown", null),
    },
      h("label", {},
        radio,
        swatchOf(entry.types),
        h("span", {}, entry.label),
        h("span", { class: "soft small" }, threads(entry.tally))),
      after);
  }

  function overrideRow(entry, count) {
    const index = entry.layer;
    const edit = (fabric, next) => {
      if (chosen.startsWith("override ")) chosen = next;
      session.edit(fabric);
    };
    const button = (label, text, isOff, onclick) =>
      h("button", { type: "button", class: "plain", "aria-label": `${label}: ${entry.label}`, title: label, disabled: isOff, onclick }, text);
    return row(entry, [
      button("Apply earlier", "↑", index === 0, () =>
        edit(withMoved(session.fabric, index, -1), `override ${index - 1}`)),
      button("Apply later", "↓", index === count - 1, () =>
        edit(withMoved(session.fabric, index, 1), `override ${index + 1}`)),
      button("Remove override", "✕", false, () => edit(withoutOverride(session.fabric, index), BASE)),
    ]);
  }

  function select(id) {
    chosen = id;
    refresh();
  }

  let drawn = "";
  function refresh() {
    const { base, ofTypes, ofOverrides } = entriesOf(session);
    const entries = [base, ...ofTypes, ...ofOverrides];
    const entry = entries.find(({ id }) => id === chosen) ?? base;
    chosen = entry.id;
    // The list is made anew only where it would look otherwise: not while a slider moves.
    const look = JSON.stringify(entries.map(({ id, label, tally, types }) =>
      [id, label, threads(tally), types.map(({ srgb }) => srgb)]));
    if (look !== drawn) {
      drawn = look;
      const focused = document.activeElement?.closest("#yarns") ? document.activeElement.value : null;
      list.replaceChildren(
        row(base),
        h("h3", { id: "types-title" }, "Types of yarn in the cloth"),
        ...ofTypes.map((each) => row(each)),
        ...(ofOverrides.length ? [h("h3", {}, "Overrides, later ones win")] : []),
        ...ofOverrides.map((each) => overrideRow(each, ofOverrides.length)),
      );
      if (focused) list.querySelector(`input[value="${CSS.escape(focused)}"]`)?.focus();
    }
    for (const radio of list.querySelectorAll("input[type=radio]")) radio.checked = radio.value === chosen;
    choose(entry);
  }

  session.on("cloth", refresh);
  session.on("fabric", () => session.cloth && refresh());
  showAdder(session, select);
}

/** The form that adds an override. */
function showAdder(session, select) {
  const by = byId("add-by");
  const color = byId("add-color");
  const [first, last] = [byId("add-first"), byId("add-last")];
  const update = () => {
    byId("add-color-field").hidden = by.value !== "color";
    byId("add-range-field").hidden = !by.value.startsWith("range");
  };
  by.addEventListener("change", update);
  update();
  session.on("cloth", () => {
    const before = color.value;
    color.replaceChildren(...session.cloth.palette.map(({ number, srgb, ends, picks }) =>
      h("option", { value: number }, `${number}: ${srgb}, ${threads({ ends, picks })}`)));
    if (before) color.value = before;
    const most = Math.max(session.draft.ends, session.draft.picks);
    for (const input of [first, last]) input.max = most;
  });
  byId("adder").addEventListener("submit", (event) => {
    event.preventDefault();
    const range = [Number(first.value), Number(last.value)];
    const selector = {
      warp: { warp: true },
      weft: { warp: false },
      color: { color: Number(color.value) },
      "range-warp": { warp: true, threads: range },
      "range-weft": { warp: false, threads: range },
    }[by.value];
    if (selector.threads && !(range[0] >= 1 && range[1] >= range[0])) {
      tell(`threads: ${range[0]} to ${range[1]}, expected a first from 1 on and a last that is not before it`, true);
      return;
    }
    const [fabric, index] = withOverride(session.fabric, selector);
    session.edit(fabric);
    select(`override ${index}`);
  });
}
