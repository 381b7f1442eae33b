// The simulator as a WebAssembly module, in threads of its own. It computes the same bits as the
// other programs.

/** The bytes of an element with data, such as a file that is part of this page. */
export function bytesIn(id) {
  const text = atob(document.getElementById(id).textContent);
  return Uint8Array.from(text, (letter) => letter.charCodeAt(0));
}

/** The compiled module; null if the program that made this page was compiled without it. */
export async function loadSimulator() {
  const link = document.querySelector("link[rel=simulator]");
  const isWithin = document.getElementById("simulator") !== null;
  if (!isWithin && !link) return null;
  const packed = isWithin ? bytesIn("simulator") : await (await fetch(link.href)).blob();
  const unpacked = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return WebAssembly.compile(await new Response(unpacked).arrayBuffer());
}

/** A thread with an instance of the module, which answers one request after the other. */
export class Thread {
  constructor(module) {
    const source = URL.createObjectURL(new Blob([`(${serve})()`], { type: "text/javascript" }));
    this.worker = new Worker(source);
    URL.revokeObjectURL(source);
    this.requests = [];
    this.worker.onmessage = ({ data }) => this.requests.shift()?.settle(data);
    this.worker.onerror = (event) => this.end(event.message);
    this.worker.postMessage(module);
  }

  /** Sends a request: a header, and bytes. Returns the answer's header and bytes; fails with the
   *  module's error. */
  call(header, bytes = new Uint8Array()) {
    return new Promise((resolve, reject) => {
      const settle = (answer) => (answer.header.error === undefined ? resolve(answer) : reject(new Error(answer.header.error)));
      this.requests.push({ settle });
      this.worker.postMessage({ header, bytes });
    });
  }

  /** Ends the thread at once; requests without an answer fail. */
  end(error = "cancelled") {
    this.worker.terminate();
    for (const { settle } of this.requests.splice(0)) settle({ header: { error } });
  }
}

/** The program of a thread, which uses nothing of this module. */
function serve() {
  let simulator;

  function start(module) {
    // The library for ZIP archives can also encrypt, and brings functions for that. Nobody calls them.
    const imports = {};
    for (const { module: library, name } of WebAssembly.Module.imports(module)) {
      (imports[library] ??= {})[name] = () => {
        throw new Error(`the simulator lacks ${name}`);
      };
    }
    simulator = new WebAssembly.Instance(module, imports).exports;
  }

  function answer({ header, bytes }) {
    const text = new TextEncoder().encode(JSON.stringify(header));
    const request = simulator.buffer(4 + text.length + bytes.length);
    // The memory may grow, and is then another buffer.
    new DataView(simulator.memory.buffer).setUint32(request, text.length, true);
    new Uint8Array(simulator.memory.buffer).set(text, request + 4);
    new Uint8Array(simulator.memory.buffer).set(bytes, request + 4 + text.length);
    const length = simulator.call();
    const address = simulator.answer();
    const end = address + 4 + new DataView(simulator.memory.buffer).getUint32(address, true);
    const found = new TextDecoder().decode(new Uint8Array(simulator.memory.buffer, address + 4, end - address - 4));
    return { header: JSON.parse(found), bytes: new Uint8Array(simulator.memory.buffer.slice(end, address + length)) };
  }

  onmessage = ({ data }) => {
    if (data instanceof WebAssembly.Module) return void start(data);
    try {
      const reply = answer(data);
      postMessage(reply, [reply.bytes.buffer]);
    } catch (error) {
      postMessage({ header: { error: `the simulator stopped: ${error.message}` }, bytes: new Uint8Array() });
    }
  };
}
