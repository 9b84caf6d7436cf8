// The parameters of the yarn that is chosen, made from what the shader tells of itself.

import { byId, count, h, short, threads, words } from "./dom.js";
import {
  BASE, at, hex, layerOf, linear, withOverride, withValue, withoutOverride,
} from "./fabric.js";
import { imageControls, isImage } from "./images.js";
import { STEPS, scaleOf } from "./scale.js";

const TITLES = {
  look: "Colour and reflection",
  shape: "Shape",
  highlight: "Highlight",
  phase: "Scattering about the fibre",
  noise: "Irregularities",
};

/** Groups that are open from the start. */
const OPEN = ["look", "shape", "highlight"];

/** Which group a choice stands in. */
const GROUP_OF_CHOICE = { highlight: "highlight", phase: "phase" };

const capital = (text) => text[0].toUpperCase() + text.slice(1);

/** The name of the option that a value of a choice is: `"flat"`, or `{ rough: { … } }`. */
const optionOf = (value) => (typeof value === "string" ? value : Object.keys(value)[0]);

/** Shows the panel; returns what takes the entry that it is about. */
export function showParameters(session) {
  const { numbers, colors, choices } = session.parameters;
  const place = byId("parameters");
  let entry = null;

  // Where values stand.

  const layer = () => (entry.layer === null ? {} : layerOf(session.fabric, entry.layer));

  /** What the layer sets a number to, by itself or in its choice. */
  function own(parameter) {
    const value = at(layer(), parameter.path);
    if (value != null) return value;
    const choice = choiceOf(parameter);
    const chosen = choice && layer()[choice.name];
    return chosen == null ? undefined : chosen[optionOf(chosen)]?.[parameter.name];
  }

  /** What holds where the layer says nothing. */
  function inherited(parameter) {
    const value = layered(parameter.path);
    return isImage(value) ? value : entry.type.values[parameter.name] ?? value ?? parameter.default;
  }

  /** What the last layer with a value at `path` has there. */
  function layered(path) {
    const layers = [BASE, ...entry.type.overrides.map((number) => number - 1)];
    return layers.map((each) => at(layerOf(session.fabric, each), path)).findLast((value) => value != null);
  }

  const choiceOf = ({ name }) =>
    choices.find(({ options }) => options.some((option) => option.numbers?.includes(name)));

  /** Which option of a choice holds. */
  function kindOf(choice) {
    const value = layer()[choice.name];
    return value == null ? entry.type.kind[choice.name] : optionOf(value);
  }

  const isThere = (parameter) => {
    const choice = choiceOf(parameter);
    const option = choice?.options.find(({ name }) => name === kindOf(choice));
    return !choice || option?.numbers.includes(parameter.name);
  };

  /** Sets what stands at `path` of the layer, which comes into being where there is none. */
  function write(path, value, gesture = null) {
    let { fabric } = session;
    let index = entry.layer;
    if (index === null) {
      if (value === undefined) return;
      [fabric, index] = withOverride(fabric, entry.selector);
      entry.layer = index;
    }
    fabric = withValue(fabric, index, path, value);
    const isLeft = entry.kind === "type" && Object.keys(layerOf(fabric, index)).length === 0;
    if (isLeft) {
      fabric = withoutOverride(fabric, index);
      entry.layer = null;
    }
    session.edit(fabric, { gesture: gesture && `${gesture} of ${entry.id}` });
  }

  // The rows.

  /** What all rows have: whether the layer overrides, the label, and the way back. */
  function frame(name, label, path, isSet, current) {
    const toggle = h("input", {
      type: "checkbox",
      onchange: () => write(path, toggle.checked ? current() : undefined),
    });
    const labelId = `label-${name.replaceAll(".", "-")}`;
    const text = h("span", { class: "label", id: labelId }, `${capital(label)} `, h("code", {}, name));
    const reset = h("button", {
      type: "button",
      class: "plain",
      "aria-label": `Reset: ${label}`,
      title: "Reset",
      onclick: () => write(path, undefined),
    }, "↺");
    const value = h("span", { class: "value" });
    const wide = h("div", { class: "wide" });
    const row = h("div", { class: "parameter", dataset: { name } }, toggle, text, value, reset, wide);
    const update = () => {
      const set = isSet();
      toggle.hidden = entry.layer === BASE;
      toggle.checked = set;
      toggle.setAttribute("aria-label", `Override for ${entry.label}: ${label}`);
      reset.disabled = !set;
      row.classList.toggle("inherited", !set);
    };
    return { row, value, wide, labelId, update };
  }

  function numberRow(parameter) {
    const { name, meaning, unit, low, high, path } = parameter;
    const scale = scaleOf(parameter);
    const current = () => own(parameter) ?? inherited(parameter);
    const base = frame(name, meaning, path, () => own(parameter) !== undefined, current);
    const unitId = `${base.labelId}-unit`;
    const labels = `${base.labelId} ${unitId}`;
    const number = h("input", {
      type: "number",
      min: low,
      max: high,
      step: "any",
      "aria-labelledby": labels,
      onchange: () => {
        const value = Number(number.value);
        if (number.value !== "" && Number.isFinite(value)) {
          write(path, Math.min(high, Math.max(low, value)));
        }
        update();
      },
    });
    const slider = h("input", {
      type: "range",
      min: 0,
      max: STEPS,
      "aria-labelledby": labels,
      style: { "--notch": scale.toPlace(parameter.default) / STEPS },
      oninput: () => write(path, scale.toValue(Number(slider.value)), name),
      onchange: () => session.endGesture(),
    });
    const degrees = h("span", { class: "soft small" });
    base.value.append(number, h("span", { class: "unit", id: unitId },
      unit || h("span", { class: "hidden-text" }, "no unit")));
    base.wide.append(slider, unit === "rad" ? degrees : "");
    const image = parameter.texturable ? imageControls(meaning, parameter, (value) => write(path, value)) : null;
    base.wide.append(...(image?.parts ?? []));
    const update = () => {
      base.row.hidden = !isThere(parameter);
      if (base.row.hidden) return;
      base.update();
      const found = current();
      image?.update(found, isImage(own(parameter)));
      for (const part of [number, slider, degrees]) part.hidden = isImage(found);
      // A picture's own number is its mean, which the cloth tells.
      const value = isImage(found) ? entry.type.values[name] ?? parameter.default : found;
      if (document.activeElement !== number) number.value = short(value, 5);
      slider.value = scale.toPlace(value);
      degrees.textContent = `${((value * 180) / Math.PI).toFixed(1)}°`;
      slider.setAttribute("aria-valuetext", `${short(value)} ${unit}`);
    };
    number.addEventListener("blur", () => update());
    return { row: base.row, update };
  }

  /** A reflectance: how much, and of what hue. */
  function colorRow(color) {
    const { name, meaning, path } = color;
    const mine = () => at(layer(), path);
    const ofType = () => (name === "color" ? entry.type.srgb : color.default ?? entry.type[name] ?? 0);
    const current = () => {
      const found = mine() ?? layered(path);
      if (isImage(found)) return found;
      return mine() ?? (name === "color" ? ofType() : found ?? ofType());
    };
    const base = frame(name, meaning, path, () => mine() != null, current);
    const unitId = `${base.labelId}-unit`;
    const labels = `${base.labelId} ${unitId}`;
    const well = h("input", { type: "color", "aria-labelledby": labels });
    base.value.append(well, h("span", { class: "unit", id: unitId }, "sRGB"));
    let slider = null;
    const amount = h("span", { class: "soft small" });
    if (name === "color") {
      well.addEventListener("input", () => write(path, well.value, name));
      base.wide.append(amount);
    } else {
      // Stored as the product; the well shows the hue at full strength.
      const put = () => {
        const hue = linear(well.value);
        const most = Math.max(...hue) || 1;
        const strength = Number(slider.value) / STEPS;
        const product = hue.map((part) => Number(((strength * part) / most).toFixed(5)));
        const isGrey = product.every((part) => part === product[0]);
        write(path, isGrey ? product[0] : product, name);
      };
      slider = h("input", {
        type: "range",
        min: 0,
        max: STEPS,
        "aria-label": `${capital(meaning)}: amount, no unit`,
        oninput: put,
        onchange: () => session.endGesture(),
      });
      well.addEventListener("input", put);
      base.wide.append(slider, amount);
    }
    well.addEventListener("change", () => session.endGesture());
    const image = color.texturable ? imageControls(meaning, null, (value) => write(path, value)) : null;
    base.wide.append(...(image?.parts ?? []));
    const update = () => {
      base.update();
      const value = current();
      image?.update(value, isImage(mine()));
      for (const part of [well, slider, amount]) part?.toggleAttribute("hidden", isImage(value));
      if (isImage(value)) return;
      if (!slider) {
        well.value = typeof value === "string" ? value : hex(linear(value));
        amount.textContent = entry.layer === BASE && mine() == null ? "open: each thread as in the draft" : "";
        return;
      }
      const rgb = linear(value);
      const most = Math.max(...rgb);
      well.value = hex(most > 0 ? rgb.map((part) => part / most) : [1, 1, 1]);
      slider.value = STEPS * most;
      slider.setAttribute("aria-valuetext", short(most, 3));
      amount.textContent = short(most, 3);
    };
    return { row: base.row, update };
  }

  function choiceRow(choice) {
    const { name, options } = choice;
    const label = choice.meaning ?? `Kind of ${words(name)}`;
    const valueOf = (kind) => options.find((option) => option.name === kind)?.value ?? kind;
    const base = frame(name, label, [name], () => layer()[name] != null, () => valueOf(kindOf(choice)));
    const select = h("select", {
      "aria-labelledby": base.labelId,
      onchange: () => change(select.value),
    }, options.map((option) => h("option", { value: option.name }, words(option.name))));
    base.value.append(select);

    // Numbers of other kinds would be errors: they go, here and where an override takes this over.
    function change(kind) {
      const option = options.find((each) => each.name === kind);
      const strange = options.flatMap((each) => each.numbers ?? [])
        .filter((number) => !option.numbers?.includes(number));
      const clean = (yarn) => {
        const rest = { ...yarn };
        for (const number of strange) delete rest[number];
        return rest;
      };
      let { fabric } = session;
      let index = entry.layer;
      if (index === null) {
        [fabric, index] = withOverride(fabric, entry.selector);
        entry.layer = index;
      }
      fabric = withValue(fabric, index, [name], option.value ?? kind);
      const overrides = (fabric.overrides ?? []).map((rule, each) => {
        const follows = index === BASE || each > index;
        const takesOver = follows && rule.yarn?.[name] == null;
        return each === index || takesOver ? { ...rule, yarn: clean(rule.yarn) } : rule;
      });
      fabric = { ...fabric, overrides };
      if (index === BASE) fabric = { ...fabric, yarn: clean(fabric.yarn) };
      session.edit(fabric);
    }

    const update = () => {
      base.update();
      const kind = kindOf(choice);
      // A kind that no panel makes, as one that is tabulated, is shown and can be left.
      if (!options.some((option) => option.name === kind) && ![...select.options].some(({ value }) => value === kind)) {
        select.append(h("option", { value: kind, disabled: true }, words(kind)));
      }
      select.value = kind;
    };
    return { row: base.row, update };
  }

  /** Something that is so or not, of one option of a choice. */
  function flagRow(choice, option, flag) {
    const path = [choice.name, option.name, flag.name];
    const isSet = () => at(layer(), path) != null;
    const mine = () => layer()[choice.name];
    // It stands within the choice, which the layer must have as a whole.
    const held = () => at({ [choice.name]: mine() ?? layered([choice.name]) }, path) ?? false;
    const put = (value) => {
      const chosen = mine() ?? layered([choice.name]) ?? option.value;
      write([choice.name], { [option.name]: { ...chosen[option.name], [flag.name]: value } });
    };
    const base = frame(flag.name, flag.meaning, path, isSet, held);
    const box = h("input", { type: "checkbox", "aria-labelledby": base.labelId, onchange: () => put(box.checked) });
    base.value.append(box);
    const [toggle, reset] = [base.row.querySelector("input"), base.row.querySelector(".plain")];
    const update = () => {
      base.row.hidden = kindOf(choice) !== option.name;
      base.update();
      // The choice as a whole is overridden and reset.
      toggle.hidden = true;
      reset.hidden = true;
      box.checked = held();
    };
    return { row: base.row, update };
  }

  const rows = [];
  const groups = new Map();
  const add = (group, row) => {
    if (!groups.has(group)) groups.set(group, []);
    groups.get(group).push(row);
    rows.push(row);
  };
  for (const color of colors) add("look", colorRow(color));
  for (const choice of choices) {
    const group = GROUP_OF_CHOICE[choice.name] ?? "look";
    add(group, choiceRow(choice));
    for (const option of choice.options) {
      for (const flag of option.flags ?? []) add(group, flagRow(choice, option, flag));
    }
  }
  for (const parameter of numbers) add(parameter.group, numberRow(parameter));
  place.replaceChildren(...Object.keys(TITLES).filter((group) => groups.has(group)).map((group) =>
    h("details", { class: "card group", open: OPEN.includes(group) },
      h("summary", {}, TITLES[group]),
      h("div", { class: "rows" }, groups.get(group).map(({ row }) => row)))));

  const heading = byId("chosen");
  let said = "";
  const refresh = () => {
    const isOpen = entry.kind !== "type" || entry.selector;
    place.inert = !isOpen;
    const note = entry.kind === "base"
      ? "What holds where nothing overrides it."
      : isOpen
        ? "A tick overrides what this yarn has otherwise."
        : "No single rule names these threads: change the overrides that apply to them.";
    const { overrides } = entry.type;
    const force = entry.kind === "type" && overrides.length
      ? `${count(overrides.length, "override")} in force: ${overrides.join(", ")}`
      : "";
    // What is said aloud when it changes is put anew only then.
    const texts = [`${entry.label} · ${threads(entry.tally)}`, note, force].filter(Boolean);
    if (texts.join() !== said) {
      said = texts.join();
      heading.replaceChildren(...texts.map((text, index) => h("span", { class: index ? "soft small" : "" }, text)));
    }
    for (const { update } of rows) update();
  };
  return (next) => {
    entry = next;
    refresh();
  };
}
