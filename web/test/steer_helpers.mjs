// What tests of the steering page ask of it, whichever server is behind.
import assert from "node:assert/strict";

export function makeDriver(page) {
  const text = async (name) => (await page.textContent(`[data-test=${name}]`)).trim();
  const seconds = (words) => parseFloat(words.replace("−", "-"));
  const draw = () => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  return {
    text,
    click: (name) => page.click(`[data-test=${name}]`),
    frontier: async () => seconds(await text("frontier")),
    viewed: async () => seconds(await text("time")),
    branch: () => text("active-branch"),
    /// Waits for words in an element, whatever else it says.
    until: (name, words) =>
      page.waitForFunction(([n, w]) => [...document.querySelectorAll(`[data-test=${n}]`)].some((e) => e.textContent.includes(w)), [name, words]),
    untilFrontier: (t) => page.waitForFunction((time) => parseFloat(document.querySelector("[data-test=frontier]")?.textContent ?? "0") >= time, t),
    untilViewed: (t) => page.waitForFunction((time) => Math.abs(parseFloat(document.querySelector("[data-test=time]")?.textContent ?? "0") - time) < 2e-2, t),
    untilBranch: (name) => page.waitForFunction((n) => document.querySelector("[data-test=active-branch]")?.textContent === n, name),
    scrub: (time) =>
      page.locator("[data-test=slider]").evaluate((slider, t) => {
        slider.value = String(t);
        slider.dispatchEvent(new Event("input", { bubbles: true }));
      }, time),
    /// Two pictures later everything that was asked for is drawn.
    draw,
    settle: async () => {
      await draw();
      // and with all its pixels, when the picture rests
      await page.waitForFunction(() => {
        const canvas = document.querySelector("[data-test=canvas]");
        return canvas === null || canvas.hidden || canvas.width >= Math.floor(canvas.clientWidth * devicePixelRatio);
      });
    },
    async run() {
      await page.click("[data-test=run]");
      await page.waitForFunction(() => document.querySelector("[data-test=phase]").textContent.includes("Running"));
    },
    async pause() {
      if ((await text("phase")).includes("Running")) await page.click("[data-test=run]");
      await page.waitForFunction(() => !document.querySelector("[data-test=phase]").textContent.includes("Running"));
    },
    tab: (name) => page.click(`[data-test=tab-${name}]`),
    async submit(values) {
      for (const [name, value] of Object.entries(values)) await page.fill(`dialog input[name=${name}]`, String(value));
      await page.click("dialog [data-test=submit]");
    },
    /// An empty picture has few colours.
    async countColours() {
      const shot = (await page.locator("[data-test=canvas]").screenshot()).toString("base64");
      return page.evaluate(async (data) => {
        const image = new Image();
        image.src = `data:image/png;base64,${data}`;
        await image.decode();
        const small = document.createElement("canvas");
        small.width = small.height = 120;
        const ctx = small.getContext("2d", { willReadFrequently: true });
        ctx.drawImage(image, 0, 0, 120, 120);
        const bytes = ctx.getImageData(0, 0, 120, 120).data;
        const found = new Set();
        for (let i = 0; i < bytes.length; i += 4) found.add((bytes[i] >> 3) * 1024 + (bytes[i + 1] >> 3) * 32 + (bytes[i + 2] >> 3));
        return found.size;
      }, shot);
    },
  };
}

/// Bytes of a PNG or WebM that the page offers.
export async function takeDownload(page, click) {
  const [download] = await Promise.all([page.waitForEvent("download"), click()]);
  const stream = await download.createReadStream();
  const parts = [];
  for await (const part of stream) parts.push(part);
  return { name: download.suggestedFilename(), bytes: Buffer.concat(parts) };
}

export function assertPng(bytes) {
  assert.equal(bytes.subarray(1, 4).toString("latin1"), "PNG");
  const width = bytes.readUInt32BE(16), height = bytes.readUInt32BE(20);
  assert.ok(width > 300 && height > 200, `${width} x ${height}`);
  assert.ok(bytes.length > 10000, `${bytes.length} bytes are an empty picture`);
}

