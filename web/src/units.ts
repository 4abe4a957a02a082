/// The one place where SI turns into what people read.

interface Readable {
  unit: string;
  factor: number;
}
const readable: Record<string, Readable> = {
  rad: { unit: "°", factor: 180 / Math.PI },
  "rad/s": { unit: "°/s", factor: 180 / Math.PI },
  J: { unit: "MJ", factor: 1e-6 },
  N: { unit: "MN", factor: 1e-6 },
  "N·m": { unit: "MN·m", factor: 1e-6 },
  "N*m": { unit: "MN·m", factor: 1e-6 },
  Nm: { unit: "MN·m", factor: 1e-6 },
  Pa: { unit: "N/mm²", factor: 1e-6 },
  kg: { unit: "t", factor: 1e-3 },
  "1": { unit: "", factor: 1 },
  m2: { unit: "m²", factor: 1 },
  m3: { unit: "m³", factor: 1 },
};

export function toReadable(unit: string): Readable {
  return readable[unit] ?? { unit, factor: 1 };
}

/// A whole number as an exponent.
const raise = (n: number): string => String(n).replace(/-/g, "⁻").replace(/\d/g, (digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(digit)] as string);

/// Four significant digits; "–" for what is not a number.
export function formatNumber(value: number | null | undefined, digits = 4): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e") as [string, string];
    return `${mantissa.replace("-", "−")} × 10${raise(Number(exponent))}`;
  }
  const decimals = Math.max(0, Math.min(6, digits - 1 - Math.floor(Math.log10(size))));
  return value.toFixed(decimals).replace("-", "−");
}

/// As many more digits as values need that vary little beside their size.
export function digitsWithin(low: number, high: number, digits = 4): number {
  const size = Math.max(Math.abs(low), Math.abs(high)), width = high - low;
  return width > 0 && Number.isFinite(size) ? Math.min(15, digits + Math.max(0, Math.floor(Math.log10(size / width) + 1e-9))) : digits;
}

/// With so many significant digits, by `round`; what is such a number but for its last bits stays that number.
function roundTo(value: number, digits: number, round: (x: number) => number, slack: number): number {
  if (!(value > 0)) return value;
  const decimals = digits - 1 - Math.floor(Math.log10(value));
  return round(value * 10 ** decimals + slack) / 10 ** decimals;
}

/// A possibility that was found can only be higher, a necessity only lower: that stays true of what is written.
export const atLeast = (possibility: number | null, digits: number): string =>
  possibility === null || possibility >= 1 ? formatNumber(possibility, 1) : `≥ ${formatNumber(roundTo(possibility, digits, Math.floor, 1e-9), digits)}`;
export const atMost = (necessity: number | null, digits: number): string =>
  necessity === null || necessity <= 0 ? formatNumber(necessity, 1) : `≤ ${formatNumber(roundTo(necessity, digits, Math.ceil, -1e-9), digits)}`;

/// The largest size of all numbers.
export function findLargest(values: (number | null)[][]): number {
  let largest = 0;
  for (const list of values) for (const x of list) if (x !== null && Math.abs(x) > largest) largest = Math.abs(x);
  return largest;
}

/// 0 for what a sum of numbers of this size leaves when it cancels.
export function dropRoundOff(value: number | null | undefined, size: number): number | null | undefined {
  return typeof value === "number" && Math.abs(value) < 1e-12 * size ? 0 : value;
}

/// A readable number with its unit.
export function formatValue(value: number | null | undefined, unit: string): string {
  const number = unit === "" && Number.isInteger(value) ? String(value).replace("-", "−") : formatNumber(value);
  return number === "–" ? number : `${number}${unit === "°" ? "" : " "}${unit}`.trim();
}

