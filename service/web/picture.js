// What is on the stage: one picture, a pair, or a sweep that goes to and fro.

const GAP_PX = 8; // between the pictures of a row, as panel/picture.py has it
const FRAME_MS = 90;

export class Picture {
  #canvas;
  #control;
  #playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
  #shown = 0;
  #ticking;

  /** control: the button that starts and stops a sweep. */
  constructor(canvas, control) {
    this.#canvas = canvas;
    this.#control = control;
  }

  /** Show one picture. */
  show(image) {
    this.#stop();
    this.#context(image.width, image.height).drawImage(image, 0, 0);
  }

  /** Show two pictures of a row: side by side, crossed, or one over the other in red and cyan. */
  showPair(image, way) {
    this.#stop();
    const { height } = image;
    const width = (image.width - GAP_PX) / 2;
    const second = width + GAP_PX;
    if (way !== "anaglyph") {
      const context = this.#context(2 * width, height);
      const [left, right] = way === "crossed" ? [width, 0] : [0, width];
      context.drawImage(image, 0, 0, width, height, left, 0, width, height);
      context.drawImage(image, second, 0, width, height, right, 0, width, height);
      return;
    }
    const context = this.#context(width, height);
    const half = (from, colour) => {
      const part = new OffscreenCanvas(width, height);
      const inside = part.getContext("2d");
      inside.drawImage(image, from, 0, width, height, 0, 0, width, height);
      inside.globalCompositeOperation = "multiply";
      inside.fillStyle = colour;
      inside.fillRect(0, 0, width, height);
      return part;
    };
    context.drawImage(half(0, "#f00"), 0, 0);
    context.globalCompositeOperation = "lighter";
    context.drawImage(half(second, "#0ff"), 0, 0);
  }

  /** Show a row of so many pictures one after the other, to and fro, or the one it rests at. */
  showSweep(image, count) {
    this.#stop();
    this.#control.textContent = this.#playing ? "Pause" : "Play";
    const { height } = image;
    const pitch = (image.width + GAP_PX) / count;
    const width = pitch - GAP_PX;
    const there = 2 * (count - 1);
    const tick = () => {
      const from = pitch * (this.#shown < count ? this.#shown : there - this.#shown);
      const context = this.#context(width, height);
      context.drawImage(image, from, 0, width, height, 0, 0, width, height);
      if (this.#playing) this.#shown = (this.#shown + 1) % there;
    };
    tick();
    if (this.#playing) this.#ticking = setInterval(tick, FRAME_MS);
    this.#control.onclick = () => {
      this.#playing = !this.#playing;
      this.showSweep(image, count);
    };
  }

  /** The canvas in a size, to draw on. */
  #context(width, height) {
    Object.assign(this.#canvas, { width, height });
    return this.#canvas.getContext("2d");
  }

  #stop() {
    clearInterval(this.#ticking);
  }
}
