// Measures how many pictures a second the steering page shows: node test/speed.mjs [bodies]. Not a test: a number of
// this machine at this moment. The run plays, then stands while the picture is turned. Beside the time between pictures
// stands the processor time of the browser's processes, which other work on the machine does not change much.
import { openPage } from "./browser.mjs";
import { closeAll } from "./harness.mjs";
import { readTime } from "./processes.mjs";
import { Standin, useData } from "./standin.mjs";
import { makeSynthetic } from "./synthetic.mjs";

const wanted = Number(process.argv[2] ?? 300);

/// The made-up building as often beside itself as it takes, over fewer frames.
function makeMany(count) {
  const frames = count > 2000 ? 40 : 270;
  const one = makeSynthetic(frames);
  const B = one.bodies.length, copies = Math.max(1, Math.round(count / B));
  const floats = (text) => new Float32Array(Uint8Array.from(Buffer.from(text, "base64")).buffer);
  const p = floats(one.position), q = floats(one.orientation);
  const N = B * copies;
  const position = new Float32Array(frames * N * 3), orientation = new Float32Array(frames * N * 4);
  const side = Math.ceil(Math.sqrt(copies));
  for (let s = 0; s < frames; ++s)
    for (let c = 0; c < copies; ++c)
      for (let b = 0; b < B; ++b) {
        const from = s * B + b, to = s * N + c * B + b;
        for (let k = 0; k < 3; ++k) position[3 * to + k] = p[3 * from + k] + (k === 0 ? 16 * (c % side) : k === 1 ? 26 * Math.floor(c / side) : 0);
        for (let k = 0; k < 4; ++k) orientation[4 * to + k] = q[4 * from + k];
      }
  const text = (values) => Buffer.from(values.buffer).toString("base64");
  return {
    ...one, bodies: Array.from({ length: N }, (_, i) => ({ ...one.bodies[i % B], name: `${one.bodies[i % B].name}-${Math.floor(i / B)}` })),
    position: text(position), orientation: text(orientation),
  };
}
const data = makeMany(wanted);
useData(() => data);
const server = new Standin();
server.rate = 1;
server.frames = data.time.length;
await server.start();
const { page } = await openPage(server.url);
const watch = async (milliseconds) => {
  const begin = [readTime("gpu-process"), readTime("renderer")];
  const result = await page.evaluate(async (limit) => {
    const gaps = [];
    let last = performance.now();
    const end = last + limit;
    while (last < end) {
      await new Promise((done) => requestAnimationFrame(done));
      const now = performance.now();
      gaps.push(now - last);
      last = now;
    }
    gaps.sort((a, b) => a - b);
    const canvas = document.querySelector("[data-test=canvas]");
    return { pictures: gaps.length, mean: gaps.reduce((a, b) => a + b) / gaps.length, median: gaps[gaps.length >> 1], p95: gaps[Math.floor(gaps.length * 0.95)], pixels: `${canvas.width} x ${canvas.height}` };
  }, milliseconds);
  return { ...result, draw: (readTime("gpu-process") - begin[0]) / result.pictures, script: (readTime("renderer") - begin[1]) / result.pictures };
};
const show = (words, r) => console.log(`${data.bodies.length} bodies, ${words}: mean ${r.mean.toFixed(1)} ms, median ${r.median.toFixed(1)} ms, 95 % ${r.p95.toFixed(1)} ms between pictures of ${r.pixels}; processor time a picture: drawing ${r.draw.toFixed(0)} ms, page ${r.script.toFixed(0)} ms`);
await page.click("[data-test=run]");
show("running", await watch(4000));
await page.waitForFunction(() => !document.querySelector("[data-test=phase]").textContent.includes("Running"), undefined, { timeout: 60000 }).catch(() => page.click("[data-test=run]"));
const box = await page.locator("[data-test=canvas]").boundingBox();
await page.mouse.move(box.x + 300, box.y + 200);
await page.mouse.down();
let turning = true;
const turn = (async () => {
  for (let i = 0; turning; ++i) await page.mouse.move(box.x + 300 + 150 * Math.sin(i / 10), box.y + 200 + 40 * Math.cos(i / 10));
})();
show("turned", await watch(4000));
turning = false;
if (process.argv[3]) await page.screenshot({ path: process.argv[3] });
await turn;
await closeAll();
process.exit(0);
