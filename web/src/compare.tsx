/// Two runs of one building beside each other: overlaid in two colours, with photographs, plots and differences.
import "uplot/dist/uPlot.min.css";
import "./style.css";
import { effect, signal } from "@preact/signals";
import { Building } from "./building";
import { readComparison, type Comparison, type Compared, type Photo } from "./compare_data";
import type { Triple } from "./data";
import { Help, listenToKeys } from "./keys";
import { NoWebGl } from "./no_webgl";
import { cssColour, Plots } from "./plots";
import { Scene, type View } from "./scene";
import { useSceneView } from "./scene_view";
import { makeState, runClock, type State } from "./state";
import { Timeline } from "./timeline";
import { formatTime } from "./units";
import { startPage } from "./start";

type Shown = "both" | "a" | "b";
/// Those of the plots.
const colours = ["--series-0", "--series-1"] as const;

const shows: [Shown, string][] = [
  ["both", "both"],
  ["a", "A alone"],
  ["b", "B alone"],
];

/// The picture of A with B in it.
class OverlaidScene extends Scene {
  private readonly other: Building;
  private shown: Shown = "both";

  constructor(canvas: HTMLCanvasElement, { a, b }: Compared) {
    super(canvas, a);
    this.other = new Building(b);
    this.paint();
    this.stage.scene.add(this.other.group);
    this.setLook("kind", "none", -1);
    this.other.setLook("kind", "none", -1);
    this.fit("side");
  }

  private paint(): void {
    this.building.setGhost(cssColour(colours[0]), 1);
    this.other.setGhost(cssColour(colours[1]), 0.5);
  }

  override setDark(dark: boolean): void {
    super.setDark(dark);
    if (this.other !== undefined) this.paint();
  }

  /// Both of them.
  override fit(view?: View | Triple): void {
    if (this.other === undefined) return super.fit(view);
    for (const one of [this.building, this.other]) one.collectFitPoints();
    this.stage.setFitPoints([...this.building.fitPoints, ...this.other.fitPoints]);
    this.site.resetAxes();
    this.stage.fit(view);
  }

  override setTime(t: number): void {
    super.setTime(t);
    this.other?.setTime(t);
  }

  show(shown: Shown): void {
    this.shown = shown;
    this.building.group.visible = this.shown !== "b";
    this.other.group.visible = this.shown !== "a";
    this.onChange();
  }
}

function Overlay(props: { state: State; compared: Compared; fitRef: { current: () => void } }) {
  const { state, compared } = props;
  const { names } = compared.comparison;
  const { frameRef, canvasRef, sceneRef, problem } = useSceneView(
    (canvas) => new OverlaidScene(canvas, compared),
    (scene) => {
      props.fitRef.current = () => scene.fit();
      const stops = [effect(() => scene.setTime(state.time.value)), effect(() => scene.show(shown.value))];
      document.documentElement.dataset["ready"] = "yes";
      return () => stops.forEach((stop) => stop());
    },
    () => (document.documentElement.dataset["ready"] = "yes"),
  );
  return (
    <section class="panel view" aria-label="Both runs in three dimensions">
      <div class="toolbar">
        <span class="button-group" role="group" aria-label="What is shown">
          {shows.map(([value, word]) => (
            <button type="button" data-test={`show-${value}`} aria-pressed={shown.value === value} onClick={() => (shown.value = value)}>
              {word}
            </button>
          ))}
        </span>
        <span class="spring" />
        <span class="button-group" role="group" aria-label="Point of view">
          {(["oblique", "side", "front", "top"] as const).map((view) => (
            <button type="button" onClick={() => sceneRef.current?.fit(view)}>{view}</button>
          ))}
          <button type="button" title="Fit to the window (F)" onClick={() => sceneRef.current?.fit()}>Fit</button>
        </span>
      </div>
      <div class="canvas-frame" ref={frameRef}>
        <canvas ref={canvasRef} data-test="canvas" role="img" aria-label="Both buildings at the time of the cursor" hidden={problem !== ""} />
        {problem !== "" && <NoWebGl problem={problem} />}
      </div>
      <div class="legend">
        <div class="legend-row">
          {colours.map((colour, k) => (
            <span class="with-sign"><i class="swatch" style={{ background: `var(${colour})` }} /> {`${"AB"[k]}: ${names[k]}`}</span>
          ))}
        </div>
      </div>
    </section>
  );
}
const shown = signal<Shown>("both");

/// The photograph nearest to the time of the cursor, and a row of all of them.
function Photos(props: { state: State; photos: Photo[] }) {
  const { state, photos } = props;
  if (photos.length === 0) return null;
  const t = state.time.value;
  const nearest = photos.reduce((best, p) => (Math.abs(p.time - t) < Math.abs(best.time - t) ? p : best));
  return (
    <section class="panel photos" aria-label="Photographs">
      <h2>The real event</h2>
      <figure>
        <img src={nearest.data} alt={`Photograph at ${formatTime(nearest.time)}`} data-test="photo" />
        <figcaption>{nearest.name}, {formatTime(nearest.time)}; the cursor stands at {formatTime(t)}</figcaption>
      </figure>
      <div class="photo-row">
        {photos.map((p) => (
          <button type="button" title={p.name} aria-pressed={p === nearest} onClick={() => state.pauseAt(p.time)}>
            <img src={p.data} alt="" loading="lazy" />
            {formatTime(p.time)}
          </button>
        ))}
      </div>
    </section>
  );
}

const degrees = (angle: number | null): string => (angle === null ? "–" : `${((angle * 180) / Math.PI).toFixed(2)}°`);
const instant = (t: number | null, end?: number | null): string => (t !== null ? formatTime(t) : end === undefined || end === null ? "never" : `not up to ${formatTime(end)}`);

