// The followed robot: its perception, its neurons, and its actions.

import { decimals, element } from "swarm/dom.js";
import { palette, pixels, readingColor, symbolColor } from "swarm/drawing.js";
import { track } from "swarm/timeline.js";

/** Height of a row of a map, pixels. */
const ROW = 9;

/** `id`: makes the ids of its parts from their names; `label`: its name for screen readers. */
export function robotPanel(episode, view, seek, choose, id, label) {
  const node = element("aside", { className: "robot-panel", "aria-label": label });
  let shown = undefined;
  let parts = [];

  const build = () => {
    shown = view.robot;
    parts = [];
    node.replaceChildren();
    node.hidden = shown === null;
    if (shown === null) return;
    const kind = episode.kinds[shown];
    const first = episode.kinds.indexOf(kind);
    const step = (by) => () => choose((shown + by + episode.n_robots) % episode.n_robots);
    node.append(
      element("header", {},
        element("h2", {}, `Robot ${shown}`),
        element("span", { className: "muted" }, episode.robots.length > 1 ? `${kind.name} ${shown - first}` : kind.name),
        element("span", { className: "space" }),
        element("button", { onclick: step(-1), title: "the robot before ([)", "aria-label": "the robot before" }, "‹"),
        element("button", { onclick: step(1), title: "the next robot (])", "aria-label": "the next robot" }, "›"),
        element("button", { onclick: () => choose(null), title: "follow no robot (Esc)", "aria-label": "follow no robot" }, "×")),
      facts());
    const n_inputs = kind.stimuli.reduce((sum, rows) => sum + rows.n, 0);
    if (n_inputs > 0) node.append(element("h3", {}, "Stimuli"), map("stimuli", kind.stimuli));
    if (kind.has_network) node.append(element("h3", {}, "Neurons"), map("neurons", episode.ensembles));
  };

  /** The actions of the robot in this step, as a list. */
  const facts = () => {
    const list = element("dl", {});
    const fact = (name, text, part) => {
      const value = element("dd", { id: id(part) });
      list.append(element("dt", {}, name), value);
      parts.push(() => value.replaceChildren(...[text()].flat()));
    };
    const at = (name) => episode.at(name, shown, view.step);
    fact("position", () => `${decimals(at("x"), 2)}, ${decimals(at("y"), 2)} cm`, "position");
    fact("heading", () => `${decimals((at("heading") * 180) / Math.PI, 1)}°`, "heading");
    fact("wheels", () => {
      const [right, left] = episode.components("wheels", shown, view.step);
      return `left ${decimals(left, 2)}, right ${decimals(right, 2)}`;
    }, "wheels");
    const hasLeds = episode.has_targets || episode.columns.led.values.some((led) => led > 0);
    if (hasLeds) fact("LED", () => {
      const led = episode.whole("led", shown, view.step);
      const target = episode.whole("target", shown, view.step);
      const wanted = target < 0 ? "" : target > 0 ? ", should be on" : ", should be off";
      return (led > 0 ? `on (${led})` : "off") + wanted;
    }, "led");
    if (episode.kinds[shown].emits_within !== null) {
      fact("sends", () => {
        if (episode.whole("relays", shown, view.step)) return "the message that it hears (relays)";
        return message(episode.components("message", shown, view.step), shown);
      }, "sends");
    }
    if (episode.kinds[shown].hears_within !== null) fact("hears", hears, "hears");
    return list;
  };

  const message = (values, robot) => {
    const symbol = episode.symbol(robot, values);
    const text = `(${values.map((value) => decimals(value, 2)).join(", ")})`;
    if (symbol === null) return text;
    // Some of these colours would be unreadable as text.
    const mark = element("i", { className: "symbol" });
    mark.style.background = symbolColor(symbol, episode.n_symbols, palette().isDark);
    return [mark, element("b", {}, `symbol ${symbol} `), text];
  };

  const hears = () => {
    const emitter = episode.whole("emitter", shown, view.step);
    if (emitter < 0) return "nobody";
    const originator = episode.whole("originator", shown, view.step);
    const hops = episode.whole("hops", shown, view.step);
    const signal = episode.at("signal", shown, view.step);
    const by = originator === emitter ? "" : `, a message of ${originator} after ${hops} hops`;
    const said = message(episode.components("heard", shown, view.step), emitter);
    return [`robot ${emitter}${by}: `, ...[said].flat(), `, signal ${decimals(signal, 4)}`];
  };

  /** A map of a robot's values over all steps, group by group, with the values of this step. */
  const map = (name, groups) => {
    const box = element("div", { className: "map" });
    let row = shown * (episode.columns[name].n_rows / episode.n_robots);
    for (const group of groups) {
      const start = row;
      row += group.n;
      const height = Math.max(14, group.n * ROW);
      const picture = track(view, seek, height, `${group.name} over all steps`, (context, width, tall) => {
        const { isDark } = palette();
        context.imageSmoothingEnabled = false;
        const valueAt = (i, step) => readingColor(episode.at(name, start + i, step), isDark);
        context.drawImage(pixels(group.n, episode.steps, valueAt), 0, 0, width, tall);
      });
      const now = element("div", { className: "bars", title: "in this step" });
      const bars = Array.from({ length: group.n }, () => element("i"));
      now.append(...bars);
      now.style.height = `${height}px`;
      box.append(element("div", { className: "label", title: group.name }, group.name), picture, now);
      parts.push(() => {
        picture.redraw();
        bars.forEach((bar, i) => {
          const value = episode.at(name, start + i, view.step);
          bar.style.width = `${Math.min(100, Math.abs(value) * 100)}%`;
          bar.className = value < 0 ? "negative" : "";
          bar.title = decimals(value, 2);
        });
      });
    }
    return box;
  };

  const redraw = () => {
    if (shown !== view.robot) build();
    for (const part of parts) part();
  };
  return { node, redraw };
}
