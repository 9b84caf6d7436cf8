// Fabrics to start from, with a thumbnail each.

import { Refusal, get } from "./api.js";
import { byId, h, tell } from "./dom.js";

export function showPresets(session) {
  const place = byId("presets");
  const picture = ({ name }) => h("img", { src: `api/preset/${encodeURIComponent(name)}.png`, alt: "", width: 192, height: 128 });

  async function choose(name) {
    try {
      const { fabric } = await get(`preset/${encodeURIComponent(name)}`);
      session.edit(fabric, { name });
      byId("presets-button").dispatchEvent(new Event("close-sheet"));
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      tell(error.message, true);
    }
  }

  // The server draws thumbnails once it is asked for the list: when the first picture is finished, or before
  // if the list is opened.
  let loading = null;
  async function load() {
    const presets = await get("presets");
    place.replaceChildren(...presets.map((preset) =>
      h("li", {}, h("button", { type: "button", dataset: { name: preset.name }, onclick: () => choose(preset.name) },
        preset.has_thumbnail ? picture(preset) : h("span", { class: "blank" }),
        h("span", {}, preset.title || preset.name),
        h("span", { class: "soft small" }, `${preset.ends} × ${preset.picks} threads`)))));
  }
  const ask = () => {
    loading ??= load().catch((error) => {
      loading = null;
      tell(error.message, true);
    });
  };
  session.on("shown", ({ done }) => done && ask());
  byId("presets-button").parentElement.addEventListener("toggle-sheet", ask);

  session.on("thumbnail", (name) => {
    const button = place.querySelector(`[data-name="${CSS.escape(name)}"]`);
    button?.querySelector(".blank")?.replaceWith(picture({ name }));
  });
}