const azimuth = (angle: number): string => `${(Math.round((angle * 180) / Math.PI) + 360) % 360}°`;

/// How all bodies compared lean at the end, and how far apart they leant.
function tellLean(c: Comparison): [string, string][] {
  const lean = c.series.find((s) => s.id === "lean_compared");
  const apart = c.distance.lean;
  if (lean === undefined || !apart) return [];
  const one = (values: (number | null)[], towards: number | null | undefined): string =>
    `${degrees(values.at(-1) ?? null)}${towards === null || towards === undefined ? "" : ` towards ${azimuth(towards)}`}`;
  const before = apart.filter((v, i) => v !== null && (c.time[i] ?? Infinity) <= (c.until ?? Infinity)) as number[];
  const most = before.length > 0 ? `; until then at most ${degrees(Math.max(...before))}` : "";
  return [["Lean at the end", `A ${one(lean.a, c.lean_azimuth?.[0])}, B ${one(lean.b, c.lean_azimuth?.[1])}: ${degrees(apart.at(-1) ?? null)} apart${most}`]];
}

function Summary(props: { comparison: Comparison }) {
  const { comparison: c } = props;
  const [a, b] = c.touchdown;
  const [planA, planB] = c.fall_azimuth ?? [null, null];
  const tiltsDiffer = planA !== null && planB !== null && !c.series.some((s) => s.id === "tilt_angle");
  const rows: [string, string][] = [
    ["First touchdown of the upper block", `A ${instant(a, c.end?.[0])}, B ${instant(b, c.end?.[1])}${a === null || b === null ? "" : `, difference ${(b - a).toFixed(3)} s`}`],
    ["Largest difference of the tilt until then", c.tilt_difference === null ? (tiltsDiffer ? `not compared: A counts it towards ${azimuth(planA)}, B towards ${azimuth(planB)}` : "not known of both") : `${degrees(c.tilt_difference)} at ${formatTime(c.tilt_time ?? 0)}${c.tilt_share === null ? "" : `, ${(100 * c.tilt_share).toFixed(0)} % of the larger tilt at the end of this time`}`],
    ["Mass centres until then", c.centre_difference === null ? "–" : `at most ${c.centre_difference.toFixed(2)} m apart`],
    ...tellLean(c),
    ["Compared", c.points],
  ];
  return (
    <section class="panel" aria-label="Differences">
      <h2>Differences</h2>
      <table class="pairs">
        <tbody>
          {rows.map(([key, value]) => (
            <tr><th scope="row">{key}</th><td data-test={key === rows[0]?.[0] ? "touchdown" : undefined}>{value}</td></tr>
          ))}
        </tbody>
      </table>
    </section>
  );
}

function Touchdowns(props: { state: State; comparison: Comparison }) {
  const { state, comparison } = props;
  if (comparison.touchdowns.length === 0) return null;
  return (
    <section class="panel" aria-label="Touchdowns">
      <h2>Touchdowns</h2>
      <div class="scroller" tabIndex={0} role="region" aria-label="Touchdowns">
        <table>
          <thead><tr><th scope="col">part</th><th scope="col">A [s]</th><th scope="col">B [s]</th><th scope="col">B − A [s]</th></tr></thead>
          <tbody>
            {comparison.touchdowns.slice(0, 300).map((t) => (
              <tr onClick={() => state.pauseAt(Math.min(t.a ?? Infinity, t.b ?? Infinity))}>
                <td>{t.body}</td>
                <td>{t.a?.toFixed(2) ?? instant(null, comparison.end?.[0])}</td>
                <td>{t.b?.toFixed(2) ?? instant(null, comparison.end?.[1])}</td>
                <td>{t.a === null || t.b === null ? "" : (t.b - t.a).toFixed(2).replace(/^-(?=0\.00$)/, "")}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </section>
  );
}

/// One title of both runs, or two where they differ.
function headingsOf(compared: Compared): string[] {
  const [a, b] = [compared.a, compared.b].map((run) => run.provenance.title);
  return a === b ? [a || "Comparison"] : [a || "no title", b || "no title"];
}

function Page(props: { state: State; compared: Compared; fitRef: { current: () => void } }) {
  const { state, compared, fitRef } = props;
  const { titles, notes } = compared.plotted;
  const { names, note } = compared.comparison;
  const headings = headingsOf(compared);
  const ofRun = (k: 0 | 1): string => (headings.length === 2 ? `${headings[k]}, ${names[k]}` : names[k]);
  return (
    <>
      <header class="header">
        <div class="title-row">
          <h1>{headings.join(" | ")}</h1>
          <p class="subtitle">A: {ofRun(0)} · B: {ofRun(1)}</p>
        </div>
        {note && <p class="verdict warning" data-test="note">{note}</p>}
      </header>
      <main class="layout">
        <div class="stage">
          <Overlay state={state} compared={compared} fitRef={fitRef} />
          <Timeline state={state} />
          <Plots state={state} titles={titles} notes={notes} />
        </div>
        <div class="side">
          <Summary comparison={compared.comparison} />
          <Photos state={state} photos={compared.photos} />
          <Touchdowns state={state} comparison={compared.comparison} />
        </div>
      </main>
      <Help state={state} />
    </>
  );
}

startPage("comparison", readComparison, (compared) => {
  document.title = `${headingsOf(compared).join(" | ")} – topple compare`;
  const { run } = compared.plotted;
  const state = makeState(run);
  const fitRef = { current: (): void => undefined };
  runClock(state);
  listenToKeys(state, () => fitRef.current());
  return <Page state={state} compared={compared} fitRef={fitRef} />;
}, "drawn");
