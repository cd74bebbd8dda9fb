// Scenes: one is picked from the server's, or dropped and uploaded.

import { ask, Problem } from "./api.js";
import { attempt, note } from "./notices.js";

const BUILT_IN = "builtin:";
const MODEL = /\.(glb|gltf|obj)$/i;

export class Scenes {
  #select = document.querySelector("#scene");
  #triangles = document.querySelector("#triangles");
  #facts = document.querySelector("#scene-facts");
  #delete = document.querySelector("#scene-delete");
  #camera = document.querySelector("#camera");
  #looked = null; // the scene that the facts are of
  #changed;

  /** changed: is called whenever another scene is to be shown. */
  constructor(changed) {
    this.#changed = changed;
    for (const control of [this.#select, this.#triangles]) {
      control.addEventListener("change", () => this.#picked());
    }
    this.#delete.addEventListener("click", () => attempt(() => this.#remove(), this.#delete));
    for (const input of document.querySelectorAll("#model-files, #model-folder")) {
      input.addEventListener("change", async () => {
        const files = [...input.files].map((file) => [file.webkitRelativePath || file.name, file]);
        await this.upload(files);
        input.value = "";
      });
    }
    this.#dropping();
  }

  /** What a request calls the scene. */
  get id() {
    const id = this.#select.value;
    const count = this.#triangles.value;
    return this.isBuiltIn && count ? `${id}?triangles=${count}` : id;
  }

  get isBuiltIn() {
    return this.#select.value.startsWith(BUILT_IN);
  }

  /** A file name for pictures of the scene. */
  get stem() {
    const label = this.#select.selectedOptions[0].textContent;
    return label.replace(MODEL, "").replace(/[^\w.-]+/g, "-");
  }

  /** Read the list and pick the scene of an id, or the gallery. */
  async start(id) {
    await this.#list();
    const [name, count] = (id ?? "").split("?triangles=");
    const known = [...this.#select.options].some((option) => option.value === name);
    this.#select.value = known ? name : `${BUILT_IN}gallery`;
    if (known && name.startsWith(BUILT_IN)) this.#count(count ?? "");
    this.#show();
  }

  /** Choose a number of triangles, be it none of those on offer. */
  #count(number) {
    const offered = [...this.#triangles.options].some((option) => option.value === number);
    if (!offered) this.#triangles.add(new Option(Number(number).toLocaleString("en"), number));
    this.#triangles.value = number;
  }

  /** Read what the scene holds, once a picture has shown that it can be read. */
  async look() {
    const { id } = this;
    if (id === this.#looked) return;
    this.#looked = id;
    const found = await (await ask(`v1/scenes/${encodeURIComponent(id)}`)).json();
    if (id !== this.id) return;
    const count = (number, what) => `${number.toLocaleString("en")} ${what}${number === 1 ? "" : "s"}`;
    this.#facts.textContent = [
      count(found.triangles, "triangle"),
      count(found.materials, "material"),
      count(found.images, "picture"),
      ...found.warnings,
    ].join(" · ");
    const chosen = this.#camera.value;
    const cameras = found.cameras.map((name) => new Option(name, name));
    this.#camera.replaceChildren(new Option("Framed", ""), ...cameras);
    this.#camera.value = found.cameras.includes(chosen) ? chosen : "";
    this.#camera.parentElement.hidden = !cameras.length;
  }

  /** Upload files, pairs of relative name and File, and show the scene that they are. */
  async upload(files) {
    const models = files.filter(([name]) => MODEL.test(name));
    await attempt(async () => {
      if (!files.length) throw new Problem({ detail: "there are none", field: "files" });
      const main = models.length > 1 ? await choose(models.map(([name]) => name)) : models[0]?.[0];
      if (models.length > 1 && !main) return;
      note(`Uploading ${main ?? files[0][0]}…`);
      document.body.classList.add("uploading");
      try {
        const scene = await (await ask("v1/scenes", form(files, main))).json();
        await this.#list();
        this.#select.value = scene.id;
        note(`${scene.main} is on the server.`);
        this.#picked();
      } finally {
        document.body.classList.remove("uploading");
      }
    });
  }

  #picked() {
    this.#show();
    this.#camera.value = "";
    this.#changed();
  }

  #show() {
    this.#delete.hidden = this.isBuiltIn;
    this.#triangles.parentElement.hidden = !this.isBuiltIn;
    this.#facts.textContent = "";
    this.#looked = null;
  }

  async #list() {
    const chosen = this.#select.value;
    const { scenes } = await (await ask("v1/scenes")).json();
    const group = (label, builtIn) => {
      const made = document.createElement("optgroup");
      made.label = label;
      const those = scenes.filter(({ id }) => id.startsWith(BUILT_IN) === builtIn);
      made.append(...those.map(({ id, main }) => new Option(main.replace(BUILT_IN, ""), id)));
      return made;
    };
    const groups = [group("Yours", false), group("Built in", true)];
    this.#select.replaceChildren(...groups.filter((made) => made.children.length));
    if (scenes.some(({ id }) => id === chosen)) this.#select.value = chosen;
  }

