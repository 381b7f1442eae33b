// The movement of an algorithm's distribution. The server repeats the generations to find it, so
// the page requests it only when the user opens this part.

import { chart } from "swarm/charts.js";
import { element } from "swarm/dom.js";
import { askJson, oneByOne } from "swarm/page.js";

/** A part of the page that is closed at first; `update(n_generations)`: the number of generations. */
export function dynamicsPanel(id) {
  const rows = [];
  let n_generations = 0;
  const width = chart("standard deviation of the genes by generation");
  const step = chart("step of the mean by generation");
  const agreement = chart("rank correlation of trials by generation");
  const part = (title, text, it) => element("section", {}, element("h3", {}, title), element("p", { className: "muted small" }, text), it);
  const parts = [
    part("Width", "standard deviations of the genes in the distribution: quartiles in the dark band, least and largest in the light one", width),
    part("Step", "distance by which a generation moved the mean of the distribution", step),
    part("Agreement", "rank correlation of the individuals\u2019 fitness between trials: 1 if all trials rank them alike, 0 if selection was luck", agreement),
  ];
  const note = element("p", { className: "muted small" });
  const node = element("details", { className: "panel dynamics", ontoggle: () => ask() },
    element("summary", {}, "How the algorithm moves"), note, element("div", { className: "columns" }, ...parts));

  const draw = () => {
    const xLabel = "generation";
    const line = (name, column) => ({ name, color: "var(--line)", points: rows.filter((row) => row[column] !== null).map((row) => [row[0], row[column]]) });
    const spread = rows.filter((row) => row[2].length);
    const quantile = (low, high) => ({ color: "var(--line)", points: spread.map(([at, , all]) => [at, all[low], all[high]]) });
    width.show({ xLabel, yLabel: "standard deviation", bands: [quantile(0, 4), quantile(1, 3)], lines: [{ name: "median", color: "var(--line)", points: spread.map(([at, , all]) => [at, all[2]]) }] });
    step.show({ xLabel, yLabel: "distance", lines: [line("step of the mean", 1)] });
    agreement.show({ xLabel, yLabel: "correlation", lines: [line("rank correlation", 3)] });
    // A genetic algorithm draws from no distribution.
    [parts[0].hidden, parts[1].hidden] = [spread.length === 0, spread.length === 0];
    node.dataset.generations = rows.length;
  };

  // Generations that are complete before an answer need another request.
  const ask = oneByOne(async () => {
    try {
      for (let next = rows.length ? rows.at(-1)[0] + 1 : 0; next !== null && next < n_generations && node.open;) {
        const page = await askJson(`/api/experiments/${id}/dynamics?from=${next}`);
        rows.push(...page.generations);
        next = page.next;
        draw();
      }
      note.textContent = "";
    } catch (error) {
      note.textContent = error.message;
    }
  });

  node.update = (n) => {
    n_generations = n;
    ask();
  };
  return node;
}
