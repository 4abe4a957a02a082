// Measures from a command to its effect on the steering page before the real program, on the storehouse, the pictures it
// shows, and beside them those that the renderer alone allows: the same scene turned, with nothing computed.
// TOPPLE=build/release/apps/topple node test/latency.mjs. Not a test: numbers of this machine at this moment. Processor
// time hardly changes with other work on the machine.
import { copyFile, mkdir, rm } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { openPage } from "./browser.mjs";
import { closeAll } from "./harness.mjs";
import { readTime } from "./processes.mjs";
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
const starts = [], pauses = [];
for (let k = 0; k < 8; ++k) {
  starts.push(await measure("run", "Running"));
  await page.waitForTimeout(150);
  pauses.push(await measure("run", "Paused"));
}
show("run: click to “Running”", starts);
show("pause: click to “Paused”", pauses);
for (const speed of ["0.25", "1"]) {
  await page.selectOption("[data-test=solver-speed]", speed);
  await d.run();
  const branches = [], moments = [];
  for (let k = 0; k < 8; ++k) {
    await page.waitForTimeout(150);
    const times = await page.evaluate(
      (ground) =>
        new Promise((done) => {
          const s = globalThis.topple;
          const begin = performance.now(), before = s.active.value;
          let shown; // the new branch, as it parts from the old one
          void s.edit("set_friction", { ground, bodies: 0.6 });
          const look = () => {
            const view = s.view.value;
            if (s.active.value !== before && view.id === s.active.value) {
              shown ??= performance.now() - begin;
              if (view.last > (s.branch.value?.time ?? Infinity)) return done([shown, performance.now() - begin]);
            }
            requestAnimationFrame(look);
          };
          look();
        }),
      0.5 + 0.01 * k);
    branches.push(times[0]);
    moments.push(times[1]);
  }
  show(`edit while it runs at ${speed} of real time: to the new branch`, branches);
  show(`... to its first later moment, of ${60 * speed} a second`, moments);
  await d.pause();
}
await page.selectOption("[data-test=solver-speed]", "");
await page.locator("[data-test=branch]", { hasText: "main" }).click();
await d.untilBranch("main");
const count = async (words, turns, limit = 6000) => {
  const begin = [readTime("gpu-process"), readTime("renderer")];
  const r = await page.evaluate(async ([alone, milliseconds]) => {
    const s = globalThis.topple, { stage } = globalThis.toppleView.scene;
    const up = stage.camera.up;
    const shown = new Set();
    let n = 0;
    const draw = stage.draw.bind(stage);
    stage.draw = () => {
      draw();
      shown.add(s.view.value.state.time.value);
      ++n;
    };
    const begin = performance.now(), from = s.frontier.value;
    while (performance.now() - begin < milliseconds && (alone || s.phase.value === "running")) {
      await new Promise((done) => (alone ? requestAnimationFrame(done) : setTimeout(done, 50)));
      if (!alone) continue;
      stage.camera.position.applyAxisAngle(up, 0.01 * Math.sin(n / 20));
      stage.camera.lookAt(stage.controls.target);
      stage.draw();
    }
    stage.draw = draw;
    const passed = (performance.now() - begin) / 1000;
    const canvas = document.querySelector("[data-test=canvas]");
    return { n, rate: n / passed, fresh: shown.size / passed, speed: (s.frontier.value - from) / passed, pixels: `${canvas.width} x ${canvas.height}` };
  }, [turns, limit]);
  const of = (kind, from) => ((readTime(kind) - from) / r.n).toFixed(1);
  const moved = turns ? "" : `, ${r.fresh.toFixed(1)} of another moment, ${r.speed.toFixed(2)} times real time`;
  console.log(`${words}: ${r.rate.toFixed(1)} pictures of ${r.pixels} a second${moved}; processor time a picture: drawing ${of("gpu-process", begin[0])} ms, page ${of("renderer", begin[1])} ms`);
};
for (const ratio of [1, 0.5]) {
  await page.evaluate((r) => (globalThis.release = globalThis.toppleView.scene.stage.holdRatio(r)), ratio);
  await count("renderer alone", true);
  await page.evaluate(() => globalThis.release());
}
for (const [speed, words] of [["1", "running at real time"], ["", "running as fast as it can"]]) {
  await page.selectOption("[data-test=solver-speed]", speed);
  await d.run();
  await page.waitForFunction(() => globalThis.topple.frontier.value > 4.2); // it falls from 4 s on
  await count(words, false, 4000);
  await d.pause();
  if (speed !== "") {
    await page.evaluate(() => globalThis.topple.look(0.1));
    await page.evaluate(() => globalThis.topple.makeBranch("once more"));
  }
}
await closeAll();
process.exit(0);
