// The world as a video, recorded while it plays.

import { element } from "swarm/dom.js";
import { save } from "swarm/export.js";

/** Bits per second: a hundred steps, at twenty a second, have less than 1 MB. */
const BITS = 1_200_000;
/** Video formats of browsers, the most common one first, and their file extensions. */
const KINDS = [["video/webm;codecs=vp9", "webm"], ["video/webm", "webm"], ["video/mp4", "mp4"]];

/** A button that plays and records until the end, or until a pause; null if the browser cannot
 *  record. `update()`: to be called when the clock may have paused. */
export function recordButton(canvas, clock, properties) {
  const [kind, end] = KINDS.find(([it]) => globalThis.MediaRecorder?.isTypeSupported(it)) ?? [];
  if (!kind || !canvas.captureStream) return null;
  let recorder = null;
  const node = element("button", { type: "button", title: "play from here, and save a video of the world", ...properties }, "● video");
  const stop = () => {
    recorder?.stop();
    recorder = null;
    node.textContent = "● video";
  };
  node.onclick = () => {
    if (recorder) return clock.pause();
    if (clock.isPlaying) clock.pause();
    const first = clock.step === clock.steps - 1 ? 0 : clock.step;
    recorder = new MediaRecorder(canvas.captureStream(), { mimeType: kind, videoBitsPerSecond: BITS });
    recorder.ondataavailable = ({ data }) => save(`swarm-from-${first}.${end}`, kind, data);
    recorder.start();
    node.textContent = "■ save";
    return clock.toggle();
  };
  node.update = () => recorder && !clock.isPlaying && stop();
  return node;
}
