import "../style.css";
import "./study.css";
import { readStudy, type Study } from "./data";
import { DebrisPlan, Fans, Memberships } from "./plots";
import { Runs } from "./runs";
import { makeState } from "./state";
import { Boxes, Confirmed, Drivers, Inputs, NotModelled, Notable, Origin } from "./tables";
import { Header, Outcomes, Requirement } from "./verdict";
import { localiseStudy } from "../localise";
import { startPage } from "../start";
import { say, translateElements } from "../translate";

function Page(props: { study: Study }) {
  const state = makeState(props.study);
  return (
    <>
      <Header study={props.study} />
      <main class="study">
        <div class="pair">
          <Outcomes state={state} />
          <div class="column">
            <Requirement state={state} />
            <Inputs study={props.study} />
          </div>
        </div>
        <div class="pair">
          <Fans state={state} />
          <DebrisPlan state={state} />
        </div>
        <Memberships state={state} />
        <Confirmed state={state} />
        <Drivers state={state} />
        <Boxes state={state} />
        <Runs state={state} />
        <div class="pair">
          <Notable state={state} />
          <NotModelled study={props.study} />
        </div>
        <Origin study={props.study} />
      </main>
    </>
  );
}

translateElements();
startPage("study", (text) => localiseStudy(readStudy(text)), (study) => {
  document.title = `${study.title || say("Study")} – ${say("topple study")}`;
  return <Page study={study} />;
}, "now");
