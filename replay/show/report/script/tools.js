// Elements, and what a page gives away: text for the clipboard, files of tables and pictures.
const SAVED_MS = 60000, NOTED_MS = 1600, SHARPNESS = 2;
const element = (name, text = "", properties = {}) =>
  Object.assign(document.createElement(name), { textContent: text, ...properties });
const button = (text, title, action) => {
  const made = element("button", text, { type: "button", title });
  made.addEventListener("click", action);
  return made;
};
const live = element("p", "", { className: "live" });
live.setAttribute("role", "status");
document.body.append(live);
let noted = 0;
const note = (text) => {
  live.textContent = text;
  clearTimeout(noted);
  noted = setTimeout(() => { live.textContent = ""; }, NOTED_MS);
};

const slug = (text) => text.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "").slice(0, 60);
const save = (name, content, type) => {
  const address = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  const link = element("a", "", { href: address, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), SAVED_MS);
  note(`Saved ${name}`);
};

const copy = async (text) => {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    // A page of file:// may not write the clipboard in every browser; a selection can always be copied.
    const field = element("textarea", text);
    document.body.append(field);
    field.select();
    document.execCommand("copy");
    field.remove();
  }
  note("Copied");
};

// A spreadsheet runs what begins like a formula, unless it is a number.
const cellText = (value) => {
  const text = String(value), formula = /^[\s\p{C}]*([=+\-@＝＋－＠]|[\t\r\n])/u.test(text) && isNaN(Number(text));
  return `"${(formula ? "'" : "") + text.replaceAll('"', '""')}"`;
};
const csv = (rows) => "\ufeff" + rows.map((row) => row.map(cellText).join(",")).join("\r\n") + "\r\n";

const STYLED = ["fill", "fill-opacity", "stroke", "stroke-width", "stroke-opacity", "stroke-dasharray", "opacity",
  "font-family", "font-size", "font-weight", "text-anchor", "vector-effect"];
const styledCopy = (source) => {
  const made = source.cloneNode(true), originals = [source, ...source.querySelectorAll("*")];
  [made, ...made.querySelectorAll("*")].forEach((target, k) => {
    const style = getComputedStyle(originals[k]);
    for (const name of STYLED) target.style.setProperty(name, style.getPropertyValue(name));
    for (const name of ["class", "role", "tabindex", "id"]) target.removeAttribute(name);
  });
  return made;
};
const SVG = "http://www.w3.org/2000/svg";
const shape = (name, attributes, text = "") => {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  return made;
};
const drawing = (width, height, parts) => {
  const made = shape("svg", { width, height, viewBox: `0 0 ${width} ${height}` });
  const paper = getComputedStyle(document.body).backgroundColor;
  made.append(shape("rect", { width, height, fill: paper }), ...parts);
  return made;
};
const chartDrawing = (chart) => {
  const [, , width, height] = chart.getAttribute("viewBox").split(" ").map(Number), inner = styledCopy(chart);
  inner.setAttribute("width", width);
  inner.setAttribute("height", height);
  return drawing(width, height, [inner]);
};
const svgText = (made) => new XMLSerializer().serializeToString(made);
const savePng = async (name, made) => {
  const picture = new Image(), canvas = element("canvas");
  picture.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svgText(made))}`;
  await picture.decode();
  canvas.width = SHARPNESS * made.getAttribute("width");
  canvas.height = SHARPNESS * made.getAttribute("height");
  canvas.getContext("2d").drawImage(picture, 0, 0, canvas.width, canvas.height);
  canvas.toBlob((content) => save(name, content), "image/png");
};
const saveButtons = (name, draw) => {
  const bar = element("span", "", { className: "tools" });
  bar.append(
    button("PNG", `Save ${name} as PNG`, () => savePng(`${slug(name)}.png`, draw())),
    button("SVG", `Save ${name} as SVG`, () => save(`${slug(name)}.svg`, svgText(draw()), "image/svg+xml")));
  return bar;
};
