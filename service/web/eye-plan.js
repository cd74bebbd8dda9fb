// The display from above: its cone, and where the eye stands in it.

const SVG = "http://www.w3.org/2000/svg";
const [WIDTH, HEIGHT, TOP] = [240, 118, 12];
const REACH = 1.25; // viewing distances that the plan shows

export class EyePlan {
  #cone;
  #panel;
  #eyes;

  constructor(svg) {
    svg.setAttribute("viewBox", `0 0 ${WIDTH} ${HEIGHT}`);
    const made = (name, className) => {
      const element = document.createElementNS(SVG, name);
      element.setAttribute("class", className);
      svg.append(element);
      return element;
    };
    this.#cone = made("path", "cone");
    this.#panel = made("path", "panel");
    this.#eyes = [made("circle", "eye"), made("circle", "eye")];
  }

  /** Show an eye at (x, y, z) mm before the display of a profile. */
  show([x, , z], { panel, viewing }, mode) {
    const scale = (HEIGHT - TOP) / (REACH * viewing.distance_mm);
    const half = Math.min(WIDTH / 2 - 4, (panel.size_mm[0] / 2) * scale);
    const reach = REACH * viewing.distance_mm * scale;
    const aside = Math.tan((viewing.cone_deg * Math.PI) / 360) * reach;
    const middle = WIDTH / 2;
    this.#cone.setAttribute(
      "d",
      `M${middle} ${TOP}L${middle - aside} ${TOP + reach}H${middle + aside}Z`,
    );
    this.#panel.setAttribute("d", `M${middle - half} ${TOP}H${middle + half}`);
    const apart = mode === "stereo" ? 32 : 0;
    for (const [index, eye] of this.#eyes.entries()) {
      const side = (index ? 1 : -1) * apart;
      eye.setAttribute("cx", clamp(middle + (x + side) * scale, 4, WIDTH - 4));
      eye.setAttribute("cy", clamp(TOP + z * scale, 8, HEIGHT - 4));
      eye.setAttribute("r", mode === "sweep" ? 0 : 4);
    }
  }
}

const clamp = (value, low, high) => Math.min(high, Math.max(low, value));
