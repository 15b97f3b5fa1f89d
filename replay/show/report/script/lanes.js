// The timeline: all lanes zoom and pan together, say what lies under the pointer, and lead to the card of a fault.
const NEAR_PX = 5, MOVED_PX = 4, SHORTEST_S = 0.05, STEP = 1.6, TICKS = 6;
const timeline = document.querySelector(".time[data-window]");
const tip = element("div", "", { className: "tip", hidden: true });
tip.setAttribute("role", "tooltip");
document.body.append(tip);
const tell = (lines, x, y) => {
  tip.replaceChildren(...lines.filter(Boolean).map((line, k) => element(k ? "span" : "b", line)));
  tip.hidden = !lines.length;
  if (tip.hidden) return;
  const right = innerWidth - tip.offsetWidth - 8, above = y - tip.offsetHeight - 14;
  tip.style.left = `${Math.max(8, Math.min(x + 14, right))}px`;
  tip.style.top = `${above > 8 ? above : y + 18}px`;
};
const hush = () => { tip.hidden = true; };

const lanes = { show: () => {}, mark: () => {} };
if (timeline) {
  const [first, length] = timeline.dataset.window.split(" ").map(Number), LANE = 20;
  const { pairs, contacts, reference } = JSON.parse(timeline.dataset.contacts);
  const rows = [...timeline.querySelectorAll(".lane")], ruler = timeline.querySelector(".ticks");
  const printed = [...ruler.childNodes], cursors = [];
  let start = 0, span = length, moved = 0, drag = null;
  for (const row of rows) {
    const cursor = shape("path", { class: "cursor" });
    row.append(cursor);
    cursors.push(cursor);
  }

  const seconds = (value) => `${value.toFixed(span < 2 ? 3 : span < 20 ? 2 : 1)} s`;
  const draw = () => {
    for (const row of rows) row.setAttribute("viewBox", `${start.toFixed(4)} 0 ${span.toFixed(4)} ${LANE}`);
    timeline.classList.toggle("zoomed", span < length);
    if (span >= length) return ruler.replaceChildren(...printed);
    const rough = span / TICKS, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 2.5, 5, 10].map((k) => k * power).find((value) => value >= rough * 0.999);
    const marks = [];
    for (let k = Math.ceil((first + start) / step); k * step <= first + start + span; k++) {
      const share = (k * step - first - start) / span, mark = element("span", `${+(k * step).toFixed(4)} s`);
      // At the edges a mark would be cut off.
      if (share < 0.03 || share > 0.97) continue;
      mark.style.left = `${100 * share}%`;
      marks.push(mark);
    }
    ruler.replaceChildren(...marks);
  };
  const view = (from, to) => {
    span = Math.min(length, Math.max(Math.min(SHORTEST_S, length), to));
    start = Math.min(length - span, Math.max(0, from));
    requestAnimationFrame(draw);
  };
  const zoom = (factor, at = start + span / 2) => {
    const next = Math.min(length, Math.max(Math.min(SHORTEST_S, length), span / factor));
    view(at - (at - start) * next / span, next);
    hush();
  };
  const secondAt = (row, x) => {
    const box = row.getBoundingClientRect();
    return start + (x - box.left) / box.width * span;
  };

  const RANK = { missed: 0, late: 1, false: 2 };
  const under = (row, x) => {
    const label = row.dataset.detector, at = first + secondAt(row, x);
    const reach = NEAR_PX * span / row.getBoundingClientRect().width;
    const away = (begin, end) => Math.max(0, begin - at, at - end);
    const faults = (faultsOf.get(label) ?? []).filter((fault) => away(fault.start, fault.end) <= reach);
    faults.sort((a, b) => away(a.start, a.end) - away(b.start, b.end) || RANK[a.key] - RANK[b.key]
      || (a.end - a.start) - (b.end - b.start));
    if (faults.length) return { fault: faults[0], others: faults.length - 1 };
    const known = contacts[label] ?? contacts[reference] ?? [];
    const near = known.map((contact, k) => ({ number: k + 1, contact, away: away(contact[1], contact[2]) }))
      .filter((hit) => hit.away <= reach).sort((a, b) => a.away - b.away);
    return near.length ? { contact: near[0], others: near.length - 1 } : null;
  };
  const sentences = (row, hit) => {
    const label = row.dataset.detector;
    const others = hit.others ? `${hit.others} more here: zoom in` : "";
    if (hit.fault) return [...hit.fault.lines, others];
    const { number, contact: [pair, begin, end, depth] } = hit.contact, of = reference || label;
    const source = !reference || label === reference ? `seen by ${label}` : `reported by ${label}`;
    const when = `${begin.toFixed(3)} to ${end.toFixed(3)} s`;
    return [`Contact ${number} of ${contacts[of]?.length ?? number}: ${pairs[pair]}`, `${when}, ${source}`, depth, others];
  };

  for (const row of rows) {
    row.addEventListener("pointermove", (event) => {
      if (drag) {
        moved = Math.max(moved, Math.abs(event.clientX - drag.x));
        if (moved > MOVED_PX) view(drag.start - (event.clientX - drag.x) / row.getBoundingClientRect().width * span, span);
        return hush();
      }
      const hit = under(row, event.clientX);
      row.classList.toggle("over", !!hit?.fault);
      tell(hit ? sentences(row, hit) : [], event.clientX, event.clientY);
    });
    row.addEventListener("pointerleave", hush);
    row.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      drag = { x: event.clientX, start };
      moved = 0;
      row.setPointerCapture(event.pointerId);
    });
    row.addEventListener("pointerup", () => { drag = null; });
    row.addEventListener("pointercancel", () => { drag = null; });
    row.addEventListener("click", (event) => {
      const hit = moved > MOVED_PX ? null : under(row, event.clientX);
      if (hit?.fault) location.hash = hit.fault.address;
    });
    row.addEventListener("dblclick", (event) => zoom(STEP ** 3, secondAt(row, event.clientX)));
    row.addEventListener("wheel", (event) => {
      const sideways = Math.abs(event.deltaX) > Math.abs(event.deltaY);
      if (event.ctrlKey || event.metaKey) zoom(STEP ** (-event.deltaY / 100), secondAt(row, event.clientX));
      else if (sideways && span < length) view(start + event.deltaX / row.clientWidth * span, span);
      else return;
      event.preventDefault();
    }, { passive: false });
  }

  const drawn = () => {
    const LABEL = 250, WIDTH = 960, ROW = 24, TOP = 30;
    const text = (x, y, content, weight = "400") => shape("text", {
      x, y, fill: getComputedStyle(document.body).color, "font-family": "system-ui, sans-serif", "font-size": 12,
      "font-weight": weight,
    }, content);
    const parts = [text(4, 18, "When", "600")];
    let x = 60;
    for (const item of timeline.querySelectorAll(".leg span")) {
      const fill = getComputedStyle(item.querySelector(".k")).backgroundColor;
      parts.push(shape("rect", { x, y: 8, width: 12, height: 12, rx: 3, fill }), text(x + 18, 18, item.textContent));
      x += 40 + 7 * item.textContent.length;
    }
    const visible = rows.filter((row) => row.checkVisibility?.() ?? true);
    visible.forEach((row, k) => {
      const lane = styledCopy(row), y = TOP + k * ROW, name = row.closest(".ln").querySelector(".nm").textContent;
      for (const [key, value] of Object.entries({ x: LABEL, y, width: WIDTH - LABEL - 10, height: ROW - 5 })) lane.setAttribute(key, value);
      parts.push(text(4, y + 14, name.length > 38 ? `${name.slice(0, 37)}…` : name), lane);
    });
    const bottom = TOP + visible.length * ROW + 14, box = ruler.getBoundingClientRect();
    for (const mark of ruler.children) {
      const share = (mark.getBoundingClientRect().left - box.left) / box.width;
      parts.push(text(LABEL + share * (WIDTH - LABEL - 10), bottom, mark.textContent));
    }
    return drawing(WIDTH, bottom + 10, parts);
  };
  const tools = saveButtons("timeline", drawn);
  tools.prepend(
    button("+", "Zoom in (key +); double-click or Ctrl and wheel zoom at the pointer", () => zoom(STEP)),
    button("−", "Zoom out (key -)", () => zoom(1 / STEP)),
    button("whole", "Show the whole session (key 0)", () => view(0, length)));
  timeline.querySelector(".th2").append(tools);

  lanes.zoom = zoom;
  lanes.whole = () => view(0, length);
  lanes.mark = (fault) => {
    if (!fault) return cursors.forEach((cursor) => cursor.removeAttribute("d"));
    const at = (fault.start + fault.end) / 2 - first;
    for (const cursor of cursors) cursor.setAttribute("d", `M${at.toFixed(3)} 0V${LANE}`);
    if (at < start || at > start + span) view(at - span / 2, span);
  };
}
