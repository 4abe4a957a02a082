/// What stands in the place of a picture where the browser offers no WebGL.
export function NoWebGl(props: { problem: string }) {
  return (
    <div class="no-webgl" role="alert" data-test="no-webgl">
      <p><strong>This browser shows no 3D picture (WebGL is not available).</strong></p>
      <p>Findings, plots, events and tables on this page are complete. To see the playback, switch on hardware
        acceleration or open the file in another browser.</p>
      <p class="quiet">{props.problem}</p>
    </div>
  );
}
