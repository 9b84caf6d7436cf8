// A and B: the cloth as it was when it was kept beside the cloth as it is, with a handle between.

import { Refusal, picture } from "./api.js";
import { byId, tell } from "./dom.js";

export function showCompare(session) {
  const toggle = byId("compare");
  const before = byId("before");
  const split = byId("split");
  const handle = byId("split-handle");
  const context = before.getContext("2d");
  let kept = null;
  let viewOfA = null;
  let rest = 0;

  const place = () => {
    const part = Number(handle.value) / 10;
    split.style.setProperty("--split", `${part}%`);
    before.style.clipPath = `inset(0 ${100 - part}% 0 0)`;
    handle.setAttribute("aria-valuetext", `A on the left ${Math.round(part)} %`);
  };
  handle.addEventListener("input", place);

  const viewKey = () => JSON.stringify(session.view);

  function show(image) {
    const [width, height] = session.view.size;
    Object.assign(before, { width, height });
    context.drawImage(image, 0, 0, width, height);
  }

  function keep() {
    kept = { fabric: session.fabric, name: session.name };
    show(byId("picture"));
    // A picture that is not finished yet is drawn again once there is time.
    viewOfA = byId("picture").dataset.done === "true" ? viewKey() : null;
  }

  function end() {
    kept = null;
    clearTimeout(rest);
  }

  function refresh() {
    toggle.setAttribute("aria-pressed", String(kept !== null));
    split.hidden = kept === null;
    before.hidden = kept === null;
    byId("compare-tools").hidden = kept === null;
    place();
  }

  toggle.addEventListener("click", () => {
    if (kept) end();
    else keep();
    refresh();
  });
  byId("swap").addEventListener("click", () => {
    const { fabric, name } = kept;
    keep();
    session.edit(fabric, { name });
  });

  // A is drawn in the view of B when B is done and nothing has changed for a moment.
  session.on("fabric view", () => clearTimeout(rest));
  session.on("shown", (frame) => {
    clearTimeout(rest);
    if (kept && frame.done && viewOfA !== viewKey()) rest = setTimeout(drawA, 250);
  });

  async function drawA() {
    const view = viewKey();
    try {
      await session.drawOther(kept.fabric, async (frame) => {
        if (!frame.done || !kept) return;
        try {
          show(await picture(`frame/${frame.id}.png`));
          viewOfA = view;
        } catch (error) {
          if (!(error instanceof Refusal)) throw error;
        }
        // The server goes back to B, whose picture is already seen.
        session.redraw();
      });
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      tell(error.message, true);
    }
  }
  refresh();
}
