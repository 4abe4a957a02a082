// The built page in a browser. TOPPLE_REPORT=FILE tests a report of a real run instead of the made-up one.
import assert from "node:assert/strict";
import { mkdir, readFile } from "node:fs/promises";
import { resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { isFittedAt, openPage } from "./browser.mjs";
import { after, before, describe, it } from "./harness.mjs";
import { load } from "./load.mjs";
import { hostile, makeEmpty, makeSynthetic, writePage } from "./synthetic.mjs";

const { prettify } = await load("units.ts");
const out = fileURLToPath(new URL(`out/report${process.env.TOPPLE_REPORT === undefined ? "" : "_run"}/`, import.meta.url));
const given = process.env.TOPPLE_REPORT;
const report = given === undefined ? `${out}synthetic.html` : resolve(given);

const clock = async (page) => Number((await page.textContent("[data-test=time]")).replace("−", "-").replace(" s", ""));
const scrub = (page, time) =>
  page.locator("[data-test=slider]").evaluate((slider, t) => {
    slider.value = String(t);
    slider.dispatchEvent(new Event("input", { bubbles: true }));
  }, time);
const picture = (page) => page.locator("[data-test=canvas]").screenshot();
const settle = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

async function readData(path) {
  const text = await readFile(path, "utf8");
  const open = '<script type="application/json" id="topple-data">';
  const begin = text.indexOf(open) + open.length;
  return JSON.parse(text.slice(begin, text.indexOf("</script", begin)));
}

/// The tenth of the run in which the parts move most: its frames, and the longest way of a part in it [m].
function findMotion(data) {
  const S = data.time.length, B = data.bodies.length;
  const bytes = Buffer.from(data.position, "base64");
  const value = (frame, k) => bytes.readFloatLE(4 * (frame * B * 3 + k));
  const count = Math.max(1, Math.floor(S / 10));
  let best = { first: 0, last: S - 1, way: 0 };
  for (let first = 0; first + count < S; first += count)
    for (let k = 0; k < 3 * B; ++k) {
      const way = Math.abs(value(first + count, k) - value(first, k));
      if (way > best.way) best = { first, last: first + count, way };
    }
  return best;
}
const visible = 0.1; // a part that moved this far [m] changes the picture

/// Nothing sticks out of the window or lies on something else in the same row.
const findOverflow = (page) =>
  page.evaluate(() => {
    const wide = [...document.querySelectorAll(".panel, .verdict, .ending, .toolbar > *, .transport > *")].filter(
      (e) => e.getClientRects().length > 0 && e.getBoundingClientRect().right > innerWidth + 0.5,
    );
    const panels = [...document.querySelectorAll(".panel, .verdict, .ending")].map((e) => [e.className, e.getBoundingClientRect()]);
    const overlaps = [];
    for (const [a, r] of panels)
      for (const [b, s] of panels)
        if (r !== s && r.left < s.right - 1 && s.left < r.right - 1 && r.top < s.bottom - 1 && s.top < r.bottom - 1) overlaps.push(`${a} on ${b}`);
    return [...wide.map((e) => `${e.className} is too wide`), ...overlaps];
  });

describe("report page", () => {
  let browser, page, data, motion;
  before(async () => {
    await mkdir(out, { recursive: true });
    if (given === undefined) await writePage(makeSynthetic(300), report);
    data = await readData(report);
    motion = findMotion(data);
    browser = await openPage(report);
    page = browser.page;
  });
  after(() => browser?.close());

  it("shows title, verdict and ending", async () => {
    assert.equal(await page.textContent("h1"), data.provenance.title || "Untitled plan");
    const verdict = data.findings.find((f) => f.id === "mechanism") ?? data.findings[0];
    if (verdict !== undefined) assert.equal(await page.textContent("[data-test=verdict]"), prettify(verdict.text));
    assert.ok((await page.textContent(".ending")).includes(prettify(data.ending.text)));
    // The worst beside the verdict, so that a good mechanism does not hide a broken limit.
    const open = data.findings.filter((f) => f !== verdict && f.status === "bad").slice(0, 4);
    const shown = await page.$$eval("[data-test=open-finding]", (list) => list.map((e) => e.textContent));
    open.forEach((f, i) => assert.ok(shown[i].includes(f.title) && shown[i].includes("Problem"), f.id));
    // nor its colour: the headline has that of the worst limit
    const colour = open.some((f) => /^(criterion|clearance|vibration)\./.test(f.id)) ? "bad" : undefined;
    const headline = (await page.getAttribute("section.verdict", "class")).split(" ")[1];
    if (colour !== undefined) assert.equal(headline, colour);
    if (given === undefined) {
      assert.equal(verdict.status, "good");
      assert.equal(colour, "bad");
      assert.match(await page.textContent(".verdict .verdict-title"), /Mechanism\s*OK\s*Limits\s*Problem/);
    }
    await page.screenshot({ path: `${out}start.png` });
  });

  it("lists the findings in their order, each with a word beside its colour", async () => {
    const ids = await page.$$eval(".finding", (list) => list.map((e) => e.getAttribute("data-finding")));
    // What is not modelled has a panel of its own.
    const listed = data.findings.filter((f) => f.id !== "not_modelled" || data.not_modelled.length === 0);
    assert.deepEqual(ids, listed.map((f) => f.id));
    const texts = await page.$$eval(".finding", (list) => list.map((e) => e.textContent));
    const words = { info: "Note", good: "OK", warning: "Caution", bad: "Problem" };
    listed.forEach((f, i) => {
      assert.ok(texts[i].includes(prettify(f.text)), f.id);
      assert.ok(texts[i].includes(words[f.status]), f.id);
    });
    for (const text of data.not_modelled) assert.ok((await page.textContent(".not-modelled")).includes(text));
  });

  it("draws the building", async () => {
    const colours = await page.evaluate(async () => {
      const canvas = document.querySelector("[data-test=canvas]");
      await new Promise((done) => requestAnimationFrame(done));
      return [canvas.width, canvas.height];
    });
    assert.ok(colours[0] > 300 && colours[1] > 300);
    const stills = await page.$$eval(".still-row img", (list) => list.map((i) => i.src));
    assert.ok(stills.length >= 2);
    assert.ok(stills.every((src) => src.startsWith("data:image/png;base64,") && src.length > 3000));
    if (motion.way > visible) assert.notEqual(stills[0], stills[stills.length - 1], "the first and the last still are the same");
  });

  it("plays", async () => {
    await page.keyboard.press("Home");
    const span = data.time[motion.last] - data.time[motion.first];
    await scrub(page, data.time[motion.first]);
    // So slowly that the end is not reached in between.
    await page.selectOption(".transport select", span > 0.5 ? "0.5" : "0.1");
    await settle(page);
    const begin = await clock(page);
    const still = await picture(page);
    await page.click("[data-test=play]");
    await page.waitForFunction((t) => parseFloat(document.querySelector("[data-test=time]").textContent) > t, begin + 0.8 * span);
    await page.keyboard.press("Space");
    const paused = await clock(page);
    assert.ok(paused > begin);
    if (motion.way > visible) assert.notDeepEqual(await picture(page), still, "the picture did not change");
    await page.waitForTimeout(200);
    assert.equal(await clock(page), paused, "space did not pause");
  });

  it("plays at the chosen speed and stops at the end", async () => {
    const end = data.time[data.time.length - 1];
    await scrub(page, end - 0.2);
    await page.selectOption(".transport select", "4");
    await page.click("[data-test=play]");
    await page.waitForFunction(() => document.querySelector("[data-test=play]").getAttribute("aria-label") === "Play");
    assert.ok(Math.abs((await clock(page)) - end) < 6e-4); // the clock shows milliseconds
    await page.selectOption(".transport select", "1");
    await page.screenshot({ path: `${out}end.png` });
  });

  it("steps by keys", async () => {
    await page.locator("h1").click();
    await page.keyboard.press("Home");
    assert.ok(Math.abs((await clock(page)) - data.time[0]) < 6e-4);
    await page.keyboard.press("ArrowRight");
    assert.ok(Math.abs((await clock(page)) - data.time[1]) < 6e-4);
    await page.keyboard.press("ArrowLeft");
    assert.ok(Math.abs((await clock(page)) - data.time[0]) < 6e-4);
    await page.keyboard.press("Shift+ArrowRight");
    const shown = await page.$$eval("[data-event-time]", (list) => list.map((e) => Number(e.getAttribute("data-event-time"))));
    const next = Math.min(...shown.filter((t) => t > data.time[0] + 1e-6), data.time[data.time.length - 1]);
    assert.ok(Math.abs((await clock(page)) - next) < 6e-4);
    await page.keyboard.press("End");
    assert.ok(Math.abs((await clock(page)) - data.time[data.time.length - 1]) < 6e-4);
    await page.keyboard.press("?");
    await page.waitForSelector("dialog.help", { state: "visible" });
    await page.keyboard.press("Escape");
    await page.waitForSelector("dialog.help", { state: "hidden" });
  });

  it("fits the picture again after it was turned", async () => {
    await page.getByRole("button", { name: "Top", exact: true }).click();
    await settle(page);
    const fitted = await picture(page);
    const box = await page.locator("[data-test=canvas]").boundingBox();
    await page.mouse.move(box.x + 200, box.y + 200);
    await page.mouse.wheel(0, -600);
    await settle(page);
    await page.mouse.move(box.x - 10, box.y - 60);
    await settle(page);
    assert.notDeepEqual(await picture(page), fitted, "the wheel did not zoom");
    await page.keyboard.press("f");
    await settle(page);
    assert.deepEqual(await picture(page), fitted);
    await page.getByRole("button", { name: "Oblique", exact: true }).click();
  });

  it("shows the member under the pointer and the one asked for by name", async () => {
    await page.keyboard.press("Home");
    const box = await page.locator("[data-test=canvas]").boundingBox();
    let found = false;
    for (let i = 0; i < 48 && !found; ++i) {
      await page.mouse.click(box.x + (box.width * (1 + (i % 8))) / 9, box.y + (box.height * (1 + Math.floor(i / 8))) / 7);
      found = (await page.locator("[data-test=inspector]").count()) > 0;
    }
    assert.ok(found, "no click met a member");
    const picked = await page.textContent("[data-test=member-name]");
    assert.ok(data.bodies.some((b) => b.name === picked));

    const zone = data.zones.find((z) => data.bodies.some((b) => b.name === z.member));
    if (zone !== undefined) {
      await page.fill("[data-test=member-search]", zone.member);
      assert.equal(await page.textContent("[data-test=member-name]"), zone.member);
      const text = await page.textContent("[data-test=inspector]");
      assert.ok(text.includes(zone.name) && text.includes(zone.subsystem) && text.includes("utilisation"));
    }
    for (const colouring of ["state", "utilisation"]) {
      await page.selectOption("[data-test=colouring]", colouring);
      await settle(page);
      await page.screenshot({ path: `${out}${colouring}.png` });
    }
    await page.selectOption("[data-test=colouring]", "kind");
    await page.keyboard.press("Escape");
  });

  it("gives each plot a table of its values in readable units", async () => {
    const plots = page.locator(".plot");
    const count = await plots.count();
    assert.equal(count, new Set(data.series.map((s) => `${s.group} ${s.unit}`)).size);
    for (let i = 0; i < count; ++i) {
      await plots.nth(i).locator("summary").click();
      if (data.time.length > 0) await plots.nth(i).locator("tbody tr").first().waitFor();
      assert.equal(await plots.nth(i).locator("tbody tr").count(), data.time.length);
    }
    const angle = data.series.find((s) => s.unit === "rad");
    if (angle !== undefined) {
      // The angle ends where the upper block no longer holds together.
      const share = data.series.find((s) => s.id === "connected_share")?.value ?? [];
      const apart = share.findIndex((v) => v < 0.5);
      const last = (apart < 0 ? angle.value.length : apart) - 1;
      const cells = page.locator(`[data-plot=${angle.group}] tbody td:nth-child(2)`);
      const cell = await cells.nth(last).textContent();
      if (apart >= 0) assert.equal(await cells.nth(apart).textContent(), "–");
      const degrees = (angle.value[last] * 180) / Math.PI;
      assert.ok(Math.abs(Number(cell.replace("−", "-")) - degrees) <= 1e-3 * Math.abs(degrees) + 1e-3); // four digits are shown
    }
    for (let i = 0; i < count; ++i) await plots.nth(i).locator("summary").click();
  });

  it("jumps to a time in a plot", async () => {
    const over = page.locator(".plot .u-over").first();
    await over.scrollIntoViewIfNeeded();
    const box = await over.boundingBox();
    await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
    const begin = data.time[0], end = data.time[data.time.length - 1];
    // One pixel of the plot is the accuracy of a click.
    assert.ok(Math.abs((await clock(page)) - (begin + end) / 2) < (2 * (end - begin)) / box.width);
  });

  it("jumps to an event of the list", async () => {
    const event = page.locator("[data-event-time]").last();
    if ((await event.count()) === 0) return;
    await event.click();
    const time = Number(await event.getAttribute("data-event-time"));
    const end = data.time[data.time.length - 1];
    assert.ok(Math.abs((await clock(page)) - Math.min(time, end)) < 6e-4);
  });

  it("says where it comes from", async () => {
    const details = await page.textContent(".details");
    const { provenance: p, counts } = data;
    for (const text of [p.plan_sha256, p.program_version, p.seed, p.engine, p.machine, String(counts.bodies), String(counts.force_elements)])
      assert.ok(details.includes(text), text);
    for (const v of data.plan_values) assert.ok((await page.textContent(".plan-values")).includes(prettify(v.value)));
  });

  it("keeps the building in a narrower picture, unless the camera was moved", async () => {
    await page.getByRole("button", { name: "Fit", exact: true }).click();
    assert.ok(await isFittedAt(page, 400));
    await page.setViewportSize({ width: 1440, height: 900 });
    await page.locator("[data-test=canvas]").hover();
    await page.mouse.wheel(0, -300);
    assert.ok(!(await isFittedAt(page, 400)), "the eye was moved");
    await page.setViewportSize({ width: 1440, height: 900 });
  });

  it("fits wide, narrow, dark and printed", async () => {
    await page.evaluate(() => scrollTo(0, 0));
    for (const [name, width, height] of [["wide", 1440, 900], ["large", 1920, 1080], ["narrow", 900, 1000], ["phone", 420, 800]]) {
      await page.setViewportSize({ width, height });
      await settle(page);
      assert.deepEqual(await findOverflow(page), [], name);
      await page.screenshot({ path: `${out}${name}.png`, fullPage: true });
    }
    await page.setViewportSize({ width: 1440, height: 900 });
    await page.emulateMedia({ colorScheme: "dark" });
    await settle(page);
    await page.screenshot({ path: `${out}dark.png`, fullPage: true });
    await page.emulateMedia({ colorScheme: "light" });
    const pdf = await page.pdf({ path: `${out}print.pdf`, preferCSSPageSize: true, printBackground: true });
    assert.ok(pdf.length > 20000);
  });

  it("reports no error and asks the network for nothing", () => assert.deepEqual(browser.problems, []));
});

describe("unusual reports", () => {
  before(() => mkdir(out, { recursive: true }));

  async function open(name, data, options) {
    const path = `${out}${name}.html`;
    await writePage(data, path);
    const browser = await openPage(path, options);
    await browser.page.screenshot({ path: `${out}${name}.png`, fullPage: true });
    return browser;
  }

  it("shows an empty record", async () => {
    const browser = await open("empty", makeEmpty());
    assert.equal(await browser.page.textContent("h1"), "Untitled plan");
    assert.equal(await browser.page.textContent("[data-test=ending]"), "Calculation failed");
    for (const key of ["Space", "ArrowRight", "Shift+ArrowRight", "End", "f"]) await browser.page.keyboard.press(key);
    assert.equal(await clock(browser.page), 0);
    assert.deepEqual(browser.problems, []);
    await browser.close();
  });

  it("draws no parts where nobody knows where they are", async () => {
    const data = makeSynthetic(2);
    const none = { ...data, time: [], position: "", orientation: "", zone_state: "", zone_utilisation: "", series: data.series.map((s) => ({ ...s, value: [] })) };
    const pictures = [];
    for (const [name, bodies] of [["no-frames", data.bodies], ["no-parts", data.bodies.map((b) => (b.shapes.some((s) => s.material === "ground") ? b : { ...b, shapes: [] }))]]) {
      const browser = await open(name, { ...none, bodies });
      await settle(browser.page);
      pictures.push(await picture(browser.page));
      assert.deepEqual(browser.problems, []);
      await browser.close();
    }
    assert.ok(pictures[0].equals(pictures[1]));
  });

  it("shows a single frame without zones and poses that are not numbers", async () => {
    const data = makeSynthetic(2);
    const S = 1, B = data.bodies.length;
    const floats = (text, count) => Buffer.from(text, "base64").subarray(0, 4 * count);
    const position = floats(data.position, S * B * 3);
    position.writeFloatLE(NaN, 0);
    const browser = await open("single", {
      ...data, time: [0], zones: [], zone_state: "", zone_utilisation: "", position: position.toString("base64"),
      orientation: floats(data.orientation, S * B * 4).toString("base64"),
      series: data.series.map((s) => ({ ...s, value: [null] })),
    });
    await browser.page.fill("[data-test=member-search]", data.bodies[0].name);
    assert.equal(await browser.page.textContent("[data-test=member-name]"), data.bodies[0].name);
    assert.deepEqual(browser.problems, []);
    await browser.close();
  });

  it("keeps everything but the picture without WebGL", async () => {
    const browser = await open("no-webgl", makeSynthetic(20), { webgl: false });
    assert.ok(await browser.page.isVisible("[data-test=no-webgl]"));
    assert.equal(await browser.page.locator(".plot").count(), 4);
    await browser.page.keyboard.press("End");
    assert.equal(await clock(browser.page), 9);
    assert.deepEqual(browser.problems.filter((p) => !/WebGL/i.test(p)), []);
    await browser.close();
  });

  it("takes names and texts as text", async () => {
    const browser = await open("hostile", makeSynthetic(3));
    const { page } = browser;
    assert.equal(await page.title(), "Storehouse of seven storeys (synthetic) – topple report");
    assert.equal(await page.locator(".finding[data-finding='clearance.gas'] .finding-title").textContent(), `Gas main ${hostile}`);
    await page.fill("[data-test=member-search]", hostile);
    assert.equal(await page.textContent("[data-test=member-name]"), hostile);
    assert.equal(await page.locator("img[src=x]").count(), 0);
    assert.deepEqual(browser.problems, []);
    await browser.close();
  });

  it("keeps long names without blanks within a narrow page", async () => {
    const data = makeSynthetic(3), long = "Haus".repeat(40);
    data.provenance.title = long;
    data.neighbours[0].name = long;
    for (const f of data.findings) f.title = long;
    data.plan_values.push({ group: "Sections", key: long, value: long }, { group: long, key: "Height", value: "1 m" });
    const browser = await open("long", data, { viewport: { width: 400, height: 900 } });
    const { page } = browser;
    const wide = await page.evaluate(() => [document.documentElement.scrollWidth, [...document.querySelectorAll("body *")].filter((e) => !e.closest("svg, .scroller") && e.getBoundingClientRect().right > 400.5).map((e) => `${e.tagName}.${e.className}`).slice(0, 9)]);
    assert.ok(wide[0] <= 400, String(wide));
    await browser.close();
  });

  it("plays in still pictures where reduced motion is asked for", async () => {
    const browser = await open("reduced", makeSynthetic(50), { reducedMotion: "reduce" });
    const { page } = browser;
    const seen = await page.evaluate(async () => {
      const shown = () => parseFloat(document.querySelector("[data-test=time]").textContent);
      const times = [shown()];
      document.querySelector("[data-test=play]").click();
      while (times.length < 4) {
        if (shown() !== times[times.length - 1]) times.push(shown());
        await new Promise((done) => requestAnimationFrame(done));
      }
      return times;
    });
    // A picture comes at least 0.25 s after the one before; the clock shows milliseconds.
    for (let i = 1; i < seen.length; ++i) assert.ok(seen[i] - seen[i - 1] >= 0.249, `${seen}`);
    await browser.close();
  });

  it("says so when the data cannot be read", async () => {
    const damaged = makeSynthetic(2);
    damaged.position = damaged.position.slice(0, 40);
    for (const [name, data, words] of [["damaged", damaged, /damaged/], ["newer", { ...damaged, version: 9 }, /version 9/], ["other", {}, /does not hold/]]) {
      const browser = await open(name, data);
      assert.match(await browser.page.textContent("[data-test=problem]"), words);
      assert.deepEqual(browser.problems, []);
      await browser.close();
    }
  });
});
