// Measures how many pictures a second the steering page shows: node test/speed.mjs [bodies]. Not a test: a number of
// this machine at this moment. The run plays, then stands while the picture is turned. Beside the time between pictures
// stands the processor time of the browser's processes, which other work on the machine does not change much.
import { openPage } from "./browser.mjs";
import { closeAll } from "./harness.mjs";
import { readTime } from "./processes.mjs";
import { Standin, useData } from "./standin.mjs";
import { makeMany } from "./synthetic.mjs";

const wanted = Number(process.argv[2] ?? 300);

const data = makeMany(wanted);
useData(() => data);
const server = new Standin();
server.rate = 2; // 60 frames a second
server.frames = data.time.length;
await server.start();
const { page } = await openPage(server.url);
const watch = async (milliseconds, whileRunning) => {
  const begin = [readTime("gpu-process"), readTime("renderer")];
  const result = await page.evaluate(async ([limit, running]) => {
    const s = globalThis.topple, { stage } = globalThis.toppleView.scene, gaps = [], moments = new Set();
    const start = performance.now(), draw = stage.draw.bind(stage);
    let last = start;
    stage.draw = () => {
      draw();
      gaps.push(performance.now() - last);
      last = performance.now();
      moments.add(s.view.value.state.time.value);
    };
    while (performance.now() < start + limit && (!running || s.phase.value === "running")) await new Promise((done) => setTimeout(done, 50));
    stage.draw = draw;
    gaps.sort((a, b) => a - b);
    const canvas = document.querySelector("[data-test=canvas]");
    return { pictures: gaps.length, mean: gaps.reduce((a, b) => a + b) / gaps.length, median: gaps[gaps.length >> 1], p95: gaps[Math.floor(gaps.length * 0.95)], pixels: `${canvas.width} x ${canvas.height}`, moments: moments.size, seconds: (last - start) / 1000, memory: performance.memory?.usedJSHeapSize / 2 ** 20 };
  }, [milliseconds, whileRunning]);
  return { ...result, draw: (readTime("gpu-process") - begin[0]) / result.pictures, script: (readTime("renderer") - begin[1]) / result.pictures };
};
const show = (words, r) => console.log(`${data.bodies.length} bodies, ${words}: mean ${r.mean.toFixed(1)} ms, median ${r.median.toFixed(1)} ms, 95 % ${r.p95.toFixed(1)} ms between pictures of ${r.pixels}, ${(r.moments / r.seconds).toFixed(0)} moments a second; processor time a picture: drawing ${r.draw.toFixed(1)} ms, page ${r.script.toFixed(1)} ms; ${r.memory.toFixed(0)} MB of JavaScript`);
await page.click("[data-test=run]");
await page.waitForFunction(() => globalThis.topple.phase.value === "running");
show("running", await watch(4000, true));
await page.waitForFunction(() => !document.querySelector("[data-test=phase]").textContent.includes("Running"), undefined, { timeout: 60000 }).catch(() => page.click("[data-test=run]"));
const box = await page.locator("[data-test=canvas]").boundingBox();
await page.mouse.move(box.x + 300, box.y + 200);
await page.mouse.down();
let turning = true;
const turn = (async () => {
  for (let i = 0; turning; ++i) await page.mouse.move(box.x + 300 + 150 * Math.sin(i / 10), box.y + 200 + 40 * Math.cos(i / 10));
})();
show("turned", await watch(4000, false));
turning = false;
if (process.argv[3]) await page.screenshot({ path: process.argv[3] });
await turn;
await closeAll();
process.exit(0);
