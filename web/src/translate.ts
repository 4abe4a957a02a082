/// The page in the reader's language. English is what the sources and the record say; for German a table (words_de.ts)
/// holds each text beside its translation. A text may hold places in the manner of the program's own format strings:
/// `{}` a name or the like, within a sentence, in quotes whatever stands between them; `{w}` the same without commas, `{n}`
/// without spaces too; `{a}` anything, which stays as it is; `{v}` a
/// name with a number behind it, `{l}` several; `{*}` sentences of this table; `{:.1f}`, `{:g}` a number. The texts of the record are made of such sentences, so that pages can be
/// made from any record, also from an old one (docs/decisions/0054-german-pages.md).
import { Fragment, options, type VNode } from "preact";
import { german } from "./words_de";

const root = typeof document === "undefined" ? undefined : document.documentElement;
export const language: "en" | "de" = root?.lang === "de" ? "de" : "en";

interface Sentence {
  whole: RegExp; // the text and nothing else
  loose: RegExp; // the same, where names may hold any sign
  fixed: string; // its longest part without a place
  isNumber: boolean[]; // of each place
  isKnown: boolean[]; // of each place: in the table itself
  isKept: boolean[]; // of each place: stays as it is
  isList: boolean[]; // of each place: names with numbers
  isOpen: boolean; // ends with anything
  german: string;
  weight: number; // letters that are fixed
}

const number = "[-−]?(?:\\d[\\d\\u202f]*(?:\\.\\d+)?(?:e[+-]?\\d+| ?[×·] ?10[⁻⁰¹²³⁴-⁹]+)?|nan|inf)";
const escape = (text: string): string => text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");

function makeSentence([english, translated]: readonly [string, string]): Sentence {
  const pieces = english.split(/(\{(?:\*|a|l|v|w|n|:[^}]*)?\})/);
  const isNumber: boolean[] = [];
  const isKnown: boolean[] = [];
  const isKept: boolean[] = [];
  const isList: boolean[] = [];
  let pattern = "", loose = "";
  let weight = 0;
  let fixed = "";
  pieces.forEach((piece, i) => {
    if (i % 2 === 0) {
      pattern += escape(piece);
      loose += escape(piece);
      weight += piece.length;
      if (piece.length > fixed.length) fixed = piece;
      return;
    }
    isKnown.push(piece === "{*}");
    isNumber.push(/:.*[fgde]\}$/.test(piece));
    const isQuoted = pieces[i - 1]?.endsWith('"') === true && pieces[i + 1]?.startsWith('"') === true;
    isKept.push(piece === "{a}");
    isList.push(piece === "{l}" || piece === "{v}");
    const any = piece === "{*}" || piece === "{a}" || (isQuoted && piece === "{}") ? ".+?" : piece === "{w}" || piece === "{v}" ? "(?:(?![.] )[^,;])+?" : piece === "{n}" ? "[^\\s,;:]+" : "(?:(?![;.] ).)+?";
    pattern += `(${isNumber[isNumber.length - 1] === true ? number : any})`;
    loose += `(${isNumber[isNumber.length - 1] === true ? number : piece === "{}" ? ".+?" : any})`;
  });
  return { whole: new RegExp(`^${pattern}$`, "s"), loose: new RegExp(`^${loose}$`, "s"), fixed, isNumber, isKnown, isKept, isList, isOpen: english.endsWith("{a}"), german: translated, weight };
}

const exact = new Map(german.filter(([english]) => !english.includes("{")));
/// The most telling ones first.
const sentences = german.filter(([english]) => english.includes("{")).map(makeSentence).sort((a, b) => b.weight - a.weight);

/// Decimal commas in text; versions, dates and what stands in quotes keep their dots.
export const commas = (text: string): string => text.replace(/„[^“]*“|(?<![\w.])(-?\d+)\.(\d+(?:e[+-]?\d+)?)(?![\d.]*\.\d|\w*\.\w)/g, (found, whole?: string, rest?: string) => (whole === undefined ? found : `${whole},${rest}`));

