// The page at /calibrate: a display's numbers by eye, with a pattern that follows the sliders.

import { ask, Newest, save } from "./api.js";
import { Displays, tiltDeg } from "./displays.js";
import { decode, ExactCanvas } from "./exact.js";
import { attempt, complain, forgive, note } from "./notices.js";
import { Outlet } from "./outlet.js";

const $ = (selector) => document.querySelector(selector);

// In the order in which they are found.
const NUMBERS = [
  {
    name: "lens_count",
    label: "Lens count",
    step: 0.01,
    range: 5,
    of: ({ lens }) => lens.lens_count,
    task: "With one eye before the middle, at the viewing distance, count the fringes across a row and change the count by as many. The wrong sign makes more of them. Go on until a row is evenly lit.",
  },
  {
    name: "tilt_deg",
    label: "Tilt (°), + leans left",
    step: 0.005,
    range: 1,
    of: tiltDeg,
    task: "Look up and down a column. Change the tilt until it is evenly lit, too.",
  },
  {
    name: "center",
    label: "Center (lenses)",
    step: 0.005,
    range: 0.5,
    of: ({ lens }) => lens.center,
    task: "The panel is of one brightness. Change the center until it is brightest: half a lens is from brightest to darkest.",
  },
];

const adjust = (json, signal) => ask("v1/adjust-display", { method: "POST", json, signal });

let changes = {}; // numbers that the profile is yet to take
let current = NUMBERS[0];

const pattern = new Newest(
  async (_, signal) => {
    const taken = changes;
    if (Object.keys(taken).length) {
      const adjusted = await adjust({ display: displays.told, ...taken }, signal);
      if (changes === taken) changes = {};
      displays.take(await adjusted.json());
      fill();
    }
    await show(signal);
    forgive();
    outlet.caption = caption();
    outlet.update();
  },
  {
    stale: () => false, // the pattern follows a moving hand
    busy: (is) => $("#stage").setAttribute("aria-busy", is),
    failed: (error) => {
      changes = {};
      fill();
      complain(error);
    },
  },
);

function asked() {
  const kind = $("#kind").value;
  const width = Math.max(1, Math.floor(displays.profile.viewing.views / 6));
  const grating = kind === "grating" ? { width, colour: $("#colour").value } : {};
  return { display: displays.told, kind, ...grating };
}

const make = async (json, signal) =>
  (await ask("v1/pattern", { method: "POST", json, accept: "image/png", signal })).blob();

const pixels = new ExactCanvas($("#pixels"), () => {});

async function show(signal) {
  const through = $("#through").value;
  $("#pixels").hidden = Boolean(through);
  $("#seen").hidden = !through;
  const image = await decode(await make({ ...asked(), ...(through && { through }) }, signal));
  if (through) {
    const seen = $("#seen");
    [seen.width, seen.height] = [image.width, image.height];
    seen.getContext("2d").drawImage(image, 0, 0);
    $("#said").textContent = `What an eye before ${through} sees of it.`;
  } else {
    pixels.show(image);
    $("#said").textContent = "The panel's own pixels, from its top left corner.";
  }
}

const caption = () => `${current.label} ${current.of(displays.profile).toFixed(4)}.`;

// --- sliders -------------------------------------------------------------------------------------

function slider(number, index) {
  const { name, label, step, task } = number;
  const made = document.createElement("fieldset");
  made.innerHTML = `
    <legend></legend>
    <p class="note"></p>
    <div class="row">
      <input type="range"><input type="number">
    </div>`;
  made.querySelector("legend").textContent = `${index + 1}. ${label}`;
  made.querySelector("p").textContent = task;
  const [range, exact] = made.querySelectorAll("input");
  range.setAttribute("aria-label", label);
  exact.setAttribute("aria-label", `${label}, as a number`);
  Object.assign(range, { step, id: `range-${name}` });
  Object.assign(exact, { step: "any", id: `exact-${name}`, name });
  for (const input of [range, exact]) {
    input.addEventListener("input", () => {
      if (!Number.isNaN(input.valueAsNumber)) change(number, input.valueAsNumber);
    });
    input.addEventListener("focus", () => (current = number));
  }
  return made;
}

