// The page at /: a scene on a display's virtual panel, orbited and looked at from any place.

import { ask, Newest, save, timings } from "./api.js";
import { Displays } from "./displays.js";
import { decode } from "./exact.js";
import { EyePlan } from "./eye-plan.js";
import { attempt, complain, forgive, note } from "./notices.js";
import { Outlet } from "./outlet.js";
import { Picture } from "./picture.js";
import { Scenes } from "./scenes.js";
import { showTimings } from "./timings.js";

const DEGREES_A_PIXEL = 0.4;
const STEP_DEG = 5;
const EYE_STEPS = 24; // of an arrow key, across the stage
const SETTLE_MS = 350; // of rest before the panel image is made
const ROUGH_FROM_MS = 300; // panel images that take longer wait until the hand rests
const SWEEP_EYES = 9;
const SWEEP_OF_CONE = 0.9;
const ROUGH_PIXELS = 480;

const $ = (selector) => document.querySelector(selector);
const stage = $("#stage");
const picture = new Picture($("#picture"), $("#play"));
const options = $("#options");
const chosen = (name) => $(`[name=${name}]:checked`).value;

const place = { yaw: 0, pitch: 0, eye: null };
let frameMs = 0; // what the last panel image took
let last = null; // what the picture on the stage was asked for by

// --- what is asked for ---------------------------------------------------------------------------

/** The options of the form that are not as the server has them, and where the window stands. */
function settings() {
  const given = { yaw: place.yaw, pitch: place.pitch };
  for (const input of options.elements) {
    if (!input.name || input.value === "" || input.value === input.dataset.default) continue;
    const number = input.type === "number" || input.type === "range";
    given[input.name] = number ? input.valueAsNumber : input.value;
  }
  if (given.exposure !== undefined) given.exposure = `${given.exposure}EV`;
  return given;
}

const things = () => ({ scene: scenes.id, display: displays.told });

/** A request for a kind of picture: with the options that it takes. */
function body(kind, extra = {}) {
  const given = { picture: kind, ...things(), ...settings(), ...extra };
  const woven = kind === "eia" || kind === "look";
  for (const name of woven ? [] : ["aa", "weave"]) delete given[name];
  if (kind !== "look") delete given.crosstalk;
  if (kind === "quilt") delete given.views;
  return given;
}

const render = (json, accept, signal) =>
  ask("v1/render", { method: "POST", json, accept, signal });

/** Where the eyes stand: the part of a request that says so. */
function eyes() {
  const mode = chosen("eyes");
  if (mode === "sweep") {
    const edge = (SWEEP_OF_CONE * displays.profile.viewing.cone_deg) / 2;
    return { sweep: `${-edge}:${edge}:${SWEEP_EYES}` };
  }
  return { eye: place.eye.map((mm) => mm.toFixed(2)).join(","), stereo: mode === "stereo" };
}

const eyeDeg = () => (Math.atan2(place.eye[0], place.eye[2]) * 180) / Math.PI;

/** One upright view in the eye's direction: what can be had at once where panel images take long. */
function roughBody() {
  const [width, height] = displays.profile.panel.size_mm;
  const scale = ROUGH_PIXELS / Math.max(width, height);
  const size = [width, height].map((mm) => Math.max(1, Math.round(mm * scale)));
  const angle = Math.max(-80, Math.min(80, eyeDeg()));
  return body("view", { angle, view_size: size.join("x") });
}

// --- newest wins ---------------------------------------------------------------------------------

const pictures = new Newest(
  async (wanted, signal) => {
    await (wanted.rough ? showRough : showPanel)(signal);
    forgive();
  },
  {
    // Drafts are so quick that calling each one off would leave nothing to see.
    stale: (running, wanted) => (running.rough ? !wanted.rough : running.frame !== wanted.frame),
    busy: (is) => stage.setAttribute("aria-busy", is),
    failed: (error) => {
      said("No new picture.");
      complain(error, () => refresh());
    },
  },
);

let settling;

/** Show what has changed; rough: a hand is still moving. */
function refresh(rough = false) {
  clearTimeout(settling);
  plan.show(place.eye, displays.profile, chosen("eyes"));
  const slow = frameMs > ROUGH_FROM_MS && chosen("drag") === "camera";
  pictures.want({ rough: rough && slow, frame: JSON.stringify([settings(), things()]) });
  if (rough) settling = setTimeout(() => refresh(), SETTLE_MS);
  else remember();
}

