// The steering page before the real `topple steer` (TOPPLE names the program), on the storehouse.
import assert from "node:assert/strict";
import { copyFile, mkdir, readFile, rm, writeFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { openPage } from "./browser.mjs";
import { after, before, describe, it } from "./harness.mjs";
import { listOwn, putToSleep } from "./processes.mjs";
import { assertPng, assertWebm, makeDriver, takeDownload } from "./steer_helpers.mjs";
import { startServer } from "./steer_server.mjs";

const out = fileURLToPath(new URL("out/steer_program/", import.meta.url));
const root = fileURLToPath(new URL("../../", import.meta.url));
const program = process.env.TOPPLE;
if (program === undefined) {
  console.log("TOPPLE names no program: nothing is steered");
  process.exit(0);
}

describe("steering the storehouse", { timeout: 240000 }, () => {
  let server, browser, page, d;
  const shot = (name) => page.screenshot({ path: `${out}${name}.png` });
  before(async () => {
    await rm(out, { recursive: true, force: true });
    await mkdir(out, { recursive: true });
    await copyFile(`${root}examples/weida/plan.toml`, `${out}plan.toml`);
    const short = await readFile(`${root}tests/data/short.toml`, "utf8");
    const fuzzy = '\n[fuzzy]\nsite.friction = { trapezoidal = [0.4, 0.6, 0.6, 0.8] }\nconcrete.C25.fc = { triangular = ["20 N/mm2", "25 N/mm2", "30 N/mm2"] }\n';
    await writeFile(`${out}fuzzy.toml`, short.replace('title = "Short run"', 'title = "Short run, fuzzy"') + fuzzy);
    server = await startServer(program, "plan.toml", out);
    browser = await openPage(server.url, { acceptDownloads: true });
    page = browser.page;
    d = makeDriver(page);
  });
  after(() => browser?.close());

  it("stands and waits", async () => {
    await page.waitForFunction(() => document.querySelector("[data-test=phase]")?.textContent.includes("Paused"), undefined, { timeout: 120000 });
    assert.equal(await d.frontier(), 0);
    assert.equal(await page.locator("[data-test=sessions] option").first().textContent(), "Storehouse in Weida, 1998");
    await d.settle();
    await shot("paused");
    assert.ok((await d.countColours()) > 20);
  });

  it("runs and pauses", async () => {
    await page.selectOption("[data-test=solver-speed]", "0.1");
    await d.run();
    await d.untilFrontier(0.5);
    await d.pause();
    const frontier = await d.frontier();
    // slowed down so far that a test under load pauses before the second stage, at 4 s
    assert.ok(frontier < 4, `${frontier}`);
    await d.untilViewed(frontier);
    await page.waitForFunction(() => document.querySelectorAll(".marker").length > 0);
  });

  it("changes the second stage's delay, on a branch from where it looks", async () => {
    await d.scrub(0.25);
    await d.click("delay-stage-1");
    await d.submit({ time: "3" });
    await d.untilBranch("what-if 1");
    await d.until("edits", "3");
    assert.ok((await d.frontier()) <= 0.26 + 1 / 60);
    assert.match(await page.locator("[data-test=delay-stage-1]").locator("xpath=..").textContent(), /3\.000 s/);
  });

  it("edits in each way and takes back", async () => {
    await d.click("add-charge");
    await d.submit({ member: "C-D1-0", position: "1.1", destroyed_length: "1.2", time: "3.5" });
    await d.until("edits", "C-D1-0");
    await d.click("add-cut");
    await d.submit({ member: "C-D2-0", at: "0", cut_bars: "50" });
    await d.until("edits", "C-D2-0");
    await d.click("add-cable");
    await d.submit({ member: "C-A1-3", position: "1", x: "-60", y: "0", z: "0", pretension: "50" });
    await page.waitForSelector("[data-test=remove-cable]");
    await d.click("friction");
    await d.submit({ ground: "0.5", bodies: "0.5" });
    await d.until("edits", "0.5");
    const name = await d.branch();
    await page.keyboard.press("Control+z");
    await page.waitForFunction((n) => document.querySelector("[data-test=active-branch]").textContent !== n || !document.querySelector("[data-test=edits]")?.textContent.includes("0.5"), name);
    await shot("edits");
    const covered = await page.evaluate(() => {
      const bar = document.querySelector(".view .toolbar").getBoundingClientRect().bottom;
      return [...document.querySelectorAll(".notice")].filter((n) => n.getBoundingClientRect().top < bar).map((n) => n.textContent);
    });
    assert.deepEqual(covered, [], "notices over the controls of the picture");
    await d.tab("log");
    for (const words of ["set delay", "add charge", "add pre cut", "add cable", "set friction", "undo"]) await d.until("log", words);
    await shot("log");
    await d.tab("plots");
  });

  it("watches a zone on its curves while it runs", async () => {
    await page.fill("[data-test=member-search]", "C-D1-0");
    await page.locator("[data-test=watch-zone]").first().click();
    await page.waitForSelector("[data-test=zone-plot] canvas");
    await d.run();
    const begin = await d.frontier();
    await d.untilFrontier(begin + 0.5);
    await d.pause();
    await page.locator("[data-test=zone-plot] summary").click();
    await page.locator("[data-test=zone-plot] tbody tr").first().waitFor();
    await shot("zone");
    await page.keyboard.press("Escape");
  });

  it("runs on, survives a lost connection and a reload", async () => {
    await page.locator("[data-test=branch]", { hasText: "main" }).click();
    await d.untilBranch("main");
    await d.run();
    const seen = await d.frontier();
    await page.evaluate(() => globalThis.topple.connection.drop());
    await d.untilFrontier(seen + 0.3);
    await d.pause();
    const frontier = await d.frontier();
    await d.scrub(0.3);
    await d.untilViewed(0.3);
    await page.reload();
    await page.waitForSelector("html[data-ready=yes]");
    await d.untilViewed(0.3);
    assert.equal(await d.branch(), "main");
    assert.ok(Math.abs((await d.frontier()) - frontier) < 1e-3);
    await d.click("live");
  });

  it("wakes with the machine, without a reload and with each command done once", async () => {
    await page.selectOption("[data-test=solver-speed]", "0.1");
    await d.run();
    const before = await page.evaluate(() => {
      globalThis.stays = true;
      return { branches: topple.branches.value.length, edits: topple.log.value.filter((e) => e.action === "set_friction").length };
    });
    // an edit is on its way when all stops, for longer than the server waits for a silent page (45 s)
    const own = listOwn();
    const wakeServer = putToSleep(own.filter((p) => p.id === server.id));
    await page.evaluate(() => void topple.tryEdit("set_friction", { ground: 0.55, bodies: 0.55 }).then(() => (globalThis.edited = "done"), (error) => (globalThis.edited = String(error))));
    const wakeBrowser = putToSleep(own.filter((p) => p.id !== server.id));
    await new Promise((done) => setTimeout(done, 48000));
    wakeBrowser();
    wakeServer();
    await page.waitForFunction(() => globalThis.edited !== undefined);
    assert.equal(await page.evaluate(() => globalThis.edited), "done");
    const seen = await d.frontier();
    await d.untilFrontier(seen + 0.05);
    await d.pause();
    const after = await page.evaluate(() => ({
      stays: globalThis.stays, status: topple.status.value, branches: topple.branches.value.length,
      edits: topple.log.value.filter((e) => e.action === "set_friction").length,
    }));
    assert.deepEqual([after.stays, after.status, after.branches, after.edits], [true, "open", before.branches + 1, before.edits + 1]);
    await page.waitForFunction(() => topple.view.value.rows.every((row, i) => row === i), undefined, { timeout: 20000 }); // no frame is missing
    await shot("awake");
    await page.locator("[data-test=branch]", { hasText: "main" }).click();
    await d.untilBranch("main");
    await page.selectOption("[data-test=solver-speed]", "");
  });

  it("compares two branches", async () => {
    await d.tab("compare");
    await d.click("compare-go");
    await page.waitForSelector("[data-test=compare-panel] .plot canvas");
    await d.click("compare-beside");
    await d.settle();
    await shot("compare");
    await d.click("compare-off");
    await d.tab("plots");
  });

  it("checks, saves, and asks before it writes over another's text", async () => {
    await d.click("check");
    const text = await page.inputValue("[data-test=plan-text]");
    assert.equal(text, await readFile(`${out}plan.toml`, "utf8"));
    await page.fill("[data-test=plan-text]", text.replace('time = "4 s"', 'tmie = "4 s"'));
    await page.waitForSelector("[data-test=diagnostic]");
    await shot("check-failed");
    const mine = text.replace("seed = 1998", "seed = 1999");
    await page.fill("[data-test=plan-text]", mine);
    await d.until("check-count", "0 errors");
    await d.click("save");
    await d.until("notice", "Saved");
    assert.equal(await readFile(`${out}plan.toml`, "utf8"), mine);
    await page.fill("[data-test=plan-text]", `${mine}# by me\n`);
    await writeFile(`${out}plan.toml`, `${mine}# by another\n`);
    // the page hears of the change on the disk; its text is still from before
    await page.waitForFunction(() => topple.plan.value.text.includes("# by another"));
    await d.click("save");
    await page.waitForSelector("[data-test=conflict]");
    await d.click("overwrite");
    await page.waitForSelector("[data-test=conflict]", { state: "detached" });
    assert.equal(await readFile(`${out}plan.toml`, "utf8"), `${mine}# by me\n`);
    await d.click("tall");
    await d.tab("plots");
  });

  it("writes the report, a picture and a video", async () => {
    const [popup] = await Promise.all([page.context().waitForEvent("page"), d.click("report")]);
    await popup.waitForSelector("html[data-ready=yes]");
    assert.equal(await popup.textContent("h1"), "Storehouse in Weida, 1998");
    await popup.close();
    await d.settle();
    assertPng((await takeDownload(page, () => d.click("png"))).bytes);
    await page.selectOption("select[aria-label='Speed of the playback']", "1");
    assertWebm((await takeDownload(page, () => d.click("webm"))).bytes);
  });

  it("runs a study of a fuzzy plan and plays one of its collapses", async () => {
    await page.selectOption("[data-test=sessions]", "open");
    await page.locator("[data-test=open-path]", { hasText: "fuzzy.toml" }).click();
    await page.waitForFunction(() => document.querySelector("[data-test=open-plan]") === null);
    await d.until("phase", "Paused");
    await d.until("sessions", "Short run, fuzzy");
    await d.settle();
    // another building: the picture holds all of it and its neighbours, and is full of them
    const edge = await page.evaluate(() => {
      const { stage, building } = toppleView.scene;
      return Math.max(...building.fitPoints.flatMap((p) => { const q = p.clone().project(stage.camera); return [Math.abs(q.x), Math.abs(q.y)]; }));
    });
    assert.ok(edge > 0.8 && edge < 1, `${edge}`);
    await d.tab("study");
    await page.fill(".study .count", "12");
    await d.click("study-start");
    await page.waitForFunction(() => parseInt(document.querySelector("[data-test=study-state]")?.textContent.split(", ")[1] ?? "0") >= 3, undefined, { timeout: 200000 });
    await d.click("tall");
    await shot("study");
    await page.locator(".study-body summary").click();
    await page.locator("[data-test=play-sample]").first().click();
    await page.waitForFunction(() => document.querySelector("[data-test=active-branch]").textContent !== "main");
    await d.untilFrontier(0.1);
    await d.click("tall");
  });

  it("reports no error of the page", () => assert.deepEqual(browser.problems.filter((p) => !/WebSocket/.test(p)), []));
});
