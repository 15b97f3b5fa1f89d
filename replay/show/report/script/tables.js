// Tables: sorted by a heading, filtered by words and choices, saved as CSV. Without a script every table is there, whole.
const FIRST_ROWS = 10, FEW_ROWS = 12;
const textOf = (cell) => cell?.textContent.trim() ?? "";
const numberOf = (cell) => parseFloat(textOf(cell).replace(/^[<>]/, "").replaceAll(",", ""));

for (const table of document.querySelectorAll(".wide table, table.rank")) {
  const body = table.tBodies[0], rows = [...body.rows], heads = [...table.tHead.rows[0].cells];
  const order = new Map(rows.map((row, k) => [row, k])), choices = new Map();
  // The reference has one wide cell instead of counts: it stays last.
  const whole = (row) => row.cells.length === heads.length;
  const ranking = table.matches(".rank"), frame = ranking ? table : table.parentElement;
  const name = ranking ? "ranking" : textOf(table.caption);
  const bar = element("div", "", { className: "choose" }), count = element("span");
  let words = "", all = ranking || rows.length <= FEW_ROWS;
  count.setAttribute("role", "status");
  const more = button("", "Show every row", () => { all = true; filter(); });
  more.className = "more";

  const filter = () => {
    const fits = (row) => textOf(row).toLowerCase().includes(words)
      && [...choices].every(([k, value]) => !value || textOf(row.cells[k]) === value);
    const matching = [...body.rows].filter(fits), visible = new Set(all ? matching : matching.slice(0, FIRST_ROWS));
    for (const row of rows) row.hidden = !visible.has(row);
    count.textContent = visible.size < rows.length ? `${visible.size} of ${rows.length} rows` : "";
    more.hidden = all || matching.length <= FIRST_ROWS;
    more.textContent = `Show all ${matching.length}`;
  };

  const NEXT = { none: "descending", descending: "ascending", ascending: "none" };
  const NEXT_OF_WORDS = { none: "ascending", ascending: "descending", descending: "none" };
  const sort = (k, head, worded) => {
    const to = (worded ? NEXT_OF_WORDS : NEXT)[head.ariaSort ?? "none"], sign = to === "ascending" ? 1 : -1;
    for (const other of heads) other.ariaSort = "none";
    head.ariaSort = to;
    const compare = (a, b) => {
      if (to === "none") return order.get(a) - order.get(b);
      if (whole(a) !== whole(b)) return whole(b) - whole(a);
      const first = a.cells[k], second = b.cells[k];
      if (worded) return sign * textOf(first).localeCompare(textOf(second)) || order.get(a) - order.get(b);
      const x = numberOf(first), y = numberOf(second);
      // What is no number stands last in either direction.
      return isNaN(x) - isNaN(y) || (sign * (x - y) || order.get(a) - order.get(b));
    };
    body.append(...rows.toSorted(compare));
    filter();
  };

  heads.forEach((head, k) => {
    const cells = rows.filter(whole).map((row) => row.cells[k]);
    const worded = head.className === "word" || cells.filter((cell) => isNaN(numberOf(cell))).length > cells.length / 2;
    const heading = button(head.textContent, "Sort", () => sort(k, head, worded));
    heading.title = `Sort by ${textOf(head)}`;
    head.replaceChildren(heading);
    head.ariaSort = "none";
    const values = [...new Set(cells.map(textOf))].sort();
    if (!worded || ranking || values.length < 2 || values.length > FEW_ROWS || values.length === rows.length) return;
    if (rows.length <= FEW_ROWS && !table.closest("[data-choose]")) return;
    const label = element("label", `${heading.textContent} `), select = element("select");
    for (const value of ["", ...values]) select.append(new Option(value || "all", value));
    select.addEventListener("change", () => { choices.set(k, select.value); filter(); });
    label.append(select);
    bar.append(label);
  });
  if (rows.length > FEW_ROWS && !ranking) {
    const label = element("label", "words "), field = element("input", "", { type: "search" });
    field.addEventListener("input", () => { words = field.value.toLowerCase(); filter(); });
    label.append(field);
    bar.prepend(label);
  }
  const lines = () => [heads.map(textOf), ...[...body.rows].filter((row) => !row.hidden).map((row) => {
    const cells = [...row.cells].flatMap((cell) => [textOf(cell), ...Array(cell.colSpan - 1).fill("")]);
    return cells.map((text) => text.replace(/\s+/g, " "));
  })];
  const saving = button("CSV", `Save ${name} as CSV`, () => save(`${slug(name)}.csv`, csv(lines()), "text/csv"));
  const tools = element("span", "", { className: "tools" });
  tools.append(saving);
  bar.append(count, tools);
  if (ranking) frame.previousElementSibling.append(tools);
  else frame.before(bar);
  frame.after(more);
  filter();
}
