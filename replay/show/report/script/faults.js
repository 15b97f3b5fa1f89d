// Faults: each has an address; keys and clicks lead from one to the next, choices leave out the others.
const faults = [...document.querySelectorAll(".fault")].map((node) => {
  const { pair = node.closest("[data-pair]").dataset.pair, span, contact } = node.dataset;
  const written = [...node.querySelectorAll("i")].map((part) => part.textContent);
  const { kind = written[0], cause = written[1], size = written[2] ?? "" } = node.dataset;
  const key = node.querySelector(".k").classList[1];
  const [start, end] = span.split(" ").map(Number), detector = node.closest("[data-detector]").dataset.detector;
  const title = node.querySelector("h3, a").textContent.replace(/:.*/s, "");
  const lines = [`${title} of ${detector}: ${pair}`, `${start.toFixed(3)} to ${end.toFixed(3)} s, ${kind}`,
    `cause: ${cause}`, size, contact && `contact ${contact} of the reference`];
  return { node, address: node.id, pair, cause, key, kind, size, start, end, detector, title, lines };
});
const faultsOf = Map.groupBy?.(faults, (fault) => fault.detector)
  ?? faults.reduce((map, fault) => map.set(fault.detector, [...map.get(fault.detector) ?? [], fault]), new Map());
const byAddress = new Map(faults.map((fault) => [fault.address, fault]));
const inOrder = [...faultsOf.values()].flatMap((group) => group.toSorted((a, b) => a.start - b.start));
const sections = [...document.querySelectorAll(".faults")];
const chosen = { pair: "", detector: "", cause: "", words: "" };
const fields = {}, tally = element("span");
let matching = new Set(faults), current = null;

const matches = (fault) => ["pair", "detector", "cause"].every((name) => !chosen[name] || fault[name] === chosen[name])
  && (!chosen.words || `${fault.lines.join(" ")}`.toLowerCase().includes(chosen.words));
const choose = () => {
  matching = new Set(faults.filter(matches));
  const every = matching.size === faults.length;
  for (const fault of faults) if (fault.node.matches("li")) fault.node.hidden = !matching.has(fault);
  const present = (node) => every || faults.some((fault) => matching.has(fault) && node.contains(fault.node));
  for (const card of document.querySelectorAll(".card.fault")) {
    const own = matching.has(byAddress.get(card.id)), lines = [...card.querySelectorAll("li.fault")];
    const others = lines.some((line) => !line.hidden);
    card.hidden = !own && !others;
    card.classList.toggle("context", !own && others);
    if (!every && !own && others) card.querySelector("details:has(.fault)").open = true;
  }
  for (const section of sections) {
    const fold = section.closest("details");
    if (!fold) continue;
    fold.hidden = !present(section);
    if (!every && !fold.hidden) fold.open = true;
  }
  tally.textContent = `${matching.size.toLocaleString("en")} of ${faults.length.toLocaleString("en")} faults${faultsOf.size > 1 ? " of all detectors" : ""}`;
};
const clear = () => {
  for (const [name, field] of Object.entries(fields)) chosen[name] = field.value = "";
  choose();
};
const leave = () => {
  current?.node.classList.remove("current");
  current = null;
  lanes.mark(null);
};

const open = (fault) => {
  if (!matching.has(fault)) clear();
  for (let node = fault.node.parentElement; node; node = node.parentElement) if (node.matches("details")) node.open = true;
  leave();
  current = fault;
  fault.node.classList.add("current");
  fault.node.scrollIntoView({ block: "nearest" });
  lanes.mark(fault);
};
const asked = () => {
  try { return byAddress.get(decodeURIComponent(location.hash.slice(1))); } catch { return undefined; }
};
const follow = () => {
  const fault = asked();
  if (fault && fault !== current) open(fault);
};
const step = (by) => {
  const list = inOrder.filter((fault) => matching.has(fault));
  if (!list.length) return note("No fault matches the choices");
  const at = list.indexOf(current), next = list[at < 0 ? (by > 0 ? 0 : list.length - 1) : at + by];
  if (!next) return note(by > 0 ? "That was the last fault" : "That was the first fault");
  open(next);
  location.replace(`#${encodeURIComponent(next.address)}`);
};

