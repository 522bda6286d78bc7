// Plays one recording, without the engine: the program of the HTML files that the Python package writes.
import { connectPlayback, showSample } from "./controls";
import { byId, giveUp } from "./dom";
import { everyFrame } from "./frames";
import type { Look } from "./link";
import { Playback } from "./playback";
import { connectPointer } from "./pointer";
import { Recording } from "./recording";
import { Stage } from "./stage";
import style from "./style.css?inline";
import { Timeline } from "./timeline";

const LOOK: Look = { playing: true, speed: 1, forces: true, camera: "angle", theme: "auto" };

class Player extends Playback {
  constructor(readonly motion: Recording) {
    super(LOOK);
  }
}

function start(recording: Recording): void {
  const player = new Player(recording);
  const stage = new Stage(byId<HTMLCanvasElement>("view"), byId("notes"));
  const strip = new Timeline(byId<HTMLCanvasElement>("strip"), player);
  connectPlayback(player, stage);
  connectPointer(stage, byId<HTMLCanvasElement>("view"), null);
  const name = recording.fields?.name ?? "";
  byId("summary").textContent = `scene ${name}: ${recording.summary}`;
  everyFrame(player, stage, () => {
    const { sample, pose } = player.shown();
    stage.draw(pose, sample, recording.fields?.control.lifting, null);
    strip.draw();
    showSample(player, sample);
  });
  document.documentElement.dataset.ready = "true";
}

/** Bytes of a text in base 64. */
function bytesOf(text: string): Uint8Array<ArrayBuffer> {
  return Uint8Array.from(atob(text.trim()), (letter) => letter.charCodeAt(0));
}

async function load(): Promise<Recording> {
  document.head.append(Object.assign(document.createElement("style"), { textContent: style }));
  return Recording.read(bytesOf(byId("recording").textContent ?? ""));
}

load().then(start).catch((error: unknown) => giveUp("The recording cannot be shown", error));
