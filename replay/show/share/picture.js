"use strict";
// The picture beside the report: Rerun's viewer, fed from files of this folder and from nothing else.
{
  const box = document.getElementById("picture"), status = box.querySelector("[role=status]");
  const name = document.currentScript.dataset.recording;
  let viewer = null;

  // A page of file:// may load a script and nothing else: so a script holds the bytes, packed, as text.
  const load = (file) => new Promise((done, fail) => {
    const script = document.createElement("script");
    script.onload = done;
    script.onerror = () => fail(new Error(`${file} is missing`));
    script.src = file;
    document.head.append(script);
  });
  const bytes = (text) => {
    const letters = atob(text), found = new Uint8Array(letters.length);
    for (let k = 0; k < letters.length; k++) found[k] = letters.charCodeAt(k);
    return found;
  };
  const unpacked = async (file) => {
    await load(file);
    const stream = new Blob([bytes(window.packed)]).stream().pipeThrough(new DecompressionStream("gzip"));
    delete window.packed;
    return new Uint8Array(await new Response(stream).arrayBuffer());
  };

  // Recordings (field 3) with timelines (2), and nothing that is still loading (7): see viewer_control.proto.
  const fields = function* (data) {
    let at = 0;
    const number = () => {
      let value = 0, by = 1, one;
      do { one = data[at++]; value += (one & 127) * by; by *= 128; } while (one & 128);
      return value;
    };
    while (at < data.length) {
      const tag = number(), size = number();
      if (tag % 8 !== 2) continue;
      yield [tag >> 3, data.subarray(at, at + size)];
      at += size;
    }
  };
  const seen = () => {
    const state = [...fields(viewer.viewer_state())];
    const timed = (one) => [...fields(one)].some(([number]) => number === 2);
    const begun = state.some(([number, one]) => number === 3 && timed(one));
    return { begun, whole: begun && !state.some(([number]) => number === 7) };
  };
  const pause = (ms) => new Promise((done) => setTimeout(done, ms));

  const show = async (address) => {
    const message = window.moments?.[address];
    if (viewer && message) await viewer.viewer_control(bytes(message));
    if (viewer && message) box.dataset.shows = address;
  };
  const asked = () => {
    try { return decodeURIComponent(location.hash.slice(1)); } catch { return ""; }
  };

  const start = async () => {
    console.debug = () => {};  // thousands of lines about shaders
    const recording = await unpacked(`${name}.js`), program = await unpacked("viewer.js");
    // The viewer calls home, which the page forbids; without an answer it would say so in the console.
    window.fetch = async (what) =>
      new Response(String(what.url ?? what).endsWith("/run.rrd") ? recording : "{}");
    await load("re_viewer.js");
    await wasm_bindgen({ module_or_path: program });
    const panels = { top: "Hidden", blueprint: "Hidden", selection: "Hidden", time: "Collapsed" };
    viewer = new wasm_bindgen.WebHandle({
      url: ["https://run.invalid/run.rrd"], manifest_url: null, render_backend: "webgl", hide_welcome_screen: true,
      enable_history: false, notebook: false, persist: false, theme: "dark", panel_state_overrides: panels,
    });
    await viewer.start(box.querySelector("canvas"));
    box.viewer = viewer;
    for (const field of document.querySelectorAll("input")) field.setAttribute("aria-label", "Words for the picture");
    // The layout comes as soon as it can: the viewer's own has more to draw.
    for (let laid = false, now = seen(); !now.whole || !laid; now = seen()) {
      if (viewer.has_panicked()) throw new Error(viewer.panic_message());
      if (now.begun) await show("layout");
      laid = now.whole;
      await pause(50);
    }
    await show(window.moments[asked()] ? asked() : "");
    requestAnimationFrame(() => requestAnimationFrame(() => { box.dataset.state = "shown"; status.textContent = ""; }));
  };

  addEventListener("hashchange", () => show(asked()));
  // A link that was followed before still leads there when the cursor has moved on.
  addEventListener("click", ({ target }) => {
    const link = target.closest?.("a[href^='#']");
    if (!link) return;
    if (link.hash === location.hash) show(asked());
    // Where the picture is not beside the page, it must come into sight; after the browser has gone to the card.
    if (window.moments?.[decodeURIComponent(link.hash.slice(1))]) setTimeout(() => box.scrollIntoView({ block: "nearest" }));
  });
  box.querySelector("button").addEventListener("click", () => box.requestFullscreen());
  const failed = (error) => {
    box.dataset.state = "failed";
    status.textContent = `The picture cannot be shown here (${error.message ?? error}). The report is whole without it; `
      + `${name}.rrd opens in Rerun.`;
  };
  // The report first: it is painted before the viewer is unpacked.
  const begin = () => requestAnimationFrame(() => setTimeout(() => start().catch(failed)));
  const small = matchMedia("(max-width: 620px)").matches;
  const ask = () => {
    if ("asked" in box.dataset) return;
    box.dataset.asked = "";
    begin();
  };
  if (!small || location.hash === "#picture") addEventListener("load", ask);
  else for (const link of document.querySelectorAll(".open-picture a, dd a, .cb > p > a")) link.addEventListener("click", ask);
}
