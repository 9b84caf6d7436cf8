// A studio, a browser, and what a test needs to see in it.

import { spawn } from "node:child_process";
import { once } from "node:events";
import { readFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { createInterface } from "node:readline";

import { chromium } from "playwright-core";

/** The program under test, and the browser. */
const PROGRAM = process.env.SELVEDGE_PROGRAM ?? "selvedge";
const CHROMIUM = process.env.SELVEDGE_CHROMIUM ?? "/usr/bin/chromium";

/** Path of a file among the fixtures of the workspace. */
export const fixture = (name) =>
  process.env.SELVEDGE_FIXTURES
    ? `${process.env.SELVEDGE_FIXTURES}/${name}`
    : fileURLToPath(new URL(`../../../../fixtures/${name}`, import.meta.url));

/** Starts `selvedge studio CLOTH`; the address that it prints, and what ends it. */
export async function startStudio(cloth, ...options) {
  const child = spawn(PROGRAM, ["studio", cloth, "--port", "0", "--no-open", "--idle-exit", "60s", ...options], {
    stdio: ["ignore", "pipe", "pipe"],
  });
  let messages = "";
  child.stderr.on("data", (data) => { messages += data; });
  const ended = once(child, "exit");
  const address = new Promise((resolve) => {
    const look = (line) => {
      const found = line.match(/http:\/\/\S+/);
      if (found) resolve(found[0]);
    };
    createInterface({ input: child.stdout }).on("line", look);
    createInterface({ input: child.stderr }).on("line", look);
  });
  const url = await Promise.race([
    address,
    ended.then(([code]) => { throw new Error(`the studio ended with ${code}\n${messages}`); }),
  ]);
  const stop = async () => {
    child.kill("SIGINT");
    await ended;
  };
  return { url, stop };
}

/** The browser, without what would call elsewhere. */
export const startBrowser = () =>
  chromium.launch({
    executablePath: CHROMIUM,
    args: [
      "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
      "--disable-background-networking", "--disable-component-update", "--disable-sync",
    ],
  });

/**
 * The studio in a page of its own, with a finished picture of so many samples, or as it starts if `samples` is null;
 * of another `size` if that is told; `page.faults` gathers what the page complains of.
 */
export async function openPage(browser, url, { width = 1280, height = 800, scheme = "light", samples = 4, size = null } = {}) {
  const context = await browser.newContext({
    viewport: { width, height },
    colorScheme: scheme,
    hasTouch: width < 500,
    acceptDownloads: true,
  });
  const page = await context.newPage();
  page.faults = [];
  page.on("pageerror", (error) => page.faults.push(String(error.stack)));
  page.on("console", (message) => {
    // A refusal of the server is told to the user; the browser notes it as well.
    if (message.type() === "error" && !message.text().startsWith("Failed to load resource")) {
      page.faults.push(message.text());
    }
  });
  await page.goto(url);
  await page.waitForFunction(() => document.querySelector("#picture").dataset.revision);
  // A fixed number of samples, so that a picture takes as much work on any machine, and little.
  if (samples) {
    await page.locator("details", { has: page.locator("#spp") }).evaluate((details) => { details.open = true; });
    await page.locator("#spp").selectOption(String(samples));
    if (size) {
      await page.locator("#size").evaluate((select, size) => select.append(new Option(size)), size);
      await page.locator("#size").selectOption(size);
    }
    await redrawn(page, () => page.locator("#noise").selectOption("samples alone"));
    await finished(page);
  }
  return page;
}

/** Waits for the finished picture of what was asked for last. */
export async function finished(page) {
  await page.waitForFunction(() => document.querySelector("#picture").dataset.done === "true", null, {
    timeout: 120_000,
  });
}

/** Does `action`, which changes the document, and waits for the picture of that. */
export async function redrawn(page, action) {
  const before = await page.locator("#picture").getAttribute("data-revision");
  await action();
  await page.waitForFunction(
    (revision) => Number(document.querySelector("#picture").dataset.revision) > Number(revision),
    before,
    { timeout: 60_000 },
  );
  await finished(page);
}

/** The picture that is seen: width, height, and its bytes, four to a pixel. */
export async function pixels(page) {
  const { width, height, text } = await page.evaluate(() => {
    const canvas = document.querySelector("#picture");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let text = "";
    for (let at = 0; at < data.length; at += 0x8000) {
      text += String.fromCharCode(...data.subarray(at, at + 0x8000));
    }
    return { width: canvas.width, height: canvas.height, text: btoa(text) };
  });
  return { width, height, data: Buffer.from(text, "base64") };
}

/** The pixels of a PNG. */
export async function decoded(page, bytes) {
  const { width, height, text } = await page.evaluate(async (text) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    let out = "";
    for (let at = 0; at < data.length; at += 0x8000) out += String.fromCharCode(...data.subarray(at, at + 0x8000));
    return { width: image.width, height: image.height, text: btoa(out) };
  }, bytes.toString("base64"));
  return { width, height, data: Buffer.from(text, "base64") };
}

/** Does `action`, which hands a file to the browser to keep; its bytes. */
export async function downloaded(page, action) {
  const [download] = await Promise.all([page.waitForEvent("download", { timeout: 120_000 }), action()]);
  return readFile(await download.path());
}

/** Sets the number of a row and waits for the picture. */
export const setNumber = (page, name, value) =>
  redrawn(page, async () => {
    const number = row(page, name).getByRole("spinbutton").first();
    await number.fill(String(value));
    await number.press("Enter");
  });

/** The pixels of a mask of the server, 1 where it is not transparent. */
export async function maskOf(page, query) {
  const text = await page.evaluate(async (query) => {
    const response = await fetch(`api/mask?${query}`);
    const image = await createImageBitmap(await response.blob());
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    let text = "";
    for (let at = 3; at < data.length; at += 4) text += data[at] > 0 ? "1" : "0";
    return text;
  }, query);
  return Uint8Array.from(text, Number);
}

/** Drops a file on the page, as from a folder. */
export async function drop(page, name, bytes) {
  const transfer = await page.evaluateHandle(({ name, text }) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const transfer = new DataTransfer();
    transfer.items.add(new File([bytes], name));
    return transfer;
  }, { name, text: Buffer.from(bytes).toString("base64") });
  await page.dispatchEvent("body", "dragenter", { dataTransfer: transfer });
  await page.dispatchEvent("body", "drop", { dataTransfer: transfer });
}

/** Chooses the yarn of this name in the panel. */
export const chooseYarn = (page, name) =>
  page.locator("#yarns").getByRole("radio", { name }).first().check();

/** The row of a parameter in the panel. */
export const row = (page, name) => page.locator(`.parameter[data-name="${name}"]`).first();
