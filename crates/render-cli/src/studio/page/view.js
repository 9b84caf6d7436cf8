// Controls of what is not yarn: the view, camera and light, how well it is drawn, and the cloth's own options.

import { byId, h, short, words } from "./dom.js";
import { scaleOf, STEPS } from "./scale.js";

/** Numbers of the view: where they stand, their range, and for which kinds they are. */
const PLACED = ["drape", "sphere"];
const NUMBERS = [
  { at: ["camera", "azimuth"], label: "Camera azimuth", unit: "°", low: -180, high: 180, kinds: PLACED },
  { at: ["camera", "elevation"], label: "Camera elevation", unit: "°", low: 1, high: 89, kinds: PLACED },
  { at: ["camera", "distance"], label: "Camera distance", unit: "× built-in", low: 0.1, high: 4, kinds: PLACED },
  { at: ["mm"], label: "Width of the swatch", unit: "mm", low: 0.1, high: 1000, default: 20, scale: "log", kinds: ["swatch"] },
  { at: ["light", "azimuth"], label: "Light azimuth", unit: "°", low: -180, high: 180 },
  { at: ["light", "elevation"], label: "Light elevation", unit: "°", low: 1, high: 89 },
  { at: ["exposure"], label: "Exposure", unit: "stops", low: -8, high: 8, default: 0 },
];

function slider({ label, unit, low, high, default: preset, scale }, set, name) {
  const map = scaleOf({ low, high, default: preset ?? (low + high) / 2, scale });
  const [labelId, unitId] = [`${name}-label`, `${name}-unit`];
  const number = h("input", {
    type: "number", min: low, max: high, step: "any", "aria-labelledby": `${labelId} ${unitId}`,
    onchange: () => number.value !== "" && set(Math.min(high, Math.max(low, Number(number.value)))),
  });
  const range = h("input", {
    type: "range", min: 0, max: STEPS, "aria-labelledby": `${labelId} ${unitId}`,
    oninput: () => set(map.toValue(Number(range.value))),
  });
  const row = h("div", { class: "parameter", dataset: { name } },
    h("span", { class: "label", id: labelId }, label),
    h("span", { class: "value" }, number, h("span", { class: "unit", id: unitId },
      unit || h("span", { class: "hidden-text" }, "no unit"))),
    h("div", { class: "wide" }, range));
  const show = (value) => {
    if (document.activeElement !== number) number.value = short(value, 5);
    range.value = map.toPlace(value);
    range.setAttribute("aria-valuetext", `${short(value)} ${unit}`);
  };
  return { row, show };
}

export function showView(session) {
  for (const radio of document.querySelectorAll("input[name=kind]")) {
    radio.addEventListener("change", () => session.look({ kind: radio.value }));
  }
  for (const radio of document.querySelectorAll("input[name=side]")) {
    radio.addEventListener("change", () => session.look({ back: radio.value === "back" }));
  }
  byId("reset-view").addEventListener("click", () => session.look({ camera: null, light: null, at: [0, 0] }));

  const rows = NUMBERS.map((each) => {
    const [group, key] = each.at;
    const set = (value) => session.look(key
      ? { [group]: { ...session.placement()[group], [key]: value } }
      : { [group]: value });
    return { ...each, ...slider(each, set, `view-${each.at.join("-")}`) };
  });
  byId("view-rows").replaceChildren(...rows.map(({ row }) => row));

  const selects = [
    ["size", (text) => text.split("x").map(Number), ({ size }) => size.join("x")],
    ["noise", (text) => (text === "" ? null : Number(text)), ({ noise }) => noise ?? ""],
    ["spp", Number, ({ spp }) => spp],
    ["lod", String, ({ lod }) => lod],
    ["seed", Number, ({ seed }) => seed],
  ];
  for (const [name, read] of selects) {
    byId(name).addEventListener("change", (event) => {
      if (event.target.validity.valid && !(name !== "noise" && event.target.value === "")) {
        session.look({ [name]: read(event.target.value) });
      }
    });
  }

  const show = () => {
    const { view } = session;
    const placement = session.placement();
    for (const radio of document.querySelectorAll("input[name=kind]")) radio.checked = radio.value === view.kind;
    for (const radio of document.querySelectorAll("input[name=side]")) radio.checked = (radio.value === "back") === view.back;
    byId("ruler-field").hidden = view.kind !== "swatch";
    byId("drag-camera-text").textContent = view.kind === "swatch" ? "Move" : "Turn";
    for (const { row, show: put, at, kinds } of rows) {
      const [group, key] = at;
      const value = key ? placement[group]?.[key] : view[group];
      row.hidden = value == null || (kinds && !kinds.includes(view.kind));
      if (!row.hidden) put(value);
    }
    for (const [name, , write] of selects) {
      const control = byId(name);
      const value = String(write(view));
      if (control.tagName === "SELECT" && ![...control.options].some((option) => option.value === value)) {
        control.append(h("option", { value }, value.replace("x", " × ")));
      }
      if (document.activeElement !== control) control.value = value;
    }
  };
  session.on("view", show);
  showCloth(session);
}

/** The options of the cloth as a whole, from what the shader tells of itself. */
function showCloth(session) {
  const rows = session.parameters.cloth.map((option) => {
    const { name, meaning, options, default: preset } = option;
    const label = words(meaning ?? name);
    const put = (value, gesture) =>
      session.edit({ ...session.fabric, [name]: value }, { gesture });
    const text = label[0].toUpperCase() + label.slice(1);
    if (options) {
      const select = h("select", { "aria-labelledby": `cloth-${name}-label`, onchange: () => put(select.value) },
        options.map((each) => h("option", { value: each }, words(each))));
      const row = h("div", { class: "parameter", dataset: { name } },
        h("span", { class: "label", id: `cloth-${name}-label` }, text), h("span", { class: "value" }, select));
      return { row, show: () => { select.value = session.fabric[name] ?? preset; } };
    }
    const isWhole = name === "seed";
    const set = (value) => put(isWhole ? Math.round(value) : value, `cloth ${name}`);
    const high = isWhole ? Math.min(option.high ?? 999, 999) : option.high;
    const made = slider({ ...option, low: option.low ?? 0, high, label: text, unit: option.unit ?? "" }, set, `cloth-${name}`);
    made.row.addEventListener("change", () => session.endGesture());
    return { row: made.row, show: () => made.show(session.fabric[name] ?? preset) };
  });
  byId("cloth-rows").replaceChildren(...rows.map(({ row }) => row));
  session.on("fabric", () => rows.forEach(({ show }) => show()));
}
