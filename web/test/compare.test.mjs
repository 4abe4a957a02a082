// The page of two runs in a browser. TOPPLE_COMPARE=FILE tests a page of real runs instead of the made-up one.
import assert from "node:assert/strict";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { isFittedAt, openPage } from "./browser.mjs";
import { after, before, describe, it } from "./harness.mjs";
import { load } from "./load.mjs";
import { makeSynthetic } from "./synthetic.mjs";

const { makePlotted } = await load("compare_data.ts");
const given = process.env.TOPPLE_COMPARE;
const out = fileURLToPath(new URL(`out/compare${given === undefined ? "" : "_run"}/`, import.meta.url));
const file = given === undefined ? `${out}synthetic.html` : resolve(given);
const dot = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==";

function makeCompared() {
  const a = makeSynthetic(120), b = makeSynthetic(120);
  a.provenance.engine = "native";
  b.provenance.engine = "finite elements";
  const lag = (values) => values.map((v, i) => (v === null ? null : (values[Math.max(0, i - 4)] ?? v)));
  for (const s of b.series) s.value = lag(s.value);
  const zero = a.time.map((_, i) => 0.01 * i);
  return {
    comparison: {
      format: "topple-comparison", version: 1, names: ["native", "finite elements"],
      points: "All bodies have the same name in both.", matched: a.bodies.length, touchdown: [4.9, 5.02], until: 4.9,
      tilt_difference: 0.02, tilt_time: 4.8, tilt_share: 0.08, centre_difference: 0.4, time: a.time,
      series: a.series.map((s, i) => ({ id: s.id, title: s.title, unit: s.unit, group: s.group, a: s.value, b: b.series[i].value })),
      distance: { rms: zero, largest: zero, farthest: a.time.map(() => "C-A1-0"), centre: zero },
      touchdowns: [{ body: "</script><b>hostile", a: 4.9, b: null }],
    },
    a, b,
    photos: [{ time: 1, name: "first.png", data: dot }, { time: 6, name: "second.png", data: dot }],
  };
}

describe("the data of two runs", () => {
  it("puts each quantity of both runs into one plot", () => {
    const { comparison, a } = makeCompared();
    const { run, titles } = makePlotted(comparison, a);
    const tilt = run.series.filter((s) => s.group === "tilt_angle");
    assert.deepEqual(tilt.map((s) => s.title), ["A native", "B finite elements"]);
    assert.equal(titles.tilt_angle, "Tilt angle");
    assert.ok(run.series.some((s) => s.group === "distance" && s.id === "rms"));
    for (const s of run.series) assert.equal(s.value.length, run.time.length);
  });

  it("ends tilts where less than half of a block holds together, and says so", () => {
    const { comparison, a } = makeCompared();
    const whole = a.time.map(() => 1);
    comparison.series.push({ id: "connected_share", title: "Share", unit: "1", group: "share", a: whole, b: whole.map((_, i) => (i < 50 ? 1 : 0.4)) });
    const { run, notes } = makePlotted(comparison, a);
    const [first, second] = run.series.filter((s) => s.group === "tilt_angle");
    assert.equal(second.value[50], null);
    assert.equal(first.value[50], comparison.series.find((s) => s.id === "tilt_angle").a[50]);
    assert.match(notes.tilt_angle, /^B ends at .* s, when less than half of the upper block holds together\.$/);
  });
});