/// What a measure may hold beside numbers: units, and words between numbers.
const unit = /^(?:[numckMG]?m[23]?|m?s|[kM]?N|[kM]?Nm|[kM]?J|[kMG]?Pa|k?g|t|Hz|deg|mm\/s|m\/s2?|k?N\/m[23]?|kg\/m[23]|N\/mm2|x|to|and|up|bis|und)$/;
/// A list in which decimal commas stand has semicolons between its parts.
const part = (text: string): string => (/\d,\d/.test(text) ? text.replaceAll(", ", "; ") : text);
/// Decimal commas in a number, or in several with their units; names keep their dots.
const commasOfMeasures = (text: string): string => (/\d\.\d/.test(text) && (text.match(/(?<![\w.])[A-Za-z][\w/]*/g) ?? []).every((word) => unit.test(word)) ? part(commas(text)) : text);

const settled = new Set<string>();
/// What is in the reader's language already, and names, from here on: they stay as they are, also within sentences.
export function settle(...texts: string[]): void {
  for (const text of texts) settled.add(text);
}

/// The German of a text that is in the table as a whole or made of sentences that are; undefined if not.
export function translate(text: string): string | undefined {
  const said = translateWhole(text) ?? translateParts(text) ?? translateWhole(text, false, true);
  if (said !== undefined || !text.endsWith(".")) return said;
  const sentence = translate(text.slice(0, -1));
  return sentence === undefined ? undefined : `${sentence}.`;
}

///   isLoose  names may hold any sign
///   isOpen   with those that end with anything, which may be further sentences
function translateWhole(text: string, isLoose = false, isOpen = isLoose): string | undefined {
  const known = exact.get(text);
  if (known !== undefined) return known;
  for (const s of sentences) {
    const found = text.includes(s.fixed) ? (isLoose ? s.loose : s.whole).exec(text) : null;
    if (isLoose && s.weight < 10) break; // anything would be like it
    if (found === null || (s.isOpen && !isOpen)) continue;
    if (s.isKnown.some((isKnown, i) => isKnown && translate((found[i + 1] as string).trim()) === undefined)) continue;
    let count = 0;
    const values = s.isNumber.map((isNumber, i) => {
      const value = found[i + 1] as string;
      return s.isKept[i] === true ? value : s.isList[i] === true ? part(value.replace(/(?<= )(-?\d+)\.(\d+(?:e[+-]?\d+)?)(?=(?: [^\s,]+)?(?:, |$))/g, "$1,$2")) : isNumber ? commas(value) : settled.has(value.trim()) ? value : translate(value.trim()) ?? commasOfMeasures(value);
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

/// The same of texts with names that hold what ends sentences.
export function translateLoosely(text: string): string | undefined {
  const said = translate(text);
  if (said !== undefined) return said;
  for (const end of [...text.matchAll(/[.;:](?= )/g)].map((found) => found.index).reverse())
    for (const cut of [end + 1, end]) {
      const gap = /^[\s.;:]*/.exec(text.slice(cut))?.[0] ?? "";
      const before = text.slice(0, cut), behind = text.slice(cut + gap.length);
      const first = translateWhole(before), rest = first === undefined ? translate(behind) : translateLoosely(behind);
      const begun = first ?? (rest === undefined ? undefined : translateWhole(before, true));
      if (begun !== undefined && rest !== undefined) return begun + gap + rest;
    }
  return translateWhole(text, true);
}

const kept = new Map<string, string>();

/// A text in the reader's language; one that the table does not have stays as it is, but for its decimal points.
export function say(text: string): string {
  if (language === "en" || settled.has(text)) return text;
  let said = kept.get(text);
  if (said === undefined) {
    const [, before = "", core = "", after = ""] = /^(\s*)(.*?)(\s*)$/s.exec(text) ?? [];
    said = /[A-Za-z]|, /.test(core) ? before + (translateLoosely(core) ?? commas(core)) + after : commas(text);
    if (kept.size < 20000) kept.set(text, said);
  }
  return said;
}

const attributes = ["aria-label", "title", "alt", "placeholder", "aria-valuetext"];

/// From here on all texts of elements are said in the reader's language; what stands in <pre> and <datalist>, and names
/// (elements with data-name), are not.
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
