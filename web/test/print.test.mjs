// The report on paper: A4, the order of its parts, nothing cut in two. TOPPLE_REPORT=FILE is the report of a run; pdfinfo,
// pdftotext and pdfimages of poppler-utils read the pages.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdir } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { openPage } from "./browser.mjs";
import { describe, it } from "./harness.mjs";

const out = fileURLToPath(new URL("out/print/", import.meta.url));
const ask = (program, ...words) => execFileSync(program, words, { encoding: "utf8", timeout: 60000, maxBuffer: 1 << 26 });

describe("the printed report", () => {
  it("is A4 with the verdict, the pictures and the conditions on its first page, and cuts nothing in two", async () => {
    await mkdir(out, { recursive: true });
    const { page, problems, close } = await openPage(process.env.TOPPLE_REPORT);
    const path = `${out}report.pdf`;
    await page.pdf({ path, preferCSSPageSize: true, printBackground: true });
    const stills = await page.$$eval(".still-row img", (list) => list.length);
    const plots = await page.$$eval(".plot canvas", (list) => list.length);
    const findings = await page.$$eval(".finding > div", (list) => list.map((e) => e.innerText.replace(/\s+/g, " ").trim()));
    const rows = await page.$$eval("main .pairs tr", (list) => list.filter((e) => e.querySelector("td") !== null).map((e) => [...e.children].map((cell) => cell.innerText.replace(/\s+/g, " ").trim())));
    const heads = ["Sequence", "This fails if", "Findings", "What is not modelled", "The site from above", "The plan", "Assumptions", "Events", "Fuzzy results", "Verification", "The model", "Where this comes from", "Glossary"];
    const title = await page.textContent("h1");
    const verdict = await page.textContent("[data-test=verdict]");
    await close();
    assert.deepEqual(problems, []);

    const info = ask("pdfinfo", path);
    assert.match(info, /Page size: +59[45](?:\.\d+)? x 84[12](?:\.\d+)? pts \(A4\)/);
    const count = Number(/Pages: +(\d+)/.exec(info)[1]);
    assert.ok(count >= 3 && count < 40, `${count} pages`);
    const flat = (text) => text.replace(/[\s\u00a0\u202f-]+/g, "");
    const pages = Array.from({ length: count }, (_, i) => ask("pdftotext", "-f", String(i + 1), "-l", String(i + 1), path, "-"));
    assert.ok(pages.every((text) => text.trim() !== ""), "an empty page");
    for (const text of [title, verdict, "Sequence", "This fails if"]) assert.ok(flat(pages[0]).includes(flat(text)), `not on the first page: ${text}`);
    assert.ok(!flat(pages[0]).includes("Whereitcomesfrom"));

    // the order of the parts
    const lines = pages.flatMap((text, i) => text.split("\n").map((line) => ({ line: line.trim(), page: i })));
    let at = -1;
    for (const head of heads) {
      const next = lines.findIndex((l, i) => i > at && l.line === head);
      assert.ok(next >= 0, `"${head}" is missing or comes too early`);
      assert.ok(lines.slice(next + 1).some((l) => l.page === lines[next].page && l.line !== ""), `"${head}" stands alone at the end of its page`);
      at = next;
    }
    // findings and rows stand on one page
    const flatPages = pages.map(flat);
    for (const parts of [...findings.map((text) => [text]), ...rows]) {
      const ends = parts.map(flat).flatMap((words) => [words.slice(0, 14), words.slice(-14)]);
      assert.ok(flatPages.some((p) => ends.every((end) => p.includes(end))), `cut in two: ${parts.join(" | ")}`);
    }
    // a picture that is cut is on two pages
    const pictures = ask("pdfimages", "-list", path).split("\n").slice(2).map((line) => line.trim().split(/\s+/)).filter((row) => row[2] === "image");
    assert.ok(pictures.filter((row) => row[0] === "1").length >= stills, "pictures of the sequence on the first page");
    assert.ok(pictures.length <= stills + plots, `${pictures.length} pictures of ${stills} stills and ${plots} plots`);
  });

  it("leaves no page nearly empty behind a long first one, and breaks no word of its head", async () => {
    const { page, close } = await openPage(process.env.TOPPLE_REPORT);
    await page.setViewportSize({ width: 688, height: 900 }); // A4 within its margins
    await page.emulateMedia({ media: "print" });
    const broken = await page.evaluate(() => {
      const link = document.querySelector("[data-test=open-finding]") ?? document.querySelector(".ending").appendChild(Object.assign(document.createElement("a"), { className: "open-finding" }));
      link.innerHTML = '<span class="status-word">Nicht beurteilt</span> <span>Erschütterungen: Versorgungsleitung</span>';
      const text = link.lastElementChild.firstChild, words = [...text.data.matchAll(/\S+/g)];
      return words.filter((word) => {
        const range = document.createRange();
        range.setStart(text, word.index);
        range.setEnd(text, word.index + word[0].length);
        return range.getClientRects().length > 1;
      }).map(String);
    });
    assert.deepEqual(broken, []);
    const path = `${out}long.pdf`;
    for (let more = 2; more <= 12; more += 2) {
      await page.evaluate(() => {
        for (let i = 0; i < 2; ++i) document.querySelector(".conditions ul").append(Object.assign(document.createElement("li"), { textContent: "One more thing that is not as planned." }));
      });
      await page.pdf({ path, preferCSSPageSize: true, printBackground: true });
      const second = ask("pdftotext", "-f", "2", "-l", "2", path, "-");
      assert.ok(second.length > 600, `${more} lines more leave ${second.length} letters on page 2`);
    }
    await close();
  });
});
