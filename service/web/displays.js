// Displays: one is picked, edited in fields or as JSON, read from other systems' files, kept.

import { ask, Problem, save } from "./api.js";
import { attempt, note } from "./notices.js";

const HANDED_OVER = "lfd-profile"; // from one page to the other, while it has no name
const TYPING_MS = 600;

// Path in the profile, label, unit.
const FIELDS = [
  ["panel.resolution_px.0", "Width", "px"],
  ["panel.resolution_px.1", "Height", "px"],
  ["panel.size_mm.0", "Width", "mm"],
  ["panel.size_mm.1", "Height", "mm"],
  ["lens.lens_count", "Lenses across", ""],
  ["lens.tilt_deg", "Tilt, + leans left", "°"],
  ["lens.center", "Center", "lenses"],
  ["lens.index", "Lens index", ""],
  ["viewing.views", "Views", ""],
  ["viewing.cone_deg", "Cone", "°"],
  ["viewing.distance_mm", "Viewing distance", "mm"],
];

/** The value at a dotted path. */
export const at = (data, path) => path.split(".").reduce((part, key) => part?.[key], data);

function put(data, path, value) {
  const keys = path.split(".");
  const last = keys.pop();
  at(data, keys.join("."))[last] = value;
}

/** The tilt in degrees that a profile's lenses have. */
export function tiltDeg({ lens, panel }) {
  if (lens.tilt_deg !== undefined) return lens.tilt_deg;
  const [width, height] = panel.size_mm;
  return (Math.atan((lens.drift * width) / height) * 180) / Math.PI;
}

export class Displays {
  #select = document.querySelector("#display");
  #facts = document.querySelector("#display-facts");
  #editor = document.querySelector("#editor");
  #text = document.querySelector("#profile-text");
  #name = document.querySelector("#display-name");
  #summaries = [];
  #typing;
  #typed = new Set(); // inputs whose numbers the profile is yet to take
  #changed;

  name = null; // null: the profile has none, and is sent whole
  profile = null;

