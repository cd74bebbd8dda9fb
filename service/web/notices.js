// What the page says: problems, with the field at fault marked, and short notes.

const region = document.querySelector("#problem");
const NOTE_MS = 8000;
let marked = null;
let passing;

/** Show a problem until the next picture, and mark the input that its field names. */
export function complain(error, again) {
  forgive();
  region.replaceChildren();
  if (error.field) {
    const field = document.createElement("code");
    field.textContent = error.field;
    region.append(field, " ");
  }
  region.append(withoutField(error));
  if (again) region.append(" ", button("Try again", again));
  region.append(" ", button("Dismiss", forgive));
  region.hidden = false;
  const input = inputOf(error);
  if (input) {
    marked = input;
    input.setAttribute("aria-invalid", "true");
    input.setAttribute("aria-describedby", "problem");
    input.closest("details")?.setAttribute("open", "");
  }
  if (!error.status) console.error(error);
}

/** Take the problem away. */
export function forgive() {
  region.hidden = true;
  marked?.removeAttribute("aria-invalid");
  marked?.removeAttribute("aria-describedby");
  marked = null;
}

/** Run something a person asked for: its button is busy meanwhile, and its problems are shown. */
export async function attempt(work, control) {
  control?.setAttribute("aria-busy", "true");
  try {
    const result = await work();
    forgive();
    return result;
  } catch (error) {
    complain(error);
    return undefined;
  } finally {
    control?.removeAttribute("aria-busy");
  }
}

/** Say something in passing. */
export function note(text) {
  const line = document.querySelector("#note");
  line.textContent = text;
  clearTimeout(passing);
  passing = setTimeout(() => (line.textContent = ""), NOTE_MS);
}

/** The input of the field at fault, or of the field of it that the message begins with. */
function inputOf(error) {
  const names = [withoutField(error).split(" ")[0], error.field ?? ""];
  return names
    .map((name) => name && document.querySelector(`[name="${CSS.escape(name)}"]`))
    .find(Boolean);
}

function withoutField(error) {
  const prefix = `${error.field}: `;
  return error.message.startsWith(prefix) ? error.message.slice(prefix.length) : error.message;
}

function button(text, action) {
  const made = document.createElement("button");
  made.type = "button";
  made.className = "quiet";
  made.textContent = text;
  made.addEventListener("click", () => {
    forgive();
    action();
  });
  return made;
}
