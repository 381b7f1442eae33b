// The simulator for browsers in Node: it proves bundles in the words of the other programs.
//
//     node crates/browser/tests/node.mjs SIMULATOR.wasm.gz SWARMCTL BUNDLE...

import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { basename } from "node:path";
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
