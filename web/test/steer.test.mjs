// The steering page in a browser, before a stand-in of the server: every control, every state.
import assert from "node:assert/strict";
import { mkdir } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { openPage } from "./browser.mjs";
import { after, before, describe, it } from "./harness.mjs";
import { Standin, planText } from "./standin.mjs";
import { assertPng, assertWebm, findAccessFaults, findFaint, findOverflow, findUnreached, makeDriver, takeDownload } from "./steer_helpers.mjs";

const out = fileURLToPath(new URL("out/steer/", import.meta.url));
const near = (a, b, tolerance) => assert.ok(Math.abs(a - b) <= tolerance, `${a}, not ${b}`);
// Frames are 9 s / 269 apart: what is asked for is met up to one of them, and the clock shows milliseconds.
const frame = 9 / 269 + 1e-3;

/// A picture of a state, which must be one for everybody: names, roles, contrast in light and dark. What is found is
/// told at the end, so that it does not end the story.
const faults = [];
async function look(page, name) {
  await page.screenshot({ path: `${out}${name}.png` });
  const note = (found, where) => faults.push(...found.map((fault) => `${where}: ${fault}`));
  note(await findAccessFaults(page), name);
  for (const colorScheme of ["dark", "light"]) {
    await page.emulateMedia({ colorScheme });
    // colours change over a moment
    await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(Promise.all(document.getAnimations().map((a) => a.finished.catch(() => undefined))))))));
    note(await findFaint(page), `${name}, ${colorScheme}`);
  }
}

