// Search on pages that are opened as files: browsers start no Worker from file://, so its script runs in a hidden frame.
if (location.protocol === "file:") {
  window.Worker = class FrameWorker extends EventTarget {
    constructor(url) {
      super()
      const frame = document.createElement("iframe")
      frame.hidden = true
      document.body.append(frame)
      const inner = frame.contentWindow
      inner.postMessage = data => this.dispatchEvent(new MessageEvent("message", { data }))
      const script = inner.document.createElement("script")
      const loaded = new Promise((resolve, reject) => Object.assign(script, { onload: resolve, onerror: reject }))
      script.src = url
      inner.document.body.append(script)
      this.postMessage = data => loaded.then(() => inner.dispatchEvent(new MessageEvent("message", { data })))
    }
    terminate() {}
  }
}
