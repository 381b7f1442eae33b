// The search runs in a worker, and browsers start no worker for a page that is a file on a disk.
// There, an invisible frame takes the place of the worker.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    #frame = document.createElement("iframe")
    #isReady

    constructor(address) {
      super()
      this.#isReady = new Promise(resolve => {
        this.#frame.onload = () => {
          const inner = this.#frame.contentWindow
          inner.postMessage = data => this.dispatchEvent(new MessageEvent("message", { data }))
          const script = inner.document.createElement("script")
          script.src = new URL(address, document.baseURI)
          script.onload = () => resolve(inner)
          inner.document.body.append(script)
        }
      })
      this.#frame.hidden = true
      document.body.append(this.#frame)
    }

    postMessage(data) {
      this.#isReady.then(inner => inner.dispatchEvent(new MessageEvent("message", { data })))
    }

    terminate() {
      this.#frame.remove()
    }
  }
}
