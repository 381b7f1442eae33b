// The simulator for browsers in Node: it proves bundles in the words of the other programs, and its
// fleet has the digest of every other fleet.
//
//     node crates/browser/tests/node.mjs SIMULATOR.wasm.gz SWARMCTL BUNDLE...

import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, join } from "node:path";
import { gunzipSync } from "node:zlib";

const [packed, swarmctl, ...bundles] = process.argv.slice(2);
const module = new WebAssembly.Module(gunzipSync(readFileSync(packed)));

/** An instance of the module: takes a header and bytes, returns the answer's. */
function start() {
  const imports = {};
  for (const { module: library, name } of WebAssembly.Module.imports(module)) {
    (imports[library] ??= {})[name] = () => {
      throw new Error(`the simulator lacks ${name}`);
    };
  }
  const { buffer, call, answer, memory } = new WebAssembly.Instance(module, imports).exports;
  return (header, bytes = new Uint8Array()) => {
    const text = new TextEncoder().encode(JSON.stringify(header));
    const request = Buffer.alloc(4 + text.length + bytes.length);
    request.writeUint32LE(text.length);
    request.set(text, 4);
    request.set(bytes, 4 + text.length);
    const to = buffer(request.length);
    new Uint8Array(memory.buffer).set(request, to);
    const length = call();
    const found = Buffer.from(memory.buffer.slice(answer(), answer() + length));
    const end = 4 + found.readUint32LE();
    const reply = JSON.parse(found.subarray(4, end).toString());
    if (reply.error !== undefined) throw new Error(reply.error);
    return [reply, found.subarray(end)];
  };
}

function prove(file) {
  const [repeating, simulating] = [start(), start()];
  const [{ config }] = repeating({ call: "open", file: basename(file), generations: 2 }, readFileSync(file));
  simulating({ call: "compile", config });
  for (;;) {
    const [{ batch, is_over }, genes] = repeating({ call: "repeat" });
    if (batch) {
      const { n_genotypes, ...rest } = batch;
      const size = genes.length / n_genotypes;
      const request = { call: "evaluate", trials: rest.trials, n_trials: rest.n_trials, values_per_trial: rest.values_per_trial };
      const values = Array.from({ length: n_genotypes }, (_, i) => simulating(request, genes.subarray(i * size, (i + 1) * size))[1]);
      repeating({ call: "compare" }, Buffer.concat(values));
    } else if (is_over) {
      return repeating({ call: "finish" })[0].proof;
    }
  }
}

for (const file of bundles) {
  const expected = execFileSync(swarmctl, ["verify", file, "--generations", "2"], { stdio: ["ignore", "pipe", "ignore"] });
  const [expectedLines, lines] = [expected.toString().trim(), prove(file)].map((text) => text.split("\n").slice(1));
  if (expectedLines.join() !== lines.join()) throw new Error(`${file}:\n${lines.join("\n")}\n${expectedLines.join("\n")}`);
  console.log(`${file}: ${lines.length} lines as swarmctl prints them`);
}

/** The digest of the last of the first generations of quickstart, as `swarmctl run` computes it. */
function digestOf(nGenerations) {
  const data = mkdtempSync(join(tmpdir(), "node-"));
  try {
    const run = ["run", "--example", "quickstart", "--generations", nGenerations, "--data-dir", data];
    execFileSync(swarmctl, run, { stdio: "ignore" });
    const history = execFileSync(swarmctl, ["history", "1", "--data-dir", data, "--output", "json"]);
    return JSON.parse(history).at(-1).digest;
  } finally {
    rmSync(data, { recursive: true });
  }
}

/** Runs the fleet of the page for some generations of quickstart, and treats workers badly on the way. */
function breakFleet(nGenerations) {
  const call = start();
  let [{ report, workers }] = call({ call: "begin-fleets", audits: 1 });
  const quarantined = new Set();
  const take = ([next]) => {
    report = next;
    for (const event of report.events) if (event.what === "quarantined") quarantined.add(event.worker);
  };
  const treat = (worker, health) => take(call({ call: "treat", worker, health }));
  const faults = ["killed", "hung", "slow", "lying"];
  const liars = new Set();
  for (let i = 0; i < 10_000 && report.disturbed.links.length < nGenerations; i++) {
    const worker = (7 * i) % workers.length;
    if (i % 4 === 0) {
      const health = faults[(i / 4) % 4];
      if (health === "lying") liars.add(worker);
      treat(worker, health);
    }
    if (i % 4 === 3) treat((7 * (i + 11)) % workers.length, "healthy");
    take(call({ call: "advance", ms: 3000 }));
  }
  const [digest, expected] = [report.disturbed.links[nGenerations - 1]?.digest, digestOf(nGenerations)];
  if (digest !== expected) throw new Error(`digest ${digest}, not ${expected}`);
  if (quarantined.size === 0) throw new Error("no liar was found");
  for (const worker of quarantined) if (!liars.has(worker)) throw new Error(`worker ${worker} never lied`);
  return quarantined.size;
}

const began = performance.now();
const nFound = breakFleet(8);
console.log(`8 generations of a fleet treated badly have quickstart's digest after ${((performance.now() - began) / 1000).toFixed(1)} s; ${nFound} liars were found`);
