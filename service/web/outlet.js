// Where a panel's pixels go: full-screen in this window, or into a window of their own that lies on
// the attached display and follows.

import { Newest } from "./api.js";
import { CHANNEL, decode, ExactCanvas } from "./exact.js";
import { complain } from "./notices.js";

const HINT_MS = 4000;

export class Outlet {
  #newest;
  #element = document.querySelector("#full");
  #said = this.#element.querySelector("p");
  #canvas;
  #channel = new BroadcastChannel(CHANNEL);
  #followed = false;
  #hiding;

  caption = ""; // what is said besides

  /** make: gives the panel's pixels as a Blob, under a signal. */
  constructor(make) {
    const work = async (_, signal) => this.#show(await make(signal));
    this.#newest = new Newest(work, {
      stale: () => false, // the display follows a moving hand
      failed: (error) => {
        this.#say(error.message, false);
        if (!this.isFull) complain(error);
      },
    });
    this.#canvas = new ExactCanvas(this.#element.querySelector("canvas"), (verdict) =>
      this.#say(verdict.text, verdict.exact),
    );
    this.#channel.addEventListener("message", ({ data }) => {
      if (data.hello) this.#followed = true;
      if (data.bye) this.#followed = false;
      if (data.hello) this.update();
    });
    document.addEventListener("fullscreenchange", () => {
      if (!document.fullscreenElement) this.#leave();
    });
    this.#element.addEventListener("keydown", (event) => {
      if (event.key === "h") this.#said.hidden = !this.#said.hidden;
      if (event.key === "Escape") this.#leave();
    });
  }

  get element() {
    return this.#element;
  }

  get isFull() {
    return !this.#element.hidden;
  }

  /** Show the panel's pixels full-screen, on the screen of the panel's size where there are more. */
  async enter(size) {
    this.#element.hidden = false;
    this.#say("The panel image is being made…", false);
    try {
      const screen = await screenOf(size);
      await this.#element.requestFullscreen({ navigationUI: "hide", ...(screen && { screen }) });
    } catch (error) {
      this.#leave();
      complain(new Error(`The browser does not go full-screen: ${error.message}`));
      return;
    }
    this.#element.focus();
    this.update();
  }

  /** Open the window of its own. */
  open() {
    window.open("panel", "lfd-panel", "popup,width=960,height=540");
  }

  /** Make the pixels anew, where somebody looks at them. */
  update() {
    if (this.isFull || this.#followed) this.#newest.want(null);
  }

  async #show(blob) {
    if (this.#followed) this.#channel.postMessage({ blob });
    if (this.isFull) this.#canvas.show(await decode(blob));
  }

  #leave() {
    this.#element.hidden = true;
    if (document.fullscreenElement) document.exitFullscreen();
  }

  #say(text, passing) {
    this.#said.textContent = `${this.caption} ${text} Esc leaves, H hides this.`.trim();
    this.#said.hidden = false;
    clearTimeout(this.#hiding);
    if (passing) this.#hiding = setTimeout(() => (this.#said.hidden = true), HINT_MS);
  }
}

/** The attached screen of a panel's size, where the browser may tell; null: this window's own. */
async function screenOf(size) {
  if (!window.screen.isExtended || !window.getScreenDetails) return null;
  try {
    const { screens } = await window.getScreenDetails();
    const pixels = (screen) =>
      [screen.width, screen.height].map((n) => Math.round(n * screen.devicePixelRatio));
    return screens.find((screen) => `${pixels(screen)}` === `${size}`) ?? null;
  } catch {
    return null; // the person said no
  }
}
