// How long one waits after an input event: for the first changed frame, for noise 0.05 over the picture, and until
// each tile of it has that noise. Prints a line with medians, and the worst, for each kind of picture.
//
//     SELVEDGE_PROGRAM=target/release/selvedge node latency.js [MOVES [PICTURES]]
//
// MOVES of a slider for the first frame, PICTURES that are drawn until they are done.

import { fixture, openPage, row, startBrowser, startStudio } from "./harness.js";

const MOVES = Number(process.argv[2] ?? 15);
const PICTURES = Number(process.argv[3] ?? 3);
const CLOTHS = ["preset:tartan-wool", "preset:denim", "preset:silk-charmeuse"];
const NOISE = 0.05;
/** Time between moves, and the longest that a picture is waited for, ms. */
const PAUSE = 1000;
const LONGEST = 60_000;

const median = (values) => {
  const sorted = [...values].sort((a, b) => a - b);
  const middle = sorted.length >> 1;
  return sorted.length % 2 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
};

/**
 * Moves a slider to `place`; milliseconds to the first frame of what it was moved to, to the one with little noise and
 * to the last, or to the first alone. Infinite is what took too long.
 */
const move = (slider, place, isWhole) =>
  slider.evaluate((input, { place, isWhole, noise, longest }) => new Promise((resolve) => {
    const canvas = document.querySelector("#picture");
    const old = canvas.dataset.revision;
    const times = [Infinity, Infinity, Infinity];
    const end = () => {
      watch.disconnect();
      clearTimeout(timer);
      // JSON has no infinity.
      resolve(times.map(String));
    };
    const timer = setTimeout(end, longest);
    const watch = new MutationObserver(() => {
      const { revision, noise: found, done } = canvas.dataset;
      if (revision === old) return;
      const now = performance.now() - start;
      const isDone = done === "true";
      times[0] = Math.min(times[0], now);
      if (isDone || (found && Number(found) <= noise)) times[1] = Math.min(times[1], now);
      if (isDone) times[2] = now;
      if (isDone || !isWhole) end();
    });
    watch.observe(canvas, { attributes: true });
    input.value = place;
    const start = performance.now();
    input.dispatchEvent(new Event("input", { bubbles: true }));
  }), { place, isWhole, noise: NOISE, longest: LONGEST }).then((times) => times.map(Number));

const browser = await startBrowser();
const number = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits) : `over ${LONGEST / 1000}`);
const text = (values, unit, digits) =>
  `${number(median(values) / unit, digits)}; ${number(Math.max(...values) / unit, digits)}`;
const line = (...cells) => console.log(cells.map((cell, index) => cell.padEnd(index ? 18 : 30)).join("").trimEnd());
line("cloth, 640 x 480", "first frame, ms", `noise ${NOISE}, s`, "each tile, s");
for (const cloth of CLOTHS) {
  const studio = await startStudio(cloth.startsWith("preset:") ? cloth : fixture(cloth));
  try {
    const page = await openPage(browser, studio.url, { samples: null });
    for (const kind of ["Swatch", "Drape"]) {
      const radio = page.getByRole("radio", { name: kind });
      await radio.check();
      const slider = row(page, "psi").getByRole("slider");
      const place = (index) => 150 + ((index * 397) % 700);
      const first = [];
      for (let index = 0; index < MOVES; index += 1) {
        first.push((await move(slider, place(index), false))[0]);
        await page.waitForTimeout(PAUSE);
      }
      const whole = [];
      for (let index = 0; index < PICTURES; index += 1) whole.push(await move(slider, place(MOVES + index), true));
      const at = (index) => text(whole.map((times) => times[index]), 1000, 2);
      line(`${cloth} ${kind.toLowerCase()}`, text(first, 1, 0), at(1), at(2));
    }
    await page.context().close();
  } finally {
    await studio.stop();
  }
}
await browser.close();
