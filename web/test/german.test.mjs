// The German table: whole, used, and enough for what the program says. TOPPLE_REPORT=FILE also compares the German page of a
// real run with the English one.
import assert from "node:assert/strict";
import { mkdir, readFile, readdir, writeFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { openPage } from "./browser.mjs";
import { describe, it } from "./harness.mjs";
import { load } from "./load.mjs";

const { german } = await load("words_de.ts");
const { translate, commas } = await load("translate.ts");
const root = fileURLToPath(new URL("../../", import.meta.url));
const out = fileURLToPath(new URL("out/german/", import.meta.url));
const given = process.env.TOPPLE_REPORT;

const places = (text) => text.match(/\{[^}]*\}/g) ?? [];
/// The fixed words of a text.
const fragments = (text) => text.split(/\{[^}]*\}/).map((part) => part.replace(/\s+/g, " ").trim()).filter((part) => /[A-Za-z]/.test(part));

async function readAll(folder, pattern) {
  const names = (await readdir(root + folder, { recursive: true })).filter((name) => pattern.test(name));
  return (await Promise.all(names.map((name) => readFile(`${root}${folder}/${name}`, "utf8")))).join("\n");
}
/// Text of the string literals of C++, adjacent ones joined.
const literalsOf = (text) =>
  [...text.replace(/(?<!\\)"\s+"/g, "").matchAll(/"((?:[^"\\\n]|\\.)*)"/g)].map((m) => m[1].replace(/\\"/g, '"'));

describe("the German table", () => {
  it("has each text once and the places of each in its translation", () => {
    const seen = new Map();
    for (const [english, translated] of german) {
      assert.ok(!seen.has(english) || seen.get(english) === translated, `two translations of: ${english}`);
      seen.set(english, translated);
      assert.ok(translated.trim() !== "", english);
      const count = places(english).length;
      const used = new Set((translated.match(/\{\d*\}/g) ?? []).map((place, i) => (place === "{}" ? -1 - i : Number(place.slice(1, -1)))));
      const named = [...used].filter((n) => n >= 0);
      assert.ok(named.every((n) => n < count) && used.size <= count, `places of: ${english}`);
    }
  });

  it("translates every text with values in its places", () => {
    for (const [english, translated] of german) {
      const values = places(english).map((place, i) => (place === "{*}" ? "dust" : /:/.test(place) ? `${i + 1}.5` : `C-A${i + 1}-0`));
      let n = 0;
      const text = english.replace(/\{[^}]*\}/g, () => values[n++]);
      let k = 0;
      const expected = translated.replace(/\{(\d*)\}/g, (_, index) => commas(values[index === "" ? k++ : Number(index)]).replace(/^dust$/, "Staub"));
      assert.equal(translate(text), expected);
    }
  });

  it("holds no text that nobody says any more", async () => {
    const program = literalsOf(await readAll("src", /\.(cpp|h)$/)).join("\n").replace(/\{[^}]*\}/g, "{}");
    const pages = (await readAll("web/src", /^(?!words_de).*\.tsx?$/)).replace(/\s+/g, " ");
    const corpus = `${program.replace(/\s+/g, " ")}\n${pages}`;
    // sentences are put together at their signs
    // put together from words that depend on the run
    const made = ["No part of the upper block has touched the ground so far.", "No part of the upper block touched the ground."];
    const pieces = (english) => (made.includes(english) ? ["No part of the upper block"] : fragments(english.replace(/ \[[^\]]*\]$/, ""))).flatMap((part) => part.split(/[;:,.()]+ ?/)).filter((part) => /[A-Za-z]{3}/.test(part)).map((part) => part.trim());
    const stale = german.map(([english]) => english).filter((english) => !pieces(english).every((part) => corpus.includes(part)));
    assert.deepEqual(stale, []);
  });

  it("knows every sentence of the findings, events and values that a run tells", async () => {
    const table = german.map(([english]) => english.replace(/\{[^}]*\}/g, "{}").replace(/\s+/g, " ")).join("\n");
    const missing = [];
    for (const file of ["findings", "mechanism", "recorder", "plan_record", "vibration"]) {
      const text = await readFile(`${root}src/collapse/${file}.cpp`, "utf8");
      for (const literal of literalsOf(text.replace(/\/\/.*/g, ""))) {
        if (/\/|^\w+\.|_/.test(literal)) continue; // includes, ids, names of files
        for (const part of fragments(literal))
          if (part.split(" ").length >= 3 && !table.includes(part.replace(/^[;,:. )]+|[;,:. (]+$/g, ""))) missing.push(`${file}.cpp: ${part}`);
      }
    }
    assert.deepEqual(missing, []);
  });

  it("writes decimal commas and leaves versions and dates alone", () => {
    assert.equal(commas("1.5 m at -0.25 s, 3.0e-12, (1.0, 2.5)"), "1,5 m at -0,25 s, 3,0e-12, (1,0, 2,5)");
    for (const text of ["topple 0.1.0", "2026-11-20", "record.h5", "C20.5x"]) assert.equal(commas(text), text);
    assert.equal(translate("It topples: at the end, 5.00 s, it leans by 1.5 deg, its mass centre has come down by 0.10 m, and its rear edge 3 % as far as its front edge. In the end 90 % of the mass has come down. Parts were still moving when the run ended."),
      "Es kippt: Am Ende, bei 5,00 s, neigt er sich um 1,5 deg, sein Schwerpunkt ist um 0,10 m gefallen und seine hintere Kante um 3 % so weit wie seine vordere. Am Ende sind 90 % der Masse heruntergekommen. Als die Rechnung endete, bewegten sich noch Teile.");
    assert.match(translate("It topples: when the upper block first touches the ground, at 1.23 s, it leans by 15.7 deg, its mass centre has come down by 1.47 m, and its rear edge 2 % as far as its front edge. In the end 100 % of the mass has come down. Parts were still moving when the run ended."),
      /^Es kippt: Wenn der obere Block zuerst den Boden berührt, bei 1,23 s, neigt er sich .* herunter\w+\. Als die Rechnung endete/);
    assert.equal(translate("Nobody ever says this."), undefined);
  });
});

