// The picture: frames as they come, what is pointed at, the ruler, and how one moves about.

import { Refusal, get, picture } from "./api.js";
import { byId, h, latest, short, tell } from "./dom.js";

/** Degrees to a pixel of dragging. */
const TURN = 0.4;
/** Degrees and factor to a key. */
const KEY_TURN = 5;
const KEY_ZOOM = 1.15;
/** Part of the width of a swatch to a key. */
const KEY_PAN = 0.1;
/** Movement in pixels up to which pressing is pointing, not dragging. */
const STILL = 4;

const clamp = (value, low, high) => Math.min(high, Math.max(low, value));
const wrap = (degrees) => ((((degrees + 180) % 360) + 360) % 360) - 180;

/** Turns the camera about the cloth, in degrees, clockwise seen from above. */
export function orbit(session, azimuth, elevation) {
  const { camera } = session.placement();
  if (!camera) return;
  session.look({
    camera: {
      ...camera,
      azimuth: wrap(camera.azimuth + azimuth),
      elevation: clamp(camera.elevation + elevation, 1, 89),
    },
  });
}

/** Moves the light, in degrees. */
export function moveLight(session, azimuth, elevation) {
  const { light } = session.placement();
  if (!light) return;
  session.look({
    light: {
      azimuth: wrap(light.azimuth + azimuth),
      elevation: clamp(light.elevation + elevation, 1, 89),
    },
  });
}

/** Farthest place of the cloth in the corner of a swatch, mm. */
const FARTHEST = 2000;

/** Pixels to a millimetre of a swatch so wide, and the place in the picture of the corner where `view.at` is. */
function swatchScale({ size: [width, height] }, mm) {
  const composed = Math.min(width, 1.5 * height);
  return { perMm: composed / mm, left: (width - composed) / 2, low: (height + composed / 1.5) / 2 };
}

/** Takes the swatch along by pixels of the picture, right and down. */
export function pan(session, right, down) {
  const { view } = session;
  const { perMm } = swatchScale(view, view.mm);
  const across = view.back ? right : -right;
  session.look({ at: placeAt(view.at[0] + across / perMm, view.at[1] + down / perMm) });
}

const placeAt = (u, v) => [u, v].map((mm) => Number(clamp(mm, -FARTHEST, FARTHEST).toFixed(4)));

/**
 * Comes nearer by `factor`, or goes away where it is below 1; in a swatch the cloth stays under `place`, `{ x, y }` in
 * pixels of the picture, or its middle.
 */
export function zoom(session, factor, place = null) {
  const { camera } = session.placement();
  const { view } = session;
  if (view.kind === "swatch") {
    const mm = Number(clamp(view.mm / factor, 0.1, 1000).toPrecision(3));
    const [width, height] = view.size;
    const { x, y } = place ?? { x: width / 2, y: height / 2 };
    const [before, after] = [view.mm, mm].map((wide) => swatchScale(view, wide));
    const reach = ({ perMm, left, low }) =>
      [(view.back ? width - left - x : x - left) / perMm, (low - y) / perMm];
    const [old, next] = [reach(before), reach(after)];
    session.look({ mm, at: placeAt(view.at[0] + old[0] - next[0], view.at[1] + old[1] - next[1]) });
  } else if (camera) {
    session.look({ camera: { ...camera, distance: clamp(camera.distance / factor, 0.1, 4) } });
  }
}

const dragsLight = (event) => event.shiftKey || byId("drag-light").checked;

/** Where an event is, in pixels of the picture. */
function placeOf(session, { clientX, clientY }) {
  const box = byId("picture").getBoundingClientRect();
  const [width, height] = session.view.size;
  return { x: ((clientX - box.left) / box.width) * width, y: ((clientY - box.top) / box.height) * height };
}

