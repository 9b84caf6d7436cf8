// The studio as an artist has it: each test opens the page and does with it what she would do.

import assert from "node:assert/strict";
import { mkdir, mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import {
  chooseYarn, decoded, downloaded, drop, finished, fixture, maskOf, openPage, pixels, redrawn, row, setNumber,
  startBrowser, startStudio,
} from "./harness.js";

const axe = await readFile(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** Where pictures of the page go, for a person to look at. */
const SCREENSHOTS = process.env.SELVEDGE_SCREENSHOTS;

let browser;
before(async () => { browser = await startBrowser(); });
after(async () => { await browser?.close(); });

/** A test with a studio and a page of its own, which complains of nothing. */
function withPage(name, cloth, options, body) {
  test(name, { timeout: 180_000 }, async () => {
    const studio = await startStudio(cloth.startsWith("preset:") ? cloth : fixture(cloth));
    try {
      const page = await openPage(browser, studio.url, options);
      await body(page, studio);
      assert.deepEqual(page.faults, [], "errors of the page");
      await page.context().close();
    } finally {
      await studio.stop();
    }
  });
}

const screenshot = async (page, name) => {
  if (!SCREENSHOTS) return;
  await mkdir(SCREENSHOTS, { recursive: true });
  await page.screenshot({ path: join(SCREENSHOTS, `${name}.png`) });
};

/** A swatch so near that each thread is several pixels wide, with a fixed number of samples. */
async function nearSwatch(page, mm) {
  await redrawn(page, () => page.getByRole("radio", { name: "Swatch" }).check());
  const field = row(page, "view-mm").getByRole("spinbutton");
  await redrawn(page, async () => {
    await field.fill(String(mm));
    await field.press("Enter");
  });
}

/** Number of pixels in which two pictures differ by more than `tolerance` of 255. */
function differences(a, b, tolerance = 0) {
  assert.deepEqual([a.width, a.height], [b.width, b.height]);
  const found = [];
  for (let pixel = 0; pixel < a.width * a.height; pixel += 1) {
    const most = Math.max(...[0, 1, 2].map((part) =>
      Math.abs(a.data[4 * pixel + part] - b.data[4 * pixel + part])));
    if (most > tolerance) found.push(pixel);
  }
  return found;
}

withPage("a draft opens as a picture that is not black", "drafts/houndstooth.wif", {}, async (page) => {
  const { width, height, data } = await pixels(page);
  assert.deepEqual([width, height], [640, 480]);
  const lightness = [];
  for (let at = 0; at < data.length; at += 4) lightness.push((data[at] + data[at + 1] + data[at + 2]) / 3);
  const mean = lightness.reduce((sum, value) => sum + value, 0) / lightness.length;
  const spread = Math.sqrt(lightness.reduce((sum, value) => sum + (value - mean) ** 2, 0) / lightness.length);
  assert.ok(mean > 25 && mean < 230, `mean lightness ${mean}, expected 25 to 230`);
  assert.ok(spread > 10, `spread of lightness ${spread}, expected more than 10`);
  assert.match(await page.locator("#draft-facts").textContent(), /ends? × \d+ picks?/);
  assert.match(await page.locator("#status").textContent(), /Samples.*Noise.*Time/);
});

withPage("psi changes the picture at once", "preset:silk-charmeuse", {}, async (page) => {
  await nearSwatch(page, 8);
  const before = await pixels(page);
  const slider = row(page, "psi").getByRole("slider");
  await slider.scrollIntoViewIfNeeded();
  const times = [];
  for (const place of [200, 800, 350, 650, 100]) {
    // From the event to the frame that shows it, in the page itself.
    times.push(await slider.evaluate((input, value) => new Promise((resolve) => {
      const canvas = document.querySelector("#picture");
      const old = canvas.dataset.revision;
      const watch = new MutationObserver(() => {
        if (canvas.dataset.revision === old) return;
        watch.disconnect();
        resolve(performance.now() - start);
      });
      watch.observe(canvas, { attributes: true, attributeFilter: ["data-revision"] });
      input.value = value;
      const start = performance.now();
      input.dispatchEvent(new Event("input", { bubbles: true }));
    }), place));
    await finished(page);
  }
  times.sort((a, b) => a - b);
  assert.ok(times[2] <= 300, `milliseconds to the first changed frame ${times}, expected a median of at most 300`);
  const changed = differences(before, await pixels(page), 2).length;
  assert.ok(changed > 640 * 480 * 0.02, `${changed} pixels changed, expected more than 2 in 100`);
});

withPage("a colour that is overridden changes its own threads and no others", "drafts/houndstooth.wif", {}, async (page) => {
  await nearSwatch(page, 12);
  const before = await pixels(page);
  const palette = await page.evaluate(async () => (await (await fetch("api/cloth")).json()).yarns);
  const seen = await page.evaluate(async (count) => {
    const shares = [];
    for (let yarn = 0; yarn < count; yarn += 1) {
      const image = await createImageBitmap(await (await fetch(`api/mask?yarn=${yarn}`)).blob());
      const canvas = new OffscreenCanvas(image.width, image.height);
      const context = canvas.getContext("2d");
      context.drawImage(image, 0, 0);
      const { data } = context.getImageData(0, 0, image.width, image.height);
      let sum = 0;
      for (let at = 3; at < data.length; at += 4) sum += data[at] > 0;
      shares.push(sum / (data.length / 4));
    }
    return shares;
  }, palette.length);
  const yarn = seen.findIndex((share) => share > 0.1 && share < 0.7);
  assert.ok(yarn >= 0, `shares of the types of yarn in the picture ${seen}, expected one of 0.1 to 0.7`);
  const mask = await maskOf(page, `yarn=${yarn}`);
  const [number] = palette[yarn].color_numbers;
  await chooseYarn(page, new RegExp(`^Colour ${number} `));
  await redrawn(page, () => row(page, "color").locator("input[type=color]").fill("#f0a020"));
  const after = await pixels(page);

  // A pixel gathers light from beside it: those near a thread may change with it.
  const reach = 3;
  const near = (pixel) => {
    const [x, y] = [pixel % after.width, Math.floor(pixel / after.width)];
    for (let dy = -reach; dy <= reach; dy += 1) {
      for (let dx = -reach; dx <= reach; dx += 1) {
        const [u, v] = [x + dx, y + dy];
        if (u >= 0 && u < after.width && v >= 0 && v < after.height && mask[v * after.width + u]) return true;
      }
    }
    return false;
  };
  const changed = differences(before, after);
  const strange = changed.filter((pixel) => !near(pixel));
  assert.equal(strange.length, 0, `${strange.length} of ${changed.length} changed pixels are of other threads`);
  const own = mask.reduce((sum, value) => sum + value, 0);
  const hit = differences(before, after, 2).filter((pixel) => mask[pixel]).length;
  assert.ok(hit > 0.9 * own, `${hit} of ${own} pixels of the threads changed, expected nine in ten`);
  assert.match(await page.locator("#yarns").textContent(), /Overrides/);
  await screenshot(page, "override");

  await redrawn(page, () => page.getByRole("button", { name: "Undo" }).click());
  assert.equal(differences(before, await pixels(page)).length, 0, "undone, the picture is what it was");
  await redrawn(page, () => page.getByRole("button", { name: "Redo" }).click());
  assert.equal(differences(after, await pixels(page)).length, 0, "and redone what it became");
});

/** What `selvedge draft lint` finds in an invalid fixture: the text of its first error. */
const firstError = async (name) =>
  (await readFile(fixture(`invalid/${name}.txt`), "utf8")).match(/^error: (.+)$/m)[1];

withPage("a broken draft is told with its line", "drafts/plain.wif", {}, async (page) => {
  const name = await page.locator("#name").textContent();
  await drop(page, "limit.wif", await readFile(fixture("invalid/limit.wif")));
  await page.locator("#diagnostics li.error").first().waitFor();
  const text = await page.locator("#diagnostics").textContent();
  const expected = await firstError("limit");
  assert.ok(text.includes(expected), `${text}, expected ${expected}`);
  assert.equal(await page.locator("#diagnostics-title").textContent(), "Not opened: limit.wif");
  assert.equal(await page.locator("#name").textContent(), name, "the cloth stays");
  await screenshot(page, "broken");

  // What can be read past is woven, and told as well.
  await redrawn(page, async () => drop(page, "bad-key.wif", await readFile(fixture("invalid/bad-key.wif"))));
  const findings = await page.locator("#diagnostics").textContent();
  const found = await firstError("bad-key");
  assert.ok(findings.includes(found), `${findings}, expected ${found}`);
  assert.match(await page.locator("#name").textContent(), /bad-key\.wif/);
});

withPage("a draft that is dropped is woven", "drafts/plain.wif", {}, async (page) => {
  await redrawn(page, async () =>
    drop(page, "houndstooth.wif", await readFile(fixture("drafts/houndstooth.wif"))));
  assert.match(await page.locator("#name").textContent(), /houndstooth\.wif/);
});

withPage("a fabric that is saved gives the same picture again", "preset:denim", {}, async (page, studio) => {
  await redrawn(page, async () => {
    const number = row(page, "psi").getByRole("spinbutton");
    await number.fill("0.9");
    await number.press("Enter");
  });
  const before = await pixels(page);
  const [download] = await Promise.all([
    page.waitForEvent("download"),
    page.getByRole("button", { name: "Save", exact: true }).click(),
  ]);
  const path = join(tmpdir(), `selvedge-${process.pid}.json`);
  await download.saveAs(path);
  const saved = await readFile(path);
  assert.equal(JSON.parse(saved).yarn.psi, 0.9);

  await redrawn(page, () => page.getByRole("button", { name: "Undo" }).click());
  assert.notEqual(differences(before, await pixels(page)).length, 0);
  await redrawn(page, () => drop(page, "denim.json", saved));
  assert.equal(differences(before, await pixels(page)).length, 0, "dropped on the page");

  const other = await startStudio(path);
  try {
    const again = await openPage(browser, other.url);
    assert.equal(differences(before, await pixels(again)).length, 0, "in a studio of its own");
    await again.context().close();
  } finally {
    await other.stop();
    await rm(path);
  }
});

withPage("what is seen is exported as PNG, and all of it as EXR", "preset:tartan-wool", { size: "240x180" }, async (page) => {
  const shown = await pixels(page);
  const bytes = async (name) => {
    await page.getByRole("button", { name: "Export", exact: true }).click();
    const bytes = await downloaded(page, () => page.getByRole("link", { name }).click());
    await page.keyboard.press("Escape");
    return bytes;
  };
  assert.equal(differences(shown, await decoded(page, await bytes("PNG, as seen"))).length, 0);
  const exr = await bytes("EXR, linear light");
  assert.equal(exr.readUInt32LE(0), 0x0131_2f76, "how an EXR begins");
  for (const layer of ["yarn_id", "albedo.R", "normalization 0"]) assert.ok(exr.includes(layer), `the EXR tells ${layer}`);
});

test("a fabric is saved to the file that the studio was started with", { timeout: 180_000 }, async () => {
  const folder = await mkdtemp(join(tmpdir(), "selvedge-"));
  const path = join(folder, "mine.json");
  await writeFile(path, JSON.stringify({ version: 1, draft: fixture("drafts/plain.wif"), yarn: { psi: 0.1 } }));
  const studio = await startStudio(path);
  try {
    const page = await openPage(browser, studio.url, { size: "240x180" });
    await setNumber(page, "psi", 0.4);
    await page.getByRole("button", { name: "Save", exact: true }).click();
    await page.locator("#toast", { hasText: `Saved to ${path}` }).waitFor();
    const saved = JSON.parse(await readFile(path, "utf8"));
    assert.deepEqual([saved.yarn.psi, saved.draft], [0.4, fixture("drafts/plain.wif")], "the draft stays where it is");
    assert.deepEqual(page.faults, []);
    await page.context().close();
  } finally {
    await studio.stop();
    await rm(folder, { recursive: true });
  }
});

withPage("a preset is chosen by its picture", "drafts/plain.wif", { size: "240x180" }, async (page) => {
  await page.getByRole("button", { name: "Presets" }).click();
  const preset = page.locator('#presets button[data-name="silk-charmeuse"]');
  await preset.locator("img").waitFor({ timeout: 120_000 });
  const size = await preset.locator("img").evaluate((image) => image.decode().then(() => [image.naturalWidth, image.naturalHeight]));
  assert.ok(size.every((side) => side > 50), `${size}`);
  await screenshot(page, "presets");
  await redrawn(page, () => preset.click());
  assert.match(await page.locator("#name").textContent(), /^silk-charmeuse/);
  assert.ok(await page.locator("#presets-sheet").isHidden(), "the list closes");
});

withPage("a picture takes the place of a colour and of a number", "drafts/plain.wif", { size: "240x180" }, async (page) => {
  await nearSwatch(page, 16);
  const before = await pixels(page);
  const file = { name: "tiles.png", mimeType: "image/png", buffer: await readFile(fixture("scenes/tiles.png")) };
  const color = row(page, "color");
  await redrawn(page, () => color.locator("input[type=file]").setInputFiles(file));
  const pictured = await pixels(page);
  assert.ok(differences(before, pictured, 8).length > 2_500, "the cloth has the colours of the picture");
  assert.ok(await color.locator("img").isVisible() && await color.locator("input[type=color]").isHidden());
  await screenshot(page, "picture");
  const width = color.getByRole("spinbutton", { name: /width of the picture, mm/ });
  await redrawn(page, async () => {
    await width.fill("7");
    await width.press("Enter");
  });
  assert.ok(differences(pictured, await pixels(page), 8).length > 700, "and so wide as it is told");

  const opacity = row(page, "opacity");
  await redrawn(page, () => opacity.locator("input[type=file]").setInputFiles(file));
  const limits = [/black, no unit/, /white, no unit/].map((name) => opacity.getByRole("spinbutton", { name }).inputValue());
  assert.deepEqual(await Promise.all(limits), ["0", "1"]);
  const both = await pixels(page);
  const saved = await downloaded(page, () => page.getByRole("button", { name: "Save", exact: true }).click());
  const { yarn } = JSON.parse(saved);
  assert.deepEqual(yarn.opacity.range, [0, 1]);
  assert.equal(yarn.color.image, `data:image/png;base64,${file.buffer.toString("base64")}`);
  assert.equal(yarn.color.mm[0], 7);

  await redrawn(page, () => color.getByRole("button", { name: /^Remove/ }).click());
  await redrawn(page, () => opacity.getByRole("button", { name: /^Remove/ }).click());
  assert.equal(differences(before, await pixels(page)).length, 0, "removed, all is as it was");
  await redrawn(page, () => drop(page, "mine.json", saved));
  assert.equal(differences(both, await pixels(page)).length, 0, "a saved fabric has its pictures in it");

  await color.locator("input[type=file]").setInputFiles({ name: "a.png", mimeType: "image/png", buffer: Buffer.from("none") });
  await page.locator("#toast", { hasText: "a.png was not taken" }).waitFor();
});

withPage("the peak of a wrapped Cauchy is turned round", "drafts/plain.wif", { size: "240x180" }, async (page) => {
  await page.evaluate(() => {
    for (const details of document.querySelectorAll("#parameters details")) details.open = true;
  });
  assert.ok(await row(page, "backward").isHidden());
  await redrawn(page, () => row(page, "phase").locator("select").selectOption("wrapped_cauchy"));
  const forward = await pixels(page);
  await redrawn(page, () => row(page, "backward").getByRole("checkbox", { name: /side of the light/ }).check());
  assert.ok(differences(forward, await pixels(page), 4).length > 500);
  const saved = await downloaded(page, () => page.getByRole("button", { name: "Save", exact: true }).click());
  assert.equal(JSON.parse(saved).yarn.phase.wrapped_cauchy.backward, true);
});

test("two pages show the same cloth, and what one changes the other can undo", { timeout: 180_000 }, async () => {
  const studio = await startStudio("preset:denim");
  try {
    const [one, two] = [await openPage(browser, studio.url, { size: "240x180" }), await openPage(browser, studio.url, { samples: null })];
    // A field in which one types stays as it is: the slider beside it tells.
    const psi = (page) => row(page, "psi").getByRole("slider").getAttribute("aria-valuetext");
    const shows = (page, text) => page.waitForFunction((text) =>
      document.querySelector('.parameter[data-name="psi"] input[type=range]').getAttribute("aria-valuetext") === text, text);
    const old = await psi(two);
    await setNumber(one, "psi", 0.77);
    await shows(two, "0.77 rad");
    await finished(two);
    assert.equal(differences(await pixels(one), await pixels(two)).length, 0, "the same picture");
    await redrawn(two, () => two.getByRole("button", { name: "Undo" }).click());
    await shows(one, old);
    await finished(one);
    assert.equal(differences(await pixels(one), await pixels(two)).length, 0, "again");
    assert.deepEqual([...one.faults, ...two.faults], []);
    await Promise.all([one, two].map((page) => page.context().close()));
  } finally {
    await studio.stop();
  }
});

withPage("a swatch is moved and stays under what zooms it", "drafts/tartan.wif", { size: "240x180" }, async (page) => {
  await nearSwatch(page, 12);
  const box = await page.locator("#picture").boundingBox();
  const at = ([x, y]) => [box.x + x * box.width, box.y + y * box.height];
  const place = async ([x, y]) => (await page.evaluate(async ([x, y]) => {
    const { width, height } = document.querySelector("#picture");
    return (await (await fetch(`api/at?x=${x * width}&y=${y * height}`)).json()).uv_mm;
  }, [x, y]));
  const near = (a, b, what) =>
    assert.ok(Math.hypot(a[0] - b[0], a[1] - b[1]) < 0.06, `${what}: ${a}, expected ${b}`);
  for (const side of ["Front", "Back"]) {
    await page.getByRole("radio", { name: side }).check();
    await finished(page);
    const held = await place([0.4, 0.6]);
    await redrawn(page, async () => {
      await page.mouse.move(...at([0.4, 0.6]));
      await page.mouse.down();
      await page.mouse.move(...at([0.65, 0.35]), { steps: 5 });
      await page.mouse.up();
    });
    near(await place([0.65, 0.35]), held, `${side}: dragged`);
    const below = await place([0.2, 0.3]);
    await page.mouse.move(...at([0.2, 0.3]));
    await redrawn(page, () => page.mouse.wheel(0, -200));
    near(await place([0.2, 0.3]), below, `${side}: zoomed`);
  }
  const touched = await place([0.5, 0.5]);
  const touches = await page.context().newCDPSession(page);
  const touch = (type, points) => touches.send("Input.dispatchTouchEvent", {
    type, touchPoints: points.map((point, id) => ({ x: at(point)[0], y: at(point)[1], id })),
  });
  await redrawn(page, async () => {
    await touch("touchStart", [[0.5, 0.5]]);
    for (const x of [0.55, 0.6, 0.65, 0.7]) await touch("touchMove", [[x, 0.5]]);
    await touch("touchEnd", []);
  });
  near(await place([0.7, 0.5]), touched, "by a finger");
  await page.locator("#frame").focus();
  const middle = await place([0.5, 0.5]);
  await redrawn(page, () => page.keyboard.press("ArrowUp"));
  assert.notDeepEqual(await place([0.5, 0.5]), middle, "and by key");
  await redrawn(page, () => page.getByRole("button", { name: "Reset view" }).click());
});

withPage("everything is reached by keyboard, and seen to be", "drafts/houndstooth.wif", {}, async (page) => {
  const reached = new Set();
  const unseen = [];
  for (let step = 0; step < 220; step += 1) {
    await page.keyboard.press("Tab");
    const stop = await page.evaluate(() => {
      const element = document.activeElement;
      if (element === document.body) return null;
      const styles = [element, element.closest("label")].filter(Boolean).map((each) => getComputedStyle(each));
      return {
        name: element.id || element.closest(".parameter")?.dataset.name || element.name || element.textContent.trim(),
        isSeen: styles.some((style) => style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2),
      };
    });
    if (!stop) break;
    reached.add(stop.name);
    if (!stop.isSeen) unseen.push(stop.name);
  }
  const wanted = [
    "open", "presets-button", "save", "export-button", "loom-canvas", "end", "pick", "kind", "side", "compare",
    "reset-view", "frame", "yarn", "add-by", "color", "psi", "u_max", "view-light-azimuth",
  ];
  assert.deepEqual(wanted.filter((name) => !reached.has(name)), [], `reached ${[...reached]}`);
  assert.deepEqual(unseen, [], "focus is not seen");

  await page.locator("#frame").focus();
  const before = await pixels(page);
  await redrawn(page, () => page.keyboard.press("ArrowLeft"));
  assert.ok(differences(before, await pixels(page), 8).length > 5000, "an arrow key turns the cloth");
  await redrawn(page, () => page.keyboard.press("0"));
  assert.equal(differences(before, await pixels(page)).length, 0, "and 0 turns it back");

  await page.locator("#loom-canvas").focus();
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("ArrowUp");
  assert.match(await page.locator("#crossing").textContent(), /Thread.*(end|pick) \d+ over/);
  await page.waitForFunction(() => document.querySelector("#over").dataset.mask);

  await row(page, "psi").getByRole("slider").focus();
  await redrawn(page, () => page.keyboard.press("PageUp"));
  assert.notEqual(differences(before, await pixels(page)).length, 0, "a slider moves");
  await redrawn(page, () => page.keyboard.press("Control+z"));
  assert.equal(differences(before, await pixels(page)).length, 0, "and is undone");
});

withPage("pointing at the picture tells thread, segment and parameters", "drafts/houndstooth.wif", {}, async (page) => {
  await nearSwatch(page, 8);
  await page.locator("#frame").hover({ position: { x: 150, y: 120 } });
  await page.waitForFunction(() => document.querySelector("#over").dataset.mask);
  const text = await page.locator("#crossing").textContent();
  for (const part of ["Thread", "Segment", "float of", "psi", "u_max", "rad"]) {
    assert.ok(text.includes(part), `${text}, expected ${part}`);
  }
  await screenshot(page, "pointing");
});

/** A number of the view, as the panel shows it. */
const viewed = (page, name) => row(page, `view-${name}`).getByRole("spinbutton").inputValue().then(Number);

withPage("mouse and fingers turn, zoom and light the cloth", "drafts/plain.wif", {}, async (page) => {
  const box = await page.locator("#picture").boundingBox();
  const drag = async (from, to) => {
    await page.mouse.move(box.x + from[0] * box.width, box.y + from[1] * box.height);
    await page.mouse.down();
    await page.mouse.move(box.x + to[0] * box.width, box.y + to[1] * box.height, { steps: 4 });
    await page.mouse.up();
  };
  const azimuth = await viewed(page, "camera-azimuth");
  const elevation = await viewed(page, "camera-elevation");
  await drag([0.5, 0.5], [0.6, 0.4]);
  assert.ok(await viewed(page, "camera-azimuth") > azimuth, "dragged to the right, the cloth turns there");
  assert.ok(await viewed(page, "camera-elevation") < elevation, "dragged up, it is seen from lower down");
  await page.mouse.wheel(0, -200);
  const distance = await viewed(page, "camera-distance");
  assert.ok(distance < 1, `distance ${distance}, expected less than 1`);

  await page.getByRole("radio", { name: "Light" }).check();
  await drag([0.4, 0.5], [0.75, 0.5]);
  const light = [await viewed(page, "light-azimuth"), await viewed(page, "light-elevation")];
  assert.deepEqual(light, [0, 60], "half way to the right edge it comes from there, 60 degrees up");
  const dial = await page.locator("#dial").boundingBox();
  await page.mouse.click(dial.x + dial.width / 2, dial.y + dial.height * 0.15);
  assert.ok(Math.abs(await viewed(page, "light-azimuth") - 90) < 2, "on the dial it goes behind the cloth");

  const touches = await page.context().newCDPSession(page);
  const pinch = (type, half) => touches.send("Input.dispatchTouchEvent", {
    type,
    touchPoints: half === null ? [] : [-half, half].map((dx, id) =>
      ({ x: box.x + box.width / 2 + dx, y: box.y + box.height / 2, id })),
  });
  await pinch("touchStart", 40);
  for (const half of [50, 60, 70, 80]) await pinch("touchMove", half);
  await pinch("touchEnd", null);
  const near = await viewed(page, "camera-distance");
  assert.ok(near < 0.75 * distance, `fingers apart bring it from ${distance} to ${near}, expected nearer`);

  await redrawn(page, () => page.getByRole("button", { name: "Reset view" }).click());
  assert.deepEqual([await viewed(page, "camera-azimuth"), await viewed(page, "camera-distance")], [azimuth, 1]);
});

withPage("A and B stand beside each other", "preset:denim", {}, async (page) => {
  const a = await pixels(page);
  await page.getByRole("button", { name: "Compare A/B" }).click();
  await redrawn(page, async () => {
    const number = row(page, "u_max").getByRole("spinbutton");
    await number.fill("0.9");
    await number.press("Enter");
  });
  const kept = await page.evaluate(() => {
    const canvas = document.querySelector("#before");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let sum = 0;
    for (let at = 0; at < data.length; at += 4) sum += data[at] + data[at + 1] + data[at + 2];
    return sum;
  });
  let sum = 0;
  for (let at = 0; at < a.data.length; at += 4) sum += a.data[at] + a.data[at + 1] + a.data[at + 2];
  assert.equal(kept, sum, "A is what was seen");
  const handle = page.getByRole("slider", { name: /Split/ });
  await handle.focus();
  await page.keyboard.press("Home");
  assert.match(await page.locator("#before").getAttribute("style"), /inset\(0(px)? 100%/);
  await screenshot(page, "compare");
});

for (const [width, height] of [[1280, 800], [390, 844]]) {
  for (const scheme of ["light", "dark"]) {
    const name = `the page is readable and accessible ${width} pixels wide, ${scheme}`;
    withPage(name, "preset:tartan-wool", { width, height, scheme }, async (page) => {
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      assert.ok(wide <= width, `${wide} pixels wide, expected at most ${width}`);
      await screenshot(page, `${width}-${scheme}`);
      await page.evaluate(() => {
        for (const details of document.querySelectorAll("details")) details.open = true;
      });
      await page.evaluate(axe);
      const { violations } = await page.evaluate(() => window.axe.run(document));
      const serious = violations.filter(({ impact }) => impact === "serious" || impact === "critical");
      const told = serious.map(({ id, nodes }) => `${id}: ${nodes.map(({ target }) => target).join(", ")}`);
      assert.deepEqual(told, [], "findings of axe");

      const unlabelled = await page.evaluate(() =>
        [...document.querySelectorAll('input[type="range"], input[type="number"], input[type="color"]')]
          .filter((input) => input.offsetParent !== null)
          .filter((input) => {
            const ids = input.getAttribute("aria-labelledby")?.split(" ") ?? [];
            const parts = ids.map((id) => document.getElementById(id)?.textContent.trim());
            if (ids.length) return parts.length < 2 || parts.some((text) => !text);
            const text = input.getAttribute("aria-label") ?? input.labels[0]?.textContent ?? "";
            return !/(no\.|number|px|part of|no unit|mm)/.test(text);
          })
          .map((input) => input.id || input.outerHTML));
      assert.deepEqual(unlabelled, [], "controls without a label or a unit");
    });
  }
}
