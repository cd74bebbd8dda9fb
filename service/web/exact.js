// A canvas on which one pixel of the image is one pixel of the device, whatever the browser's zoom
// and the screen's ratio: its size is the device pixels that it covers, and the image lies in the
// top left corner unscaled.

/** What the page and the panel's own window call each other by. */
export const CHANNEL = "lfd-panel";

export class ExactCanvas {
  #canvas;
  #told;
  #image = null;

  /** told: is given a verdict whenever something changes. */
  constructor(canvas, told) {
    this.#canvas = canvas;
    this.#told = told;
    const observer = new ResizeObserver(([entry]) => this.#fit(entry));
    try {
      observer.observe(canvas, { box: "device-pixel-content-box" });
    } catch {
      observer.observe(canvas); // a browser that does not tell; the ratio has to do
    }
  }

  /** Show an image; image: ImageBitmap. */
  show(image) {
    this.#image?.close();
    this.#image = image;
    this.#draw();
  }

  #fit(entry) {
    const box = entry.devicePixelContentBoxSize?.[0];
    const ratio = box ? 1 : devicePixelRatio;
    const { inlineSize, blockSize } = box ?? entry.contentBoxSize[0];
    this.#canvas.width = Math.round(inlineSize * ratio);
    this.#canvas.height = Math.round(blockSize * ratio);
    this.#draw();
  }

  #draw() {
    const context = this.#canvas.getContext("2d", { alpha: false });
    context.imageSmoothingEnabled = false;
    context.fillStyle = "black";
    context.fillRect(0, 0, this.#canvas.width, this.#canvas.height);
    if (!this.#image) return;
    context.drawImage(this.#image, 0, 0);
    this.#told(this.verdict());
  }

  /** Whether the image covers the screen pixel for pixel, and how to say so. */
  verdict() {
    const image = [this.#image.width, this.#image.height];
    const device = [this.#canvas.width, this.#canvas.height];
    const screenPixels = [screen.width, screen.height].map((n) => Math.round(n * devicePixelRatio));
    const same = (one, other) => one.every((n, axis) => n === other[axis]);
    const size = (pixels) => pixels.join(" × ");
    const ratio = `device-pixel ratio ${Number(devicePixelRatio.toFixed(3))}`;
    const exact = same(image, device);
    if (exact) {
      return {
        exact,
        text: `Exact: ${size(image)} image pixels on ${size(device)} device pixels, ${ratio}.`,
      };
    }
    const why = same(device, screenPixels)
      ? `this screen has ${size(device)}. Move to the display's screen, or set it to its own resolution`
      : `this window has ${size(device)} of the screen's ${size(screenPixels)}. Make it full-screen`;
    return { exact, text: `Not exact: the panel has ${size(image)} pixels, ${why} (${ratio}).` };
  }
}

/** An image of a file, its colours left as they are. */
export const decode = (blob) =>
  createImageBitmap(blob, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
