// The harness ends by itself whatever happens: each case is a file of tests of its own, run by another Node.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { mkdir, writeFile } from "node:fs/promises";
import { describe, it } from "node:test";
import { fileURLToPath } from "node:url";

const folder = new URL("out/harness/", import.meta.url);

async function run(name, body, limit = 60) {
  await mkdir(folder, { recursive: true });
  const path = fileURLToPath(new URL(`${name}.mjs`, folder));
  const top = `import { createServer } from "node:http";\nimport { after, before, describe, it, keep } from "../../harness.mjs";\n`;
  // A server keeps its process alive until it is closed.
  const open = `const open = () => { const s = createServer().listen(0); return keep(() => new Promise((done) => (console.log("closed"), s.close(done)))); };\n`;
  await writeFile(path, top + open + body);
  const { NODE_TEST_CONTEXT: _, ...env } = process.env;
  const child = spawn(process.execPath, ["--test", path], { env: { ...env, TOPPLE_WEB_LIMIT: String(limit) }, stdio: ["ignore", "pipe", "pipe"] });
  let output = "";
  for (const stream of [child.stdout, child.stderr]) stream.on("data", (text) => (output += text));
  const code = await new Promise((done) => child.on("close", done));
  return { code, output };
}

describe("harness", { timeout: 100000 }, () => {
  it("closes what a passing file left open", async () => {
    const { code, output } = await run("pass", `describe("s", () => { before(() => open()); it("a", () => {}); it("b", () => {}); });`);
    assert.equal(code, 0, output);
    assert.match(output, /closed/);
  });
  it("closes after a failed assertion", async () => {
    const { code, output } = await run("fail", `describe("s", () => { before(() => open()); it("a", () => { throw new Error("no luck"); }); });`);
    assert.notEqual(code, 0);
    assert.match(output, /no luck/);
    assert.match(output, /closed/);
  });
  it("closes after a throwing before()", async () => {
    const { code, output } = await run(
      "before",
      `describe("s", () => { before(() => { open(); throw new Error("no start"); }); after(() => console.log("after ran")); it("a", () => {}); it("b", () => {}); });
       describe("t", () => { it("c", () => console.log("c ran")); });`,
    );
    assert.notEqual(code, 0);
    for (const words of [/no start/, /closed/, /after ran/, /c ran/]) assert.match(output, words);
  });
  it("fails a test that takes too long and goes on", async () => {
    const { code, output } = await run(
      "slow", `describe("s", { timeout: 200 }, () => { it("a", () => new Promise(() => open())); it("b", () => console.log("b ran")); });`);
    assert.notEqual(code, 0);
    for (const words of [/took longer than 0.2 s/, /b ran/, /closed/]) assert.match(output, words);
  });
  it("ends a file that hangs by the watchdog", async () => {
    const { code, output } = await run(
      "hang", `describe("s", () => { before(() => open()); it("sleeps", () => new Promise(() => setInterval(() => {}, 1000))); });`, 1);
    assert.notEqual(code, 0);
    for (const words of [/running: s > sleeps/, /watchdog/, /closed/]) assert.match(output, words);
  });
});
