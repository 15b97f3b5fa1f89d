"use strict";
// Sorting by a heading, filtering by words and choices; without a script every table is there, whole.
{
  const SHOWN = 10, FEW = 12;
  const made = (name, words, about = {}) => Object.assign(document.createElement(name), { textContent: words }, about);
  const text = (cell) => cell.textContent.trim();
  const number = (cell) => parseFloat(text(cell).replace(/^</, ""));

  for (const table of document.querySelectorAll(".wide table")) {
    const body = table.tBodies[0], rows = [...body.rows], heads = [...table.tHead.rows[0].cells];
    const order = new Map(rows.map((row, k) => [row, k])), chosen = new Map();
    const bar = made("div", "", { className: "choose" }), status = made("span", "", { role: "status" });
    let words = "", all = rows.length <= FEW;
    const more = made("button", "", { type: "button" });

    const show = () => {
      const fits = (row) => text(row).toLowerCase().includes(words)
        && [...chosen].every(([k, value]) => !value || text(row.cells[k]) === value);
      const found = [...body.rows].filter(fits), seen = new Set(all ? found : found.slice(0, SHOWN));
      for (const row of rows) row.hidden = !seen.has(row);
      status.textContent = `${seen.size} of ${rows.length} rows`;
      more.hidden = all || found.length <= SHOWN;
      more.textContent = `Show all ${found.length}`;
    };

    const sort = (k, head) => {
      const next = { none: "descending", descending: "ascending", ascending: "none" };
      const word = head.className === "word";
      if (word) Object.assign(next, { none: "ascending", ascending: "descending", descending: "none" });
      const to = next[head.ariaSort ?? "none"], sign = to === "ascending" ? 1 : -1;
      for (const one of heads) one.ariaSort = "none";
      head.ariaSort = to;
      const by = (a, b) => {
        if (to === "none") return order.get(a) - order.get(b);
        const one = a.cells[k], two = b.cells[k];
        if (word) return sign * text(one).localeCompare(text(two)) || order.get(a) - order.get(b);
        const x = number(one), y = number(two);
        // What is no number stands last in either direction.
        return isNaN(x) - isNaN(y) || (sign * (x - y) || order.get(a) - order.get(b));
      };
      body.append(...rows.toSorted(by));
      show();
    };

    heads.forEach((head, k) => {
      const button = made("button", head.textContent, { type: "button" });
      button.addEventListener("click", () => sort(k, head));
      head.replaceChildren(button);
      head.ariaSort = "none";
      const values = [...new Set(rows.map((row) => text(row.cells[k])))].sort();
      if (head.className !== "word" || values.length < 2 || values.length > FEW || values.length === rows.length) return;
      const label = made("label", `${button.textContent} `), select = made("select", "");
      for (const value of ["", ...values]) select.append(new Option(value || "all", value));
      select.addEventListener("change", () => { chosen.set(k, select.value); show(); });
      label.append(select);
      bar.append(label);
    });
    if (rows.length > FEW) {
      const label = made("label", "words "), field = made("input", "", { type: "search" });
      field.addEventListener("input", () => { words = field.value.toLowerCase(); show(); });
      label.append(field);
      bar.prepend(label);
    }
    more.addEventListener("click", () => { all = true; show(); });
    if (bar.children.length) bar.append(status);
    table.parentElement.before(bar);
    table.parentElement.after(more);
    show();
  }
}
