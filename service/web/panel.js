// The window that lies on the attached display and shows what the page sends it.

import { CHANNEL, decode, ExactCanvas } from "./exact.js";

const element = document.querySelector("#full");
const said = element.querySelector("p");
const channel = new BroadcastChannel(CHANNEL);

const canvas = new ExactCanvas(element.querySelector("canvas"), ({ exact, text }) => {
  said.textContent = document.fullscreenElement ? text : `${text} Click for full-screen.`;
  said.hidden = exact;
});

channel.addEventListener("message", async ({ data }) => {
  if (data.blob) canvas.show(await decode(data.blob));
});
channel.postMessage({ hello: true });
window.addEventListener("pagehide", () => channel.postMessage({ bye: true }));

const fill = () => element.requestFullscreen({ navigationUI: "hide" });
element.addEventListener("click", fill);
element.addEventListener("keydown", (event) => {
  if (event.key === "Enter") fill();
  if (event.key === "h") said.hidden = !said.hidden;
});