function change(number, value) {
  current = number;
  changes = { ...changes, [number.name]: value };
  for (const input of inputs(number)) {
    if (input !== document.activeElement) input.value = Number(value.toPrecision(7));
  }
  pattern.want(null);
}

const inputs = ({ name }) => [$(`#range-${name}`), $(`#exact-${name}`)];

/** Let the sliders reach about the profile's numbers. */
function reach() {
  for (const number of NUMBERS) {
    const { step, range } = number;
    const middle = Math.round(number.of(displays.profile) / step) * step;
    const [slide] = inputs(number);
    Object.assign(slide, { min: middle - range, max: middle + range });
  }
  fill();
}

/** Show the profile's numbers, but for one that is being typed. */
function fill() {
  for (const number of NUMBERS) {
    if (number.name in changes) continue;
    for (const input of inputs(number)) {
      const value = number.of(displays.profile);
      if (input !== document.activeElement) input.value = Number(value.toPrecision(7));
    }
  }
}

// --- start ---------------------------------------------------------------------------------------

function keys(event) {
  const number = NUMBERS[Number(event.key) - 1];
  const sides = { ArrowLeft: -1, ArrowRight: 1, ArrowDown: -1, ArrowUp: 1 };
  const side = sides[event.key];
  if (number) {
    current = number;
    outlet.caption = caption();
    outlet.update();
  } else if (side) {
    const value = changes[current.name] ?? current.of(displays.profile);
    change(current, value + side * current.step * (event.shiftKey ? 10 : 1));
  } else if (event.key === "p") {
    const kind = $("#kind");
    kind.selectedIndex = (kind.selectedIndex + 1) % kind.options.length;
    picked();
  } else {
    return;
  }
  event.preventDefault();
}

function picked() {
  $("#colour").disabled = $("#kind").value !== "grating";
  pattern.want(null);
}

/** Displays whose panel has as many pixels. */
async function rehearsals() {
  const { displays: all } = await (await ask("v1/displays")).json();
  const same = all.filter(({ resolution_px: size }) => `${size}` === `${displays.size}`);
  const select = $("#through");
  const chosen = select.value;
  const options = same.map(({ name }) => new Option(name, name));
  select.replaceChildren(new Option("nothing: show the panel's pixels", ""), ...options);
  select.value = same.some(({ name }) => name === chosen) ? chosen : "";
}

const outlet = new Outlet((signal) => make(asked(), signal));
const displays = new Displays(() => {
  changes = {};
  shape();
  reach();
  pattern.want(null);
  attempt(rehearsals);
});

function shape() {
  const [width, height] = displays.profile.panel.size_mm;
  $("#stage").style.setProperty("--aspect", width / height);
}

const finished = () => adjust({ display: displays.told, name: $("#unit-name").value });

async function start() {
  await displays.start(new URLSearchParams(location.search).get("display"));
  $("#sliders").append(...NUMBERS.map(slider));
  $("#unit-name").value = `${displays.profile.name}-by-eye`.slice(0, 64);
  shape();
  reach();
  await rehearsals();
  for (const select of [$("#kind"), $("#colour"), $("#through")]) {
    select.addEventListener("change", picked);
  }
  $("#enter").addEventListener("click", () => outlet.enter(displays.size));
  $("#window").addEventListener("click", () => outlet.open());
  outlet.element.addEventListener("keydown", keys);
  $("#keep").addEventListener("click", (event) =>
    attempt(async () => displays.keep($("#unit-name").value, await (await finished()).json()), event.target),
  );
  $("#download").addEventListener("click", (event) =>
    attempt(async () => {
      const name = `${$("#unit-name").value}.json`;
      save(await (await finished()).blob(), name);
      note(`${name} is made.`);
    }, event.target),
  );
  picked();
}

attempt(start);
