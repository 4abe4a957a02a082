// The German table: whole, used, and enough for what the program says. TOPPLE_REPORT=FILE, TOPPLE_STUDY=FILE compare
// the German page of a real run or study with the English one, instead of that of a made-up study.
import assert from "node:assert/strict";
import { mkdir, readFile, readdir, writeFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { openPage } from "./browser.mjs";
import { describe, it } from "./harness.mjs";
import { load } from "./load.mjs";
import { makeStudy, writeStudy } from "./study-data.mjs";
import { hostile, makeSynthetic, writePage } from "./synthetic.mjs";

const { german } = await load("words_de.ts");
const { translate, translateLoosely, commas } = await load("translate.ts");
const { prettify } = await load("units.ts");
const { titleOf, unitWord } = await load("study/data.ts");
const root = fileURLToPath(new URL("../../", import.meta.url));
const out = fileURLToPath(new URL("out/german/", import.meta.url));
const { TOPPLE_REPORT: run, TOPPLE_STUDY: study } = process.env;

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

/// Arguments of the call of C++ whose parenthesis opens at `at`, as text.
function argumentsOf(text, at) {
  const out = [];
  let depth = 0, from = at + 1, isQuoted = false;
  for (let i = at; i < text.length; ++i) {
    const c = text[i];
    if (isQuoted) {
      if (c === "\\") ++i;
      else if (c === '"') isQuoted = false;
    } else if (c === '"') isQuoted = true;
    else if ("([{".includes(c)) ++depth;
    else if (")]}".includes(c) && --depth === 0) return [...out, text.slice(from, i)];
    else if (c === "," && depth === 1) {
      out.push(text.slice(from, i));
      from = i + 1;
    }
  }
  return out;
}

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
    const program = literalsOf(await readAll("src", /\.(cpp|h)$/)).map(normalise).join("\n").replace(/\{[^}]*\}/g, "{}");
    const pages = (await readAll("web/src", /^(?!words_de).*\.tsx?$/)).replace(/\s+/g, " ");
    const corpus = `${program.replace(/\s+/g, " ")}\n${pages}`;
    // put together from words that depend on the run: what all of them have
    const made = [/^wind, and people's behaviour/, /^No equilibrium was found under dead load/, /^No part of the upper block/, /^Breaking/, /^no dead-load equilibrium after \S+ iterations: the largest unbalanced force/, /^dead load/, /what the others hold; of all reactions that give the same motion/, /^singular position at/];
    // sentences are put together at their signs
    const pieces = (english) => (made.some((start) => start.test(english)) ? fragments(made.map((start) => start.exec(english)?.[0] ?? "").join("")) : fragments(english.replace(/ \[[^\]]*\]$/, ""))).flatMap((part) => part.split(/[;:,.()]+ ?/)).filter((part) => /[A-Za-z]{3}/.test(part)).map((part) => part.trim());
    const stale = german.map(([english]) => english).filter((english) => !pieces(english).every((part) => corpus.includes(part)));
    assert.deepEqual(stale, []);
  });

  // how a text of the sources stands in the table
  const normalise = (text) => text.replaceAll("\\n", " ").replace(/%[-+.\d]*l?[dsgfe]/g, "{}").replaceAll("%%", "%");

  const table = german.map(([english]) => english.replace(/\{[^}]*\}/g, "{}").replace(/\s+/g, " ")).join("\n");
  /// What of the literals in a piece of C++ the table does not have, of so many words at least.
  const findMissing = (text, words) =>
    literalsOf(text)
      .filter((literal) => !/\/\w|^\w+\.|^[^ ]*_[^ ]*$/.test(literal)) // includes, ids, names of files
      .flatMap((literal) => fragments(normalise(literal)))
      .map((part) => part.replace(/^[;,:. )\]"'+]+|[;,:. (["'+]+$/g, ""))
      .filter((part) => part.split(" ").length >= words && !table.includes(part));

  it("knows every sentence that findings, events, values, notes and studies tell", async () => {
    const tellers = {
      collapse: ["findings", "mechanism", "outcome", "structures", "recorder", "plan_record", "vibration", "shafts", "live_model", "manager", "run"],
      farfield: ["run", "fragments", "whole", "motion"],
      study: ["story", "plan_model"],
      fem: ["relaxation"],
      mbs: ["equilibrium", "dampers", "forces", "joint_notes"],
    };
    const missing = [];
    for (const [folder, files] of Object.entries(tellers))
      for (const file of files) {
        const text = await readFile(`${root}src/${folder}/${file}.cpp`, "utf8");
        // what is refused: below
        const told = text.replace(/\/\/.*/g, "").replace(/\b(?:InputError|runtime_error|complain|complaints|demand|refuse)\b[\s\S]*?;\n/g, "");
        for (const part of findMissing(told, 3)) missing.push(`${folder}/${file}.cpp: ${part}`);
      }
    assert.deepEqual(missing, []);
  });

  it("knows why a sample is no plan, cannot be built or failed", async () => {
    // a sample differs from its plan, which was read, in numbers: it breaks off neither at words and kinds of values nor at what is too
    // many or missing; steering, files of rules and the files of a study's own inputs speak to the terminal
    const others = /^E(?:20[1-46-9]|21[15]|30[12347]|40[136]|6[67]|[789])/;
    const read = {
      product: /^(?:read_(?:blasting|grid|materials|members|shafts|site)|table_reader)\.cpp$/,
      material: /^(?:concrete|steel)\.cpp$/,
      nearfield: /^(?:cage|fired|panel|rcc|ring|shell)\.cpp$/,
      collapse: /^(?:assembly|builder|charges|condense|connections|law|manager|schedule|shafts)\.cpp$/,
    };
    const missing = [];
    for (const [folder, pattern] of Object.entries(read))
      for (const file of (await readdir(`${root}src/${folder}`)).filter((name) => pattern.test(name))) {
        const text = (await readFile(`${root}src/${folder}/${file}`, "utf8")).replace(/\/\/.*/g, "");
        for (const call of text.matchAll(/\b(?:InputError|complain|refuse|error|Diagnostic|complaints\.push_back)\s*[({]+/g)) {
          const all = argumentsOf(text, call.index + call[0].length - 1);
          const code = all.map((one) => /^\s*"(E\d+)"\s*$/.exec(one)?.[1]).find((one) => one !== undefined);
          if (code !== undefined && code !== "E207" && others.test(code)) continue;
          // of the message, not of the hint behind it
          const message = all.find((one) => literalsOf(one).some((literal) => fragments(normalise(literal)).some((part) => part.includes(" "))));
          for (const part of findMissing(message ?? "", 2)) missing.push(`${folder}/${file} ${code ?? ""}: ${part}`);
        }
      }
    for (const [file, told] of [["mbs/course", /out\.message \+= ([^;]*);/g], ["collapse/sample_runs", /\.text = ([^;]*);/g], ["study/evaluator", /\ba\.text = ([^;]*);|give_open\(([^;]*);/g], ["study/process", /\bwords = ([^;]*);/g], ["study/store", /\ba\.text = ([^;]*);/g],
      ["study/manager", /\bfind_fault[^}]*\}/g], ["study/plan_mapping", /\.text = ([^;]*);/g], ["product/plan_sampler", /InputError\("E207",([^,]*),/g], ["uncertainty/archive", /\.text = ([^;]*);/g],
      ["uncertainty/randomness", /\.text = ([^;]*);/g]])
      for (const one of (await readFile(`${root}src/${file}.cpp`, "utf8")).matchAll(told)) for (const part of findMissing(one[0], 2)) missing.push(`${file}.cpp: ${part}`);
    assert.deepEqual(missing, []);
  });

  it("says in German why runs failed", () => {
    for (const [english, expected] of [
      ["No equilibrium was found under dead load before the first charge: no dead-load equilibrium after 200 iterations: the largest unbalanced force is 0.12 times the weight, of body \"C-A1-0\"; without limits element \"C-A1-0/foot\" would be loaded to 130 % of its capacity.",
        "Vor der ersten Ladung wurde kein Gleichgewicht unter Eigengewicht gefunden: kein Gleichgewicht nach 200 Iterationen: Die größte nicht ausgeglichene Kraft ist das 0,12-Fache des Gewichts, an Körper „C-A1-0“; ohne Grenzen wäre Element „C-A1-0/foot“ zu 130 % seines Widerstands belastet."],
      ["The computation failed at 0.512 s: diverged at 0.512000 s: the pose of body \"node A1, storey 1\" is no longer finite.",
        "Die Rechnung ist bei 0,512 s gescheitert: divergiert bei 0,512000 s: die Lage von Körper „node A1, storey 1“ besteht nicht mehr aus endlichen Zahlen."],
      ["3 x no equilibrium was found under dead load before the first charge: the stiffness matrix of the dead-load equilibrium could not be factorised: the model is a mechanism",
        "3 × vor der ersten Ladung wurde kein Gleichgewicht unter Eigengewicht gefunden: die Steifigkeitsmatrix des Gleichgewichts ließ sich nicht zerlegen: Das Modell ist ein Mechanismus"],
      ["12 x concrete.hinge: fc: \"250000000 Pa\" is out of range", "12 × concrete.hinge: fc: „250000000 Pa“ liegt außerhalb des erlaubten Bereichs"],
      ["stage[0].charge[1]: the destroyed length, 0.20 m to 3.40 m, reaches out of C-A1-0", "stage[0].charge[1]: die zerstörte Länge, 0,20 m bis 3,40 m, reicht über C-A1-0 hinaus"],
      ["concrete.hinge.fct: the formula has no value", "concrete.hinge.fct: Die Formel hat keinen Wert"],
      ["C-A1-0: a charge lies in the joint above the clear height of 2.440000 m", "C-A1-0: eine Ladung liegt im Knoten über der lichten Höhe von 2,440000 m"],
      ["section 'ground-column': the bars fill more than a fifth of the section", "Querschnitt „ground-column“: die Stäbe füllen mehr als ein Fünftel des Querschnitts"],
      ["2 x the evaluator ended without an answer: exit code 3", "2 × das Programm endete ohne Antwort: Rückgabewert 3"],
      ["2 x the evaluator ended without an answer: Segfault in my.model", "2 × das Programm endete ohne Antwort: Segfault in my.model"],
      ["3 x 5 of 20 inner runs failed: my own words", "3 × 5 von 20 inneren Rechnungen sind gescheitert: my own words"],
      ["It does not stand; 84 zones have yielded, 528 are broken. The upper block has moved by 303.9 cm and its fastest part moves at 12.618 m/s.",
        "Es steht nicht; 84 Zonen fließen, 528 sind gebrochen. Der obere Block hat sich um 303,9 cm bewegt, sein schnellstes Teil bewegt sich mit 12,618 m/s."],
    ])
      assert.equal(translate(english), expected);
  });

  it("says in German when the findings would not hold", async () => {
    const { listConditions } = await load("handover.tsx");
    const name = "Haus 3.5; Hof: links. Nr. 2";
    const finding = (id, status, more) => ({ id, status, title: name, heading: "Abstände", text: "", value: null, unit: "", time: null, ...more });
    const pause = 'Zwischen „Row 1.5 (0.5 s)“ und „B“', limited = "Nichts; der Grenzwert ist 4,0 m.";
    const findings = [
      finding("mechanism", "good"), finding("clearance.0", "bad"), finding("criterion.mechanism", "bad", { title: "Mechanismus: Kippen" }),
      finding("clearance.1", "warning", { value: 0 }), finding("criterion.fall", "not_judged", { title: "Mechanismus: Kippen" }), finding("clearance.2", "not_judged"),
      finding("vibration.0", "warning"), finding("clearance.3", "good", { value: 6.25 }), finding("clearance.4", "good", { value: 6.25, text: limited }),
    ];
    const stability = (text, value) => [...findings, finding("stability.0", "good", { title: pause, text, value })];
    const runs = [stability("", 1.25), stability("1 Zone fließt", 1.25), stability("3 Zonen fließen", 1.25), stability("1 ist gebrochen", 1.25), stability("3 sind gebrochen", 1.25), stability("", 1)];
    const told = new Set();
    for (const [i, list] of runs.entries())
      for (const sentence of listConditions({ findings: list, events: Array.from({ length: i }, () => ({ kind: "charge" })) })) told.add(sentence);
    assert.equal(told.size, 20);
    for (const sentence of told) {
      const said = translate(sentence);
      assert.ok(said !== undefined && said !== sentence, sentence);
      for (const kept of [name, pause, "Mechanismus: Kippen"]) assert.equal(said.includes(kept), sentence.includes(kept), said);
    }
  });

  it("writes decimal commas at numbers behind names", () => {
    assert.equal(translate("least touchdown: 0.75 s"), "kleinster Wert von touchdown: 0,75 s");
    assert.equal(translate("largest z0: -14.64"), "größter Wert von z0: -14,64");
    assert.equal(translate("It takes no more than x1 16.85 N/mm2 (core 25), x2 47.48 (core 64.5)."), "Dazu genügt x1 16,85 N/mm2 (Kern 25), x2 47,48 (Kern 64,5).");
    assert.equal(translate("Lowest margins: S-B2C3-1 3.56, shaft 1.5/foot 13.57 of 75 members."), "Kleinste Reserven: S-B2C3-1 3,56; shaft 1.5/foot 13,57 (von 75 Bauteilen).");
    assert.equal(
      translate("Lowest margins: C-A1-0 1.86, C-B1-0 1.90 of 3 members. Heads of ground columns turn about y here; about x the margin is 2.24."),
      "Kleinste Reserven: C-A1-0 1,86; C-B1-0 1,90 (von 3 Bauteilen). Köpfe der Erdgeschossstützen drehen sich hier um y; um x ist die Reserve 2,24.",
    );
  });

  it("parts numbers with decimal commas by semicolons", () => {
    assert.equal(translate("Towards each of these sides 95 % of the mass lies within 58.9, 0.0, 0.0 and 0.0 m of it."), "Nach diesen Seiten liegen je 95 % der Masse innerhalb von 58,9; 0,0; 0,0 und 0,0 m davon.");
    assert.equal(translate("C-A1-0 at 4.80 s at (-58.8, 0.0) m with 1.20 MJ and 0.20 MN s"), "C-A1-0 bei 4,80 s an (-58,8; 0,0) m mit 1,20 MJ und 0,20 MN s");
    assert.equal(translate('stage 1 "Row A": 1 charge'), "Zündstufe 1 „Row A“: 1 Ladung");
  });

  it("leaves names as people gave them", async () => {
    const name = "Haus 3.5; Hof: links. Nr. 2.5", stage = "Row 1.5; (0.5 s). B: x";
    assert.equal(translate(`stage 1 "${stage}": 2 charges`), `Zündstufe 1 „${stage}“: 2 Ladungen`);
    assert.equal(translate(`Clearance of ${name}`), `Abstand von ${name}`);
    assert.equal(translateLoosely(`${name} hits Gas 2.5 bar at 3.5 m/s`), `${name} trifft Gas 2.5 bar mit 3,5 m/s`);
    assert.equal(translateLoosely(`Everything came to rest at 3.50 s. The nearest part, ${name}, comes to 26.1 m at 4.00 s; the limit is 5.0 m. It still sways (still: below 0.05 m/s).`),
      `Bei 3,50 s kam alles zur Ruhe. Das nächste Teil, ${name}, kommt bei 4,00 s auf 26,1 m heran; der Grenzwert ist 5,0 m. Es schwankt noch (still: unter 0,05 m/s).`);
  });

  it("writes decimal commas and leaves versions and dates alone", () => {
    assert.equal(commas("1.5 m at -0.25 s, 3.0e-12, (1.0, 2.5)"), "1,5 m at -0,25 s, 3,0e-12, (1,0, 2,5)");
    for (const text of ["topple 0.1.0", "2026-11-20", "record.h5", "C20.5x"]) assert.equal(commas(text), text);
    assert.equal(translate("It topples: at the end, 5.00 s, it leans by 1.5 deg, its mass centre has come down by 0.10 m, and its rear edge 3 % as far as its front edge. In the end 90 % of the mass has come down. Parts were still moving when the run ended."),
      "Es kippt: Am Ende, bei 5,00 s, neigt er sich um 1,5 deg, sein Schwerpunkt ist um 0,10 m gefallen und seine hintere Kante um 3 % so weit wie seine vordere. Am Ende sind 90 % der Masse heruntergekommen. Als die Rechnung endete, bewegten sich noch Teile.");
    assert.match(translate("It topples: when the upper block first touches the ground, at 1.23 s, it leans by 15.7 deg, its mass centre has come down by 1.47 m, and its rear edge 2 % as far as its front edge. In the end 100 % of the mass has come down. Parts were still moving when the run ended."),
      /^Es kippt: Wenn der obere Block zuerst den Boden berührt, bei 1,23 s, neigt er sich .* herunter\w+\. Als die Rechnung endete/);
    assert.equal(translate("Nobody ever says this."), undefined);
    assert.equal(translate("First touchdown of the upper block: A 4.80 s, B not up to 0.50 s."), "Erstes Aufsetzen des oberen Blocks: A 4,80 s, B nicht bis 0,50 s.");
    assert.equal(translate("native (second)"), "native (zweite)");
    assert.equal(translate("finite elements (second)"), "finiten Elementen (zweite)");
    assert.equal(translate("First touchdown of the upper block: A not up to 0.50 s, B not up to 1.00 s."), "Erstes Aufsetzen des oberen Blocks: A nicht bis 0,50 s, B nicht bis 1,00 s.");
    assert.equal(translate("First touchdown of the upper block: A 4.80 s, B 4.85 s, difference +0.050 s."), "Erstes Aufsetzen des oberen Blocks: A 4,80 s, B 4,85 s, Unterschied +0,050 s.");
    assert.equal(translate("Hall: parts come 5.6 m farther than in this run; the limit of 4.0 m is then broken."), "Hall: Teile kommen 5,6 m weiter als in dieser Rechnung; der Grenzwert von 4,0 m ist dann unterschritten.");
    assert.equal(translate("The nearest part, C-A1-0, comes to 9.6 m at 4.10 s; the limit is 4.0 m."), "Das nächste Teil, C-A1-0, kommt bei 4,10 s auf 9,6 m heran; der Grenzwert ist 4,0 m.");
    assert.equal(translate("Asked: topple; found: topple. Not judged: it had not come to rest when the run ended."), "Verlangt: Kippen; gefunden: Kippen. Nicht beurteilt: Am Ende der Rechnung war es noch nicht in Ruhe.");
    assert.match(translate("The nearest part, chimney/12, comes to 26.1 m at 4.00 s; the limit is 5.0 m. Not judged: chimney/12 still moved at 4.6 m/s when the run ended, and may break this limit."),
      / der Grenzwert ist 5,0 m\. Nicht beurteilt: chimney\/12 bewegte sich am Ende der Rechnung noch mit 4,6 m\/s /);
    assert.equal(translate("Frames"), "Rahmen"); // of the building
    assert.equal(translate("Frames of the record"), "Bilder der Aufzeichnung");
    assert.equal(translate("Row C fires at 5.5 s instead of 4 s"), "Row C zündet bei 5,5 s statt bei 4 s");
    assert.equal(translate("C-D2-0 is cut at 0 m: 50 % of the bars, 30 % of the concrete"), "C-D2-0 ist in 0 m angeschnitten: 50 % der Stäbe, 30 % des Betons");
    assert.equal(translate("friction of the ground 0.5, of the parts 0.6"), "Reibung am Boden 0,5, zwischen den Teilen 0,6");
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

/// Compares the page at `path` with itself in German. `name` names the picture that is left for people to look at; `namesOf`
/// gives, of the page's data, what people named and what is alike in both languages.
async function compareLanguages(path, name, namesOf) {
  await mkdir(out, { recursive: true });
  const english = await readFile(path, "utf8");
  const germanPath = `${out}${name}.html`;
  await writeFile(germanPath, english.replace('<html lang="en">', '<html lang="de">'));
  const one = await openPage(path), other = await openPage(germanPath);
  for (const { page } of [one, other])
    await page.evaluate(() => {
      for (const e of document.querySelectorAll("details")) e.open = true;
      return new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
    });
  const before = await collect(one.page), after = await collect(other.page);
  const { alike, named } = namesOf(JSON.parse(await one.page.textContent("#topple-data")));
  assert.equal(after.length, before.length);
  const names = new Set([...alike, ...named].flatMap((text) => [text, commas(prettify(text ?? ""))]));
  const areNames = (text) => names.has(text) || text.split(", ").every((part) => names.has(part));
  const isNumber = /^[\d.,:\s·–≥≤%×^⁰¹²³⁴-⁹⁻−-]*(?:m|s|t|MJ|MN|ms|UTC)?$/;
  const left = after.filter((text, i) => (text === before[i] || text === commas(before[i])) && /[A-Za-z]{2}/.test(text) && !areNames(text) && !isNumber.test(text));
  assert.deepEqual([...new Set(left)], []);
  // function words of English, apart from names ("be" in a digest is one too)
  const words = /(?<!\p{L})(?:the|of|and|with|from|which|when|than|its|are|were|has|have|this|that|not|at|is|for|by|to|on|no|be|been|after|before|below|above|least|largest|core)(?!\p{L})/iu;
  const odd = after.filter((text) => !areNames(text) && words.test(named.filter((t) => t !== "").reduce((rest, title) => rest.replaceAll(title, ""), text)));
  assert.deepEqual([...new Set(odd)], []);
  assert.deepEqual([...one.problems, ...other.problems], []);
  const title = await other.page.title();
  await other.page.screenshot({ path: `${out}${name}.png`, fullPage: true });
  await one.close();
  await other.close();
  return title;
}

const namesOfRun = (data) => {
  const { provenance: p } = data;
  const alike = [p.plan_path, p.plan_sha256, p.engine, p.machine, `topple ${p.program_version}`, `topple ${p.program_version} ·`, "Plan", "Zone", "Esc", "Problem", "Moment", "[MJ]", "[MN]"];
  for (const list of [data.bodies, data.zones, data.neighbours]) for (const one of list) alike.push(one.name);
  for (const v of data.plan_values) alike.push(v.key, v.value, v.value.split(", ")[0]);
  // findings about one member, under its name
  for (const f of data.findings) if (/^farfield\.zone\.\d+$/.test(f.id)) alike.push(f.title);
  const named = [p.title, ...data.neighbours.map((n) => n.name), ...data.events.filter((e) => e.kind === "stage").map((e) => /"(.*)"/.exec(e.text)?.[1] ?? "")];
  return { alike, named };
};

const namesOfStudy = (data) => {
  const quantities = [...data.inputs.flatMap((q) => [q.name, q.label]), ...data.derived.map((q) => q.name), ...data.outputs.map((q) => q.name), ...data.curves.map((q) => q.name)];
  const units = [...data.inputs, ...data.derived, ...data.outputs].map((q) => q.unit);
  const alike = [...quantities, ...units, data.origin.source_name, data.origin.model, data.origin.program_version, "α", "Plan", "Problem"];
  for (const q of [...data.inputs, ...data.derived, ...data.outputs, ...data.curves]) alike.push(titleOf(q), titleOf({ name: q.label, unit: q.unit }), unitWord(q.unit), `[${unitWord(q.unit)}]`);
  // what a program says of its own failures, and what was typed
  alike.push(...(data.origin.kind === "plan" ? [] : data.failures), data.boxes?.requirement, `topple ${data.origin.program_version}`);
  return { alike, named: [data.title, data.asked, ...quantities, ...data.site.neighbours.map((n) => n.name)] };
};

if (run !== undefined)
  describe("the German page of a run", () => {
    it("has no English left", { timeout: 240000 }, async () => {
      assert.match(await compareLanguages(run, "run", namesOfRun), /topple-Bericht$/);
    });
  });

if (study !== undefined)
  describe("the German page of a study", () => {
    it("has no English left", { timeout: 240000 }, async () => {
      assert.match(await compareLanguages(study, "study", namesOfStudy), /topple-Studie$/);
    });
  });

if (run === undefined && study === undefined)
  describe("names on a German page", () => {
    it("are those of the plan", { timeout: 120000 }, async () => {
      await mkdir(out, { recursive: true });
      const data = makeSynthetic(3);
      const title = "Gas 2.5 bar; Hof: links. Nr. 3.5", stage = 'Row 1.5 (0.5 s)';
      data.provenance.title = title;
      data.neighbours[0].name = title;
      data.bodies[0].name = "C 1.5";
      Object.assign(data.findings[0], { title, text: `The nearest part, C 1.5, comes to 26.1 m at 4.00 s; the limit is 5.0 m.` });
      Object.assign(data.findings[5], { title });
      data.events[0].text = `stage 1 "${stage}": 2 charges`;
      data.plan_values[0] = { group: "Site", key: `Clearance of ${title}`, value: "at most 2.5 m" };
      await writePage(data, `${out}names.en.html`);
      const english = await readFile(`${out}names.en.html`, "utf8");
      await writeFile(`${out}names.html`, english.replace('<html lang="en">', '<html lang="de">'));
      const { page, close } = await openPage(`${out}names.html`);
      const texts = await collect(page);
      await close();
      assert.deepEqual([...new Set(texts.filter((text) => /[23],5 bar|Nr\. 3,5|Row 1,5|0,5 s\)|C 1,5/.test(text)))], []);
      for (const text of [title, `Zündstufe 1 „${stage}“: 2 Ladungen`, `Abstand von ${title}`, "höchstens 2,5\u00a0m", "Das nächste Teil, C 1.5, kommt bei 4,00\u00a0s auf 26,1\u00a0m heran; der Grenzwert ist 5,0\u00a0m."])
        assert.ok(texts.includes(text), text);
    });
  });

if (run === undefined && study === undefined)
  describe("the German page of a made-up study", () => {
    it("has no English left", { timeout: 240000 }, async () => {
      await mkdir(out, { recursive: true });
      // whatever people name: quotes and semicolons would be part of sentences
      const made = JSON.parse(JSON.stringify(makeStudy()).replaceAll(JSON.stringify(hostile).slice(1, -1), "Kran").replaceAll('"reach"', '"utilisation"'));
      made.failures = ["2 x a value is not finite"];
      await writeStudy(made, `${out}made-up.en.html`);
      await compareLanguages(`${out}made-up.en.html`, "made-up", namesOfStudy);
      const { page, close } = await openPage(`${out}made-up.html`);
      const texts = await collect(page);
      await close();
      // an output has one name, that of samples.csv
      assert.ok(texts.includes("Zugehörigkeit von utilisation"));
      assert.deepEqual(texts.filter((text) => /Ausnutzung/.test(text)), []);
    });
    it("is that of a report with a study, which keeps the names of outputs", { timeout: 120000 }, async () => {
      const data = makeSynthetic(3), { outcomes, verdict, runs, failed, title } = makeStudy();
      data.study = { title, runs, failed, verdict, outcomes, outputs: [{ name: "utilisation", unit: "", levels: [{ alpha: 0, lower: 0.1, upper: 0.9 }, { alpha: 1, lower: 0.5, upper: 0.5 }] }] };
      data.study.outputs.push({ ...data.study.outputs[0], name: "touchdown_energy_of_the_upper_block", unit: "MJ" });
      await writePage(data, `${out}with-study.en.html`);
      await writeFile(`${out}with-study.html`, (await readFile(`${out}with-study.en.html`, "utf8")).replace('<html lang="en">', '<html lang="de">'));
      const { page, close } = await openPage(`${out}with-study.html`);
      const first = await page.$$eval("[data-test=fuzzy-results] table:last-of-type tbody td:first-child", (list) => list.map((e) => e.innerText.trim()));
      const speeds = (await page.$$eval(".transport option", (list) => list.map((e) => e.textContent))).slice(0, 3);
      const broken = await page.$$eval(".fuzzy-results :is(th, td) :is(*, :scope)", (list) => list.flatMap((e) => [...e.childNodes].filter((n) => n.nodeType === 3)).flatMap((n) =>
        [...n.data.matchAll(/[^\s-]+/g)].filter((word) => {
          const range = document.createRange();
          range.setStart(n, word.index);
          range.setEnd(n, word.index + word[0].length);
          return new Set([...range.getClientRects()].map((r) => Math.round(r.top))).size > 1;
        }).map(String)));
      // with the longest name that studies of plans have
      await page.locator("[data-test=fuzzy-results] table:last-of-type tbody td:first-child").last().evaluate((cell) => (cell.textContent = "touchdown_energy [MJ]"));
      const cut = [];
      for (const width of [1280, 800]) {
        await page.setViewportSize({ width, height: 900 });
        if (await page.$eval(".fuzzy-results", (section) => [...section.querySelectorAll("table")].some((table) => table.getBoundingClientRect().right > section.getBoundingClientRect().right))) cut.push(width);
      }
      await close();
      assert.deepEqual(speeds, ["0,1×", "0,25×", "0,5×"]);
      assert.deepEqual(first, ["utilisation", "touchdown_energy_of_the_upper_block [MJ]"]);
      assert.deepEqual(broken, []);
      assert.deepEqual(cut, [], "all columns are seen");
    });
  });