async function showRough(signal) {
  const response = await render(roughBody(), "image/jpeg", signal);
  const image = await decode(await response.blob());
  last = null;
  picture.show(image);
  said("Draft: a single view. Rest, and the panel image follows.");
}

async function showPanel(signal) {
  const started = performance.now();
  const mode = chosen("eyes");
  const wanted = body("look", eyes());
  const told = JSON.stringify([wanted, mode]);
  if (told === last) return;
  said("The panel image is being made…");
  const accept = mode === "sweep" ? "image/jpeg" : "image/png";
  const response = await render(wanted, accept, signal);
  const image = await decode(await response.blob());
  last = told;
  const spans = timings(response);
  frameMs = spans.frame ?? frameMs;
  showTimings($("#timings"), spans, performance.now() - started);
  if (mode === "sweep") picture.showSweep(image, SWEEP_EYES);
  else if (mode === "stereo") picture.showPair(image, $("#pair").value);
  else picture.show(image);
  const warnings = response.headers.get("LFD-Warnings");
  if (warnings) note(warnings);
  said(where(mode));
  outlet.update();
  scenes.look().catch((error) => complain(error));
}

function where(mode) {
  if (mode === "sweep") return `Virtual panel, ${SWEEP_EYES} eyes across the cone.`;
  const off = Math.abs(eyeDeg()).toFixed(1);
  const degrees = off === "0.0" ? "straight ahead" : `${off}° to the ${eyeDeg() < 0 ? "left" : "right"}`;
  const outside = Math.abs(eyeDeg()) > displays.profile.viewing.cone_deg / 2;
  const who = mode === "stereo" ? "two eyes" : "an eye";
  return `Virtual panel, ${who} ${degrees}${outside ? ", outside the cone: views repeat" : ""}.`;
}

function said(text) {
  $("#said").textContent = text;
}

// --- hands ---------------------------------------------------------------------------------------

/** Move what is being dragged by so many pixels: the scene follows, or the eye. */
function drag(dx, dy, eye, element) {
  if (eye) {
    const mmAPixel = displays.distance / element.clientWidth;
    place.eye[0] += dx * mmAPixel;
    place.eye[1] -= dy * mmAPixel;
  } else {
    place.yaw = turned(place.yaw - dx * DEGREES_A_PIXEL);
    place.pitch = Math.max(-90, Math.min(90, place.pitch + dy * DEGREES_A_PIXEL));
  }
}

const turned = (degrees) => Number((((((degrees + 180) % 360) + 360) % 360) - 180).toFixed(2));

function handle(element) {
  element.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    element.setPointerCapture(event.pointerId);
    element.classList.add("held");
    let [x, y] = [event.clientX, event.clientY];
    const moved = (now) => {
      drag(now.clientX - x, now.clientY - y, now.shiftKey || chosen("drag") === "eye", element);
      [x, y] = [now.clientX, now.clientY];
      refresh(true);
    };
    const ended = () => {
      element.classList.remove("held");
      element.removeEventListener("pointermove", moved);
      refresh();
    };
    element.addEventListener("pointermove", moved);
    element.addEventListener("lostpointercapture", ended, { once: true });
  });
  element.addEventListener("keydown", (event) => {
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const arrow = arrows[event.key];
    if (arrow) {
      const eye = event.shiftKey || chosen("drag") === "eye";
      const pixels = eye ? element.clientWidth / EYE_STEPS : STEP_DEG / DEGREES_A_PIXEL;
      drag(pixels * arrow[0], pixels * arrow[1], eye, element);
      refresh(true);
    } else if (event.key === "Home") {
      reset();
    } else if (event.key === "f" && !outlet.isFull) {
      full();
    } else if (event.key === "Escape" && !outlet.isFull) {
      pictures.stop();
    } else {
      return;
    }
    event.preventDefault();
  });
  element.addEventListener(
    "wheel",
    (event) => {
      if (!event.shiftKey && chosen("drag") !== "eye") return;
      event.preventDefault();
      const delta = event.deltaY || event.deltaX;
      const z = place.eye[2] * Math.exp(delta / 1000);
      place.eye[2] = Math.max(0.25 * displays.distance, Math.min(4 * displays.distance, z));
      refresh(true);
    },
    { passive: false },
  );
}

