// Measures from a command to its effect on the steering page before the real program, on the storehouse, and the pictures
// it shows: TOPPLE=build/release/apps/topple node test/latency.mjs. Not a test: numbers of this machine at this moment.
import { copyFile, mkdir, rm } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { openPage } from "./browser.mjs";
import { closeAll } from "./harness.mjs";
import { makeDriver } from "./steer_helpers.mjs";
import { startServer } from "./steer_server.mjs";

const out = fileURLToPath(new URL("out/latency/", import.meta.url));
await rm(out, { recursive: true, force: true });
await mkdir(out, { recursive: true });
await copyFile(fileURLToPath(new URL("../../examples/weida/plan.toml", import.meta.url)), `${out}plan.toml`);
const server = await startServer(process.env.TOPPLE, "plan.toml", out);
const { page } = await openPage(server.url);
const d = makeDriver(page);
await page.waitForFunction(() => document.querySelector("[data-test=phase]")?.textContent.includes("Paused"), undefined, { timeout: 120000 });
const show = (words, list) => {
  const sorted = [...list].sort((a, b) => a - b);
  console.log(`${words}: median ${sorted[sorted.length >> 1].toFixed(0)} ms, least ${sorted[0].toFixed(0)}, most ${sorted[sorted.length - 1].toFixed(0)} (${list.length} times)`);
};

/// From a click until the page says what it did, in the page's own time.
const measure = (test, words) =>
  page.evaluate(
    ([name, text]) =>
      new Promise((done) => {
        const begin = performance.now();
        document.querySelector(`[data-test=${name}]`).click();
        const look = () => (document.querySelector("[data-test=phase]").textContent.includes(text) ? done(performance.now() - begin) : requestAnimationFrame(look));
        requestAnimationFrame(look);
      }),
    [test, words]);
await page.selectOption("[data-test=solver-speed]", "0.25");
const starts = [], pauses = [], edits = [];
for (let k = 0; k < 8; ++k) {
  starts.push(await measure("run", "Running"));
  await page.waitForTimeout(150);
  pauses.push(await measure("run", "Paused"));
}
show("run: click to “Running”", starts);
show("pause: click to “Paused”", pauses);
await d.run();
for (let k = 0; k < 8; ++k) {
  await page.waitForTimeout(150);
  edits.push(
    await page.evaluate(
      (ground) =>
        new Promise((done) => {
          const s = globalThis.topple;
          const begin = performance.now(), before = s.active.value;
          void s.edit("set_friction", { ground, bodies: 0.6 });
          // the new branch is shown, and the run goes on in it
          const look = () => {
            const view = s.view.value;
            if (s.active.value !== before && view.id === s.active.value && view.last > (s.branch.value?.time ?? Infinity)) done(performance.now() - begin);
            else requestAnimationFrame(look);
          };
          look();
        }),
      0.5 + 0.01 * k));
}
show("edit while it runs: to the first picture of the new branch", edits);
await d.pause();
await page.selectOption("[data-test=solver-speed]", "");
await page.locator("[data-test=branch]", { hasText: "main" }).click();
await d.untilBranch("main");
await d.run();
const pictures = await page.evaluate(async (limit) => {
  const s = globalThis.topple;
  const shown = new Set();
  let n = 0;
  const begin = performance.now(), from = s.frontier.value;
  while (performance.now() - begin < limit && s.phase.value === "running") {
    await new Promise((done) => requestAnimationFrame(done));
    shown.add(s.view.value.state.time.value);
    ++n;
  }
  const passed = (performance.now() - begin) / 1000;
  return { rate: n / passed, fresh: shown.size / passed, speed: (s.frontier.value - from) / passed };
}, 6000);
console.log(`running: ${pictures.rate.toFixed(1)} pictures a second, ${pictures.fresh.toFixed(1)} of another moment, ${pictures.speed.toFixed(2)} times real time`);
await closeAll();
process.exit(0);
