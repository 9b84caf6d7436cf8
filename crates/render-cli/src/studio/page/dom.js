// Elements, and little else.

/**
 * An element of `tag`. Attributes that are functions listen (`onclick`), `dataset` and `style` are
 * objects, booleans are there or not, `null` is left out; children are nodes or text.
 */
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  assign(element, attributes);
  element.append(...children.flat().filter((child) => child != null && child !== false));
  return element;
}

/** The same in SVG. */
export function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  assign(element, attributes);
  element.append(...children.flat().filter((child) => child != null && child !== false));
  return element;
}

function assign(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value == null || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "dataset") Object.assign(element.dataset, value);
    else if (name === "style") {
      for (const [key, text] of Object.entries(value)) element.style.setProperty(key, text);
    } else element.setAttribute(name, value === true ? "" : value);
  }
}

/** The element with this id. */
export const byId = (id) => document.getElementById(id);

/** Calls `action` at most once per `wait` ms, the last time with the newest arguments. */
export function throttled(wait, action) {
  let timer = null;
  let pending = null;
  const tick = () => {
    timer = null;
    if (pending) {
      const next = pending;
      pending = null;
      timer = setTimeout(tick, wait);
      action(...next);
    }
  };
  return (...now) => {
    pending = now;
    if (timer === null) tick();
  };
}

/**
 * As `throttled`, for an action that waits: it gets a signal that ends it when it is called anew, and what
 * it throws then is nothing.
 */
export function latest(wait, action) {
  let abort = new AbortController();
  return throttled(wait, async (...now) => {
    abort.abort();
    abort = new AbortController();
    const { signal } = abort;
    try {
      await action(signal, ...now);
    } catch (error) {
      if (!signal.aborted) throw error;
    }
  });
}

/** "1 end", "2 ends". */
export const count = (n, noun) => `${n} ${noun}${n === 1 ? "" : "s"}`;

/** Words for how many threads a thing has: "12 ends, 3 picks". */
export function threads({ ends, picks }) {
  const parts = [];
  if (ends) parts.push(count(ends, "end"));
  if (picks) parts.push(count(picks, "pick"));
  return parts.join(", ") || "no threads";
}

/** A name of the program in words: "von_mises_3d" to "von mises 3d". */
export const words = (name) => name.replaceAll("_", " ");

/** A number with about `digits` significant digits and no zeros at its end. */
export function short(value, digits = 4) {
  if (!Number.isFinite(value)) return String(value);
  return String(Number(value.toPrecision(digits)));
}

let toastTimer = 0;

/** Tells something for some seconds; an error stays until it is closed. */
export function tell(text, isError = false) {
  const toast = byId("toast");
  clearTimeout(toastTimer);
  const close = () => {
    toast.hidden = true;
  };
  toast.replaceChildren(
    h("span", { class: isError ? "error" : "" }, text),
    h("button", { type: "button", class: "plain", onclick: close, "aria-label": "Close message" }, "✕"),
  );
  toast.hidden = false;
  if (!isError) toastTimer = setTimeout(close, 5000);
}

/** Hands the browser `text` as a file called `name` to keep. */
export function download(name, text, type) {
  const url = URL.createObjectURL(new Blob([text], { type }));
  h("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
