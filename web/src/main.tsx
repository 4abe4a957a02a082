import "uplot/dist/uPlot.min.css";
import "./style.css";
import { useState } from "preact/hooks";
import { readRun } from "./data";
import { Findings, Header, NotModelled } from "./findings";
import { Inspector } from "./inspector";
import { Assumptions, Conditions, FuzzyResults, Glossary, SitePlan, Verification } from "./handover";
import { Help, listenToKeys } from "./keys";
import { localiseRun } from "./localise";
import { Plots } from "./plots";
import type { Scene } from "./scene";
import { startPage } from "./start";
import { makeState, runClock, type State } from "./state";
import { Stills, chooseMoments, type Still } from "./stills";
import { Details, Events, PlanValues } from "./tables";
import { Timeline } from "./timeline";
import { say, translateElements } from "./translate";
import { View3D } from "./view3d";

const stillSize = { width: 560, height: 400 };

function Page(props: { state: State; fitRef: { current: () => void } }) {
  const { state, fitRef } = props;
  const { run } = state;
  const [stills, setStills] = useState<Still[]>([]);

  const onReady = (scene: Scene | undefined): void => {
    // The page stands before the pictures are drawn.
    setTimeout(() => {
      if (scene !== undefined) {
        const moments = chooseMoments(run);
        const pictures = scene.makeStills(moments.map((m) => m.time), stillSize.width, stillSize.height);
        setStills(moments.map((m, i) => ({ ...m, picture: pictures[i] ?? "" })));
      }
      document.documentElement.dataset["ready"] = "yes";
    }, 0);
  };

  return (
    <>
      <Header run={run} />
      <main class="layout">
        <div class="stage">
          <View3D state={state} onReady={onReady} fitRef={fitRef} />
          <Timeline state={state} />
          <Stills state={state} stills={stills} />
          <Conditions run={run} />
          <Plots state={state} />
        </div>
        <div class="side">
          <Inspector state={state} />
          <Findings run={run} />
          <NotModelled run={run} />
          <Verification run={run} />
        </div>
        <div class="below">
          <div class="tables">
            <Events state={state} isPrinted />
            <PlanValues run={run} />
            <Details run={run} />
            <SitePlan run={run} />
            <Assumptions />
            <FuzzyResults study={run.study} />
            <Glossary />
          </div>
        </div>
      </main>
      <Help state={state} />
    </>
  );
}

translateElements();
startPage("report", (text) => localiseRun(readRun(text)), (run) => {
  document.title = `${run.provenance.title || say("Run")} – ${say("topple report")}`;
  const state = makeState(run);
  const fitRef = { current: (): void => undefined };
  runClock(state);
  listenToKeys(state, () => fitRef.current());
  return <Page state={state} fitRef={fitRef} />;
}, "drawn");
