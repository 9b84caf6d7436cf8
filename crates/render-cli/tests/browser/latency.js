// How long one waits: from an input event to the first changed frame, and to the picture with noise 0.05.
// Prints a line for each kind of picture, with medians over as many moves of a slider as there are seconds to wait.

import { fixture, openPage, redrawn, row, startBrowser, startStudio } from "./harness.js";

const MOVES = Number(process.argv[2] ?? 15);
const CLOTHS = ["preset:tartan-wool", "preset:denim", "preset:silk-charmeuse"];

const median = (values) => {
  const sorted = [...values].sort((a, b) => a - b);
  const middle = sorted.length >> 1;
  return sorted.length % 2 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
};

/** Moves a slider to `place`; milliseconds to the first frame of what it was moved to, and to the last. */
const move = (slider, place) =>
  slider.evaluate((input, value) => new Promise((resolve) => {
    const canvas = document.querySelector("#picture");
    const old = canvas.dataset.revision;
    let first = null;
    const watch = new MutationObserver(() => {
      if (canvas.dataset.revision === old) return;
      first ??= performance.now() - start;
      if (canvas.dataset.done !== "true") return;
      watch.disconnect();
      resolve([first, performance.now() - start]);
    });
    watch.observe(canvas, { attributes: true });
    input.value = value;
    const start = performance.now();
    input.dispatchEvent(new Event("input", { bubbles: true }));
  }), place);

const browser = await startBrowser();
console.log("cloth, 640 x 480          first frame, ms   to noise 0.05, s   (medians; worst)");
for (const cloth of CLOTHS) {
  const studio = await startStudio(cloth.startsWith("preset:") ? cloth : fixture(cloth));
  try {
    const page = await openPage(browser, studio.url, { samples: null });
    for (const kind of ["Swatch", "Drape"]) {
      const radio = page.getByRole("radio", { name: kind });
      if (!(await radio.isChecked())) await redrawn(page, () => radio.check());
      const slider = row(page, "psi").getByRole("slider");
      const first = [];
      const last = [];
      for (let index = 0; index < MOVES; index += 1) {
        const [shown, done] = await move(slider, 150 + ((index * 397) % 700));
        first.push(shown);
        last.push(done / 1000);
      }
      const text = (values, digits) => `${median(values).toFixed(digits)}; ${Math.max(...values).toFixed(digits)}`;
      console.log(`${`${cloth} ${kind.toLowerCase()}`.padEnd(30)}${text(first, 0).padEnd(18)}${text(last, 2)}`);
    }
    await page.context().close();
  } finally {
    await studio.stop();
  }
}
await browser.close();