export function showPicture(session) {
  const frame = byId("frame");
  const canvas = byId("picture");
  const over = byId("over");
  const context = canvas.getContext("2d");

  // Frames are drawn in their order; one that a newer has overtaken is not fetched.
  let newest = null;
  let isFetching = false;
  let last = null;
  async function next() {
    if (isFetching || !newest) return;
    isFetching = true;
    const shown = newest;
    newest = null;
    try {
      const bitmap = await picture(`frame/${shown.id}.png`);
      draw(shown, bitmap);
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      if (error.status !== 404) tell(error.message, true);
    } finally {
      isFetching = false;
      next();
    }
  }

  function draw(shown, bitmap) {
    const [width, height] = session.view.size;
    if (canvas.width !== width || canvas.height !== height) {
      Object.assign(canvas, { width, height });
      drawOver();
    }
    context.imageSmoothingQuality = "high";
    context.drawImage(bitmap, 0, 0, width, height);
    Object.assign(canvas.dataset, {
      revision: shown.revision,
      frame: shown.id,
      spp: shown.spp,
      noise: shown.noise ?? "",
      full: shown.full,
    });
    last = shown;
    settle();
    byId("wait").hidden = true;
    session.emit("shown", shown);
  }

  session.on("frame", (shown) => {
    // The same picture drawn again shows nothing new until it is as good as what is seen.
    if (session.keepsPicture && !shown.done) return;
    session.keepsPicture = false;
    newest = shown;
    next();
  });

  // A picture is finished when it is of what was asked for last, which an answer may tell later than the frame.
  const settle = () => {
    canvas.dataset.done = Boolean(last?.done && session.isCurrent(last.revision));
  };
  session.on("fabric view", () => {
    canvas.dataset.done = false;
  });
  session.on("answer refused", settle);

  // What lies over the picture: the ruler, and shade on all but what is pointed at.
  let mask = null;
  function drawOver() {
    const [width, height] = session.view.size;
    Object.assign(over, { width, height });
    const shade = over.getContext("2d");
    if (mask) {
      shade.fillStyle = "rgb(0 0 0 / 0.62)";
      shade.fillRect(0, 0, width, height);
      shade.globalCompositeOperation = "destination-out";
      shade.drawImage(mask, 0, 0, width, height);
      shade.globalCompositeOperation = "source-over";
    }
    const perMm = session.answer?.pixels_per_mm;
    if (perMm && byId("ruler").checked) drawRuler(shade, perMm, width, height);
  }
  session.on("answer", drawOver);
  byId("ruler").addEventListener("change", drawOver);

  const fetchMask = latest(80, async (signal, query) => {
    mask = null;
    try {
      if (query) mask = await picture(`mask?${query}`, { signal });
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
    }
    if (signal.aborted) return;
    over.dataset.mask = mask ? query : "";
    drawOver();
  });
  const shadeCrossing = () => {
    const { end, pick } = session.crossing ?? {};
    fetchMask(session.crossing ? `end=${end}&pick=${pick}` : "");
  };
  session.on("crossing", shadeCrossing);
  session.on("yarn-shown", (yarn) => fetchMask(yarn === null ? "" : `yarn=${yarn}`));
  // Seen from elsewhere it is elsewhere, which is known once the view has been taken.
  session.on("view", () => mask && fetchMask(""));
  session.on("answer", () => session.crossing && shadeCrossing());

  const ask = latest(80, async (signal, place) => {
    if (!place) {
      session.point(null);
      return;
    }
    try {
      const found = await get(`at?x=${place.x.toFixed(1)}&y=${place.y.toFixed(1)}`, { signal });
      if (signal.aborted) return;
      if (found.cloth) session.point({ end: found.end, pick: found.pick }, found);
      else session.point(null);
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
    }
  });
  const askAt = (event) => ask(placeOf(session, event));

  followPointers(session, frame, askAt, () => ask(null));
  followKeys(session, frame);
  frame.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(session, Math.exp(-clamp(event.deltaY, -240, 240) * 0.0015), placeOf(session, event));
  }, { passive: false });
}

function followPointers(session, frame, askAt, leave) {
  const drag = (dx, dy) => {
    if (session.view.kind !== "swatch") return orbit(session, dx * TURN, dy * TURN);
    const scale = session.view.size[0] / byId("picture").getBoundingClientRect().width;
    return pan(session, dx * scale, dy * scale);
  };
  const pointers = new Map();
  let moved = 0;
  frame.addEventListener("pointerdown", (event) => {
    if (event.button !== 0 || event.target.closest("input")) return;
    frame.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    moved = 0;
  });
  frame.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) {
      if (event.pointerType === "mouse" && !event.target.closest("input")) askAt(event);
      return;
    }
    const now = { x: event.clientX, y: event.clientY };
    const [dx, dy] = [now.x - before.x, now.y - before.y];
    moved += Math.hypot(dx, dy);
    const others = [...pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
    pointers.set(event.pointerId, now);
    if (moved <= STILL) return;
    if (others.length) {
      const spread = (at) => Math.hypot(at.x - others[0].x, at.y - others[0].y);
      const middle = { clientX: (now.x + others[0].x) / 2, clientY: (now.y + others[0].y) / 2 };
      // Two fingers take a swatch along by what their middle moves.
      if (session.view.kind === "swatch") drag(dx / 2, dy / 2);
      if (spread(before) > 10) zoom(session, spread(now) / spread(before), placeOf(session, middle));
    } else if (dragsLight(event)) {
      dragLight(session, frame, event);
    } else {
      drag(dx, dy);
    }
  });
  const lift = (event) => {
    if (pointers.delete(event.pointerId) && moved <= STILL && event.type === "pointerup") askAt(event);
  };
  frame.addEventListener("pointerup", lift);
  frame.addEventListener("pointercancel", lift);
  frame.addEventListener("pointerleave", (event) => {
    if (event.pointerType === "mouse" && !pointers.size) leave();
  });
}