function reset() {
  Object.assign(place, { yaw: 0, pitch: 0, eye: [0, 0, displays.distance] });
  refresh();
}

function full() {
  return outlet.enter(displays.size);
}

// --- files ---------------------------------------------------------------------------------------

const ENDINGS = {
  "image/png": "png",
  "image/webp": "webp",
  "image/x-exr": "exr",
  "application/octet-stream": "raw",
  "application/zip": "zip",
};

function downloads() {
  for (const control of document.querySelectorAll("[data-picture]")) {
    control.addEventListener("click", () =>
      attempt(async () => {
        const kind = control.dataset.picture;
        const accept = control.dataset.accept ?? $("#eia-format").value;
        const response = await render(body(kind), accept);
        const ending = ENDINGS[response.headers.get("Content-Type")] ?? "bin";
        const name = `${scenes.stem}-${displays.profile.name}-${kind}.${ending}`;
        save(await response.blob(), name);
        note(`${name} is made.`);
      }, control),
    );
  }
}

/** The address of the panel image, for other programs; none while the display has no name. */
function address() {
  if (!displays.name) return null;
  const { picture: _, scene, ...given } = body("eia");
  const query = new URLSearchParams(Object.entries(given).filter(([, value]) => value !== 0));
  return new URL(`v1/scenes/${encodeURIComponent(scene)}/eia?${query}`, location.href);
}

/** Keep what is shown in the page's own address, and in the line for shells. */
function remember() {
  const query = new URLSearchParams({ scene: scenes.id });
  if (displays.name) query.set("display", displays.name);
  if (place.yaw) query.set("yaw", place.yaw);
  if (place.pitch) query.set("pitch", place.pitch);
  history.replaceState(null, "", `?${query}`);
  const link = address();
  const key = sessionStorage.getItem("lfd-key") ? ` -H "X-API-Key: $LFD_API_KEY"` : "";
  $("#shell").textContent = link
    ? `curl -o eia.png${key} '${link}'`
    : "Keep the display under a name first.";
}

// --- start ---------------------------------------------------------------------------------------

const plan = new EyePlan($("#plan"));
const outlet = new Outlet(async (signal) => (await render(body("eia"), "image/png", signal)).blob());
const displays = new Displays(() => {
  place.eye = [0, 0, displays.distance];
  shape();
  refresh();
});
const scenes = new Scenes(() => {
  Object.assign(place, { yaw: 0, pitch: 0 });
  refresh();
});

/** Give the stage the panel's shape. */
function shape() {
  const [width, height] = displays.profile.panel.size_mm;
  stage.style.setProperty("--aspect", width / height);
}

function modes() {
  const mode = chosen("eyes");
  $("#pair").hidden = mode !== "stereo";
  $("#play").hidden = mode !== "sweep";
  stage.classList.toggle("pair", mode === "stereo" && $("#pair").value !== "anaglyph");
}

async function start() {
  const given = new URLSearchParams(location.search);
  const ready = await (await ask("readyz")).json();
  $("#device").textContent = ready.renderers[0] ?? "no device";
  if (ready.software) frameMs = Infinity; // until it has shown better
  await displays.start(given.get("display"));
  await scenes.start(given.get("scene") ?? "builtin:gallery?triangles=100000");
  Object.assign(place, {
    yaw: Number(given.get("yaw")) || 0,
    pitch: Number(given.get("pitch")) || 0,
    eye: [0, 0, displays.distance],
  });
  shape();
  handle(stage);
  handle(outlet.element);
  downloads();
  for (const radio of document.querySelectorAll("[name=eyes], #pair")) {
    radio.addEventListener("change", () => {
      modes();
      last = null;
      refresh();
    });
  }
  $("#reset").addEventListener("click", reset);
  $("#enter").addEventListener("click", full);
  $("#window").addEventListener("click", () => outlet.open());
  $("#copy").addEventListener("click", () =>
    attempt(async () => {
      await navigator.clipboard.writeText($("#shell").textContent);
      note("Copied.");
    }),
  );
  options.addEventListener("input", ({ target }) => {
    const output = target.closest("label").querySelector("output");
    if (output) output.value = target.value;
    refresh(true);
  });
  options.addEventListener("submit", (event) => event.preventDefault());
  modes();
  refresh();
}

attempt(start);
