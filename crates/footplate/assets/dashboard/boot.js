// Opens the pages again if they came in half: the program that serves them may have handed over to another one meanwhile.
// A plain script, loaded before all others, so that it is there when they are not.

(() => {
  /** Interval between attempts (ms). */
  const AGAIN_MS = 1000;
  let isTrying = false;

  async function again() {
    const reached = await fetch("api/setup" + location.search, { cache: "no-store" }).then(() => true, () => false);
    if (reached) location.reload();
    else setTimeout(again, AGAIN_MS);
  }

  // Errors of scripts and style sheets do not bubble.
  addEventListener("error", ({ target }) => {
    if (isTrying || !["SCRIPT", "LINK"].includes(target?.tagName)) return;
    isTrying = true;
    setTimeout(again, AGAIN_MS);
  }, true);
})();
