// The page of `selvedge studio`: it shows and asks, the server weaves and draws.

import { Refusal, get } from "./api.js";
import { showCompare } from "./compare.js";
import { showCrossing } from "./crossing.js";
import { showDial } from "./dial.js";
import { byId, tell } from "./dom.js";
import { showFiles } from "./files.js";
import { showLoom } from "./loom.js";
import { showParameters } from "./parameters.js";
import { showPicture, showStatus } from "./picture.js";
import { showPresets } from "./presets.js";
import { showReport } from "./report.js";
import { Session } from "./session.js";
import { showView } from "./view.js";
import { showYarns } from "./yarns.js";

/** A button that opens a sheet beneath it, which closes with Escape, a click elsewhere or leaving. */
function sheet(button) {
  const panel = byId(button.getAttribute("aria-controls"));
  const open = (isOpen) => {
    panel.hidden = !isOpen;
    button.setAttribute("aria-expanded", String(isOpen));
    if (isOpen) button.parentElement.dispatchEvent(new Event("toggle-sheet"));
  };
  button.addEventListener("click", () => open(panel.hidden));
  button.addEventListener("close-sheet", () => open(false));
  button.parentElement.addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || panel.hidden) return;
    open(false);
    button.focus();
  });
  button.parentElement.addEventListener("focusout", (event) => {
    if (event.relatedTarget && !button.parentElement.contains(event.relatedTarget)) open(false);
  });
  document.addEventListener("pointerdown", (event) => {
    if (!button.parentElement.contains(event.target)) open(false);
  });
}

function showHistory(session) {
  const [undo, redo] = [byId("undo"), byId("redo")];
  undo.addEventListener("click", () => session.undo());
  redo.addEventListener("click", () => session.redo());
  session.on("history", () => {
    undo.disabled = !session.canUndo();
    redo.disabled = !session.canRedo();
  });
  document.addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
    // Fields in which one types have an undo of their own.
    if (event.target.matches('input[type="number"], input[type="text"]')) return;
    const key = event.key.toLowerCase();
    if (key === "z" || key === "y") {
      event.preventDefault();
      if (key === "y" || event.shiftKey) session.redo();
      else session.undo();
    } else if (key === "s") {
      event.preventDefault();
      byId("save").click();
    }
  });
}

async function start() {
  const session = new Session();
  session.parameters = await get("parameters");
  for (const button of document.querySelectorAll("button[aria-controls]")) sheet(button);
  // On a narrow screen the picture comes first: the draft above it is opened when it is wanted.
  byId("draft").open = matchMedia("(min-width: 1000px)").matches;
  showStatus(session);
  showPicture(session);
  showDial(session);
  showCompare(session);
  showLoom(session);
  showCrossing(session);
  showView(session);
  const showAlbedoOf = showReport(session);
  const showParametersOf = showParameters(session);
  showYarns(session, (entry) => {
    showParametersOf(entry);
    showAlbedoOf(entry);
  });
  showHistory(session);
  session.on("answer", () => {
    byId("name").textContent = [session.name, session.answer.title].filter(Boolean).join(" — ");
    document.title = `${session.name} — Selvedge Studio`;
  });
  session.on("refused", (refusal) => {
    if (!refusal.name) tell(refusal.message ?? refusal.errors.join("\n"), true);
  });
  showPresets(session);
  await session.start();
  showFiles(session);
}

start().catch((error) => {
  if (!(error instanceof Refusal)) console.error(error);
  tell(`The studio did not start\n${error.message}`, true);
});
