// Pictures in the place of values: what they show, how large they are on the cloth, and what they mean.

import { h, short, svg, tell } from "./dom.js";

/** Most bytes of a picture: with the fabric around it, and a third more in base 64, it fits what the server takes. */
const LIMIT = 11 * 1024 * 1024;

/** Width on the cloth of a picture that is new, mm. */
const WIDTH = 20;

/** How files begin that the server reads. */
const KNOWN = [[0x89, 0x50, 0x4e, 0x47], [0x76, 0x2f, 0x31, 0x01], [0x23, 0x3f]];

/** Whether a value of a yarn is a picture. */
export const isImage = (value) => value != null && typeof value === "object" && "image" in value;

const dataUri = (blob) =>
  new Promise((resolve, reject) => {
    const reader = new FileReader();
    reader.onload = () => resolve(reader.result);
    reader.onerror = () => reject(reader.error);
    reader.readAsDataURL(blob);
  });

/** The file as one that the server reads: what only browsers do, as JPEG, becomes a PNG. */
async function readable(file) {
  const start = new Uint8Array(await file.slice(0, 4).arrayBuffer());
  if (KNOWN.some((bytes) => bytes.every((byte, at) => start[at] === byte))) return file;
  const bitmap = await createImageBitmap(file).catch(() => {
    throw new Error("found no picture, expected PNG, EXR, HDR or one that the browser shows");
  });
  const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
  canvas.getContext("2d").drawImage(bitmap, 0, 0);
  return canvas.convertToBlob({ type: "image/png" });
}

/** Width over height of a picture; 1 where the browser does not show it. */
async function aspect(blob) {
  const bitmap = await createImageBitmap(blob).catch(() => null);
  return bitmap ? bitmap.width / bitmap.height : 1;
}

/** The value that `file` becomes, after `before`, which it may take the place of. */
async function valueOf(file, before, range) {
  const blob = await readable(file);
  if (blob.size > LIMIT) throw new Error(`found ${blob.size} bytes, expected at most ${LIMIT}`);
  const height = Number((WIDTH / (await aspect(blob))).toPrecision(4));
  const image = await dataUri(blob);
  return { mm: [WIDTH, Math.min(1e5, Math.max(0.1, height))], ...(range ? { range } : {}), ...before, image };
}

/** A range to begin with: all, or about the default where that is too wide to tell. */
const rangeOf = ({ low, high, default: preset, scale }) =>
  (scale === "log" ? [Math.max(low, preset / 2), Math.min(high, 2 * preset || 1)] : [low, high]);

/**
 * The controls of the picture of a value called `label`, of `parameter` if that is a number: a button that asks for
 * one, and what is shown once there is one. `set` takes it, or undefined to remove it.
 */
export function imageControls(label, parameter, set) {
  let current = null;
  const put = (change) => set({ ...current, ...change });
  const input = h("input", {
    type: "file", hidden: true, accept: "image/*,.exr,.hdr", "aria-label": `A picture: ${label}`,
    onchange: async () => {
      const [file] = input.files;
      input.value = "";
      if (!file) return;
      try {
        set(await valueOf(file, current, parameter && rangeOf(parameter)));
      } catch (error) {
        tell(`${file.name} was not taken\n${error.message}`, true);
      }
    },
  });
  const icon = svg("svg", { class: "icon", viewBox: "0 0 16 16", "aria-hidden": "true" },
    svg("path", { d: "M2 3h12v10H2zM2 11l4-4 3 3 2-2 3 3M10.5 6h.01" }));
  const choose = h("button", {
    type: "button", class: "plain", title: "A picture in the place of the value", "aria-label": `Picture: ${label}`,
    onclick: () => input.click(),
  }, icon);
  const number = (text, unit, write) =>
    h("input", {
      type: "number", step: "any", "aria-label": `${label}: ${text}, ${unit || "no unit"}`,
      onchange: (event) => event.target.value !== "" && write(Number(event.target.value)),
    });
  const sides = ["width", "height"].map((text, at) =>
    number(`${text} of the picture`, "mm", (value) => put({ mm: current.mm.with(at, Math.min(1e5, Math.max(0.1, value))) })));
  const limits = !parameter ? [] : ["black", "white"].map((text, at) =>
    number(text, parameter.unit, (value) =>
      put({ range: current.range.with(at, Math.min(parameter.high, Math.max(parameter.low, value))) })));
  const thumbnail = h("img", { alt: "", width: 48, height: 48 });
  const kind = h("span", { class: "soft small" });
  const remove = h("button", {
    type: "button", class: "plain small", "aria-label": `Remove the picture: ${label}`, onclick: () => set(undefined),
  }, "Remove");
  const field = (text, ...inputs) => h("span", { class: "pair" }, h("span", { class: "soft small" }, text), inputs);
  const shown = h("div", { class: "image", hidden: true },
    thumbnail, kind,
    field("mm", ...sides), limits.length ? field("black, white", ...limits) : "", remove);

  /** Shows a picture, or that there is none; one that is `own` can be changed. */
  const update = (value, own) => {
    current = isImage(value) ? value : null;
    shown.hidden = !current;
    remove.hidden = !own;
    for (const each of [...sides, ...limits]) each.disabled = !own;
    if (!current) return;
    const isShown = /^data:image\/(png|jpeg|webp|gif)/.test(current.image);
    thumbnail.hidden = !isShown;
    if (isShown && thumbnail.getAttribute("src") !== current.image) thumbnail.src = current.image;
    kind.textContent = isShown ? "" : current.image.startsWith("data:") ? "EXR or HDR" : current.image;
    [...sides, ...limits].forEach((each, at) => {
      const value = [...current.mm, ...(current.range ?? [])][at];
      if (document.activeElement !== each) each.value = short(value, 5);
    });
  };
  return { parts: [choose, input, shown], update };
}