if (faults.length) {
  const bar = element("div", "", { className: "choose", id: "choose" });
  const field = element("input", "", { type: "search", placeholder: "body, cause, number" });
  const select = (name) => {
    const made = element("select"), values = [...new Set(faults.map((fault) => fault[name]))].sort();
    for (const value of ["", ...values]) made.append(new Option(value || "all", value));
    return made;
  };
  const all = { pair: select("pair"), detector: select("detector"), cause: select("cause"), words: field };
  for (const [name, input] of Object.entries(all)) {
    // A choice between one value is none.
    if (input.options && input.options.length < 3) continue;
    const label = element("label", `${name} `);
    label.append(input);
    bar.append(label);
    fields[name] = input;
    input.addEventListener(input === field ? "input" : "change", () => {
      chosen[name] = input.value.toLowerCase === undefined || input !== field ? input.value : input.value.toLowerCase();
      choose();
    });
  }
  tally.setAttribute("role", "status");
  const head = ["detector", "number", "bodies", "from s", "to s", "kind", "cause", "size"];
  const table = () => [head, ...inOrder.filter((fault) => matching.has(fault)).map((fault) => [
    fault.detector, fault.title, fault.pair, fault.start, fault.end, fault.kind, fault.cause, fault.size])];
  const tools = element("span", "", { className: "tools" });
  tools.append(button("Clear", "Show all faults", clear),
    button("CSV", "Save these faults as CSV", () => save("faults.csv", csv(table()), "text/csv")),
    button("?", "Keys", () => help.show()));
  bar.append(tally, tools);
  sections[0].before(bar);
  choose();
  addEventListener("hashchange", follow);
  follow();
}

const detectorOf = (label) => sections.find((section) => section.dataset.detector === label);
for (const dot of document.querySelectorAll("circle.dot")) {
  const name = dot.dataset.name;
  dot.addEventListener("pointermove", (event) => tell([name, dot.dataset.about], event.clientX, event.clientY));
  dot.addEventListener("pointerleave", hush);
  const section = detectorOf(dot.dataset.detector);
  if (!section) continue;
  dot.classList.add("leads");
  dot.addEventListener("click", () => {
    const fault = section.querySelector(".fault");
    if (fault) location.hash = fault.id;
  });
}
for (const chart of document.querySelectorAll("svg.sc")) {
  const heading = chart.parentElement.querySelector("h2, figcaption");
  const tools = saveButtons(heading?.textContent ?? "chart", () => chartDrawing(chart));
  if (heading?.matches("h2")) heading.append(tools); else chart.after(tools);
}
for (const still of document.querySelectorAll(".hero .still")) {
  const tools = saveButtons("picture", () => chartDrawing(still));
  still.after(tools);
}
for (const command of document.querySelectorAll("main code")) {
  const made = button("Copy", "Copy this command", () => copy(command.textContent));
  made.className = "copy";
  command.after(made);
}

const help = element("dialog", "", { id: "keys" });
const KEYS = [["j  k", "next, previous fault"], ["/", "search the faults"], ["+  -  0", "zoom the timeline in, out, whole"],
  ["?", "these keys"], ["Esc", "close, or show all faults"]];
help.append(element("h2", "Keys"), ...KEYS.map(([keys, text]) => {
  const line = element("p");
  line.append(element("kbd", keys), ` ${text}`);
  return line;
}), element("p", "Timeline: drag to pan, double-click or Ctrl and wheel to zoom, click a fault to open its card."));
help.append(button("Close", "Close", () => help.close()));
document.body.append(help);

const ACTIONS = {
  j: () => step(1), k: () => step(-1), "/": () => { fields.words?.focus(); fields.words?.scrollIntoView({ block: "nearest" }); },
  "?": () => help.open ? help.close() : help.show(), "+": () => lanes.zoom?.(STEP), "=": () => lanes.zoom?.(STEP),
  "-": () => lanes.zoom?.(1 / STEP), 0: () => lanes.whole?.(), Escape: () => help.open ? help.close() : faults.length && (clear(), leave()),
};
addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const typing = event.target.closest?.("input, select, textarea, canvas, [contenteditable]");
  if (typing && event.key !== "Escape") return;
  const action = ACTIONS[event.key];
  if (!action || (help.open && !["?", "Escape"].includes(event.key))) return;
  if (event.key === "Escape") event.target.blur?.(); else event.preventDefault();
  action();
});