/// Texts of the record are plain: "12 deg +- 3 deg", "40 m2", "towards -x".
export function prettify(text: string): string {
  return text
    .replace(/(\d) deg\b/g, "$1°")
    .replace(/(\d) (?=(?:%|[kMG]?[NJW]|[kcm]?m|m?s|t|Hz|MNm|kNm)(?:[23]?[\s.,;:)/]|[23]?$))/g, "$1\u00a0")
    .replace(/(\d) x (?=\d)/g, "$1 × ")
    .replace(/\b((?:c|m|N\/[cm]?|kg\/)?m)([23])\b/g, (_, unit: string, power: string) => unit + (power === "2" ? "²" : "³"))
    .replace(/ \+- /g, " ± ")
    .replace(/ -(?=[xy\d])/g, " −")
    .replace(/\b(\d(?:\.\d+)?)e([+-]\d+)/g, (_, mantissa: string, power: string) => `${mantissa}·10${raise(Number(power))}`);
}

/// "2026-01-01 12:00 UTC" from ISO 8601; anything else stays as it is.
export function formatDate(text: string): string {
  const found = /^(\d{4}-\d\d-\d\d)T(\d\d:\d\d)[\d:.]*Z$/.exec(text);
  return found === null ? text : `${found[1]} ${found[2]} UTC`;
}

export function formatTime(t: number): string {
  return `${t.toFixed(3).replace("-", "−")} s`;
}

export function formatMass(mass: number | null): string {
  if (mass === null) return "–";
  return mass >= 10000 ? `${Math.round(mass / 1000).toLocaleString("en-GB").replace(/,/g, "\u202f")} t` : `${formatNumber(mass / 1000, 3)} t`;
}

/// Wall time: "0.84 s", "3 min 12 s".
export function formatDuration(seconds: number | null): string {
  if (seconds === null || !Number.isFinite(seconds)) return "–";
  if (seconds < 60) return `${formatNumber(seconds, 3)} s`;
  const whole = Math.round(seconds);
  const hours = Math.floor(whole / 3600);
  const minutes = Math.floor((whole % 3600) / 60);
  return hours > 0 ? `${hours} h ${minutes} min` : `${minutes} min ${whole % 60} s`;
}

/// Of an axis of time: what there is of it [s]; before there is more than one instant, the time that is asked for (0: not
/// known). uPlot's own is 0 to 100 then.
export function calcTimeRange(time: ArrayLike<number>, asked: number): [number, number] {
  const first = time[0] ?? 0, last = time[time.length - 1] ?? first;
  return last > first ? [first, last] : [first, first + (asked > 0 ? asked : 1)];
}

/// Units of the values of actions, which are SI (docs/protocol.md).
const unitOfValue: Record<string, Readable> = {
  ...Object.fromEntries(["position", "destroyed_length", "at", "anchor", "point"].map((key) => [key, { unit: "m", factor: 1 }])),
  ...Object.fromEntries(["residual_bars", "residual_concrete", "transition_damage", "cut_bars", "cut_concrete"].map((key) => [key, { unit: "%", factor: 100 }])),
  time: { unit: "s", factor: 1 },
  delay: { unit: "s", factor: 1 },
  stiffness: { unit: "MN/m", factor: 1e-6 },
  pretension: { unit: "kN", factor: 1e-3 },
  strength: { unit: "kN", factor: 1e-3 },
};
/// "member \"C-A1-0\", position 1.1 m" of an action.
export function describeValues(values: Record<string, unknown>): string {
  const say = (v: unknown, factor: number): string => (typeof v === "number" ? String(Number((factor * v).toPrecision(6))) : JSON.stringify(v));
  return Object.entries(values).map(([key, v]) => {
    const { unit, factor } = unitOfValue[key] ?? { unit: "", factor: 1 };
    const value = Array.isArray(v) ? `(${v.map((x) => say(x, factor)).join(", ")})` : say(v, factor);
    return `${key.replace(/_/g, " ")} ${value}${unit === "" || v === null ? "" : ` ${unit}`}`;
  }).join(", ");
}