  /** changed: is called whenever another display, or other figures of it, are to be shown. */
  constructor(changed) {
    this.#changed = changed;
    this.#select.addEventListener("change", () => attempt(() => this.pick(this.#select.value)));
    this.#text?.addEventListener("input", () => this.#soon(() => this.#read()));
    for (const field of FIELDS) this.#editor?.append(this.#field(field));
    const on = (id, work) => {
      const control = document.querySelector(id);
      control?.addEventListener("click", () => attempt(work, control));
    };
    on("#display-keep", () => this.keep(this.#name.value, this.profile));
    on("#display-delete", () => this.#delete());
    on("#profile-save", () => this.#export());
    const file = document.querySelector("#profile-file");
    file?.addEventListener("change", async () => {
      await attempt(() => this.#import(file.files[0]), file);
      file.value = "";
    });
  }

  /** What a request calls the display. */
  get told() {
    return this.name ?? this.profile;
  }

  get size() {
    return this.profile.panel.resolution_px;
  }

  get #first() {
    return this.#summaries.find(({ shipped }) => shipped).name;
  }

  get distance() {
    return this.profile.viewing.distance_mm;
  }

  /** Read the list and pick the one named, else that handed over, else the first shipped. */
  async start(name) {
    const handed = sessionStorage.getItem(HANDED_OVER);
    await this.#list();
    if (this.#summaries.some((summary) => summary.name === name)) await this.#load(name);
    else if (handed) this.take(JSON.parse(handed));
    else await this.#load(this.#first);
  }

  /** Take the display of a name, and tell. */
  async pick(name) {
    await this.#load(name);
    this.#changed();
  }

  /** Take a profile that the server need not know. */
  take(profile) {
    this.#take(profile, null);
  }

  /** Take it, and tell. */
  use(profile) {
    this.take(profile);
    this.#changed();
  }

  /** Keep a profile on the server under a name, and pick it. */
  async keep(name, profile) {
    const path = `v1/displays/${encodeURIComponent(name || " ")}`;
    const pattern = /^[a-z0-9][a-z0-9._-]{0,63}$/;
    if (!pattern.test(name)) {
      throw new Problem({
        detail: `'${name}'; give a name of small letters, digits, dots and dashes`,
        field: "name",
      });
    }
    await ask(path, { method: "PUT", json: profile });
    await this.#list();
    await this.pick(name);
    note(`Display ${name} is kept on the server.`);
  }

  async #list() {
    const found = await (await ask("v1/displays")).json();
    this.#summaries = found.displays;
    const group = (label, shipped) => {
      const made = document.createElement("optgroup");
      made.label = label;
      const those = this.#summaries.filter((summary) => summary.shipped === shipped);
      made.append(...those.map(({ name }) => new Option(name, name)));
      return made;
    };
    const groups = [group("Yours", false), group("Shipped", true)];
    this.#select.replaceChildren(...groups.filter((made) => made.children.length));
  }

  async #load(name) {
    const profile = await (await ask(`v1/displays/${encodeURIComponent(name)}`)).json();
    this.#take(profile, name);
  }

  #take(profile, name, { typed = false } = {}) {
    this.profile = profile;
    this.name = name;
    if (name) sessionStorage.removeItem(HANDED_OVER);
    else sessionStorage.setItem(HANDED_OVER, JSON.stringify(profile));
    this.#select.querySelector("option[data-edited]")?.remove();
    if (!name) {
      const edited = new Option(`edited: ${profile.name}`, "", true, true);
      edited.dataset.edited = "";
      edited.disabled = true;
      this.#select.prepend(edited);
    }
    this.#select.value = name ?? "";
    this.#tell();
    if (this.#text && !typed) this.#text.value = JSON.stringify(profile, null, 2);
    for (const input of this.#editor?.querySelectorAll("input") ?? []) {
      if (input === document.activeElement || this.#typed.has(input)) continue;
      const value = input.name === "lens.tilt_deg" ? tiltDeg(profile) : at(profile, input.name);
      input.value = Number(Number(value).toPrecision(10));
    }
    if (this.#name && !typed) this.#name.value = suggested(profile.name);
  }

  #tell() {
    const { viewing, provenance } = this.profile;
    const shipped = this.#summaries.find(({ name }) => name === this.name)?.shipped ?? true;
    const remove = document.querySelector("#display-delete");
    if (remove) remove.hidden = shipped;
    for (const link of document.querySelectorAll("nav a")) {
      link.search = this.name ? `?display=${this.name}` : "";
    }
    const facts = [
      `${[...this.size].join(" × ")} px`,
      `${viewing.views} views`,
      `${viewing.cone_deg}° cone`,
      `${viewing.distance_mm} mm away`,
    ];
    if (provenance?.template) facts.push("a model's figures, not a unit's calibration");
    this.#facts.textContent = facts.join(" · ");
  }

  #field([path, label, unit]) {
    const made = document.createElement("label");
    const input = document.createElement("input");
    Object.assign(input, { type: "number", step: "any", name: path, required: true });
    input.addEventListener("input", () => {
      this.#typed.add(input);
      this.#soon(() => this.#write());
    });
    const named = document.createElement("span");
    named.textContent = unit ? `${label} (${unit})` : label;
    made.append(named, input);
    return made;
  }

  /** Take the numbers that were typed over into the profile. */
  #write() {
    const profile = structuredClone(this.profile);
    for (const input of this.#typed) {
      const path = input.name;
      if (!input.checkValidity()) throw new Problem({ detail: "give a number", field: path });
      if (path === "lens.tilt_deg") delete profile.lens.drift;
      put(profile, path, input.valueAsNumber);
    }
    this.#typed.clear();
    this.use(profile);
  }

  /** Take the text over. */
  #read() {
    let profile;
    try {
      profile = JSON.parse(this.#text.value);
    } catch (error) {
      throw new Problem({ detail: `is not valid JSON: ${error.message}`, field: "profile" });
    }
    for (const [path] of FIELDS) {
      if (path !== "lens.tilt_deg" && at(profile, path) === undefined && path !== "lens.index") {
        throw new Problem({ detail: `${path} is missing`, field: "profile" });
      }
    }
    this.#take(profile, null, { typed: true });
    this.#changed();
  }

  #soon(work) {
    clearTimeout(this.#typing);
    this.#typing = setTimeout(() => attempt(work), TYPING_MS);
  }

  /** A file of this program or of another system. */
  async #import(file) {
    const text = await file.text();
    let given;
    try {
      given = JSON.parse(text);
    } catch {
      // Not JSON: 3D Global's, which the server reads when it is put.
      const name = suggested(file.name.replace(/\.[^.]*$/, ""));
      await ask(`v1/displays/${name}`, { method: "PUT", body: text });
      await this.#list();
      await this.pick(name);
      return;
    }
    const answer = await ask("v1/convert-display", {
      method: "POST",
      json: { display: given, to: "profile" },
    });
    this.use(JSON.parse((await answer.json()).text));
    note(`${file.name} is read; keep it under a name to find it again.`);
  }

  /** The profile as a file, in its own words or another system's. */
  async #export() {
    const to = document.querySelector("#profile-format").value;
    const answer = await ask("v1/convert-display", {
      method: "POST",
      json: { display: this.told, to },
    });
    const { text, lost } = await answer.json();
    const stem = suggested(this.profile.name);
    const name = to === "3d-global" ? `${stem}.ini` : `${stem}.json`;
    save(new Blob([text], { type: "application/json" }), name);
    const fields = lost.map(({ field }) => field).join(", ");
    note(fields ? `${name} cannot hold: ${fields}.` : `${name} holds all of the profile.`);
  }

  async #delete() {
    await ask(`v1/displays/${this.name}`, { method: "DELETE" });
    await this.#list();
    await this.pick(this.#first);
  }
}

/** A name that the server takes, from any. */
function suggested(name) {
  const plain = name.toLowerCase().replace(/[^a-z0-9._-]+/g, "-");
  return plain.replace(/^[^a-z0-9]+/, "").slice(0, 64) || "display";
}
