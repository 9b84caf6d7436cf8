// The draft as weavers draw it, lying as the cloth lies in the picture: end 1 at the left and pick 1 at
// the bottom, the threading below, the treadling or lift plan to the right, the tie-up where they meet.

import { byId, count } from "./dom.js";

/** Pixels of a crossing that are asked for, and between the parts. */
const CELL = 8;
const LEAST = 3;
const MOST = 20;
const GAP = 7;
/** Thickness of the strips of thread colours. */
const STRIP = 6;

export function showLoom(session) {
  const box = byId("loom");
  const canvas = byId("loom-canvas");
  const extent = byId("loom-extent");
  const context = canvas.getContext("2d");
  let zoom = CELL;
  let layout = null;

  /** Sizes of all parts in CSS pixels, for the room that there is. */
  function measure() {
    const { draft } = session;
    const room = { width: box.clientWidth, height: box.clientHeight };
    const plan = draft.treadling ?? draft.liftplan;
    const columns = draft.treadling ? draft.treadles : draft.liftplan ? draft.shafts : 0;
    const rows = draft.threading ? draft.shafts : 0;
    const rowHeight = rows ? Math.min(zoom, 14, (0.42 * room.height) / rows) : 0;
    const columnWidth = columns ? Math.min(zoom, 14, (0.3 * room.width) / columns) : 0;
    const below = rows * rowHeight + STRIP + GAP;
    const beside = columns * columnWidth + STRIP + GAP;
    const seen = {
      width: Math.max(20, room.width - beside),
      height: Math.max(20, room.height - below),
    };
    // A draft that is smaller than its window is repeated in it, as it is in the cloth.
    const ends = Math.max(draft.ends, Math.ceil(seen.width / zoom));
    const picks = Math.max(draft.picks, Math.ceil(seen.height / zoom));
    return { room, plan, columns, rows, rowHeight, columnWidth, below, beside, seen, ends, picks, cell: zoom };
  }

  function resize() {
    if (!session.draft) return;
    layout = measure();
    const { room, seen, ends, picks } = layout;
    // What is scrolled is as much larger than the window as the drawdown than its part that is seen.
    extent.style.width = `${Math.max(room.width, room.width + ends * zoom - seen.width)}px`;
    extent.style.height = `${Math.max(room.height, room.height + picks * zoom - seen.height)}px`;
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.round(room.width * ratio);
    canvas.height = Math.round(room.height * ratio);
    canvas.style.width = `${room.width}px`;
    canvas.style.height = `${room.height}px`;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    draw();
  }

  /** How far the drawdown is scrolled: its left edge, and its lower one, where pick 1 is. */
  function offset() {
    const most = layout.picks * zoom - layout.seen.height;
    return { x: box.scrollLeft, y: most - box.scrollTop };
  }

  const xOf = (end, at) => (end - 1) * zoom - at.x;
  const yOf = (pick, at) => layout.seen.height - pick * zoom + at.y;

  function draw() {
    if (!layout) return;
    const { draft } = session;
    const style = getComputedStyle(document.documentElement);
    const color = (name) => style.getPropertyValue(name).trim();
    const ink = color("--ink");
    const at = offset();
    const { seen, cell, rows, rowHeight, columns, columnWidth, plan } = layout;
    const first = { end: Math.floor(at.x / cell) + 1, pick: Math.floor(at.y / cell) + 1 };
    const last = {
      end: Math.min(layout.ends, Math.ceil((at.x + seen.width) / cell)),
      pick: Math.min(layout.picks, Math.ceil((at.y + seen.height) / cell)),
    };
    const e = (end) => (end - 1) % draft.ends;
    const p = (pick) => (pick - 1) % draft.picks;
    context.clearRect(0, 0, layout.room.width, layout.room.height);

    const inside = (x, y, width, height, paint) => {
      context.save();
      context.beginPath();
      context.rect(x, y, width, height);
      context.clip();
      paint();
      context.restore();
    };
    const line = (x, y, width, height) => {
      context.strokeStyle = color("--line");
      context.lineWidth = 1;
      context.strokeRect(x + 0.5, y + 0.5, width - 1, height - 1);
    };
    const mark = (x, y, width, height) => {
      context.fillStyle = ink;
      const [dx, dy] = [Math.min(1.5, width / 8), Math.min(1.5, height / 8)];
      context.fillRect(x + dx, y + dy, width - 2 * dx, height - 2 * dy);
    };

    const inColor = byId("in-color").checked;
    inside(0, 0, seen.width, seen.height, () => {
      for (let pick = first.pick; pick <= last.pick; pick += 1) {
        const row = draft.drawdown?.[p(pick)];
        for (let end = first.end; end <= last.end; end += 1) {
          const isWarp = row?.[e(end)] === "1";
          const thread = isWarp ? draft.end_colors[e(end)] : draft.pick_colors[p(pick)];
          context.fillStyle = inColor ? thread : isWarp ? "#1b1b1b" : "#f6f6f6";
          context.fillRect(xOf(end, at), yOf(pick, at), cell, cell);
        }
      }
      if (cell >= 6) grid(at, first, last);
      point(at);
    });
    line(0, 0, seen.width, seen.height);

    const below = seen.height + STRIP + GAP;
    inside(0, seen.height, seen.width, layout.below, () => {
      for (let end = first.end; end <= last.end; end += 1) {
        const x = xOf(end, at);
        context.fillStyle = draft.end_colors[e(end)];
        context.fillRect(x, seen.height + 3, cell, STRIP);
        for (const shaft of draft.threading?.[e(end)] ?? []) {
          mark(x, below + (shaft - 1) * rowHeight, cell, rowHeight);
        }
      }
    });
    if (rows) raster(0, below, seen.width, rows * rowHeight, cell, rowHeight, at.x % cell, 0);

    const beside = seen.width + STRIP + GAP;
    inside(seen.width, 0, layout.beside, seen.height, () => {
      for (let pick = first.pick; pick <= last.pick; pick += 1) {
        const y = yOf(pick, at);
        context.fillStyle = draft.pick_colors[p(pick)];
        context.fillRect(seen.width + 3, y, STRIP, cell);
        for (const column of plan?.[p(pick)] ?? []) {
          mark(beside + (column - 1) * columnWidth, y, columnWidth, cell);
        }
      }
    });
    if (columns) {
      const shift = (seen.height + at.y) % cell;
      raster(beside, 0, columns * columnWidth, seen.height, columnWidth, cell, 0, cell - shift);
    }
    if (draft.tieup && draft.treadling && rows) {
      draft.tieup.forEach((shafts, treadle) => {
        for (const shaft of shafts) {
          mark(beside + treadle * columnWidth, below + (shaft - 1) * rowHeight, columnWidth, rowHeight);
        }
      });
      raster(beside, below, columns * columnWidth, rows * rowHeight, columnWidth, rowHeight, 0, 0);
    }

    // What repeats is paler than the draft itself.
    context.globalAlpha = 0.62;
    context.fillStyle = color("--raised");
    const [right, top] = [xOf(draft.ends + 1, at), yOf(draft.picks, at)];
    if (right < seen.width) context.fillRect(right, 0, seen.width - right, layout.room.height);
    if (top > 0) {
      context.fillRect(0, 0, Math.min(right, seen.width), top);
      context.fillRect(seen.width, 0, layout.beside, top);
    }
    context.globalAlpha = 1;

    function raster(x, y, width, height, dx, dy, shiftX, shiftY) {
      inside(x, y, width, height, () => {
        context.fillStyle = color("--line");
        if (dx >= 4) for (let at = x - shiftX; at <= x + width; at += dx) context.fillRect(at, y, 0.7, height);
        if (dy >= 4) for (let at = y - shiftY; at <= y + height; at += dy) context.fillRect(x, at, width, 0.7);
      });
      line(x, y, width, height);
    }
  }

  function grid(at, first, last) {
    context.fillStyle = "rgb(128 128 128 / 0.55)";
    for (let end = first.end; end <= last.end; end += 1) {
      context.fillRect(xOf(end, at), 0, 0.6, layout.seen.height);
    }
    for (let pick = first.pick; pick <= last.pick; pick += 1) {
      context.fillRect(0, yOf(pick, at), layout.seen.width, 0.6);
    }
  }

  /** Shows the crossing that is pointed at, with its end and its pick. */
  function point(at) {
    if (!session.crossing) return;
    const { end, pick } = session.crossing;
    const [x, y] = [xOf(end, at), yOf(pick, at)];
    const frame = (left, top, width, height, inner, outer) => {
      context.lineWidth = 3;
      context.strokeStyle = outer;
      context.strokeRect(left, top, width, height);
      context.lineWidth = 1.2;
      context.strokeStyle = inner;
      context.strokeRect(left, top, width, height);
    };
    frame(x, -9, zoom, layout.seen.height + 18, "#ffffff", "rgb(0 0 0 / 0.55)");
    frame(-9, y, layout.seen.width + 18, zoom, "#ffffff", "rgb(0 0 0 / 0.55)");
    frame(x, y, zoom, zoom, "#ffffff", "#000000");
  }

  /** The crossing under a pointer, or none. */
  function crossingAt(event) {
    if (!layout) return null;
    const rect = canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - rect.left, event.clientY - rect.top];
    if (x < 0 || y < 0 || x >= layout.seen.width || y >= layout.seen.height) return null;
    const at = offset();
    const end = Math.floor((x + at.x) / zoom) + 1;
    const pick = Math.floor((layout.seen.height - y + at.y) / zoom) + 1;
    const { ends, picks } = session.draft;
    return { end: ((end - 1) % ends) + 1, pick: ((pick - 1) % picks) + 1 };
  }

  const same = (a, b) => a?.end === b?.end && a?.pick === b?.pick;
  const pointAt = (event) => {
    const crossing = crossingAt(event);
    if (!same(crossing, session.crossing)) session.point(crossing);
  };
  canvas.addEventListener("pointermove", (event) => event.pointerType === "mouse" && pointAt(event));
  canvas.addEventListener("click", pointAt);
  canvas.addEventListener("pointerleave", (event) => {
    if (event.pointerType === "mouse" && session.crossing) session.point(null);
  });

  canvas.addEventListener("keydown", (event) => {
    const step = {
      ArrowLeft: [-1, 0],
      ArrowRight: [1, 0],
      ArrowUp: [0, 1],
      ArrowDown: [0, -1],
    }[event.key];
    if (event.key === "Escape") {
      session.point(null);
    } else if (step) {
      event.preventDefault();
      const { ends, picks } = session.draft;
      const from = session.crossing ?? { end: 1 - step[0], pick: 1 - step[1] };
      const within = (value, most) => Math.min(most, Math.max(1, value));
      session.point({
        end: within(from.end + step[0], ends),
        pick: within(from.pick + step[1], picks),
      });
      reveal();
    }
  });

  /** Scrolls to the crossing that is pointed at. */
  function reveal() {
    if (!session.crossing || !layout) return;
    const at = offset();
    const [x, y] = [xOf(session.crossing.end, at), yOf(session.crossing.pick, at)];
    const { width, height } = layout.seen;
    if (x < 0) box.scrollLeft += x;
    else if (x + zoom > width) box.scrollLeft += x + zoom - width;
    if (y < 0) box.scrollTop += y;
    else if (y + zoom > height) box.scrollTop += y + zoom - height;
  }

  byId("loom-zoom").addEventListener("input", (event) => {
    zoom = Math.min(MOST, Math.max(LEAST, Number(event.target.value)));
    resize();
    box.scrollTop = box.scrollHeight;
  });
  byId("in-color").addEventListener("change", draw);
  box.addEventListener("scroll", draw, { passive: true });
  new ResizeObserver(resize).observe(box);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  session.on("crossing", (detail) => {
    if (detail) reveal();
    draw();
  });
  session.on("draft", () => {
    const { draft } = session;
    session.point(null);
    const plan = draft.treadling ? count(draft.treadles, "treadle") : draft.liftplan ? "lift plan" : "no plan";
    byId("draft-facts").textContent =
      `${count(draft.ends, "end")} × ${count(draft.picks, "pick")}, ${count(draft.shafts, "shaft")}, ${plan}`;
    resize();
    box.scrollTop = box.scrollHeight;
    draw();
  });
}
