// The built page of a study in a browser. TOPPLE_STUDY=FILE tests the page of a real study instead of the made-up one.
import assert from "node:assert/strict";
import { mkdir, readFile } from "node:fs/promises";
import { resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { openPage } from "./browser.mjs";
import { before, describe, it } from "./harness.mjs";
import { load } from "./load.mjs";
import { makeEmptyStudy, makeFailedStudy, makePlainStudy, makeStudy, writeStudy } from "./study-data.mjs";
import { hostile } from "./synthetic.mjs";

const { prettify } = await load("units.ts");
const { makeTicks, findRange } = await load("study/chart.tsx");
const { placeLabels, calcWidth, layTitles } = await load("study/labels.ts");
const { readStudy } = await load("study/data.ts");
const out = fileURLToPath(new URL("out/", import.meta.url));
const given = process.env.TOPPLE_STUDY;
const path = given === undefined ? `${out}study.html` : resolve(given);

const dataOf = async (file) => JSON.parse(/id="topple-data">(.*?)<\/script>/s.exec(await readFile(file, "utf8"))[1]);

/// Elements that stick out of the window to the right.
const findOverflow = (page) =>
  page.evaluate(() => {
    const wide = document.documentElement.clientWidth + 1;
    const isClipped = (e) => {
      for (let p = e.parentElement; p !== null; p = p.parentElement)
        if (["auto", "scroll", "hidden"].includes(getComputedStyle(p).overflowX)) return true;
      return false;
    };
    return [...document.querySelectorAll("body *")]
      .filter((e) => e.getBoundingClientRect().right > wide && !isClipped(e)).map((e) => `${e.tagName}.${e.className}`).slice(0, 5);
  });

describe("a study's parts", () => {
  it("finds round numbers for axes", () => {
    assert.deepEqual(makeTicks(0, 10, 5), [0, 2, 4, 6, 8, 10]);
    assert.deepEqual(makeTicks(-5, 5, 4).map(Number), [-5, -2.5, 0, 2.5, 5]);
    assert.deepEqual(makeTicks(3, 3), [3]);
    const [low, high] = findRange([null, 5, 5]);
    assert.ok(low < 5 && high > 5, "a range is never empty");
    assert.deepEqual(findRange([]), [0, 1]);
  });

  it("places labels so that none covers another one", () => {
    const frame = { left: 0, right: 200, top: 0, foot: 100 };
    const line = (y) => Array.from({ length: 21 }, (_, k) => [10 * k, y]);
    const labels = [40, 44, 48].map((y, i) => ({ text: `0.${i}25`, places: line(y), avoid: [40, 44, 48].filter((other) => other !== y).flatMap(line) }));
    const places = placeLabels(labels, frame);
    for (let a = 0; a < 3; ++a) {
      const half = calcWidth(labels[a].text) / 2;
      assert.ok(places[a][0] - half >= 0 && places[a][0] + half <= 200, "within the frame");
      for (let b = 0; b < a; ++b) assert.ok(Math.abs(places[a][0] - places[b][0]) >= 2 * half || Math.abs(places[a][1] - places[b][1]) >= 14);
    }
    assert.deepEqual(placeLabels([{ text: "1", places: [[50, 50], [60, 50]], avoid: [[50, 52]] }], frame), [[60, 50]], "away from what is not its own");
    assert.deepEqual(placeLabels([{ text: "1", places: [[50, 50]] }, { text: "2", places: [[52, 50]] }], frame), [[50, 50], undefined]);
  });

  it("lays titles of axes in rows, none over another one and none cut off", () => {
    const titles = ["fc [N/mm²]", "duration [s]", "possibility of the inputs", "tilt [deg]", "a name that is longer than all of the picture, of which the end has to be left out"];
    const places = titles.map((_, k) => 60 + 62 * k), laid = layTitles(titles, places, 368);
    const ends = laid.map(({ text, x, row }) => ({ row, low: x - calcWidth(text) / 2, high: x + calcWidth(text) / 2 }));
    ends.forEach((a, i) => {
      assert.ok(a.low >= 0 && a.high <= 368, titles[i]);
      for (const b of ends.slice(0, i)) assert.ok(a.row !== b.row || a.low >= b.high || b.low >= a.high);
    });
    assert.deepEqual(laid.slice(0, 4).map((t) => t.text), titles.slice(0, 4));
    assert.match(laid[4].text, /^a name that .*…$/);
    assert.deepEqual(layTitles(["a", "b"], [60, 900], 960).map((t) => t.row), [0, 0]);
  });

  it("refuses data that are damaged or of another kind", () => {
    const study = makeStudy(10);
    assert.equal(readStudy(JSON.stringify(study)).run_table.trajectories.length, 110);
    // curves lie over a base for each of their points, if the page has one
    const { run_table } = study, first = readStudy(JSON.stringify(study)).run_table.trajectories;
    const over = readStudy(JSON.stringify({ ...study, run_table: { ...run_table, trajectory_base: Array.from({ length: 11 }, (_, k) => 1e9 + k) } })).run_table.trajectories;
    assert.deepEqual([...over.slice(0, 12)], [...first.slice(0, 12)].map((y, i) => y + 1e9 + (i % 11)));
    const short = { ...study, run_table: { ...study.run_table, membership: [1] } };
    assert.throws(() => readStudy(JSON.stringify(short)), /membership has 1 values, not 10/);
    assert.throws(() => readStudy(JSON.stringify({ ...study, version: 9 })), /version 9/);
    assert.throws(() => readStudy("{}"), /does not hold/);
    assert.throws(() => readStudy("null"), /does not hold/);
  });
});

describe("the page of a study", () => {
  let page, problems, data;
  before(async () => {
    await mkdir(out, { recursive: true });
    if (given === undefined) await writeStudy(makeStudy(), path);
    data = await dataOf(path);
    ({ page, problems } = await openPage(path));
  });

  it("says its verdict, and how possible each outcome is", async () => {
    assert.equal(await page.textContent("[data-test=verdict]"), prettify(data.verdict[0].text));
    for (const s of data.verdict.slice(1)) assert.ok((await page.textContent(".sentences")).includes(prettify(s.text)), s.id);
    const rows = await page.$$eval("[aria-label=Outcomes] .outcomes tbody tr", (list) => list.map((e) => e.textContent));
    const unmet = data.not_met ?? [];
    assert.equal(rows.length, data.outcomes.length + unmet.length);
    unmet.forEach((name, i) => assert.equal(rows[data.outcomes.length + i], `${name}not met in ${data.runs} runs≥ 0*00`));
    data.outcomes.forEach((o, i) => {
      assert.ok(rows[i].includes(o.name) && rows[i].includes(String(o.runs)), o.name);
      assert.ok(rows[i].includes(o.possibility >= 1 ? "1" : "≥"), o.name);
    });
    await page.screenshot({ path: `${out}study-start.png` });
  });

  it("draws a membership function for each output, with its table", async () => {
    assert.equal(await page.locator("[data-membership]").count(), data.outputs.length);
    for (let k = 0; k < Math.min(3, data.outputs.length); ++k) {
      const plot = page.locator("[data-membership]").nth(k);
      assert.ok((await plot.locator("path.whole").getAttribute("d")).length > 20);
      await plot.locator("summary").click();
      await plot.locator("tbody tr").first().waitFor();
      const cells = await plot.locator("tbody tr").first().locator("td").allTextContents();
      assert.equal(cells[0], "all runs");
      const lower = data.outputs[k].levels[0].lower;
      assert.ok(Math.abs(Number(cells[2].replace("−", "-")) - lower) <= 1e-3 * Math.abs(lower) + 1e-3, "four digits are shown");
      await plot.locator("summary").click();
    }
  });

  it("draws bands of each curve, for all runs and for one outcome", async () => {
    for (const curve of data.curves.filter((c) => !c.is_outline)) {
      const plot = page.locator(`[data-fan="${curve.name}"]`);
      const fans = data.fans.filter((f) => f.curve === curve.name);
      const drawn = fans[0].levels.filter((l) => l.runs > 0).length;
      assert.equal(await plot.locator("path.band").count(), drawn);
      const lines = await plot.locator("path.run-line").count();
      assert.ok(lines > 0 && (await plot.textContent()).includes(String(lines)), "it says how many runs are drawn");
      if (fans.length > 1) {
        await plot.locator("select").selectOption(String(fans.length - 1));
        const one = data.run_table.outcome.filter((o) => data.outcomes[o].name === fans[fans.length - 1].outcome).length;
        await page.waitForFunction(([name, most]) => document.querySelectorAll(`[data-fan="${name}"] path.run-line`).length <= most, [curve.name, one]);
      }
      await plot.locator("input[type=checkbox]").uncheck();
      await plot.locator("path.run-line").first().waitFor({ state: "detached" });
    }
  });

  it("shows where parts may lie, and that this is no safe distance", async () => {
    if (data.debris.length === 0) return;
    const plan = page.locator("[data-test=debris]");
    assert.equal(await plan.locator("path.debris").count(), data.debris[0].levels.length);
    assert.match(await plan.textContent(), /no safe distance/);
    const boxes = await plan.locator(".level-text").evaluateAll((list) => list.map((e) => e.getBoundingClientRect().toJSON()));
    assert.ok(boxes.length > 0);
    for (const [i, a] of boxes.entries())
      for (const b of boxes.slice(0, i))
        assert.ok(a.left >= b.right || b.left >= a.right || a.top + 3 >= b.bottom || b.top + 3 >= a.bottom, "labels lie apart");
    await plan.locator("summary").click();
    await plan.locator("tbody tr").first().waitFor();
    assert.equal(await plan.locator("tbody tr").count(), data.debris[0].levels.length);
    await plan.locator("summary").click();
  });

  it("names drivers with their errors, and says what is unknown", async () => {
    const text = await page.textContent("[data-test=drivers]");
    for (const o of data.drivers.outputs)
      for (const d of o.inputs)
        if (d.first !== null && d.first > d.first_error) assert.ok(text.includes(`${d.first.toFixed(2)} ± ${d.first_error.toFixed(2)}`), o.name);
        else assert.ok(text.includes("unknown"));
  });

  it("shows what whole runs make of condensed ones", async () => {
    const c = data.confirmation;
    assert.equal(await page.locator("[data-test=confirmation]").count(), c === undefined ? 0 : 1);
    if (c === undefined) return;
    const text = (await page.textContent("[data-test=confirmation]")).replace(/\s+/g, " ");
    const run = c.runs.filter((r) => r.whole_outcome !== null);
    assert.ok(text.includes(`${run.length} of them were run whole beside it; ${run.filter((r) => r.outcome === r.whole_outcome).length} had the same outcome`), text);
    for (const state of ["confirmed", "exceeded", "not reached"])
      assert.ok(text.includes(`${c.bounds.filter((b) => b.state === state).length} ${state}`), text);
    assert.equal(await page.locator("[data-test=confirmation] details tbody tr").count(), c.bounds.length);
  });

  it("shows how possible it is that the requirement is broken", async () => {
    if (data.requirement === null) return;
    const text = await page.textContent("[data-test=requirement]");
    assert.ok(text.includes(data.requirement.text));
    for (const c of data.requirement.classes) {
      const row = await page.textContent(`[data-test=requirement] [data-class=${c.name}]`);
      const least = /^[^\d]*([\d.]+)(\*?)/.exec(row);
      assert.ok(Number(least[1]) <= c.possibility && Number(least[1]) > c.possibility - 1e-3, row);
      assert.equal(least[2] === "*", !c.converged, row);
    }
  });

  it("shows permissible boxes with what is known of them", async () => {
    if (data.boxes === null) return;
    const text = await page.textContent("[data-test=boxes]");
    assert.equal(await page.locator("[data-box]").count(), data.boxes.list.length);
    for (const box of data.boxes.list) assert.ok(text.includes(box.guarantee));
    assert.ok(text.includes(data.boxes.requirement));
  });

  it("chooses runs with a limit by the keyboard, and takes it away again", async () => {
    const inside = async () => Number(/^(\d+) of/.exec(await page.textContent("[data-test=inside]"))[1]);
    const all = data.run_table.sample.length;
    assert.equal(await inside(), all);
    await page.locator(".limits summary").click();
    const values = data.run_table.inputs.map((x) => x[0]).sort((a, b) => a - b);
    const middle = values[Math.floor(all / 2)];
    const field = page.locator(".limits tbody tr").first().locator("input[type=text]").first();
    await field.fill(String(middle));
    await field.press("Enter");
    const wanted = data.run_table.inputs.filter((x) => x[0] >= middle).length;
    await page.waitForFunction((n) => document.querySelector("[data-test=inside]").textContent.startsWith(`${n} of`), wanted);
    await page.locator("[data-test=clear]").click();
    assert.equal(await inside(), all);
    await page.locator(".limits summary").click();
  });

  it("chooses runs with a brush", async () => {
    const grip = page.locator(".grip").first();
    await grip.scrollIntoViewIfNeeded();
    const box = await grip.boundingBox();
    await page.mouse.move(box.x + 10, box.y + 2);
    await page.mouse.down();
    await page.mouse.move(box.x + 10, box.y + box.height / 2, { steps: 4 });
    await page.mouse.up();
    const [low, high] = [Math.min(...data.run_table.inputs.map((x) => x[0])), Math.max(...data.run_table.inputs.map((x) => x[0]))];
    const upper = data.run_table.inputs.filter((x) => x[0] > low + 0.52 * (high - low)).length;
    const lower = data.run_table.inputs.filter((x) => x[0] > low + 0.48 * (high - low)).length;
    const inside = Number(/^(\d+) of/.exec(await page.textContent("[data-test=inside]"))[1]);
    assert.ok(inside >= upper - lower / 10 && inside <= lower, `${inside} of ${upper} to ${lower}`);
    await page.locator("[data-test=clear]").click();
  });

  it("shows one run with all its values, from a line and from the table", async () => {
    const link = page.locator("[data-run]").first();
    const sample = Number(await link.getAttribute("data-run"));
    await link.focus();
    await page.keyboard.press("Enter");
    assert.match(await page.textContent("[data-test=run]"), new RegExp(`Run ${sample}:`));
    assert.equal(await page.locator("[data-test=run] tbody tr").count(), data.inputs.length + data.derived.length + 1 + data.outputs.length);
    const box = await page.locator("[data-test=coordinates]").boundingBox();
    let found = false;
    for (let k = 1; k < 30 && !found; ++k) {
      await page.mouse.click(box.x + box.width * 0.45, box.y + 30 + (k * (box.height - 60)) / 30);
      found = (await page.locator("[data-test=run]").count()) > 0;
    }
    assert.ok(found, "no click met a line");
  });

  it("hides an outcome", async () => {
    if (data.outcomes.length < 2) return;
    const index = data.outcomes.findIndex((o) => o.runs > 0);
    await page.locator(".chip").nth(index).click();
    const rest = data.run_table.outcome.filter((o) => o !== index).length;
    await page.waitForFunction((n) => document.querySelector("[data-test=inside]").textContent.startsWith(`${n} of`), rest);
    await page.locator(".chip").nth(index).click();
  });

  it("says what failed, what is not modelled and where it comes from", async () => {
    const text = await page.textContent("main");
    for (const reason of data.failures) assert.ok(text.includes(reason));
    for (const one of data.not_modelled) assert.ok(text.includes(one));
    for (const one of [data.origin.model, data.origin.program_version]) assert.ok(text.includes(one));
  });

  it("fits wide, narrow, dark and printed, and gives every control a name", async () => {
    for (const [name, width] of [["wide", 1440], ["narrow", 900], ["phone", 400]]) {
      await page.setViewportSize({ width, height: 900 });
      await page.waitForTimeout(100);
      assert.deepEqual(await findOverflow(page), [], name);
      const least = await page.evaluate(() =>
        Math.min(...[...document.querySelectorAll("svg.chart")].filter((svg) => svg.getClientRects().length > 0)
          .map((svg) => (parseFloat(getComputedStyle(svg.querySelector("text")).fontSize) * svg.getBoundingClientRect().width) / svg.viewBox.baseVal.width)));
      assert.ok(least >= 8.5, `${name}: texts of plots are ${least} px high`);
      await page.screenshot({ path: `${out}study-${name}.png`, fullPage: true });
    }
    await page.setViewportSize({ width: 1440, height: 900 });
    await page.emulateMedia({ colorScheme: "dark" });
    await page.screenshot({ path: `${out}study-dark.png`, fullPage: true });
    await page.emulateMedia({ colorScheme: "light" });
    const nameless = await page.evaluate(() =>
      [...document.querySelectorAll("button, input, select, summary, svg[role=img]")]
        .filter((e) => !(e.getAttribute("aria-label") || e.textContent.trim() || e.closest("label")?.textContent.trim())).map((e) => e.outerHTML.slice(0, 80)),
    );
    assert.deepEqual(nameless, []);
    await page.emulateMedia({ media: "print" });
    await page.setViewportSize({ width: 688, height: 900 }); // A4 within its margins, not measured again
    const beyond = await page.$$eval("[data-test=coordinates]", ([holder]) =>
      [...holder.querySelectorAll("svg, canvas, .axis-title")].filter((e) => e.getBoundingClientRect().right > holder.getBoundingClientRect().right + 1).map((e) => e.textContent));
    assert.deepEqual(beyond, []);
    assert.equal(await page.locator(".hint:visible").count(), 0);
    await page.emulateMedia({ media: "screen" });
    const pdf = await page.pdf({ path: `${out}study.pdf`, preferCSSPageSize: true, printBackground: true });
    assert.ok(pdf.length > 20000);
  });

  it("reports no error and asks the network for nothing", () => assert.deepEqual(problems, []));
});

describe("unusual studies", () => {
  const open = async (name, data) => {
    await mkdir(out, { recursive: true });
    await writeStudy(data, `${out}${name}.html`);
    const browser = await openPage(`${out}${name}.html`);
    await browser.page.screenshot({ path: `${out}${name}.png`, fullPage: true });
    return browser;
  };

  it("shows a study without a run", async () => {
    const { page, problems, close } = await open("study-empty", makeEmptyStudy());
    assert.equal(await page.textContent("h1"), "Untitled study");
    assert.match(await page.textContent("[data-test=verdict]"), /Nothing has been run/);
    assert.match(await page.textContent(".subtitle"), /under way/);
    assert.deepEqual(problems, []);
    await close();
  });

  it("shows no outcomes of a model that names none", async () => {
    const { page, problems, close } = await open("study-plain", makePlainStudy());
    assert.equal(await page.locator("[aria-label=Outcomes]").count(), 0);
    assert.ok(!(await page.innerText("body")).includes("(no name)"));
    assert.equal(await page.locator("[data-fan]").count(), 0);
    assert.deepEqual(problems, []);
    await close();
  });

  it("shows a study of which every run failed", async () => {
    const { page, problems, close } = await open("study-failed", makeFailedStudy());
    assert.match(await page.textContent("[data-test=verdict]"), /All 5 runs failed/);
    assert.ok((await page.textContent("[data-test=failures]")).includes(hostile));
    await page.locator("[data-run='0']").click();
    assert.ok((await page.textContent("[data-test=run]")).includes(hostile));
    assert.deepEqual(problems, []);
    await close();
  });

  it("takes names and texts as text", async () => {
    const { page, problems, close } = await open("study-hostile", { ...makeStudy(10), title: hostile });
    assert.equal(await page.textContent("h1"), hostile);
    assert.equal(await page.title(), `${hostile} – topple study`);
    assert.equal(await page.locator("img[src=x]").count(), 0);
    assert.deepEqual(problems, []);
    await close();
  });

  it("says so when the data cannot be read", async () => {
    const { page, problems, close } = await open("study-damaged", { ...makeStudy(3), version: 9 });
    assert.match(await page.textContent("[data-test=problem]"), /version 9/);
    assert.deepEqual(problems, []);
    await close();
  });
});
