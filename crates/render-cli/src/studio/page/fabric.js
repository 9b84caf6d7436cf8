// Fabrics as data: what is set where, and for which threads. Nothing here changes its arguments.

/** What stands at `path` in `object`, or undefined. */
export const at = (object, path) => path.reduce((inner, key) => inner?.[key], object);

/** A copy of `object` with `value` at `path`; undefined leaves it out, and what is empty then too. */
export function withAt(object, path, value) {
  const [key, ...rest] = path;
  const copy = { ...object };
  const inner = rest.length ? withAt(object?.[key] ?? {}, rest, value) : value;
  const isEmpty = inner === undefined || (rest.length && Object.keys(inner).length === 0);
  if (isEmpty) delete copy[key];
  else copy[key] = inner;
  return copy;
}

/** The layer that all threads have. */
export const BASE = "base";

/** A layer of yarn: `BASE`, or the index of an override. */
export function layerOf(fabric, layer) {
  return (layer === BASE ? fabric.yarn : fabric.overrides?.[layer]?.yarn) ?? {};
}

/** `fabric` with `value` at `path` of a layer. */
export function withValue(fabric, layer, path, value) {
  if (layer === BASE) return withAt(fabric, ["yarn", ...path], value);
  const overrides = [...(fabric.overrides ?? [])];
  const rule = overrides[layer];
  overrides[layer] = { ...rule, yarn: withAt(rule.yarn ?? {}, path, value) };
  return { ...fabric, overrides };
}

/** `fabric` with another override, last, so that it wins; and its index. */
export function withOverride(fabric, selector) {
  const overrides = [...(fabric.overrides ?? []), { ...selector, yarn: {} }];
  return [{ ...fabric, overrides }, overrides.length - 1];
}

/** `fabric` without the override at `index`. */
export function withoutOverride(fabric, index) {
  return { ...fabric, overrides: fabric.overrides.filter((_, other) => other !== index) };
}

/** `fabric` with the override at `index` `step` places later. */
export function withMoved(fabric, index, step) {
  const overrides = [...fabric.overrides];
  const [rule] = overrides.splice(index, 1);
  overrides.splice(index + step, 0, rule);
  return { ...fabric, overrides };
}

const same = (a, b) => JSON.stringify(a ?? null) === JSON.stringify(b ?? null);

/** The index of the last override for exactly these threads, or -1. */
export function indexOfSelector(fabric, selector) {
  return (fabric.overrides ?? []).findLastIndex((rule) =>
    ["warp", "color", "threads"].every((key) => same(rule[key], selector[key])));
}

/** For which threads a rule is, in words. */
export function selectorText({ warp, color, threads }) {
  const side = warp == null ? null : warp ? "warp" : "weft";
  const parts = [];
  if (color != null) parts.push(`colour ${color}`);
  if (threads) {
    const noun = warp == null ? "threads" : warp ? "ends" : "picks";
    parts.push(`${noun} ${threads[0]} to ${threads[1]}`);
  } else if (side) parts.push(side);
  const text = parts.join(", ") || "all threads";
  return text[0].toUpperCase() + text.slice(1);
}

/**
 * The rule that names the threads of a type of yarn and no others, or null where one rule cannot.
 * `palette` counts the threads of each colour, `draft` has the type of each thread.
 */
export function selectorOfType(type, palette, draft) {
  const isAll = (side) => draft[`${side}_yarns`].every((yarn) => yarn === type.index);
  if (type.color_numbers.length === 1) {
    const [color] = type.color_numbers;
    const all = palette.find(({ number }) => number === color);
    if (all && all.ends === type.ends && all.picks === type.picks) return { color };
    if (all && type.picks === 0 && all.ends === type.ends) return { warp: true, color };
    if (all && type.ends === 0 && all.picks === type.picks) return { warp: false, color };
  }
  if (type.picks === 0 && isAll("end")) return { warp: true };
  if (type.ends === 0 && isAll("pick")) return { warp: false };
  if (type.ends && type.picks) return null;
  const yarns = type.ends ? draft.end_yarns : draft.pick_yarns;
  const [first, last] = [yarns.indexOf(type.index), yarns.lastIndexOf(type.index)];
  const isRun = last - first + 1 === type.ends + type.picks;
  return isRun ? { warp: type.ends > 0, threads: [first + 1, last + 1] } : null;
}

/** How many ends and picks the override at `index` is for, from the types of yarn that it makes. */
export function threadsOfOverride(types, index) {
  const sum = { ends: 0, picks: 0 };
  for (const type of types) {
    if (!type.overrides.includes(index + 1)) continue;
    sum.ends += type.ends;
    sum.picks += type.picks;
  }
  return sum;
}

const decode = (c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
const encode = (c) => (c <= 0.0031308 ? c * 12.92 : 1.055 * c ** (1 / 2.4) - 0.055);

/** A colour as files write it, as linear [r, g, b]. */
export function linear(color) {
  if (typeof color === "number") return [color, color, color];
  if (Array.isArray(color)) return color;
  return [1, 3, 5].map((place) => decode(parseInt(color.slice(place, place + 2), 16) / 255));
}

/** The nearest "#rrggbb" to a linear colour. */
export function hex(rgb) {
  const byte = (c) => Math.round(255 * encode(Math.min(1, Math.max(0, c))));
  return `#${rgb.map((c) => byte(c).toString(16).padStart(2, "0")).join("")}`;
}