describe("steering page", () => {
  let server, browser, page, d;
  const shot = (name) => look(page, name);
  before(async () => {
    await mkdir(out, { recursive: true });
    server = await new Standin().start();
    server.rate = 1; // about real time
    server.barrier = 130; // 4.3 s: what is to be running must not end meanwhile
    browser = await openPage(server.url);
    page = browser.page;
    d = makeDriver(page);
  });
  after(() => browser?.close());

  it("shows the building before anything runs", async () => {
    await d.until("phase", "Paused");
    assert.equal(await d.branch(), "main");
    assert.equal(await d.frontier(), 0);
    await d.until("verdict-panel", "Nothing yet");
    await d.settle();
    await shot("paused");
    assert.ok((await d.countColours()) > 20, "the picture is empty");
    assert.deepEqual(await findOverflow(page), []);
  });

  it("runs, follows, and pauses where it is", async () => {
    server.judged = { time: 0.125 }; // what it finds is of another time than the run's
    await d.run();
    await d.untilFrontier(1.5);
    await shot("running");
    await d.pause();
    const frontier = await d.frontier();
    await d.untilViewed(frontier);
    assert.equal(await d.frontier(), frontier, "it went on after the pause");
    assert.ok(frontier < 9);
    await d.until("verdict-time", "so far, at 0.125 s");
    server.judged = {};
    await d.tab("findings");
    await d.until("so-far", "under way");
    await shot("under-way");
    await d.tab("plots");
  });

  it("steps one frame", async () => {
    const begin = await d.frontier();
    await d.click("step");
    await page.waitForFunction((t) => parseFloat(document.querySelector("[data-test=frontier]").textContent) > t, begin);
    near(await d.frontier(), begin + 9 / 269, 2e-3);
    await d.until("verdict-time", `so far, at ${(await d.frontier()).toFixed(3)} s`);
  });

  it("lists charges that have fired as done", async () => {
    const stage = page.locator(".stage-row", { hasText: "Rows A and B" });
    assert.ok((await d.frontier()) > 0.5);
    const [, all, done] = /(\d+) charges, (\d+) done/.exec(await stage.textContent());
    assert.equal(done, all);
    assert.equal(await page.locator("[data-test=delay-stage-0]").count(), 0, "its time cannot be changed any more");
    assert.equal(await page.locator("[data-test=delay-stage-1]").count(), 1);
  });

  it("lists charges as they are where it looks", async () => {
    const stage = page.locator(".stage-row", { hasText: "Rows A and B" });
    await d.scrub(0.4);
    await page.waitForSelector("[data-test=delay-stage-0]");
    assert.match(await stage.textContent(), / charges0\.500 s/);
    await d.scrub(0.6);
    await page.waitForSelector("[data-test=delay-stage-0]", { state: "detached" });
    assert.match(await stage.textContent(), /done/);
    await d.click("live");
  });

  it("keeps the two clocks apart: scrubbing does not change the run", async () => {
    const frontier = await d.frontier();
    const log = server.sessions[0].log.length;
    await d.scrub(0.4);
    await d.untilViewed(0.4);
    assert.equal(await d.frontier(), frontier);
    assert.equal(await page.getAttribute("[data-test=live]", "aria-pressed"), "false");
    assert.equal(server.sessions[0].log.length, log, "the viewer sent a command");
    assert.equal(server.sessions[0].cursor, null);
    await d.click("live");
    await d.untilViewed(frontier);
  });

  it("does everything by keys", async () => {
    const frontier = await d.frontier();
    await page.locator("[data-test=canvas]").focus();
    await page.keyboard.press("Home");
    await d.untilViewed(0);
    await page.keyboard.press("ArrowRight");
    await d.untilViewed(9 / 269);
    await page.keyboard.press("ArrowLeft");
    await d.untilViewed(0);
    await page.keyboard.press("Shift+ArrowRight");
    await d.untilViewed(0.5);
    await page.keyboard.press("Shift+ArrowLeft");
    await d.untilViewed(0);
    await page.keyboard.press("End");
    await d.untilViewed(frontier);
    await page.keyboard.press("Home");
    await page.keyboard.press("Space");
    await page.waitForFunction(() => parseFloat(document.querySelector("[data-test=time]").textContent) > 0.1);
    await page.keyboard.press("Space");
    assert.equal(await d.frontier(), frontier, "playing moved the run");
    await page.keyboard.press("s");
    await page.waitForSelector(".section-panel");
    await page.keyboard.press("s");
    await page.keyboard.press("l");
    await d.untilViewed(frontier);
    await page.keyboard.press("ArrowRight"); // at the frontier: computes a frame
    await page.waitForFunction((t) => parseFloat(document.querySelector("[data-test=frontier]").textContent) > t, frontier);
    await page.keyboard.press("Space");
    await d.until("phase", "Running");
    await page.keyboard.press("Space");
    await d.until("phase", "Paused");
    await page.keyboard.press("b");
    await page.waitForSelector("dialog input[name=name]");
    await page.keyboard.press("Escape");
    await page.waitForSelector("dialog input[name=name]", { state: "detached" });
    await page.keyboard.press("?");
    await page.waitForSelector("dialog.help[aria-label=Keys]", { state: "visible" });
    await shot("help");
    await page.keyboard.press("Escape");
    await page.waitForSelector("dialog.help[aria-label=Keys]", { state: "hidden" });
  });

  it("shows a member, its zones and the path on its curves", async () => {
    const box = await page.locator("[data-test=canvas]").boundingBox();
    let found = false;
    for (let i = 0; i < 63 && !found; ++i) {
      await page.mouse.click(box.x + (box.width * (1 + (i % 9))) / 10, box.y + (box.height * (1 + Math.floor(i / 9))) / 8);
      await d.draw();
      found = (await page.locator("[data-test=inspector]").count()) > 0;
    }
    if (!found) await shot("no-member");
    assert.ok(found, `no click met a member; in the middle stands ${await page.evaluate(([x, y]) => document.elementFromPoint(x, y)?.outerHTML.slice(0, 120), [box.x + box.width / 2, box.y + box.height / 2])}`);
    await page.fill("[data-test=member-search]", "C-D1-0");
    assert.equal(await d.text("member-name"), "C-D1-0");
    // what it is made of
    await d.until("member-facts", "Column C-D1-0");
    const facts = await page.locator("[data-test=member-facts]").first().innerText();
    for (const words of ["ground-column, 50.0 × 50.0 cm", "8 × ⌀ 32 mm, 64.0 cm² (2.6 %)", "⌀ 10.0 mm every 20.0 cm", "20.0 mm to the ties", "C25", "420"]) assert.ok(facts.includes(words), `${words} is not in ${facts}`);
    assert.equal(await page.locator("[data-test=member-facts]").first().locator("circle").count(), 8);
    await page.locator("[data-test=watch-zone]").first().click();
    await page.waitForSelector("[data-test=zone-plot] canvas");
    await d.until("zone-plot", "elastic");
    await shot("zone");
    await page.locator("[data-test=zone-plot] summary").click();
    await page.waitForFunction(() => document.querySelectorAll("[data-test=zone-plot] tbody tr").length > 20);
    await page.locator("[data-test=zone-plot] summary").click();
  });

  it("colours, filters, cuts and turns the picture", async () => {
    const seen = new Set();
    for (const colouring of ["material", "state", "utilisation", "speed", "kind"]) {
      await page.selectOption("[data-test=colouring]", colouring);
      await d.settle();
      seen.add((await page.locator("[data-test=canvas]").screenshot()).toString("base64"));
    }
    assert.ok(seen.size >= 4, `${seen.size} different pictures`);
    const whole = await page.locator("[data-test=canvas]").screenshot();
    await page.locator(".storeys input").first().uncheck();
    await d.settle();
    assert.notDeepEqual(await page.locator("[data-test=canvas]").screenshot(), whole, "the storey is still there");
    await page.locator(".storeys input").first().check();
    await d.click("section");
    await page.locator(".section-row input").nth(1).evaluate((e) => ((e.value = "0.5"), e.dispatchEvent(new Event("input", { bubbles: true }))));
    await d.settle();
    await shot("section");
    assert.notDeepEqual(await page.locator("[data-test=canvas]").screenshot(), whole, "nothing was cut");
    await page.locator(".section-panel button").click();
    await d.click("section");
    await page.getByRole("button", { name: "Right", exact: true }).focus();
    await page.keyboard.press("Enter");
    await d.settle();
    await shot("side");
    await page.keyboard.press("Escape");
    await page.keyboard.press("f");
  });

  it("takes fewer pixels while pictures come slowly, says so, and all of them at rest", async () => {
    // both are read in the page, between two pictures: a tenth of a second later it is at rest
    const [width, words] = await page.evaluate(async () => {
      const { stage } = globalThis.toppleView.scene;
      const canvas = document.querySelector("[data-test=canvas]");
      let width = 1, words = "";
      for (let k = 0; k < 300 && !(width < 0.8 && words !== ""); ++k) {
        await new Promise((done) => requestAnimationFrame(done));
        width = canvas.width / (canvas.clientWidth * devicePixelRatio);
        words = document.querySelector("[data-test=sharpness]")?.textContent ?? "";
        stage.onChange();
        for (const end = performance.now() + 40; performance.now() < end; );
      }
      return [width, words];
    });
    assert.ok(width < 0.8, `${width} of the pixels along an edge`);
    assert.match(words, /^[5-8]0 %/);
    await page.waitForSelector("[data-test=sharpness]", { state: "detached" });
    await d.settle();
  });

  it("changes the second stage's delay before it fires, on a branch of its own", async () => {
    await d.scrub(1);
    await d.click("delay-stage-1");
    await page.waitForSelector("dialog input[name=time]");
    await shot("dialog");
    await d.submit({ time: "5,5" });
    await d.untilBranch("what-if 1");
    const branch = server.sessions[0].branch();
    near(branch.time, 1, frame);
    assert.equal(branch.stages[1].time, 5.5);
    // not the button, which Space would press again
    await page.waitForFunction(() => document.activeElement.dataset.test === "canvas");
    assert.equal(branch.parent, 1);
    await page.waitForFunction(([t, tolerance]) => Math.abs(parseFloat(document.querySelector("[data-test=frontier]").textContent) - t) <= tolerance, [1, frame]);
    await d.until("edits", "Row C fires at 5.5");
    assert.equal(server.sessions[0].branch(1).stages[1].time, 4, "the past was changed");
  });

  it("says what is wrong with a value before it sends it", async () => {
    await d.click("delay-stage-1");
    await page.fill("dialog input[name=time]", "soon");
    await page.click("dialog [data-test=submit]");
    await page.waitForSelector("dialog [role=alert]");
    assert.match(await page.textContent("dialog [role=alert]"), /“soon” is not a number/);
    await page.keyboard.press("Escape");
  });

  it("adds and removes charges, cables and pre-cuts, fires now, changes friction", async () => {
    const session = server.sessions[0];
    const before = session.branch().charges.length;
    await d.click("add-charge");
    await d.submit({ member: "C-D1-0", position: "1.2" });
    await d.until("edits", "A charge in C-D1-0");
    const added = session.branch().charges[before];
    near(added.position, 1.2, 1e-12);
    near(added.residual_bars, 0.1, 1e-12);
    await d.click("add-charge");
    await d.submit({ member: "C-X9-0" });
    await page.waitForFunction(() => document.querySelector("dialog [role=alert]")?.textContent.includes("There is no member"));
    await shot("refused");
    await page.locator("dialog").getByRole("button", { name: "Cancel" }).click();
    await d.click("add-cable");
    await d.submit({ member: "C-A1-2", pretension: "250" });
    await page.waitForSelector("[data-test=remove-cable]");
    assert.deepEqual([session.branch().cables[0].force, session.branch().cables[0].anchor], [250000, [-40, 10, 0]]);
    await d.click("remove-cable");
    await page.waitForSelector("[data-test=remove-cable]", { state: "detached" });
    await d.click("add-cut");
    await d.submit({ member: "C-D1-0", cut_bars: "40" });
    await d.until("edits", "C-D1-0 is cut");
    await d.click("friction");
    await d.submit({ ground: "0.45" });
    await d.until("edits", "Friction 0.45");
    assert.equal(session.branch().friction.ground, 0.45);
    await page.locator(".stage-row button[aria-expanded]").nth(1).click();
    await page.locator("[data-test=fire]").first().click();
    await d.until("edits", "fires now");
    await page.locator("[data-test=remove-charge]").first().click();
    await d.until("edits", "is taken out");
    await shot("edits");
  });

  it("branches with a name, switches, renames, takes back", async () => {
    await d.click("new-branch");
    await d.submit({ name: "later" });
    await d.untilBranch("later");
    await page.getByRole("button", { name: "Rename later" }).click();
    await d.submit({ name: "much later" });
    await d.untilBranch("much later");
    await page.locator("[data-test=branch]", { hasText: "main" }).click();
    await d.untilBranch("main");
    await page.locator("[data-test=branch]", { hasText: "what-if 1" }).first().click();
    await d.untilBranch("what-if 1");
    await page.keyboard.press("Control+z");
    await d.untilBranch("main");
    await d.tab("log");
    for (const words of ["set delay", "add charge", "undo"]) await d.until("log", words);
    await shot("log");
    await d.tab("plots");
  });

  it("runs both branches to their ends and says how they ended", async () => {
    server.rate = 8;
    server.barrier = Infinity;
    await d.run();
    await d.until("banner", "At rest");
    await shot("finished");
    await page.locator("[data-test=branch]", { hasText: "what-if 1" }).first().click();
    await d.untilBranch("what-if 1");
    server.endingKind = "time_limit";
    await d.run();
    await d.until("banner", "Time limit reached");
    await d.until("banner", "may still have been moving");
    await shot("time-limit");
  });

  it("has every frame although a slow reader gets only some of them", async () => {
    server.dropEvery = 3;
    await page.locator("[data-test=branch]", { hasText: "much later" }).first().click();
    await d.untilBranch("much later");
    await d.run();
    await d.until("phase", "Finished");
    await page.waitForFunction(() => document.querySelector(".clock").textContent.includes("of 270"));
    server.dropEvery = 0;
  });

  it("compares two branches: plots, tables, beside and over each other", async () => {
    await page.locator("[data-test=branch]", { hasText: "main" }).click();
    await d.untilBranch("main");
    await page.locator(".branch-row", { hasText: "what-if 1" }).locator("[data-test=compare]").click();
    await page.waitForSelector("[data-test=compare-panel] .plot canvas");
    await d.until("compare-panel", "21.9");
    await d.scrub(6.6);
    await d.click("compare-beside");
    await page.waitForSelector(".half-name.right");
    await page.waitForFunction(() => [...globalThis.topple.runs.values()].every((r) => ![1, 2].includes(r.id) || r.rows.length === 270));
    await d.settle();
    await shot("beside");
    const beside = await page.locator("[data-test=canvas]").screenshot();
    await d.click("compare-over");
    await d.settle();
    await shot("over");
    assert.notDeepEqual(await page.locator("[data-test=canvas]").screenshot(), beside);
    await d.click("tall");
    await shot("compare");
    await d.click("tall");
    await d.click("compare-off");
  });

  it("checks the plan's text as it is written, and goes to the line", async () => {
    await d.click("check");
    const text = await page.inputValue("[data-test=plan-text]");
    assert.equal(text, planText);
    await page.fill("[data-test=plan-text]", `${planText}dealy = "4 s"\n`);
    await d.until("check-count", "1 error");
    assert.ok(await page.locator("[data-test=apply]").isDisabled());
    await page.locator("[data-test=diagnostic]").click();
    await page.waitForFunction(() => {
      const e = document.querySelector("[data-test=plan-text]");
      return e.value.slice(e.selectionStart, e.selectionEnd) === "dealy";
    });
    await shot("check-failed");
    await page.fill("[data-test=plan-text]", 'title = "x"\n');
    await page.waitForSelector("[data-test=dead-plan]");
    await shot("dead-plan");
  });

  it("saves the text, and asks when the file has changed since", async () => {
    const mine = planText.replace("500 ms", "600 ms");
    await page.fill("[data-test=plan-text]", mine);
    await d.until("check-count", "0 errors");
    const reads = server.sessions[0].reads;
    await d.click("save");
    await d.until("notice", "Saved");
    assert.equal(server.sessions[0].disk, mine);
    assert.equal(server.sessions[0].reads, reads, "what was just saved is read again");
    server.sessions[0].disk = planText.replace("500 ms", "700 ms");
    await page.fill("[data-test=plan-text]", mine.replace("600 ms", "650 ms"));
    await d.click("save");
    await page.waitForSelector("[data-test=conflict]");
    await shot("conflict");
    assert.ok(server.sessions[0].disk.includes("700 ms"), "it was overwritten");
    await d.click("overwrite");
    await d.until("notice", "Saved over");
    assert.ok(server.sessions[0].disk.includes("650 ms"));
    server.sessions[0].disk = planText;
    await page.fill("[data-test=plan-text]", mine);
    await d.click("save");
    await page.waitForSelector("[data-test=conflict]");
    await d.click("keep-disk");
    await page.waitForFunction((t) => document.querySelector("[data-test=plan-text]").value === t, planText);
    await page.fill("[data-test=plan-text]", mine);
    await d.until("check-count", "0 errors");
    await d.click("apply");
    await page.waitForFunction(() => document.querySelector("[data-test=active-branch]").textContent.startsWith("plan "));
    await page.getByRole("button", { name: "Discard" }).click();
    await d.click("edits-text");
    assert.match(await page.inputValue("[data-test=plan-text]"), /# edited/);
    await page.getByRole("button", { name: "Discard" }).click();
    await d.click("tall");
  });

  it("starts a study, watches it grow, and plays a run of it", async () => {
    server.barrier = 100;
    await d.tab("study");
    await d.until("study-edits", "1 of 2 edits");
    await d.until("left-out", "no plan can say");
    await page.fill(".study .count", "40");
    server.studyBarrier = 10;
    await d.click("study-start");
    await page.waitForFunction(() => parseInt(document.querySelector("[data-test=study-state]")?.textContent.split(", ")[1] ?? "0") >= 5);
    const early = await page.getAttribute(".membership svg", "aria-label");
    // it ends while the connection is away
    server.refuse = true;
    server.cut();
    await d.until("banner", "No connection");
    server.studyBarrier = Infinity;
    while (server.sessions[0].studies.some((s) => s.state === "running")) await new Promise((resolve) => setTimeout(resolve, 50));
    server.refuse = false;
    await d.until("study-state", "finished, 40 of 40");
    assert.notEqual(await page.getAttribute(".membership svg", "aria-label"), early, "the membership did not grow");
    assert.ok((await page.locator(".fan polygon").count()) === 3);
    await d.click("tall");
    await shot("study");
    await page.locator(".study-body summary").click();
    await page.locator("[data-test=play-sample]").first().waitFor();
    assert.equal(await page.locator("[data-test=play-sample]").count(), 40);
    await page.locator(".study-body summary").click();
    const canvas = page.locator("[data-test=parallel]");
    await canvas.scrollIntoViewIfNeeded();
    const box = await canvas.boundingBox();
    await canvas.click({ position: { x: box.width * 0.3, y: box.height * 0.5 } });
    await page.waitForFunction(() => document.querySelector("[data-test=active-branch]").textContent.startsWith("sample "));
    await d.untilFrontier(0.5);
    await d.pause();
    await d.click("tall");
    await d.tab("plots");
  });

  it("saves the picture and a video of the run", async () => {
    await page.locator("[data-test=branch]", { hasText: "main" }).click();
    await d.untilBranch("main");
    await d.scrub(6);
    await d.settle();
    const png = await takeDownload(page, () => d.click("png"));
    assertPng(png.bytes);
    assert.match(png.name, /main\.png$/);
    await page.selectOption("select[aria-label='Speed of the playback']", "4");
    const webm = await takeDownload(page, () => d.click("webm"));
    assertWebm(webm.bytes);
    await d.settle();
  });

  it("opens the report of the branch", async () => {
    const [popup] = await Promise.all([page.context().waitForEvent("page"), d.click("report")]);
    await popup.waitForLoadState();
    assert.match(popup.url(), /api\/sessions\/1\/branches\/1\/report\.html$/);
    await popup.close();
  });

  it("survives a lost connection: the run goes on, the page comes back", async () => {
    await page.locator("[data-test=branch]", { hasText: /^└ sample/ }).or(page.locator("[data-test=branch]", { hasText: "sample" })).first().click();
    await page.waitForFunction(() => document.querySelector("[data-test=active-branch]").textContent.startsWith("sample "));
    server.rate = 1;
    server.barrier = 180;
    await d.run();
    server.refuse = true;
    server.cut();
    await d.until("banner", "No connection");
    await shot("disconnected");
    const seen = await d.frontier();
    server.refuse = false;
    await page.waitForFunction(() => !(document.querySelector("[data-test=banner]")?.textContent ?? "").includes("No connection"));
    server.barrier = 200;
    await d.untilFrontier(6); // row 179
    assert.ok((await d.frontier()) > seen);
    await d.pause();
    server.barrier = Infinity;
  });

  it("survives a reload", async () => {
    await page.locator("[data-test=branch]", { hasText: "what-if 1" }).first().click();
    await d.untilBranch("what-if 1");
    await d.scrub(3);
    await d.tab("events");
    await page.reload();
    await page.waitForSelector("html[data-ready=yes]");
    await d.untilBranch("what-if 1");
    await d.untilViewed(3);
    assert.equal(await page.getAttribute("#tab-events", "aria-selected"), "true");
    await d.tab("findings");
    await shot("findings");
    await d.tab("events");
    await shot("events");
    await d.tab("plots");
    // the line in each plot stands where the view does, at the end of the run
    await d.click("live");
    await page.reload();
    await page.waitForSelector("html[data-ready=yes]");
    await d.untilBranch("what-if 1");
    await page.waitForFunction(() => {
      const lines = [...document.querySelectorAll(".time-line")].map((line) => [line.getBoundingClientRect(), line.parentElement.getBoundingClientRect()]);
      return lines.length > 0 && lines.every(([line, plot]) => Math.abs((line.left + line.right) / 2 - plot.right) < 2);
    });
    await d.scrub(3);
  });

  it("keeps text that is not saved over a reload", async () => {
    await d.tab("plan");
    const before = await page.inputValue("[data-test=plan-text]");
    await page.fill("[data-test=plan-text]", `${before}# mine\n`);
    await page.reload();
    await page.waitForSelector("html[data-ready=yes]");
    await d.tab("plan");
    assert.equal(await page.inputValue("[data-test=plan-text]"), `${before}# mine\n`);
    await page.getByRole("button", { name: "Discard" }).click();
    await page.reload();
    await page.waitForSelector("html[data-ready=yes]");
    await d.tab("plan");
    assert.equal(await page.inputValue("[data-test=plan-text]"), before);
    await d.tab("plots");
  });

  it("opens another plan beside, and goes back", async () => {
    await page.selectOption("[data-test=sessions]", "open");
    await page.waitForSelector("[data-test=open-plan] [data-test=open-template]");
    await shot("open");
    await page.setInputFiles("[data-test=import]", { name: "bad.toml", mimeType: "text/plain", buffer: Buffer.from("dealy = 1\n") });
    await page.waitForSelector("[data-test=open-plan] [role=alert]");
    assert.match(await page.textContent("[data-test=open-plan] [role=alert]"), /dealy/);
    await shot("open-failed");
    await page.locator("[data-test=open-template]").first().click();
    await page.waitForFunction(() => document.querySelector("[data-test=sessions]").options.length === 3);
    await d.untilBranch("main");
    await page.waitForFunction(() => parseFloat(document.querySelector("[data-test=frontier]").textContent) === 0);
    await page.selectOption("[data-test=sessions]", "1");
    await d.untilBranch("what-if 1");
  });

  it("does not blame the plan for a log that cannot be written", async () => {
    const session = server.sessions[0];
    const { phase } = session;
    const before = session.branch().ending;
    session.branch().ending = { kind: "failed", code: "E940", text: "house.steer.jsonl: the action log cannot be written: No space left on device" };
    session.phase = "failed";
    session.tellState();
    await d.until("banner", "This session cannot go on");
    assert.match(await d.text("banner"), /No space left/);
    session.branch().ending = before;
    session.phase = phase;
    session.tellState();
  });

  it("shows the last good state of a run that diverged", async () => {
    const session = server.sessions[0];
    session.branch().ending = { kind: "failed", text: "The step at 3.012 s did not converge; the largest residual is in C-D1-0/foot." };
    session.phase = "failed";
    session.tellState();
    await d.until("banner", "The calculation diverged");
    await page.getByRole("button", { name: "Show C-D1-0/foot" }).click();
    assert.equal(await d.text("member-name"), "C-D1-0");
    await shot("diverged");
  });

  it("fits wide, narrow and dark", async () => {
    for (const [name, width, height] of [["large", 1920, 1080], ["small", 1100, 760], ["narrow", 1000, 800], ["phone", 420, 800]]) {
      await page.setViewportSize({ width, height });
      await d.settle();
      await page.screenshot({ path: `${out}${name}.png`, fullPage: name === "phone" });
      assert.deepEqual(await findOverflow(page), [], name);
      if (name === "phone" || name === "narrow") assert.ok(await page.locator(".legend-line").evaluate((e) => e.scrollHeight <= e.clientHeight), "the legend is cut off");
    }
    await page.setViewportSize({ width: 1440, height: 900 });
    await page.emulateMedia({ colorScheme: "dark" });
    await d.settle();
    await shot("dark");
    await page.emulateMedia({ colorScheme: "light" });
  });

  it("has enough contrast, light and dark, in every tab", async () => {
    for (const colorScheme of ["light", "dark"]) {
      await page.emulateMedia({ colorScheme, reducedMotion: "reduce" });
      for (const tab of ["plots", "events", "findings", "compare", "study", "plan", "log"]) {
        await d.tab(tab);
        await d.draw();
        assert.deepEqual(await findFaint(page), [], `${colorScheme}, ${tab}`);
      }
    }
    await page.emulateMedia({ colorScheme: "light", reducedMotion: "no-preference" });
  });

  it("can be reached by Tab everywhere, and shows where the keyboard is", async () => {
    for (const tab of ["plots", "study", "plan"]) {
      await d.tab(tab);
      await d.draw();
      assert.deepEqual(await findUnreached(page), [], tab);
      assert.deepEqual(await findAccessFaults(page), [], tab);
    }
    await page.keyboard.press("Escape");
  });

  it("stands still where the system asks for it", async () => {
    await page.emulateMedia({ reducedMotion: "reduce" });
    await d.tab("plots");
    await d.draw();
    assert.deepEqual(await page.evaluate(() => document.getAnimations().map((a) => a.effect?.target?.className ?? "?")), []);
    await page.emulateMedia({ reducedMotion: "no-preference" });
  });

  it("reports no error and asks nobody but its server", () =>
    // cutting the connection is meant to fail
    assert.deepEqual(browser.problems.filter((p) => !/WebSocket/.test(p)), []));
});

describe("steering page with nothing open", () => {
  it("offers plans and templates, and opens one", async () => {
    const server = await new Standin().start({ empty: true });
    const browser = await openPage(server.url);
    const { page } = browser;
    await page.waitForSelector("[data-test=open-path]");
    await look(page, "empty");
    assert.equal(await page.locator("[data-test=open-template]").count(), 2);
    assert.deepEqual(await findUnreached(page), []);
    await page.locator("[data-test=open-path]").first().click();
    const d = makeDriver(page);
    await d.until("phase", "Paused");
    assert.equal(await d.branch(), "main");
    assert.deepEqual(browser.problems, []);
    await browser.close();
  });

  it("opens the demo, live", async () => {
    const server = await new Standin().start({ empty: true });
    const browser = await openPage(server.url);
    await browser.page.locator("[data-test=open-demo]").click();
    const d = makeDriver(browser.page);
    await d.until("phase", "Paused");
    await d.run();
    await d.untilFrontier(0.2);
    await browser.close();
  });

  it("makes a plan with gaps of a building from another program, and takes a site into a plan", async () => {
    const server = await new Standin().start({ empty: true });
    const browser = await openPage(server.url);
    const { page } = browser;
    const file = (name) => ({ name, mimeType: "application/octet-stream", buffer: Buffer.from("ISO-10303-21;") });
    await page.setInputFiles("[data-test=import]", file("mill.ifc"));
    await page.waitForSelector("[data-test=imported]");
    for (const words of ["42 columns", "C25", "gaps"]) await page.waitForFunction((w) => document.querySelector("[data-test=imported]").textContent.includes(w), words);
    const d = makeDriver(page);
    await d.until("check-count", "1 error");
    await look(page, "imported");
    await page.setInputFiles("[data-test=import-site]", file("site.dxf"));
    await page.waitForFunction(() => document.querySelector("[data-test=plan-text]").value.includes("[[site.neighbour]]"));
    await browser.close();
  });

  it("offers to go on with an earlier session of the plan", async () => {
    const server = await new Standin().start();
    server.sessions[0].earlier = { log: "storehouse.steer.jsonl", created: "2026-01-31T12:00:00Z", actions: 2, branches: 2, time: 3 };
    const browser = await openPage(server.url);
    const { page } = browser;
    const d = makeDriver(page);
    await d.until("earlier", "2 actions, 2 branches, computed to 3.000 s");
    await look(page, "earlier");
    await d.click("continue");
    await d.untilBranch("what-if 1");
    await d.untilFrontier(2.9);
    assert.equal(await page.locator("[data-test=earlier]").count(), 0);
    await d.run();
    await browser.close();
  });

  it("says that its server is gone when another one has the address", async () => {
    const server = await new Standin().start();
    const browser = await openPage(server.url);
    const d = makeDriver(browser.page);
    await d.until("phase", "Paused");
    server.refuse = server.isOther = true;
    server.cut();
    await d.until("banner", "This server is gone");
    await look(browser.page, "gone");
    await browser.close();
  });

  it("shows that a plan is built, and what is wrong if it cannot be", async () => {
    const server = await new Standin().start();
    const end = server.startBuilding(server.sessions[0]);
    const browser = await openPage(server.url);
    const { page } = browser;
    const d = makeDriver(page);
    await d.until("phase", "Building");
    await look(page, "building");
    end([{ severity: "error", code: "E310", line: 8, column: 1, width: 4, message: "the columns of row A carry nothing", help: "" }]);
    await d.until("banner", "cannot be run as it is");
    await page.locator("[data-test=diagnostic]").click();
    assert.equal(await page.locator("[data-test=plan-text]").evaluate((e) => e.value.slice(e.selectionStart, e.selectionEnd)), "name");
    await look(page, "unbuilt");
    end([]);
    await d.until("phase", "Paused");
    await page.waitForSelector("[data-test=canvas]");
    assert.deepEqual(browser.problems, []);
    await browser.close();
  });

  it("says that a plan without charges will stand, and that a crisp plan has no study", async () => {
    const server = await new Standin().start({ text: 'title = "crisp"\n' });
    const browser = await openPage(server.url);
    const d = makeDriver(browser.page);
    await d.until("banner", "the building will stand");
    await d.tab("study");
    await d.until("no-fuzzy", "[fuzzy]");
    await look(browser.page, "stands");
    await browser.close();
  });

  it("works without WebGL and with reduced motion", async () => {
    const server = await new Standin().start();
    server.barrier = 60; // it must not end before it is paused
    const browser = await openPage(server.url, { webgl: false, reducedMotion: "reduce" });
    const d = makeDriver(browser.page);
    await browser.page.waitForSelector("[data-test=no-webgl]");
    await d.run();
    await d.untilFrontier(0.8);
    await d.pause();
    await d.scrub(0.5);
    await d.untilViewed(0.5);
    assert.deepEqual(browser.problems.filter((p) => !/WebGL/i.test(p)), []);
    await browser.close();
  });
});

describe("each state of the steering page", () => {
  it("has names, roles and contrast for everybody", () => assert.deepEqual(faults, []));
});
