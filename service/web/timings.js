// What a picture took, stage by stage, as the server says it and a clock here adds.

const STAGES = ["queue", "load", "upload", "compile", "frame", "read", "look", "map", "encode"];

/** Show spans in ms, and what the way here took of the whole, as a bar with its legend. */
export function showTimings(element, spans, wholeMs) {
  const known = STAGES.filter((name) => spans[name] >= 0.05).map((name) => [name, spans[name]]);
  const sum = known.reduce((ms, [, span]) => ms + span, 0);
  const all = [...known, ["transfer", Math.max(0, wholeMs - sum)]];
  const kept = known.length ? "" : ", kept by the server from before";
  const bar = document.createElement("div");
  bar.className = "bar";
  const legend = document.createElement("dl");
  for (const [name, ms] of all) {
    const part = document.createElement("i");
    part.dataset.stage = name;
    part.style.flexGrow = ms;
    bar.append(part);
    const term = document.createElement("dt");
    term.dataset.stage = name;
    term.textContent = name;
    const value = document.createElement("dd");
    value.textContent = readable(ms);
    const pair = document.createElement("div");
    pair.append(term, value);
    legend.append(pair);
  }
  const whole = document.createElement("p");
  whole.textContent = `${readable(wholeMs)} in all${kept}`;
  element.replaceChildren(whole, bar, legend);
}

function readable(ms) {
  return ms < 999.5 ? `${ms.toFixed(ms < 10 ? 1 : 0)} ms` : `${(ms / 1000).toFixed(2)} s`;
}