/// EBML begins with 1a 45 df a3; a second of moving pictures takes more than 20 kB.
export function assertWebm(bytes) {
  assert.equal(bytes.subarray(0, 4).toString("hex"), "1a45dfa3");
  assert.ok(bytes.includes("V_VP8") || bytes.includes("V_VP9"), "no video in it");
  assert.ok(bytes.length > 20000, `${bytes.length} bytes`);
}

/// No part of the page sticks out of the window, no button is cut off.
export const findOverflow = (page) =>
  page.evaluate(() =>
    [...document.querySelectorAll("button, select, .panel, .banner, h2")]
      .filter((e) => e.getClientRects().length > 0 && e.closest(".scroller, .tab-body, .tabs, .cube-holder, .markers") === null)
      .filter((e) => e.getBoundingClientRect().right > innerWidth + 0.5)
      .map((e) => `${e.className} ${e.textContent.slice(0, 20)}`));

/// Contrast of colours after WCAG 2.1, for functions that run in the page.
const putContrast = (page) =>
  page.evaluate(() => {
    const parse = (text) => {
      const n = text.match(/[\d.]+/g)?.map(Number) ?? [0, 0, 0];
      return { rgb: n.slice(0, 3), alpha: n[3] ?? 1 };
    };
    const luminance = (rgb) => {
      const [r, g, b] = rgb.map((v) => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4));
      return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const groundOf = (e) => {
      for (let at = e; at !== null; at = at.parentElement) {
        const c = parse(getComputedStyle(at).backgroundColor);
        if (c.alpha > 0.99) return c.rgb;
      }
      return [255, 255, 255];
    };
    const ratio = (a, b) => (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    globalThis.contrast_ = { parse, luminance, groundOf, ratio };
  });

/// What a reader with a keyboard, a screen reader or weak eyes would stumble over: WCAG 2.1, 1.1.1, 1.3.1, 1.4.11, 2.1.1,
/// 2.4.6, 4.1.1, 4.1.2.
export async function findAccessFaults(page) {
  await putContrast(page);
  return page.evaluate(() => {
    const faults = [];
    const isSeen = (e) => e.getClientRects().length > 0 && getComputedStyle(e).visibility !== "hidden";
    const all = (selector) => [...document.querySelectorAll(selector)].filter(isSeen);
    const short = (e) => e.outerHTML.slice(0, 90);
    const textOf = (ids) => ids.split(" ").map((id) => document.getElementById(id)?.textContent ?? "").join(" ");
    const nameOf = (e) =>
      [e.getAttribute("aria-label"), textOf(e.getAttribute("aria-labelledby") ?? ""), e.closest("label")?.textContent, e.id === "" ? "" : document.querySelector(`label[for="${e.id}"]`)?.textContent,
        e.matches("input, select, textarea") ? "" : e.textContent, e.getAttribute("title")].map((t) => (t ?? "").trim()).find((t) => t !== "") ?? "";
    for (const e of all("button, select, input, textarea, a[href], canvas, progress, summary, dialog[open], [role=img], [role=region], [role=group], [role=tab], [role=tabpanel], nav, aside"))
      if (nameOf(e) === "" && e.closest("[aria-hidden=true]") === null) faults.push(`no name: ${short(e)}`);
    const ids = all("[id]").map((e) => e.id);
    for (const id of new Set(ids.filter((id, k) => ids.indexOf(id) !== k))) faults.push(`id twice: ${id}`);
    for (const e of all("[aria-labelledby], [aria-controls], [aria-describedby]"))
      for (const key of ["aria-labelledby", "aria-controls", "aria-describedby"])
        for (const id of (e.getAttribute(key) ?? "").split(" ").filter((x) => x !== "")) if (document.getElementById(id) === null) faults.push(`${key} leads nowhere: ${short(e)}`);
    for (const e of all("[role=tab]")) {
      if (e.closest("[role=tablist]") === null) faults.push(`a tab outside a tablist: ${short(e)}`);
      if (!["true", "false"].includes(e.getAttribute("aria-selected") ?? "")) faults.push(`a tab that says not whether it is chosen: ${short(e)}`);
    }
    if (all("[role=tab]").length > 0 && all("[role=tab][aria-selected=true]").length !== 1) faults.push("not one tab is chosen");
    if (all("main").length !== 1) faults.push(`${all("main").length} main parts`);
    if (document.querySelectorAll("h1").length !== 1) faults.push(`${document.querySelectorAll("h1").length} headings of the first level`);
    let level = 1;
    for (const e of all("h1, h2, h3, h4")) {
      const here = Number(e.tagName[1]);
      if (here > level + 1) faults.push(`a heading of level ${here} below level ${level}: ${e.textContent.slice(0, 40)}`);
      level = here;
    }
    for (const e of all("th")) if (!e.hasAttribute("scope") && e.textContent.trim() !== "") faults.push(`a head of a table without scope: ${short(e)}`);
    for (const e of all("[tabindex]")) if (Number(e.getAttribute("tabindex")) > 0) faults.push(`an order of its own: ${short(e)}`);
    if (all(".plot").length !== all(".plot details.data-table").length) faults.push("a plot without a table");
    if (document.documentElement.lang === "") faults.push("no language");
    // edges of fields against what is around them
    const { parse, luminance, groundOf, ratio } = globalThis.contrast_;
    for (const e of all("input:not([type=checkbox]):not([type=range]):not([type=file]), select, textarea")) {
      if (e.matches(":disabled")) continue;
      const style = getComputedStyle(e);
      const around = luminance(groundOf(e.parentElement)), inside = luminance(groundOf(e));
      const edge = parseFloat(style.borderTopWidth) > 0 ? luminance(parse(style.borderTopColor).rgb) : around;
      if (Math.max(ratio(edge, around), ratio(inside, around)) < 3) faults.push(`an edge of ${Math.max(ratio(edge, around), ratio(inside, around)).toFixed(2)}: ${short(e)}`);
    }
    return faults;
  });
}

/// Controls that Tab does not come to, and those that do not show that it has.
export async function findUnreached(page) {
  const wanted = await page.evaluate(() => {
    let n = 0;
    for (const e of document.querySelectorAll("button, select, input, textarea, a[href], summary")) {
      const seen = e.getClientRects().length > 0 && getComputedStyle(e).visibility !== "hidden" && !e.matches(":disabled") && e.closest("[inert]") === null;
      if (seen) e.dataset.order = String(n++);
    }
    document.activeElement?.blur();
    return n;
  });
  await page.evaluate(() => {
    globalThis.reached_ = new Set();
    globalThis.plain_ = new Set();
  });
  for (let k = 0; k < wanted + 40; ++k) {
    await page.keyboard.press("Tab");
    const over = await page.evaluate(() => {
      const e = document.activeElement;
      if (e === null || e === document.body) return false; // behind the last one; the first one follows
      if (globalThis.reached_.has(e)) return true;
      globalThis.reached_.add(e);
      const rings = [e, e.parentElement].map((x) => getComputedStyle(x));
      if (!rings.some((s) => (s.outlineStyle !== "none" && parseFloat(s.outlineWidth) > 0) || s.boxShadow !== "none")) globalThis.plain_.add(e);
      return false;
    });
    if (over && k > 3) break;
  }
  return page.evaluate(() => [
    ...[...document.querySelectorAll("[data-order]")].filter((e) => !globalThis.reached_.has(e)).map((e) => `not reached: ${e.outerHTML.slice(0, 90)}`),
    ...[...globalThis.plain_].map((e) => `does not show the focus: ${e.outerHTML.slice(0, 90)}`),
  ]);
}

/// Texts whose contrast to their ground is below 4.5 (3 for large ones): WCAG 2.1, 1.4.3. What is switched off and what
/// lies on pictures is left out.
export async function findFaint(page) {
  await putContrast(page);
  return page.evaluate(() => {
    const { parse, luminance, groundOf, ratio: ratioOf } = globalThis.contrast_;
    const faint = new Set();
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
      const e = walker.currentNode.parentElement;
      if (walker.currentNode.textContent.trim() === "" || e.getClientRects().length === 0) continue;
      if (e.closest("svg, script, style, noscript, :disabled, [aria-hidden=true], .chip[aria-pressed=false]") !== null) continue;
      const style = getComputedStyle(e);
      const ratio = ratioOf(luminance(parse(style.color).rgb), luminance(groundOf(e)));
      const size = parseFloat(style.fontSize), large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
      if (ratio < (large ? 3 : 4.5)) faint.add(`${ratio.toFixed(2)} ${style.color} on ${groundOf(e)}: ${e.className} ${walker.currentNode.textContent.trim().slice(0, 30)}`);
    }
    return [...faint];
  });
}