/// Texts that a reader sees or hears, in their order.
const collect = (page) =>
  page.evaluate(() => {
    const out = [];
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT | NodeFilter.SHOW_ELEMENT);
    for (let n = walker.nextNode(); n !== null; n = walker.nextNode()) {
      if (n.nodeType === Node.TEXT_NODE) {
        if (n.parentElement.closest("script, style, pre, datalist") === null && n.data.trim() !== "") out.push(n.data.trim());
      } else
        for (const name of ["aria-label", "title", "alt", "placeholder"]) if (n.hasAttribute(name)) out.push(n.getAttribute(name));
    }
    return out;
  });

if (given !== undefined)
  describe("the German page of a run", () => {
    it("has no English left", { timeout: 240000 }, async () => {
      await mkdir(out, { recursive: true });
      const english = await readFile(given, "utf8");
      const path = `${out}de.html`;
      await writeFile(path, english.replace('<html lang="en">', '<html lang="de">'));
      const one = await openPage(given), other = await openPage(path);
      const before = await collect(one.page), after = await collect(other.page);
      const data = JSON.parse(await one.page.textContent("#topple-data"));
      assert.equal(after.length, before.length);
      const { provenance: p } = data;
      const names = new Set([p.title, p.plan_path, p.plan_sha256, p.engine, p.machine, `topple ${p.program_version}`, `topple ${p.program_version} ·`, "Plan", "Zone", "Esc", "Problem", "Moment"]);
      for (const list of [data.bodies, data.zones, data.neighbours]) for (const one of list) names.add(one.name);
      for (const v of data.plan_values) names.add(v.key), names.add(v.value.split(", ")[0]);
      const left = after.filter((text, i) => text === before[i] && /[A-Za-z]{2}/.test(text) && !names.has(text) && !/^[\d.,:\s·–-]*(?:m|s|t|MJ|MN|ms|UTC)?$/.test(text) && !data.plan_values.some((v) => v.value === text));
      assert.deepEqual([...new Set(left)], []);
      // function words of English, apart from names that people gave
      const words = /\b(?:the|of|and|with|from|which|when|than|its|are|were|has|have|this|that|not)\b/i;
      const titles = [p.title, ...data.neighbours.map((n) => n.name), ...data.events.filter((e) => e.kind === "stage").map((e) => /"(.*)"/.exec(e.text)?.[1] ?? "")].filter((t) => t !== "");
      const odd = after.filter((text) => words.test(titles.reduce((rest, title) => rest.replaceAll(title, ""), text)));
      assert.deepEqual([...new Set(odd)], []);
      assert.equal(await other.page.evaluate(() => document.title.endsWith("topple-Bericht")), true);
      assert.deepEqual([...one.problems, ...other.problems], []);
      await other.page.screenshot({ path: `${out}de.png`, fullPage: true });
      await one.close();
      await other.close();
    });
  });
