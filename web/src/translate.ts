/// The page in the reader's language. English is what the sources and the record say; for German a table (words_de.ts)
/// holds each text beside its translation. A text may hold places in the manner of the program's own format strings:
/// `{}` a name or the like, within a sentence; `{w}` the same without commas, `{n}` without spaces too; `{*}` sentences of this
/// table; `{:.1f}`, `{:g}` a number. The texts of the record are made of such sentences, so that pages can be
/// made from any record, also from an old one (docs/decisions/0054-german-pages.md).
import { Fragment, options, type VNode } from "preact";
import { german } from "./words_de";

const root = typeof document === "undefined" ? undefined : document.documentElement;
export const language: "en" | "de" = root?.lang === "de" ? "de" : "en";

interface Sentence {
  whole: RegExp; // the text and nothing else
  fixed: string; // its longest part without a place
  isNumber: boolean[]; // of each place
  isKnown: boolean[]; // of each place: in the table itself
  german: string;
  weight: number; // letters that are fixed
}

const number = "[-−]?(?:\\d[\\d\\u202f]*(?:\\.\\d+)?(?:e[+-]?\\d+| ?[×·] ?10[⁻⁰¹²³⁴-⁹]+)?|nan|inf)";
const escape = (text: string): string => text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");

function makeSentence([english, translated]: readonly [string, string]): Sentence {
  const pieces = english.split(/(\{(?:\*|w|n|:[^}]*)?\})/);
  const isNumber: boolean[] = [];
  const isKnown: boolean[] = [];
  let pattern = "";
  let weight = 0;
  let fixed = "";
  pieces.forEach((piece, i) => {
    if (i % 2 === 0) {
      pattern += escape(piece);
      weight += piece.length;
      if (piece.length > fixed.length) fixed = piece;
      return;
    }
    isKnown.push(piece === "{*}");
    isNumber.push(/:.*[fgde]\}$/.test(piece));
    const any = piece === "{*}" ? ".+?" : piece === "{w}" ? "[^,;]+?" : piece === "{n}" ? "[^\\s,;:]+" : "(?:(?![;.] ).)+?";
    pattern += `(${isNumber[isNumber.length - 1] === true ? number : any})`;
  });
  return { whole: new RegExp(`^${pattern}$`, "s"), fixed, isNumber, isKnown, german: translated, weight };
}

const exact = new Map(german.filter(([english]) => !english.includes("{")));
/// The most telling ones first.
const sentences = german.filter(([english]) => english.includes("{")).map(makeSentence).sort((a, b) => b.weight - a.weight);

/// Decimal commas in text; versions, dates and names keep their dots.
export const commas = (text: string): string => text.replace(/(?<![\w.])(-?\d+)\.(\d+(?:e[+-]?\d+)?)(?![\d.]*\.\d|\w*\.\w)/g, "$1,$2");

/// The German of a text that is in the table as a whole or made of sentences that are; undefined if not.
export function translate(text: string): string | undefined {
  const said = translateWhole(text) ?? translateParts(text);
  if (said !== undefined || !text.endsWith(".")) return said;
  const sentence = translate(text.slice(0, -1));
  return sentence === undefined ? undefined : `${sentence}.`;
}

function translateWhole(text: string): string | undefined {
  const known = exact.get(text);
  if (known !== undefined) return known;
  for (const s of sentences) {
    const found = text.includes(s.fixed) ? s.whole.exec(text) : null;
    if (found === null) continue;
    if (s.isKnown.some((isKnown, i) => isKnown && translate((found[i + 1] as string).trim()) === undefined)) continue;
    let count = 0;
    const values = s.isNumber.map((isNumber, i) => {
      const value = found[i + 1] as string;
      return isNumber ? commas(value) : translate(value.trim()) ?? commas(value);
    });
    return s.german.replace(/\{(\d*)\}/g, (_, index: string) => values[index === "" ? count++ : Number(index)] ?? "");
  }
  return undefined;
}

/// Sentence after sentence: the longest beginning first, up to a sign with a space behind it.
function translateParts(text: string): string | undefined {
  const ends: number[] = [];
  for (const found of text.matchAll(/[.;:,](?= )/g)) ends.push(found.index);
  for (const end of ends.reverse())
    for (const cut of [end, end + 1]) {
      const first = translateWhole(text.slice(0, cut));
      if (first === undefined) continue;
      const gap = /^[\s.;:,]*/.exec(text.slice(cut))?.[0] ?? "";
      const rest = translate(text.slice(cut + gap.length));
      if (rest !== undefined) return first + gap + rest;
    }
  return undefined;
}

const kept = new Map<string, string>();
/// A text in the reader's language; one that the table does not have stays as it is, but for its decimal points.
export function say(text: string): string {
  if (language === "en") return text;
  let said = kept.get(text);
  if (said === undefined) {
    const [, before = "", core = "", after = ""] = /^(\s*)(.*?)(\s*)$/s.exec(text) ?? [];
    said = /[A-Za-z]|, /.test(core) ? before + (translate(core) ?? commas(core)) + after : commas(text);
    if (kept.size < 20000) kept.set(text, said);
  }
  return said;
}

const attributes = ["aria-label", "title", "alt", "placeholder", "aria-valuetext"];

/// From here on all texts of elements are said in the reader's language; what stands in <pre> and <datalist> is not.
export function translateElements(): void {
  if (language === "en") return;
  const before = options.vnode;
  options.vnode = (vnode: VNode) => {
    const props = vnode.props as Record<string, unknown>;
    const type: unknown = vnode.type;
    if ((typeof type === "string" && type !== "pre" && type !== "option" && !("data-name" in props)) || type === Fragment || (type === "option" && typeof props["children"] === "string")) {
      const children = props["children"];
      if (typeof children === "string") props["children"] = say(children);
      else if (Array.isArray(children)) props["children"] = children.map((c: unknown) => (typeof c === "string" ? say(c) : c));
      if (typeof type === "string")
        for (const name of attributes) if (typeof props[name] === "string") props[name] = say(props[name] as string);
    }
    before?.(vnode);
  };
}
