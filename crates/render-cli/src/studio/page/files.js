// Files in and out: dropped, opened, saved, exported.

import { Refusal, get, post, send } from "./api.js";
import { byId, download, tell } from "./dom.js";

/** Most bytes that the server takes. */
const LIMIT = 16 * 1024 * 1024;

async function open(session, file) {
  if (file.size > LIMIT) {
    tell(`${file.name}: ${file.size} bytes, expected at most ${LIMIT}`, true);
    return;
  }
  try {
    const start = (await file.slice(0, 64).text()).replace("\ufeff", "").trimStart();
    const isFabric = /\.json$/i.test(file.name) || start.startsWith("{");
    if (isFabric) await openFabric(session, file);
    else await openDraft(session, file);
  } catch (error) {
    if (!(error instanceof Refusal)) throw error;
    session.emit("refused", Object.assign(error, { name: file.name }));
    tell(`${file.name} was not opened\n${error.message}`, true);
  }
}

async function openDraft(session, file) {
  const { name, fabric, diagnostics } = await send(`wif?name=${encodeURIComponent(file.name)}`, file);
  const isKept = byId("keep-yarn").checked;
  session.edit(isKept ? { ...session.fabric, draft: fabric.draft } : fabric, { name });
  const warnings = diagnostics.filter(({ severity }) => severity === "warning").length;
  tell(warnings ? `${name} opened, ${warnings} warning${warnings === 1 ? "" : "s"}: see Draft below` : `${name} opened`);
}

async function openFabric(session, file) {
  let fabric;
  try {
    fabric = JSON.parse(await file.text());
  } catch (error) {
    throw new Refusal(422, { errors: [`${error.message}, expected a fabric in JSON`] });
  }
  if (typeof fabric?.draft === "string") {
    throw new Refusal(422, {
      errors: [
        `draft: found the path "${fabric.draft}", expected the text of a draft: a browser opens no path. ` +
        "Start the studio with this file, or drop the draft itself",
      ],
    });
  }
  // Asked before it is taken over, so that what is refused leaves no step to undo.
  await post("fabric-text", { fabric });
  session.edit(fabric, { name: file.name });
  tell(`${file.name} opened`);
}

async function save(session) {
  try {
    if (session.savesTo) {
      const { saved } = await post("save", { fabric: session.fabric });
      tell(`Saved to ${saved}`);
    } else {
      await keep(session);
    }
  } catch (error) {
    if (!(error instanceof Refusal)) throw error;
    tell(`Not saved\n${error.message}`, true);
  }
}

async function keep(session) {
  const { text } = await post("fabric-text", { fabric: session.fabric });
  download(`${session.name.replace(/\.(wif|json)$/i, "")}.json`, text, "application/json");
}

export function showFiles(session) {
  const input = byId("file");
  byId("open").addEventListener("click", () => input.click());
  input.addEventListener("change", () => {
    if (input.files[0]) open(session, input.files[0]);
    input.value = "";
  });

  const drop = byId("drop");
  let depth = 0;
  const hasFiles = (event) => [...(event.dataTransfer?.types ?? [])].includes("Files");
  const enter = (step) => (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    depth = Math.max(0, depth + step);
    drop.hidden = depth === 0;
  };
  document.addEventListener("dragenter", enter(1));
  document.addEventListener("dragleave", enter(-1));
  document.addEventListener("dragover", (event) => hasFiles(event) && event.preventDefault());
  document.addEventListener("drop", (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    depth = 0;
    drop.hidden = true;
    if (event.dataTransfer.files[0]) open(session, event.dataTransfer.files[0]);
  });

  byId("save").addEventListener("click", () => save(session));
  byId("keep").addEventListener("click", () =>
    keep(session).catch((error) => tell(`Not saved\n${error.message}`, true)));
  byId("keep").hidden = !session.savesTo;
  byId("save").title = session.savesTo ? `Save to ${session.savesTo}` : "Save as a file";

  byId("export-menu").addEventListener("toggle-sheet", async () => {
    try {
      byId("command").value = (await get("command")).command;
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      byId("command").value = error.message;
    }
  });
}