  async #remove() {
    await ask(`v1/scenes/${this.id}`, { method: "DELETE" });
    await this.#list();
    this.#select.value = `${BUILT_IN}gallery`;
    this.#picked();
  }

  #dropping() {
    const over = (on) => document.body.classList.toggle("dropping", on);
    for (const kind of ["dragenter", "dragover"]) {
      addEventListener(kind, (event) => {
        if (!event.dataTransfer.types.includes("Files")) return;
        event.preventDefault();
        over(true);
      });
    }
    addEventListener("dragleave", (event) => {
      if (!event.relatedTarget) over(false);
    });
    addEventListener("drop", async (event) => {
      if (!event.dataTransfer.types.includes("Files")) return;
      event.preventDefault();
      over(false);
      const entries = [...event.dataTransfer.items].map((item) => item.webkitGetAsEntry?.());
      const files = entries.every(Boolean)
        ? (await Promise.all(entries.map((entry) => filesOf(entry)))).flat()
        : [...event.dataTransfer.files].map((file) => [file.name, file]);
      await this.upload(files);
    });
  }
}

/** All files of what was dropped, each with its place in it. */
async function filesOf(entry, folder = "") {
  const name = folder + entry.name;
  if (entry.isFile) {
    return [[name, await new Promise((resolve, reject) => entry.file(resolve, reject))]];
  }
  const reader = entry.createReader();
  const found = [];
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (!some.length) break; // it gives a hundred at a time
    for (const inner of some) found.push(...(await filesOf(inner, `${name}/`)));
  }
  return found;
}

/** The request that uploads files, which lie relative to the folder that all of them are in. */
function form(files, main) {
  const shared = files.map(([name]) => name.split("/").slice(0, -1)).reduce(common);
  const relative = (name) => name.split("/").slice(shared.length).join("/");
  const body = new FormData();
  for (const [name, file] of files) body.append("files", file, relative(name));
  if (main) body.append("main", relative(main));
  return { method: "POST", body };
}

function common(one, other) {
  const differs = one.findIndex((part, index) => part !== other[index]);
  return differs < 0 ? one : one.slice(0, differs);
}

/** Let a person say which of several files is the scene; null for none of them. */
function choose(names) {
  return new Promise((resolve) => {
    const dialog = document.createElement("dialog");
    dialog.className = "card";
    dialog.innerHTML = `
      <form method="dialog">
        <h2>Which file is the scene?</h2>
        <label>File <select></select></label>
        <div class="row">
          <button class="primary" value="take">Take it</button><button value="">None</button>
        </div>
      </form>`;
    const select = dialog.querySelector("select");
    select.append(...names.map((name) => new Option(name)));
    dialog.addEventListener("close", () => {
      dialog.remove();
      resolve(dialog.returnValue === "take" ? select.value : null);
    });
    document.body.append(dialog);
    dialog.showModal();
  });
}
