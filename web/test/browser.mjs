// Debian's Chromium on a fresh profile, with WebGL in software.
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { chromium } from "playwright-core";
import { keep } from "./harness.mjs";

const executablePath = process.env.TOPPLE_CHROMIUM ?? "/usr/bin/chromium";
const quiet = [
  "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync",
];
const softwareGl = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
const noGl = ["--disable-3d-apis"];

/// Opens a page from disk, or from the address of a server. `problems` collects errors of the page and every request
/// beyond the file or the server itself. The browser is closed after the file at the latest.
export async function openPage(place, { webgl = true, ...options } = {}) {
  const address = /^http:/.test(place) ? place : `file://${place}`;
  const origin = /^http:\/\/[^/]*\//.exec(address)?.[0];
  const profile = await mkdtemp(join(tmpdir(), "topple-chromium-"));
  let context;
  const close = keep(async () => {
    await context?.close();
    await rm(profile, { recursive: true, force: true, maxRetries: 3 });
  });
  context = await chromium.launchPersistentContext(profile, {
    executablePath, headless: true, viewport: { width: 1440, height: 900 },
    args: [...quiet, ...(webgl ? softwareGl : noGl)], ...options,
  });
  const page = context.pages()[0] ?? (await context.newPage());
  const problems = [];
  page.on("console", (message) => message.type() === "error" && problems.push(`console: ${message.text()}`));
  page.on("pageerror", (error) => problems.push(`page: ${error.stack}`));
  page.on("dialog", (dialog) => {
    problems.push(`dialog: ${dialog.message()}`);
    void dialog.dismiss();
  });
  page.on("request", (request) => {
    const url = request.url();
    const ours = origin === undefined ? /^file:/.test(url) : url.startsWith(origin);
    if (!ours && !/^(data|blob):/.test(url)) problems.push(`request: ${url}`);
  });
  page.setDefaultTimeout(60000);
  await page.goto(address);
  await page.waitForSelector("html[data-ready=yes]");
  return { page, problems, close };
}

/// Whether the picture is fitted after the window has become so wide: then Fit changes nothing.
export async function isFittedAt(page, width) {
  const settle = () => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(done)))));
  const canvas = page.locator("[data-test=canvas]");
  await page.setViewportSize({ width, height: page.viewportSize().height });
  await settle();
  const before = await canvas.screenshot();
  await page.getByRole("button", { name: "Fit", exact: true }).click();
  await settle();
  return before.equals(await canvas.screenshot());
}