describe("the page of two runs", () => {
  let browser;
  before(async () => {
    await mkdir(out, { recursive: true });
    if (given === undefined) {
      const bundle = await readFile(new URL("../dist/compare.html", import.meta.url), "utf8");
      const data = JSON.stringify(makeCompared()).replaceAll("<", "\\u003c");
      await writeFile(file, bundle.replace("<!--TOPPLE-DATA-->", () => `<script type="application/json" id="topple-data">${data}</script>`));
    }
    browser = await openPage(file);
  });
  after(() => browser?.close());
  const scrub = (time) =>
    browser.page.locator("[data-test=slider]").evaluate((slider, t) => {
      slider.value = String(t);
      slider.dispatchEvent(new Event("input", { bubbles: true }));
    }, time);
  const picture = () => browser.page.locator("[data-test=canvas]").screenshot();

  it("shows both buildings, one alone, and the other", async () => {
    const { page } = browser;
    await scrub(given === undefined ? 6 : 1e9);
    const both = await picture();
    await page.click("[data-test=show-a]");
    const a = await picture();
    await page.click("[data-test=show-b]");
    const b = await picture();
    assert.ok(!both.equals(a) && !both.equals(b) && !a.equals(b));
    await page.click("[data-test=show-both]");
    await page.screenshot({ path: `${out}page.png`, fullPage: true });
  });

  it("gives both runs the colours of their plots, which differ without red and green", { timeout: 120000 }, async () => {
    const { page } = browser;
    for (const colorScheme of ["light", "dark"]) {
      await page.emulateMedia({ colorScheme });
      const [picture, plots] = await page.evaluate(() => [
        [...document.querySelectorAll(".legend .swatch")].map((e) => getComputedStyle(e).backgroundColor),
        [...document.querySelectorAll("[data-plot=tilt_angle] .plot-legend line")].map((e) => getComputedStyle(e).stroke),
      ]);
      assert.equal(picture.length, 2);
      assert.deepEqual(plots, picture);
      // red less blue over the whole picture, with one run alone
      const warmth = async (shown) => {
        await page.click(`[data-test=show-${shown}]`);
        const address = `data:image/png;base64,${(await page.locator("[data-test=canvas]").screenshot()).toString("base64")}`;
        return page.evaluate(async (src) => {
          const image = new Image();
          image.src = src;
          await image.decode();
          const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
          context.drawImage(image, 0, 0);
          const { data } = context.getImageData(0, 0, image.width, image.height);
          let sum = 0;
          for (let i = 0; i < data.length; i += 4) sum += data[i] - data[i + 2];
          return sum;
        }, address);
      };
      assert.ok((await warmth("a")) < (await warmth("b")), `${colorScheme}: A is blue, B orange`);
      await page.click("[data-test=show-both]");
    }
    await page.emulateMedia({ colorScheme: "light" });
  });

  it("says when the blocks touch down", async () => {
    const words = await browser.page.textContent("[data-test=touchdown]");
    assert.match(words, given === undefined ? /A 4\.90\d* s, B 5\.02\d* s, difference 0\.120 s/ : /^A /);
  });

  it("plots both runs and their distance", async () => {
    for (const plot of ["tilt_angle", "distance"]) assert.equal(await browser.page.locator(`[data-plot=${plot}] canvas`).count(), 1);
  });

  it("shows the photograph nearest to the cursor", async () => {
    if (given !== undefined) return; // that page has none
    await scrub(1.2);
    await browser.page.waitForSelector("text=first.png");
    await scrub(5.8);
    await browser.page.waitForSelector("text=second.png");
  });

  it("keeps both buildings in a narrow picture", async () => {
    const { page } = browser;
    assert.ok(await isFittedAt(page, 400));
    await page.screenshot({ path: `${out}phone.png`, fullPage: true });
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
    await page.setViewportSize({ width: 1440, height: 900 });
  });

  it("runs without an error and without asking for anything else", () => assert.deepEqual(browser.problems, []));
});

describe("runs of two titles", () => {
  it("are told apart at the head of their page", async () => {
    await mkdir(out, { recursive: true });
    const bundle = await readFile(new URL("../dist/compare.html", import.meta.url), "utf8");
    const path = `${out}titles.html`, compared = makeCompared();
    compared.a.provenance.title = "House";
    compared.b.provenance.title = "Another";
    compared.comparison.note = 'A is of "House", B of "Another": see that both are of one building.';
    await writeFile(path, bundle.replace("<!--TOPPLE-DATA-->", () => `<script type="application/json" id="topple-data">${JSON.stringify(compared).replaceAll("<", "\\u003c")}</script>`));
    const browser = await openPage(path);
    assert.equal(await browser.page.textContent("h1"), "House | Another");
    assert.equal(await browser.page.textContent(".subtitle"), "A: House, native · B: Another, finite elements");
    assert.equal(await browser.page.textContent("[data-test=note]"), compared.comparison.note);
    assert.equal(await browser.page.title(), "House | Another – topple compare");
    await browser.page.screenshot({ path: `${out}titles.png` });
    await browser.close();
  });
});

describe("data that are no comparison", () => {
  it("are said to be so", async () => {
    await mkdir(out, { recursive: true });
    const bundle = await readFile(new URL("../dist/compare.html", import.meta.url), "utf8");
    const path = `${out}wrong.html`;
    await writeFile(path, bundle.replace("<!--TOPPLE-DATA-->", () => '<script type="application/json" id="topple-data">{}</script>'));
    const browser = await openPage(path);
    assert.match(await browser.page.textContent("[data-test=problem]"), /does not hold a comparison/);
    await browser.close();
  });
});
