// The little sky in the corner of the picture, seen from above: its dot is the light.

import { byId, svg } from "./dom.js";
import { lightAt } from "./picture.js";

const RADIUS = 34;

export function showDial(session) {
  const sun = svg("circle", { class: "sun", r: 5.5 });
  const ray = svg("line", { class: "ray", x1: 0, y1: 0 });
  const ring = (elevation) =>
    svg("circle", { class: "ring", r: RADIUS * Math.cos((elevation * Math.PI) / 180) });
  const dial = byId("dial");
  dial.append(svg("circle", { class: "sky", r: RADIUS }), ring(30), ring(60), ray, sun);

  session.on("view", () => {
    const { light } = session.placement();
    dial.toggleAttribute("hidden", !light);
    if (!light) return;
    const [azimuth, elevation] = [light.azimuth, light.elevation].map((angle) => (angle * Math.PI) / 180);
    const x = RADIUS * Math.cos(elevation) * Math.cos(azimuth);
    const y = -RADIUS * Math.cos(elevation) * Math.sin(azimuth);
    for (const [name, value] of Object.entries({ cx: x, cy: y })) sun.setAttribute(name, value);
    for (const [name, value] of Object.entries({ x2: x, y2: y })) ray.setAttribute(name, value);
  });

  const put = (event) => {
    const box = dial.getBoundingClientRect();
    const scale = (2 * 38) / box.width / RADIUS;
    const x = (event.clientX - box.left - box.width / 2) * scale;
    const y = -(event.clientY - box.top - box.height / 2) * scale;
    session.look({ light: lightAt(x, y) });
  };
  dial.addEventListener("pointerdown", (event) => {
    event.stopPropagation();
    dial.setPointerCapture(event.pointerId);
    put(event);
  });
  dial.addEventListener("pointermove", (event) => {
    event.stopPropagation();
    if (dial.hasPointerCapture(event.pointerId)) put(event);
  });
}