/** Puts the light where the pointer is: over the middle of the picture it stands overhead. */
function dragLight(session, frame, event) {
  const box = frame.getBoundingClientRect();
  const x = (2 * (event.clientX - box.left)) / box.width - 1;
  const y = 1 - (2 * (event.clientY - box.top)) / box.height;
  session.look({ light: lightAt(x, y) });
}

/** The light whose direction, seen from above, is at (x, y) of the unit disk. */
export function lightAt(x, y) {
  const radius = Math.min(1, Math.hypot(x, y));
  const degrees = 180 / Math.PI;
  return {
    azimuth: Number((Math.atan2(y, x) * degrees).toFixed(1)),
    elevation: Number(clamp(Math.acos(radius) * degrees, 1, 89).toFixed(1)),
  };
}

function followKeys(session, frame) {
  frame.addEventListener("keydown", (event) => {
    if (event.target !== frame || event.ctrlKey || event.metaKey || event.altKey) return;
    const [width] = session.view.size;
    const turn = (azimuth, elevation) => {
      if (dragsLight(event)) moveLight(session, azimuth, elevation);
      else if (session.view.kind !== "swatch") orbit(session, azimuth, elevation);
      // As the camera goes: what it looks at goes the other way.
      else pan(session, (-azimuth / KEY_TURN) * KEY_PAN * width, (elevation / KEY_TURN) * KEY_PAN * width);
    };
    const actions = {
      ArrowLeft: () => turn(-KEY_TURN, 0),
      ArrowRight: () => turn(KEY_TURN, 0),
      ArrowUp: () => turn(0, KEY_TURN),
      ArrowDown: () => turn(0, -KEY_TURN),
      "+": () => zoom(session, KEY_ZOOM),
      "=": () => zoom(session, KEY_ZOOM),
      "-": () => zoom(session, 1 / KEY_ZOOM),
      0: () => session.look({ camera: null, light: null, at: [0, 0] }),
    };
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  });
}

/** A ruler along the lower edge, with a number at each centimetre or, near, each millimetre. */
function drawRuler(context, perMm, width, height) {
  const steps = [0.01, 0.05, 0.1, 0.5, 1, 5, 10, 50, 100];
  const minor = steps.find((step) => step * perMm >= 5) ?? 100;
  const major = steps.find((step) => step * perMm >= 46) ?? 500;
  const depth = Math.round(height * 0.058);
  context.fillStyle = "rgb(250 250 250 / 0.92)";
  context.fillRect(0, height - depth, width, depth);
  context.fillStyle = "#111";
  context.font = `${Math.round(depth * 0.46)}px system-ui, sans-serif`;
  context.textAlign = "center";
  context.textBaseline = "bottom";
  const last = Math.floor(width / (minor * perMm));
  for (let index = 0; index <= last; index += 1) {
    const mm = index * minor;
    const x = Math.round(mm * perMm) + 0.5;
    const isMajor = Math.abs(mm / major - Math.round(mm / major)) < 1e-6;
    context.fillRect(x - 0.5, height - depth, 1, depth * (isMajor ? 0.42 : 0.24));
    if (isMajor && index > 0 && x < width - 34) context.fillText(short(mm), x, height - 1);
  }
  context.textAlign = "right";
  context.fillText("mm", width - 5, height - 1);
}

/** The line beneath the picture: how good it is and what it took. */
export function showStatus(session) {
  const status = byId("status");
  const fact = (name, value) => h("span", {}, `${name} `, h("b", {}, value));
  session.on("frame", (frame) => {
    const facts = [
      fact("Samples", `${short(frame.spp, 3)} per pixel`),
      fact("Noise", frame.noise == null ? "not known yet" : `${short(frame.noise, 2)}, worst tile ${short(frame.noise_worst, 2)}`),
      fact("Time", frame.seconds < 1 ? `${Math.round(1000 * frame.seconds)} ms` : `${short(frame.seconds, 3)} s`),
    ];
    if (frame.far != null) {
      const far = Math.round(100 * frame.far);
      const level = far === 0 ? "single threads" : far === 100 ? "threads averaged" : `${far} % averaged, rest threads`;
      facts.push(fact("Detail", level));
    }
    facts.push(h("span", { class: "end" }, frame.done ? "finished" : "refining…"));
    status.replaceChildren(...facts);
    status.dataset.done = frame.done;
  });
}
