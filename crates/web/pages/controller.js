// The button that saves the controller of an individual as C.

import { element } from "swarm/dom.js";
import { save } from "swarm/export.js";
import { ask, complain, resolve } from "swarm/page.js";

/** `address`: of the individual or champion, such as `3` or `3@5/7`. */
export function controllerButton(address) {
  const button = element("button", {
    type: "button", className: "controller", title: "save the robot's controller as C, with a test that compares every bit",
  }, "Export controller (C)");
  button.onclick = async () => {
    button.disabled = true;
    try {
      const archive = await (await ask(`/api/controller/${address}`)).blob();
      save(`controller-${address.replaceAll(/[^0-9A-Za-z]/g, "-")}.zip`, "application/zip", archive);
      resolve("controller");
    } catch (error) {
      complain(error, "controller");
    }
    button.disabled = false;
    button.focus();
  };
  return button;
}
